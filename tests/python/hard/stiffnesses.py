"""Stiffnesses: ratios of stretching, bending and twisting over eight decades, and between rods of a scene."""

from __future__ import annotations

from functools import partial

import numpy as np
from flagrs import Clamp, Fluid, Material, Motor, Rod, Scene, Simulation, scenarios
from flagrs.validation.elastica import tip_deflection

from hard.case import add, hard
from hard.parts import SILICONE, apart, arc, bow, cantilever, elapsed, placed, settle, straight

GROUP = "Stiffnesses"

#: Where a second rod is put, too far away to matter [m].
FAR = (0.0, 50.0, 0.0)


def stretching_over_bending(compliance: float) -> np.ndarray:
    """Return the error of both tip deflections of a cantilever with this EI / (EA L^2), over the length."""
    scene = scenarios.cantilever(normalized_load=3.0, edge_count=40)
    rod = scene.rods[0]
    bending = float(rod.EI_array()[0, 0, 0])
    length = float(rod.rest_array()[-1, 0])
    changed = rod.replace(EI=bending, GJ=bending, EA=bending / (compliance * length**2))
    tip = settle(scene.replace(rods=(changed,))).nodes[-1] / length
    return np.array([-tip[2], 1.0 - tip[0]]) - tip_deflection(3.0, compliance)


for compliance in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
    # Mesh error of 40 edges: some 0.1 / 40^2 of the length; measured 2.8e-4.
    add(
        GROUP,
        f"EA L^2 / EI = {1.0 / compliance:g}",
        partial(stretching_over_bending, compliance),
        against="extensible elastica, by shooting",
        tolerance=4e-4,
        may_refuse=compliance == 1e-10,
    )


def bending_over_twisting(ratio: float) -> float:
    """Return the error of the sag out of plane of a quarter circle, against Castigliano's theorem.

    A force P on the tip gives P R^3 (pi / 4 / EI + (3 pi / 4 - 2) / GJ) for the arc from wall to tip.
    """
    radius, count = 0.05, 60
    # The clamped edge reaches half an edge behind the wall.
    step = np.pi / 2.0 / (count + 0.5)
    nodes = arc(radius * step * (count + 1), step * (count + 1), count + 1)
    bending = 1e-6
    force = 1e-3 * bending / radius**2 / (1.0 + ratio)
    options = {"EI": bending, "GJ": bending / ratio, "EA": 1e4 * bending / radius**2}
    simulation = settle(cantilever(nodes, np.array([0.0, 0.0, -force]), options))
    expected = force * radius**3 / bending * (np.pi / 4.0 + (3.0 * np.pi / 4.0 - 2.0) * ratio)
    return float(-simulation.nodes[-1, 2] / expected - 1.0)


for ratio in (1e-4, 1e-2, 1.0, 1e2, 1e4):
    # Mesh error of 60 edges of 1.5 degrees: measured 2e-4 to 3e-4, four times that with 30.
    add(
        GROUP,
        f"EI / GJ = {ratio:g}",
        partial(bending_over_twisting, ratio),
        against="Castigliano's theorem for a quarter circle",
        tolerance=2e-3,
    )

STEEL = Material(youngs_modulus=2e11, density=7800.0)


def beside_steel(options: dict[str, float], held: bool, together: bool) -> float:
    """Return how far a soft rod's motion beside a steel rod far away is from its motion alone."""
    soft = bow(material=SILICONE.replace(youngs_modulus=2e5))
    steel = Rod(nodes=placed(straight(0.1, 5), FAR), radius=2e-3, material=STEEL)
    clamps = (Clamp(rod=1, nodes=tuple(range(6)), edges=tuple(range(5))),) if held else ()
    fluid = Fluid(viscosity=1.0, model="RSS" if together else "RFT")
    alone = elapsed(Simulation(Scene(rods=soft, fluid=fluid), threads=1, **options), 2.0)
    beside = Scene(rods=(soft, steel), fluid=fluid, clamps=clamps)
    found = elapsed(Simulation(beside, threads=1, **options), 2.0)[: len(alone)]
    assert np.abs(alone - soft.nodes).max() > 1e-3
    return apart(found, alone, 0.02)


