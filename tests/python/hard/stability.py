"""Losing stability: columns buckle, trusses snap through, filaments whirl, rods curl up."""

from __future__ import annotations

from functools import partial

import numpy as np
from contact_cases import Plectoneme
from flagrs import Clamp, Fluid, Material, PointLoad, Rod, Scene, Simulation
from scipy.optimize import brentq
from scipy.special import jv

from hard.case import add, hard
from hard.parts import SILICONE, straight

GROUP = "Stability"


def column(weight: float, lean: float, rtol: float | None = None) -> Simulation:
    """Return a column with q L^3 / EI = `weight`, set off by `lean` L at its tip."""
    count = 40
    edge = 0.1 / (count + 0.5)
    density, radius = 1000.0, 1e-3
    per_length = density * np.pi * radius**2 * 9.81
    bending = per_length * 0.1**3 / weight
    nodes = np.zeros((count + 2, 3))
    nodes[:, 2] = edge * (np.arange(count + 2) - 0.5)
    rest = nodes.copy()
    nodes[:, 0] = lean * 0.1 * (1.0 - np.cos(0.5 * np.pi * np.clip(nodes[:, 2], 0.0, None) / 0.1))
    rod = Rod(
        nodes=nodes,
        rest_nodes=rest,
        radius=radius,
        material=Material(youngs_modulus=1e6, density=density),
        EI=bending,
        GJ=bending,
        EA=1e5 * bending / 0.1**2,
    )
    scene = Scene(
        rods=rod,
        fluid=Fluid(viscosity=1.0, model="RFT", density=0.0),
        clamps=Clamp(nodes=(0, 1), edges=(0,)),
        gravity=np.array([0.0, 0.0, -9.81]),
    )
    return Simulation(scene, dt=relaxation(scene), rtol=rtol, threads=1)


def relaxation(scene: Scene) -> float:
    """Return the slowest relaxation time of the column, zeta L^4 / 1.875^4 EI with zeta = 2.5 mu [s]."""
    return 2.5 * 0.1**4 / (1.875**4 * float(scene.rods[0].EI_array()[0, 0, 0]))


def lowest_stiffness(weight: float) -> float:
    """Return the smallest eigenvalue, over EI / L^3, of the Hessian of a column that stands straight."""
    simulation = column(weight, 0.0)
    simulation.step(20)
    free = (simulation.dof_of_node[2:, None] + np.arange(3)).ravel()
    hessian = simulation.hessian().toarray()[np.ix_(free, free)]
    bending = float(simulation.scene.rods[0].EI_array()[0, 0, 0])
    return float(np.linalg.eigvalsh(hessian)[0]) / (bending / 0.1**3)


@hard(
    GROUP,
    "a column buckles under its own weight",
    against="Greenhill: q L^3 / EI = 7.837, by the first zero of the Bessel function of order -1/3",
    tolerance=3e-3,  # 40 edges, second order; EA L^2 / EI = 1e5
)
def greenhill() -> float:
    """Return the error of the weight at which the lowest stiffness vanishes."""
    exact = 2.25 * float(brentq(lambda x: jv(-1.0 / 3.0, x), 1.5, 2.0)) ** 2
    return float(brentq(lowest_stiffness, 0.9 * exact, 1.1 * exact, rtol=1e-6)) / exact - 1.0


def leans(weight: float, rtol: float | None) -> float:
    """Return the lean of a column after a long time over that before."""
    simulation = column(weight, 1e-3, rtol)
    before = simulation.nodes[-1, 0]
    # Implicit steps longer than the growth would settle on the upright column, stable or not.
    simulation.dt *= 2.0 / weight
    until = 60.0 * relaxation(simulation.scene)
    simulation.run(until=until, save_every=until, path=False)
    # What falls far ends by hanging straight down, with little lean.
    hangs = simulation.nodes[-1, 2] < 0.0
    return np.inf if hangs else float(simulation.nodes[-1, 0] / before)


def stands_or_falls(weight: float, falls: bool, rtol: float | None) -> float:
    """Return 1 if a column does what it should not."""
    return float((leans(weight, rtol) > 1.5) != falls)


for weight, falls in ((3.0, False), (7.5, False), (8.2, True), (40.0, True)):
    for words, rtol in (("fixed steps", None), ("rtol 1e-3", 1e-3)):
        add(
            GROUP,
            f"a column with q L^3 / EI = {weight:g} that leans, {words}",
            partial(stands_or_falls, weight, falls, rtol),
            against="Greenhill: it stands up below 7.837 and falls over above",
            tolerance=0.5,
        )


