"""Adaptive steps under what drives them: pulses, jumps, bad functions of time; starts, stresses, energy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from flagrs import (
    Clamp,
    Fluid,
    Material,
    Motor,
    Rod,
    Scene,
    SceneError,
    Simulation,
    StabilityWarning,
    Table,
    TimeFunction,
    Trajectory,
    scenarios,
)
from flagrs.time_step import size

OIL = Fluid(viscosity=1.0, model="RFT")
CLAMP = Clamp(nodes=(0, 1), edges=(0,))
SOFT = Material(youngs_modulus=1e6, density=1000.0)


def flagellum(material: Material = SOFT, **drive: Any) -> Scene:
    """Return the robot's second flagellum on a straight clamped shaft, in local drag."""
    robot = scenarios.robot(edge_length=9e-3)
    nodes = robot.rods[0].nodes[robot.motors[1].node - 1 :]
    rod = Rod(nodes=nodes, radius=1.6e-3, material=material)
    return Scene(rods=(rod,), fluid=OIL, motors=(Motor(node=1, shaft=1, **drive),), clamps=(CLAMP,))


def run(scene: Scene, rtol: float, until: float = 2.0) -> Trajectory:
    return Simulation(scene, rtol=rtol, threads=1).run(until, 0.02, path=False)


def error(found: Trajectory, reference: Trajectory) -> float:
    return float(np.linalg.norm(found.nodes - reference.nodes, axis=2).max() / size(found.scene))


def pulse(time: float) -> float:
    """Return 20 rad/s for 10 ms."""
    return 20.0 if 1.2345 <= time < 1.2445 else 0.0


def turned(time: float) -> float:
    return 5.0 if time < 0.777 else -5.0


PULSE = Table(times=[1.2345, 1.2345 + 1e-9, 1.2445, 1.2445 + 1e-9], values=[0.0, 20.0, 20.0, 0.0])
TURNED = Table(times=[0.777, 0.777 + 1e-9], values=[5.0, -5.0])


