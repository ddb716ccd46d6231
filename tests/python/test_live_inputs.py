"""Signals set between steps: what they do, what is refused, and that they are part of a state."""

import copy
import re
from pathlib import Path
from typing import Any

import flagrs
import numpy as np
import pytest
from flagrs import Clamp, FlagrsError, Fluid, Motor, Rod, Scene, SceneError, Simulation, Table

SOFT = flagrs.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
OIL = Fluid(viscosity=1.0, model="RFT")
ROBOT = flagrs.scenarios.robot(edge_length=9e-3)


def rod(**options: Any) -> Rod:
    return Rod.straight(length=0.05, edge_count=8, radius=1e-3, material=SOFT, **options)


def everything() -> Scene:
    """Return a scene with all that can be set: a shaft with motors, a shaken rod, a turned magnet."""
    turning = flagrs.Rotation(axis=(0, 0, 1), center=(0.0, 0.1, 0.0))
    flows = (flagrs.LinearFlow.shear(rate=0.1), flagrs.PoiseuilleFlow(speed=0.0, radius=1.0))
    return Scene(
        rods=(rod(), rod(start=(0.0, 0.1, 0.0)), rod(start=(0.0, 0.2, 0.0), magnetization=(0.0, 0.0, 1e3))),
        fluid=OIL.replace(background=flows),
        motors=(Motor(node=4, shaft=4, speed=1.0), Motor(node=6, shaft=6, torque=1e-7)),
        clamps=(Clamp(rod=1, nodes=(0, 1), edges=(0,), rotation=turning),),
        loads=(
            flagrs.PointLoad(node=8, force=(0.0, 1e-6, 0.0)),
            flagrs.LineLoad(rod=2, torque=(0.0, 0.0, 1e-8)),
        ),
        magnetic_field=flagrs.MagneticField(field=(0.0, 1e-4, 0.0)),
    )


def value_of(time: float) -> float:
    return 2.0 + np.sin(3.0 * time)


CHANGES: dict[str, Any] = {
    "motors[0].speed": Table(times=[0.0, 1.0], values=[2.0, -1.0]),
    "motors[1].torque": lambda time: 1e-7 * value_of(time),
    "clamps[0].velocity": (0.01, 0.0, 0.0),
    "clamps[0].displacement": (0.0, 0.0, Table(times=[0.0, 1.0], values=[0.0, 1e-3])),
    "clamps[0].angular_velocity": 3.0,
    "clamps[0].rotation.rate": -1.0,
    "clamps[0].rotation.angle": Table(times=[0.0, 1.0], values=[0.0, 0.2]),
    "loads[0].force": (1e-6, 0.0, 2e-6),
    "loads[1].torque": (0.0, 1e-8, 0.0),
    "magnetic_field.field": (1e-4, 0.0, 0.0),
    "fluid.background[0].velocity": (0.0, 0.0, 1e-3),
    "fluid.background[0].strength": 2.0,
    "fluid.background[1].speed": 5e-3,
}


def set_at(simulation: Simulation, path: str, value: Any) -> None:
    place, _, name = path.removeprefix("fluid.").rpartition(".")
    target: Any = simulation
    for part, index in re.findall(r"(\w+)(?:\[(\d+)\])?", place):
        target = getattr(target, part)[int(index)] if index else getattr(target, part)
    setattr(target, name, value)


@pytest.mark.parametrize("path", CHANGES)
def test_what_is_set_moves_the_scene_as_one_that_was_made_so(path: str) -> None:
    simulation = Simulation(everything(), dt=0.01, threads=1)
    set_at(simulation, path, CHANGES[path])
    made = Simulation(
        flagrs.inputs.changed(everything(), path, CHANGES[path], everything()), dt=0.01, threads=1
    )
    plain = Simulation(everything(), dt=0.01, threads=1)
    for each in (simulation, made, plain):
        each.step(20)
    assert np.array_equal(simulation.nodes, made.nodes) and np.array_equal(simulation.theta, made.theta)
    moved = np.abs(simulation.nodes - plain.nodes).max() + np.abs(simulation.theta - plain.theta).max()
    assert moved > 1e-9, "the change does nothing"


