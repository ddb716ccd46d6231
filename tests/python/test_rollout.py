"""Many states of one model side by side: the same bits as one by one, errors by case, inputs by case."""

from typing import Any

import flagrs
import numpy as np
import pytest
from flagrs import FlagrsError, Scene, SceneError, Simulation, rollout

ROBOT = flagrs.scenarios.robot(edge_length=9e-3)
SOFT = flagrs.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)


def states(count: int) -> list[Any]:
    """Return states of the robot at different times of a run."""
    simulation = Simulation(ROBOT, threads=1)
    found = []
    for _ in range(count):
        simulation.step(3)
        found.append(simulation.state())
    return found


@pytest.mark.parametrize("options", [{}, {"dt": 0.02}, {"scheme": "implicit", "dt": 0.02}])
def test_every_case_goes_the_way_of_a_simulation_by_itself(options: dict[str, Any]) -> None:
    starts = states(4)
    speeds = [1.0, -2.0, 3.0, 0.5]
    inputs = [{"motors[0].speed": speed} for speed in speeds]
    found = {
        threads: rollout(
            ROBOT, starts, inputs, until=2.0, save_every=0.25, threads=threads, **options
        ).check()
        for threads in (1, 2)
    }
    for case, (start, speed) in enumerate(zip(starts, speeds, strict=True)):
        single = Simulation(ROBOT, threads=1, **options)
        single.load_state(start)
        single.motors[0].speed = speed
        first = max(float(start["time"][0]) for start in starts)
        times = found[1].time[case]
        asked = 0.25 * np.arange(1, 9)
        assert (np.diff(times) > 0.0).all() and times[0] > first and abs(times[-1] - 2.0) < 1e-12
        rows = []
        for time in asked:
            if single.rtol is None:
                flagrs.running.reach(single._native, time, single._native.step)
                rows.append(single.frame())
            else:
                single._native.advance_past(time, 2.0)
                rows.append(single._native.frame_at(time))
        for threads in (1, 2):
            for name in (
                "nodes",
                "theta",
                "velocities",
                "motor_torque",
                "force_density",
                "energy",
                "minimum_gap",
            ):
                expected = np.array([row[name] for row in rows])
                assert np.array_equal(found[threads].frames[name][case], expected), (threads, name)
            last = found[threads].states[case]
            assert last is not None
            for name, array in single.state().items():
                assert np.array_equal(last[name], array), name


def test_what_drove_one_case_so_far_is_never_taken_for_what_drove_another() -> None:
    starts, speeds = [], [0.3 + 0.1 * case for case in range(40)]
    simulation = Simulation(ROBOT, threads=1)
    for speed in speeds:
        simulation.motors[0].speed = speed
        starts.append(simulation.state())
    # Each case goes on from a speed of its own, and changes another motor's.
    found = rollout(ROBOT, starts, [{"motors[1].speed": 2.0}] * len(starts), steps=1, threads=1).check()
    assert np.allclose(found.frames["motor_speed"][:, -1, 0], speeds, rtol=1e-12, atol=0.0)
    # Where the shaft has turned to tells of the signal that the core was given.
    single = Simulation(ROBOT, threads=1)
    for case in (1, 17, 39):
        single.load_state(starts[case])
        single.motors[1].speed = 2.0
        single.step()
        assert np.array_equal(found.nodes[case, -1], single.frame()["nodes"]), case


def test_steps_and_inputs_without_states() -> None:
    found = rollout(
        ROBOT, inputs=[{"motors[0].speed": w, "motors[1].speed": -w} for w in (1.0, 2.0)], steps=4
    )
    assert found.nodes.shape == (2, 1, ROBOT.node_count, 3) and len(found) == 2
    single = Simulation(ROBOT, threads=1)
    single.motors[0].speed, single.motors[1].speed = 2.0, -2.0
    single.step(4)
    assert np.array_equal(found.nodes[1, 0], single.frame()["nodes"])
    assert found.scenes[1].motors[1].speed == -2.0


def test_last_states_go_on_in_the_next_rollout() -> None:
    simulation = Simulation(ROBOT, threads=1)
    once = rollout(simulation, inputs=[{"motors[0].speed": 1.5}] * 2, steps=6, threads=2)
    first = rollout(simulation, inputs=[{"motors[0].speed": 1.5}] * 2, steps=3, threads=2)
    second = rollout(simulation, first.states, steps=3, threads=2)  # type: ignore[arg-type]
    assert np.array_equal(second.nodes, once.nodes)
    assert second.scenes[0].motors[0].speed == 1.5
    assert simulation.time == 0.0