for held in (True, False):
    for words, options, tolerance in (
        ("fixed steps", {"dt": 0.02}, 1e-6),
        ("rtol 1e-3", {"rtol": 1e-3}, 2e-3),
        ("rtol 1e-5", {"rtol": 1e-5}, 2e-5),
    ):
        add(
            GROUP,
            f"a soft rod beside {'held' if held else 'free'} steel, a million times stiffer, {words}",
            partial(beside_steel, options, held, False),
            against="the soft rod alone",
            tolerance=tolerance,
        )


def beside_rail(rtol: float) -> float:
    """Return the error of a small filament's motion beside a rail a hundred times as long, over rtol."""
    small = bow()
    rail = Rod(nodes=placed(straight(2.0, 8), FAR), radius=2e-3, material=STEEL)
    held = Clamp(rod=1, nodes=tuple(range(9)), edges=tuple(range(8)))
    fluid = Fluid(viscosity=1.0, model="RFT")
    reference = elapsed(Simulation(Scene(rods=small, fluid=fluid), rtol=1e-7, threads=1), 0.2)
    scene = Scene(rods=(small, rail), fluid=fluid, clamps=held)
    found = elapsed(Simulation(scene, rtol=rtol, threads=1), 0.2)[: len(reference)]
    # The filament's own size: its root mean square distance from its axis is less than a twentieth of it.
    return apart(found, reference, 1e-3) / rtol


for rtol in (1e-2, 1e-3, 1e-4):
    add(
        GROUP,
        f"a filament of 20 mm beside a held rail of 2 m, rtol {rtol:g}",
        partial(beside_rail, rtol),
        against="the filament alone at rtol 1e-7; error over rtol",
        tolerance=10.0,
    )


def beside_slow_motor(rtol: float) -> float:
    """Return the error, over rtol, of a bow let go beside a motor of 1e-3 rad/s."""
    small = bow()
    shaft = Rod(nodes=placed(straight(0.03, 3), FAR), radius=1e-3, material=SILICONE)
    scene = Scene(
        rods=(small, shaft),
        fluid=Fluid(viscosity=1.0, model="RFT"),
        clamps=Clamp(rod=1, nodes=(0, 1), edges=(0,)),
        motors=Motor(rod=1, node=1, shaft=1, speed=1e-3),
    )
    alone = Scene(rods=small, fluid=scene.fluid)
    reference = elapsed(Simulation(alone, rtol=1e-7, threads=1), 0.1)
    found = elapsed(Simulation(scene, rtol=rtol, threads=1), 0.1)[: len(reference)]
    return apart(found, reference, 1e-3) / rtol


for rtol in (1e-2, 1e-3, 1e-5):
    add(
        GROUP,
        f"a bow let go beside a slow motor, rtol {rtol:g}",
        partial(beside_slow_motor, rtol),
        against="the bow alone at rtol 1e-7; error over rtol",
        tolerance=10.0,
    )


@hard(
    GROUP,
    "unequal bending stiffness: a strip sags along its soft axis by its soft stiffness",
    against="virtual work, hinge by hinge, with each axis's own stiffness",
    tolerance=1e-5,
)
def strip_sags() -> np.ndarray:
    """Return the errors of both deflections of a straight strip whose axes differ by a factor of 1e4."""
    soft, stiff = 1e-7, 1e-3
    nodes = straight(0.1, 10)
    matrix = np.array([[soft, 0.0], [0.0, stiff]])
    options = {"EI": matrix, "GJ": 1e-6, "EA": 1.0, "director": np.array([0.0, 1.0, 0.0])}
    force = 1e-3 * soft / 0.1**2
    # m1 is y and m2 = t x m1 is z; EI[0, 0] goes with the curvature kb . m2, which moves the tip along m1.
    tip = settle(cantilever(nodes, np.array([0.0, force, 0.0]), options)).nodes[-1]
    work = float((((nodes[-1, 0] - nodes[1:-1, 0]) ** 2) * 0.01).sum())
    strong = 1e4 * force
    other = settle(cantilever(nodes, np.array([0.0, 0.0, strong]), options)).nodes[-1]
    return np.array([tip[1] / (force * work / soft) - 1.0, other[2] / (strong * work / stiff) - 1.0])
