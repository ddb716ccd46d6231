"""Motors and clamps: ten thousand turns, reversed, stepped, pulsed, and steps a hundred times too large."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from flagrs import Clamp, Fluid, Motor, Rod, Scene, Simulation, Table, scenarios
from flagrs.validation.elastica import tip_deflection

from hard.case import add, hard
from hard.parts import LOCAL, SILICONE, bow, straight

GROUP = "Driving"


def shaft(**drive: Any) -> Scene:
    """Return a straight rod of 4 edges of 5 mm, held at its first, with a motor between it and the rest."""
    rod = Rod(nodes=straight(0.02, 4), radius=1e-3, material=SILICONE, immersed=np.array([0, 1, 1, 1]) > 0)
    return Scene(
        rods=rod,
        fluid=LOCAL,
        clamps=Clamp(nodes=(0, 1), edges=(0,)),
        motors=Motor(node=1, shaft=1, **drive),
    )


#: Resistance of the shaft to spin, 4 pi mu a^2 over 15 mm [N m s].
SPIN = 4.0 * np.pi * 1e-6 * 0.015


def motor_angle(simulation: Simulation) -> float:
    """Return the angle of the shaft's last edge against the first [rad]: the motor's, but for the twist."""
    return float(simulation.theta[-1])


def ten_thousand_turns(options: dict[str, Any]) -> np.ndarray:
    """Return the errors of angle and torque after ten thousand turns; the twist lags by its closed form."""
    speed, turns = 100.0, 10_000
    simulation = Simulation(shaft(speed=speed), threads=1, **options)
    until = 2.0 * np.pi * turns / speed
    simulation.run(until=until, save_every=until, path=False)
    torque = float(simulation.frame()["motor_torque"][0])
    # Each hinge bears the torque of the edges beyond it: GJ tau = M l.
    share = SPIN * speed / 3.0
    twisting = float(simulation.scene.rods[0].GJ_array()[0])
    lag = (2.0 + 1.0 + 3.0) * share * 5e-3 / twisting
    return np.array([motor_angle(simulation) - (2.0 * np.pi * turns - lag), torque / (SPIN * speed) - 1.0])


# Round-off of the angle, 6e4 rad, is 7e-12; Newton's tolerance on the torque is 1e-10 of it.
for words, options in (
    ("steps of half a turn", {"dt": np.pi / 100.0}),
    ("steps of ten turns", {"dt": np.pi / 5.0}),
    ("rtol 1e-3", {"rtol": 1e-3}),
):
    add(
        GROUP,
        f"ten thousand motor turns, {words}",
        partial(ten_thousand_turns, options),
        against="closed form of angle, lag and torque",
        tolerance=1e-6,
    )

STEPPED = Table(times=[0.0, 0.5, 0.5 + 1e-9, 1.0], values=[10.0, 10.0, -20.0, -20.0])
PULSED = Table(times=[0.0, 0.3, 0.300001, 0.31, 0.310001, 1.0], values=[0.0, 0.0, 50.0, 50.0, 0.0, 0.0])
WAVE = Table(times=np.linspace(0.0, 1.0, 41), values=30.0 * np.tile([0.0, 1.0, 0.0, -1.0], 11)[:41])


def function_of(table: Table) -> Any:
    """Return a table as a plain function of time."""
    return lambda time: float(np.interp(time, table.times, table.values))


def turned(signal: Table, as_function: bool, options: dict[str, Any]) -> float:
    """Return the error of the motor's angle at 1 s, less the integral of its speed."""
    after = Table(
        times=[*signal.times, float(signal.times[-1]) + 1e-9, 20.0], values=[*signal.values, 0.0, 0.0]
    )
    simulation = Simulation(shaft(speed=function_of(after) if as_function else after), threads=1, **options)
    simulation.run(until=1.5, save_every=0.5, path=False)
    expected = float(np.trapezoid(after.values, after.times))
    return motor_angle(simulation) - expected