def truss(load: float) -> float:
    """Return the height of the top of a truss under a share of its critical load over that at rest.

    Two edges that only stretch, with the energy EA (l - l0)^2 / 2 l0 each: the force at the height h is
    2 EA (1 / l0 - 1 / l) h, with its largest value where l^3 = l0 a^2.
    """
    span, height, stretching = 0.05, 0.01, 1.0
    rest = np.hypot(span, height)
    length = (rest * span**2) ** (1.0 / 3.0)
    top = np.sqrt(length**2 - span**2)
    critical = 2.0 * stretching * (1.0 / length - 1.0 / rest) * top
    rod = Rod(
        nodes=np.array([[-span, 0.0, 0.0], [0.0, 0.0, height], [span, 0.0, 0.0]]),
        radius=1e-4,
        material=SILICONE,
        EA=stretching,
        EI=1e-16,
        GJ=1e-16,
    )
    scene = Scene(
        rods=rod,
        fluid=Fluid(viscosity=0.1, model="RFT"),
        clamps=Clamp(nodes=(0, 2)),
        loads=PointLoad(node=1, force=np.array([0.0, 0.0, -load * critical])),
    )
    simulation = Simulation(scene, dt=1e-3, threads=1)
    for _ in range(60):
        simulation.step(5)
        simulation.dt *= 1.15
    return float(simulation.nodes[1, 2] / height)


for load, sign in ((0.98, 1.0), (0.9999, 1.0), (1.0001, -1.0), (1.5, -1.0), (100.0, -1.0)):
    add(
        GROUP,
        f"a shallow truss under {load:g} of its critical load",
        partial(lambda load, sign: 0.0 if sign * truss(load) > 0.3 else 1.0, load, sign),
        against="von Mises: it stands below the critical load and has snapped through above",
        tolerance=0.5,
    )


@hard(
    GROUP,
    "a plectoneme",
    against="ply angle of Clauvelin, Audoly and Neukirch for its torque and radius [rad]",
    tolerance=0.03,
    slow=True,
)
def plectoneme() -> float:
    """Return the error of the ply angle; it never penetrates."""
    ply = Plectoneme()
    ply.wind()
    assert ply.watch.least > 0.95
    measured = ply.measured()
    return measured["angle"] - ply.theory(measured["torque"], measured["radius"])["angle"]


def whirl(factor: float, rtol: float) -> np.ndarray:
    """Return distance of the tip from the axis and torque at the base of a filament that has whirled.

    The base turns at a multiple of 8.9 EI / (zeta L^2), the critical speed of Wolgemuth, Powers and
    Goldstein, with zeta = 4 pi mu a^2; distances are over the length, torques over the straight filament's.
    """
    count, length, radius = 16, 0.1, 4e-3
    nodes = straight(length, count)
    nodes[2:, 1] = 5e-3 * (np.arange(2, count + 1) / count) ** 2
    rod = Rod(nodes=nodes, rest_nodes=straight(length, count), radius=radius, material=SILICONE)
    bending = float(rod.EI_array()[0, 0, 0])
    spin = 4.0 * np.pi * radius**2
    speed = factor * 8.9 * bending / (spin * length**2)
    turn = Clamp(nodes=(0, 1), edges=(0,), angular_velocity=speed)
    scene = Scene(rods=rod, fluid=Fluid(viscosity=1.0, model="RFT"), clamps=turn)
    simulation = Simulation(scene, rtol=rtol, threads=1)
    until = 600.0 / speed
    trajectory = simulation.run(until=until, save_every=until / 100.0, path=False)
    radial = np.linalg.norm(np.asarray(trajectory.nodes)[-20:, -1, 1:], axis=1) / length
    torque = float(simulation.gradient()[simulation.dof_of_edge[0]]) / (spin * length * speed)
    return np.array([radial.mean(), torque])


def whirls(factor: float) -> np.ndarray:
    """Return the differences of two tolerances."""
    return whirl(factor, 1e-3) - whirl(factor, 1e-5)


for factor in (0.5, 3.0, 10.0):
    add(
        GROUP,
        f"a filament whirls at {factor:g} times the critical speed",
        partial(whirls, factor),
        against="rtol 1e-5 in place of 1e-3: distance from the axis, torque",
        tolerance=0.02,
        may_refuse=factor > 5.0,
    )