@pytest.mark.parametrize("options", [{"dt": 0.01}, {"rtol": 1e-4}])
def test_a_state_with_inputs_set_goes_on_to_the_same_bits(options: dict[str, float]) -> None:
    whole = Simulation(everything(), threads=1, **options)
    whole.step(5)
    for path, value in CHANGES.items():
        set_at(whole, path, value)
    whole.step(5)
    scene, state = whole.scene, whole.state()
    whole.step(10)
    again = Simulation(scene, threads=1, **options)
    again._native.dt = whole.dt
    again.load_state(state)
    twin = copy.copy(whole)
    again.step(10)
    assert np.array_equal(again.nodes, whole.nodes) and again.time == whole.time
    whole.step(5)
    twin.step(5)
    assert np.array_equal(twin.nodes, whole.nodes) and twin.scene == whole.scene


def test_the_first_state_brings_back_the_first_inputs() -> None:
    simulation = Simulation(ROBOT, threads=1)
    first = simulation.state()
    simulation.step(3)
    whole = simulation.nodes
    simulation.load_state(first)
    simulation.motors[0].speed = 7.0
    simulation.step(3)
    assert not np.array_equal(simulation.nodes, whole)
    simulation.load_state(first)
    assert simulation.motors[0].speed == ROBOT.motors[0].speed
    simulation.step(3)
    assert np.array_equal(simulation.nodes, whole)


def test_a_file_goes_on_with_inputs_set_on_the_way(tmp_path: Path) -> None:
    def steer(simulation: Simulation) -> None:
        if simulation.time == pytest.approx(0.4):
            simulation.motors[0].speed = -4.0

    whole = Simulation(ROBOT, threads=1)
    whole.run(1.0, 0.1, path=False, callback=steer)
    whole.run(2.0, 0.1, path=False)
    path = tmp_path / "run.h5"
    Simulation(ROBOT, threads=1).run(1.0, 0.1, path=path, callback=steer)
    again = Simulation.restore(path)
    assert again.motors[0].speed == -4.0
    trajectory = again.run(2.0, 0.1, path=path)
    assert np.array_equal(again.nodes, whole.nodes)
    assert trajectory.motor_speed[3, 0] == ROBOT.motors[0].speed and trajectory.motor_speed[-1, 0] == -4.0
    later = Simulation.restore(path)
    assert later.motors[0].speed == -4.0