for words, signal in (("stepped and reversed", STEPPED), ("pulsed for 10 ms", PULSED), ("10 Hz wave", WAVE)):
    for style, as_function in (("table", False), ("function", True)):
        for name, options in (
            ("fixed steps of 20 ms", {"dt": 0.02}),
            ("rtol 1e-2", {"rtol": 1e-2}),
            ("rtol 1e-5", {"rtol": 1e-5}),
        ):
            if as_function and "dt" in options:
                continue  # a function's quadrature over a step the user has chosen is the user's
            add(
                GROUP,
                f"a motor {words} by a {style}, {name}",
                partial(turned, signal, as_function, options),
                against="the integral of its speed [rad]",
                # A table is integrated exactly; some twist of the last steps may be left in the shaft.
                tolerance=(10.0 if as_function else 1e-3) * options.get("rtol", 0.0) + 1e-7,
            )


@hard(
    GROUP,
    "a torque-driven motor, reversed every 0.1 s",
    against="closed form: torque over resistance to spin; error over the swing",
    tolerance=1e-2,
)
def torque_reversed() -> np.ndarray:
    """Return the errors of the angle after each swing of a torque that changes sign, over a swing."""
    torque = 1e-6
    times = np.repeat(np.arange(0.0, 1.05, 0.1), 2)[1:-1]
    times[1::2] -= 1e-9
    signs = np.repeat([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0], 2)
    simulation = Simulation(shaft(torque=Table(times=times, values=torque * signs)), rtol=1e-3, threads=1)
    trajectory = simulation.run(until=1.0, save_every=0.1, path=False)
    # The mean angle of the three wet edges, which does not know how they are twisted; there, back, and so on.
    swings = np.array([0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 2.0])
    angles = np.asarray(trajectory.theta)[:, 1:].mean(axis=1)
    return angles / (torque * 0.1 / SPIN) - swings


def to_rest(factor: float) -> np.ndarray:
    """Return the error of a loaded cantilever's deflection after steps of many relaxation times."""
    scene = scenarios.cantilever(normalized_load=4.0, edge_count=20)
    rod = scene.rods[0]
    length = float(rod.rest_array()[-1, 0])
    simulation = Simulation(scene, threads=1)
    simulation.dt *= 100.0 * factor
    simulation.step(20)
    tip = simulation.nodes[-1] / length
    bending, stretching = float(rod.EI_array()[0, 0, 0]), float(rod.EA_array()[0])
    return np.array([-tip[2], 1.0 - tip[0]]) - tip_deflection(4.0, bending / (stretching * length**2))


for factor in (20.0, 1e2, 1e4, 1e8):
    add(
        GROUP,
        f"a cantilever in steps of {factor:g} relaxation times",
        partial(to_rest, factor),
        against="extensible elastica, by shooting",
        tolerance=2e-3,  # the mesh error of 20 edges, measured 1.3e-3
        may_refuse=factor > 50.0,
    )


def large_steps(scheme: str) -> float:
    """Return how much the elastic energy of a bow let go grows at worst in steps 100 times too large."""
    scene = Scene(rods=bow(), fluid=Fluid(viscosity=1.0))
    simulation = Simulation(scene, scheme=scheme, threads=1)
    simulation.dt *= 100.0
    energies = [simulation.energy()["total"]]
    for _ in range(10):
        simulation.step()
        energies.append(simulation.energy()["total"])
    assert energies[-1] < 1e-2 * energies[0]
    return max(0.0, float(np.diff(energies).max()) / energies[0])


for scheme in ("overdamped", "implicit"):
    add(
        GROUP,
        f"a bow let go in steps a hundred times too large, {scheme}",
        partial(large_steps, scheme),
        against="energy never grows",
        tolerance=1e-12,
    )


@hard(
    GROUP,
    "a robot in steps a hundred times too large",
    against="the angle its motors must have turned by [rad]",
    tolerance=1e-9,
    may_refuse=True,
)
def robot_large_steps() -> np.ndarray:
    """Return the error of the motors' angles after four steps of five radians of theirs."""
    scene = scenarios.robot(rpm=20.0, contact=False, fluid={"model": "RFT"})
    simulation = Simulation(scene, threads=1)
    simulation.dt *= 100.0
    simulation.step(4)
    speeds = np.array([float(motor.speed) for motor in scene.motors])
    return np.asarray(simulation.frame()["motor_angle"]) - speeds * simulation.time