@pytest.mark.parametrize("rtol", [1e-1, 1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize(
    ("signal", "table"),
    [
        (pulse, PULSE),
        (TimeFunction(function=pulse, breaks=[1.2345, 1.2445]), PULSE),
        (turned, TURNED),
        (TURNED, TURNED),
    ],
    ids=["pulse", "pulse with breaks", "jump", "jump in a table"],
)
def test_functions_that_jump_are_followed_as_exactly_as_their_tables(
    signal: Callable[[float], float], table: Table, rtol: float
) -> None:
    reference = run(flagellum(speed=table), 1e-6)
    found = error(run(flagellum(speed=signal), rtol), reference)
    # The pulse alone moves nodes by a fifth of the size.
    assert found < 3.0 * rtol


@pytest.mark.parametrize("rtol", [1e-2, 1e-4])
def test_a_torque_that_is_switched_is_followed(rtol: float) -> None:
    scale = 1.2e-5
    table = Table(times=TURNED.times, values=scale * TURNED.values)
    reference = run(flagellum(torque=table), 1e-6)
    for torque in (table, lambda time: scale * turned(time)):
        assert error(run(flagellum(torque=torque), rtol), reference) < 5.0 * rtol


@pytest.mark.parametrize("bad", [None, "fast", 1.0 + 2.0j, float("nan"), float("inf")])
def test_what_a_function_must_not_give_is_named_with_its_motor_time_and_value(bad: Any) -> None:
    scene = flagellum(speed=lambda time: 1.0 if time < 0.5 else bad)
    simulation = Simulation(scene, dt=1e-2, threads=1)
    with pytest.raises(SceneError) as raised:
        simulation.step(100)
    assert raised.value.field == "motors[0].speed"
    assert repr(bad) in str(raised.value) and "t = 0.5" in str(raised.value)


def test_an_error_in_a_function_is_the_cause_of_one_that_names_its_motor() -> None:
    scene = flagellum(torque=lambda time: 1.0 / 0.0)
    with pytest.raises(SceneError, match=r"motors\[0\].torque.*division") as raised:
        Simulation(scene, dt=1e-2, threads=1).step()
    assert isinstance(raised.value.__cause__, ZeroDivisionError)


def test_breaks_must_increase_and_the_function_be_one() -> None:
    with pytest.raises(SceneError, match="breaks"):
        TimeFunction(function=pulse, breaks=[1.0, 1.0])
    with pytest.raises(SceneError, match="function"):
        TimeFunction(function=1.0)


@pytest.mark.parametrize("rtol", [1e-1, 1e-2, 1e-3, 1e-4, 1e-5])
def test_the_first_step_keeps_to_the_error_however_slow_the_motor(rtol: float) -> None:
    line = Rod.straight(length=0.1, edge_count=20, radius=1e-3, material=SOFT)
    bow = np.array(line.nodes)
    bow[:, 1] += 0.2
    bow[:, 2] += 0.01 * np.sin(np.pi * bow[:, 0] / 0.1)
    bent = Rod(nodes=bow, rest_nodes=line.nodes, radius=1e-3, material=SOFT)
    shaft = Rod.straight(length=0.05, edge_count=10, radius=1e-3, material=SOFT)
    motor = Motor(node=5, shaft=5, speed=1e-3)
    scene = Scene(rods=(shaft, bent), fluid=OIL, motors=(motor,), clamps=(CLAMP,))
    assert error(run(scene, rtol, 1.0), run(scene, 1e-7, 1.0)) < 3.0 * rtol


def test_the_angle_of_a_free_motor_goes_on_between_steps() -> None:
    trajectory = run(flagellum(torque=2.4e-5), 1e-3)
    late = np.diff(trajectory.motor_angle[50:, 0]) / 0.02
    assert late == pytest.approx(trajectory.motor_speed[51:, 0], rel=0.02)


@pytest.mark.parametrize("drive", [{"speed": 2.0}, {"torque": 2.4e-5}], ids=str)
@pytest.mark.parametrize("youngs_modulus", [1e6, 1e10])
def test_stresses_of_adaptive_frames_are_those_of_fixed_steps(
    youngs_modulus: float, drive: dict[str, float]
) -> None:
    scene = flagellum(Material(youngs_modulus=youngs_modulus, density=1260.0), **drive)
    fixed = Simulation(scene, dt=1e-3, threads=1).run(2.0, 0.2, path=False)
    found = Simulation(scene, rtol=1e-2, threads=1).run(2.0, 0.2, path=False)
    # The tolerance of positions, and the first-order error of fixed steps of 2 mrad.
    assert found.energy[4:] == pytest.approx(fixed.energy[4:], rel=3e-2)
    assert found.motor_torque[4:] == pytest.approx(fixed.motor_torque[4:], rel=1e-2)


def beam() -> Scene:
    """Return an undamped cantilever bent as its first mode, its edges as long as at rest."""
    count, length, root = 20, 0.1, 1.8751
    line = Rod.straight(length=length, edge_count=count, radius=1e-3, material=SOFT)
    x = np.linspace(0.0, root, count + 1)
    slope = 0.05 * (np.sinh(x) + np.sin(x) - 0.7341 * (np.cosh(x) - np.cos(x)))
    angle = 0.5 * (slope[1:] + slope[:-1])
    angle[0] = 0.0
    nodes = np.zeros((count + 1, 3))
    nodes[1:, 0] = np.cumsum(length / count * np.cos(angle))
    nodes[1:, 2] = np.cumsum(length / count * np.sin(angle))
    rod = Rod(nodes=nodes, rest_nodes=line.nodes, radius=1e-3, material=SOFT)
    return Scene(rods=(rod,), clamps=(CLAMP,))


@pytest.mark.parametrize("rtol", [1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
def test_the_energy_of_an_undamped_beam_never_grows(rtol: float) -> None:
    simulation = Simulation(beam(), scheme="implicit", rtol=rtol, threads=1)

    def energy() -> float:
        rates = simulation.state()["velocity"]
        return float(simulation.energy()["total"] + 0.5 * simulation.mass @ rates**2)

    start = energy()
    for _ in range(200):
        simulation.step(10)
        assert energy() < 1.001 * start


def test_explicit_steps_above_the_limit_are_warned_of() -> None:
    scene = scenarios.robot(rpm=20.0)
    limit = Simulation(scene, scheme="explicit", threads=1).stable_step()
    with pytest.warns(StabilityWarning, match="stability limit"):
        simulation = Simulation(scene, scheme="explicit", dt=1.6 * limit, threads=1)
    simulation.dt = 0.9 * limit
    with pytest.warns(StabilityWarning):
        simulation.dt = 1.1 * limit