def test_a_case_that_fails_leaves_the_others_alone() -> None:
    def broken(time: float) -> float:
        raise ValueError("no speed")

    found = rollout(
        ROBOT, inputs=[{"motors[0].speed": 1.0}, {"motors[0].speed": broken}, {}], until=0.2, threads=2
    )
    assert found.errors[0] is None and found.errors[2] is None
    assert isinstance(found.errors[1], SceneError) and "no speed" in str(found.errors[1])
    assert np.isfinite(found.nodes[[0, 2]]).all() and np.isnan(found.nodes[1]).all()
    assert found.states[1] is None
    with pytest.raises(SceneError, match="no speed") as caught:
        found.check()
    assert "in case 1 of the rollout" in caught.value.__notes__
    with pytest.raises(FlagrsError, match="case 1 failed"):
        found.trajectory(1)


def test_a_case_is_a_trajectory_with_all_its_measures() -> None:
    found = rollout(ROBOT, inputs=[{}, {"motors[0].speed": flagrs.rpm(10.0)}], until=2.0, save_every=0.1)
    alone = Simulation(ROBOT, threads=1).run(2.0, 0.1, path=False)
    trajectory = found.trajectory(0)
    assert np.array_equal(trajectory.nodes, alone.nodes[1:])
    assert trajectory.swimming_speed() == pytest.approx(alone.swimming_speed(start=1.05), rel=1e-12)
    assert found.trajectory(1).scene.motors[0].speed == flagrs.rpm(10.0)


def test_clamps_report_in_every_case() -> None:
    scene = Scene(
        rods=flagrs.Rod.straight(length=0.05, edge_count=8, radius=1e-3, material=SOFT),
        fluid=flagrs.Fluid(viscosity=1.0, model="RFT"),
        clamps=flagrs.Clamp(nodes=(0, 1), edges=(0,)),
        loads=flagrs.PointLoad(node=8),
    )
    found = rollout(
        scene, inputs=[{"loads[0].force": (0.0, f, 0.0)} for f in (0.0, 1e-6)], until=50.0, rtol=1e-5
    )
    assert found.frames["clamp_force"].shape == (2, 1, 1, 3)
    assert found.frames["clamp_force"][1, 0, 0, 1] < 0.0
    assert not found.frames["clamp_force"][0].any()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({}, "until: None is not allowed"),
        ({"until": 1.0, "steps": 2}, "until"),
        ({"steps": 2, "save_every": 0.1}, "save_every"),
        ({"steps": 0}, "steps"),
        ({"until": -1.0}, "until"),
        ({"states": [], "steps": 1}, "states: 'no cases'"),
        ({"inputs": [{}], "states": [{}, {}], "steps": 1}, "inputs"),
        ({"states": [{}], "steps": 1}, r"cases\[0\].*state"),
        ({"inputs": [{"motors[0].spede": 1.0}], "steps": 1}, r"cases\[0\].*did you mean"),
        ({"inputs": [{"motors[7].speed": 1.0}], "steps": 1}, r"cases\[0\].*motors\[7\]"),
        ({"inputs": [{"motors[0].speed": "fast"}], "steps": 1}, r"cases\[0\]\.motors\[0\]\.speed"),
    ],
)
def test_what_is_not_allowed_is_refused_before_anything_runs(arguments: dict[str, Any], said: str) -> None:
    with pytest.raises(SceneError, match=said):
        rollout(ROBOT, **arguments)


def test_a_simulation_brings_its_own_settings() -> None:
    simulation = Simulation(ROBOT, dt=0.05, threads=1)
    found = rollout(simulation, steps=2)
    simulation.step(2)
    assert np.array_equal(found.nodes[0, 0], simulation.nodes)
    with pytest.raises(SceneError, match="a simulation together with"):
        rollout(simulation, steps=2, dt=0.1)
    forced = Simulation(ROBOT, force=lambda t, nodes, v, d: np.zeros_like(nodes), threads=1)
    with pytest.raises(SceneError, match="force function"):
        rollout(forced, steps=1)