def test_functions_set_on_the_way_are_wanted_back(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    simulation = Simulation(ROBOT, threads=1)
    simulation.run(0.2, 0.1, path=path)
    simulation = Simulation.restore(path)
    simulation.motors[0].speed = value_of
    simulation.run(0.4, 0.1, path=path)
    with pytest.raises(FlagrsError, match=r"motors\[0\]\.speed was the Python function"):
        Simulation.restore(path)
    again = Simulation.restore(path, scene=simulation.scene)
    again.run(0.6, 0.1, path=path)
    simulation.run(0.6, 0.1, path=False)
    assert np.array_equal(again.nodes, simulation.nodes)


def test_the_axis_of_a_turning_clamp_goes_on_from_where_it_is() -> None:
    turning = flagrs.Rotation(axis=(0, 0, 1), rate=1.0)
    clamp = Clamp(nodes=(0, 1), edges=(0,), velocity=(0.01, 0.0, 0.0), rotation=turning)
    simulation = Simulation(Scene(rods=rod(), clamps=clamp, fluid=OIL), dt=0.01, threads=1)
    simulation.step(100)
    simulation.clamps[0].velocity = (0.0, 0.02, 0.0)
    simulation.step(100)
    center = np.array([0.01, 0.02, 0.0])
    angle = 2.0
    start = rod().nodes[1]
    spun = np.array([np.cos(angle) * start[0] - np.sin(angle) * start[1], np.sin(angle) * start[0], start[2]])
    np.testing.assert_allclose(simulation.nodes[1], center + spun, atol=1e-12)


def test_a_change_begins_steps_anew_and_the_error_asked_for_holds() -> None:
    def run(rtol: float) -> np.ndarray:
        simulation = Simulation(ROBOT, rtol=rtol, threads=1)
        for speed in (5.0, -5.0, 2.0):
            simulation.motors[0].speed = speed
            simulation.run(simulation.time + 0.3, 0.3, path=False)
        return simulation.nodes

    exact, found = run(1e-7), run(1e-3)
    size = flagrs.time_step.size(ROBOT)
    assert np.linalg.norm(found - exact, axis=1).max() < 5e-3 * size


def test_setting_what_is_there_already_changes_nothing() -> None:
    one, two = (Simulation(ROBOT, threads=1) for _ in range(2))
    one.step(5)
    two.step(5)
    two.motors[0].speed = ROBOT.motors[0].speed
    assert two.scene is ROBOT
    one.step(5)
    two.step(5)
    assert np.array_equal(one.nodes, two.nodes)


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("motors[0].speed", "fast", r"motors\[0\]\.speed"),
        ("motors[0].speed", np.nan, r"motors\[0\]\.speed"),
        ("motors[0].torque", 1.0, r"motors\[0\]\.speed"),
        ("motors[1].speed", 1.0, r"motors\[1\]\.torque"),
        ("clamps[0].velocity", (1.0, 2.0), r"clamps\[0\]\.velocity"),
        ("loads[0].torque", (0.0, 0.0, 1.0), r"loads\[0\]\.torque: the load was made as a force alone"),
        ("magnetic_field.field", "north", r"magnetic_field\.field"),
        ("fluid.background[0].strength", None, r"fluid\.background\[0\]\.strength"),
    ],
)
def test_what_is_not_allowed_is_refused_by_its_path(path: str, value: Any, said: str) -> None:
    simulation = Simulation(everything(), dt=0.01, threads=1)
    before = simulation.scene
    with pytest.raises(SceneError, match=said):
        set_at(simulation, path, value)
    assert simulation.scene is before
    simulation.step()


def test_parts_that_are_not_there_say_so() -> None:
    simulation = Simulation(Scene(rods=rod(), fluid=OIL, clamps=Clamp(nodes=(0,))), threads=1)
    with pytest.raises(FlagrsError, match="magnetic_field: the scene has none"):
        _ = simulation.magnetic_field
    with pytest.raises(FlagrsError, match="no rotation"):
        _ = simulation.clamps[0].rotation
    with pytest.raises(AttributeError):
        simulation.clamps[0].spin = 1.0  # type: ignore[attr-defined]
    assert "live clamps[0]" in repr(simulation.clamps[0])


def test_a_load_of_zero_can_be_set() -> None:
    scene = Scene(rods=rod(), fluid=OIL, loads=flagrs.PointLoad(node=8))
    simulation = Simulation(scene, dt=0.01, threads=1)
    simulation.loads[0].force = (0.0, 1e-6, 0.0)
    simulation.step()
    assert simulation.nodes[8, 1] > 0.0


def test_a_function_that_fails_leaves_the_last_good_state() -> None:
    simulation = Simulation(ROBOT, threads=1)
    simulation.step(3)
    before = simulation.nodes

    def broken(time: float) -> float:
        raise ValueError("no speed today")

    simulation.motors[0].speed = broken
    with pytest.raises(SceneError, match=r"motors\[0\]\.speed.*no speed today"):
        simulation.step()
    assert np.array_equal(simulation.nodes, before)
    simulation.motors[0].speed = 1.0
    simulation.step()
