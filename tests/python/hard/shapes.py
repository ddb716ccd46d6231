"""Shapes: kinks up to the sharpest that is allowed, rings, branches."""

from __future__ import annotations

from functools import partial

import numpy as np
from flagrs import Fluid, Rod, Scene, Simulation, scenarios
from scipy.spatial.transform import Rotation

from hard.case import add, hard
from hard.parts import LOCAL, SILICONE, apart, elapsed, settle, straight

GROUP = "Shapes"


def kinked(degrees: float, turn: float = 0.0, tail: bool = False) -> Rod:
    """Return two edges of 10 mm with an angle between them, straight at rest, in a plane turned [rad].

    With a tail there is a third edge, which turns out of the plane by a right angle.
    """
    angle = np.radians(degrees)
    plane = np.array([0.0, np.cos(turn), np.sin(turn)])
    out = np.cos(angle) * np.array([1.0, 0.0, 0.0]) + np.sin(angle) * plane
    nodes = [np.zeros(3), np.array([0.01, 0.0, 0.0])]
    nodes.append(nodes[1] + 0.01 * out)
    if tail:
        nodes.append(nodes[2] + 0.01 * np.cross([1.0, 0.0, 0.0], plane))
    flat = straight(0.01 * (len(nodes) - 1), len(nodes) - 1)
    return Rod(nodes=np.array(nodes), rest_nodes=flat, radius=5e-4, material=SILICONE)


def kink_energy(degrees: float, turn: float) -> np.ndarray:
    """Return the errors of bending and twisting energy of a kink, over the bending energy.

    The hinge has the curvature 2 tan(phi / 2) over the mean length l: EI (2 tan(phi / 2))^2 / 2 l.
    """
    rod = kinked(degrees, turn)
    energy = Simulation(Scene(rods=rod, fluid=LOCAL), threads=1).energy()
    bending = float(rod.EI_array()[0, 0, 0])
    expected = bending * (2.0 * np.tan(np.radians(degrees) / 2.0)) ** 2 / (2.0 * 0.01)
    return np.array([energy["bending"] / expected - 1.0, energy["twisting"] / expected])


for degrees in (90.0, 170.0, 179.0, 179.5, 179.9):
    for turn in (0.0, 0.3, 2.0):
        # Near 180 degrees the cosine loses digits: 1 + cos(179.9 deg) = 1.5e-6, known to 1e-16, or 1e-10.
        add(
            GROUP,
            f"a kink of {degrees:g} degrees in a plane turned by {turn:g} rad",
            partial(kink_energy, degrees, turn),
            against="closed form of the hinge's energy; no twist",
            tolerance=1e-7,
        )


def kink_opens(degrees: float) -> np.ndarray:
    """Return the shape to which a kinked rod opens, less a straight line, over its length, and its energy."""
    simulation = settle(Scene(rods=kinked(degrees, 0.4, tail=True), fluid=LOCAL))
    span = np.linalg.norm(simulation.nodes[-1] - simulation.nodes[0])
    energy = simulation.energy()
    scale = float(simulation.scene.rods[0].EI_array()[0, 0, 0]) / 0.01
    return np.array([span / 0.03 - 1.0, energy["total"] / scale])


for degrees in (150.0, 179.0, 179.9):
    add(
        GROUP,
        f"a rod with a kink of {degrees:g} degrees and a tail out of plane opens",
        partial(kink_opens, degrees),
        against="its rest shape, a straight line without energy",
        tolerance=1e-6,
    )

add(
    GROUP,
    "a kink of 179.99 degrees",
    partial(kink_energy, 179.99, 0.0),
    against="the range allowed",
    refused=True,
)


def closed_ring(edge_count: int) -> float:
    """Return the error of the energy of a straight rod closed to a ring, 2 pi^2 EI / L for many edges.

    A regular polygon of n hinges has EI n^2 (2 tan(pi / n))^2 / (2 L), which is that.
    """
    scene = scenarios.twisted_ring(twist=0.0, edge_count=edge_count)
    rod = scene.rods[0]
    bending = float(rod.EI_array()[0, 0, 0])
    stiff = rod.replace(EI=bending, GJ=bending, EA=1e4 * rod.EA_array())
    energy = settle(scene.replace(rods=(stiff,))).energy()["total"]
    length = float(rod.rest_lengths().sum())
    polygon = bending * edge_count**2 * (2.0 * np.tan(np.pi / edge_count)) ** 2 / (2.0 * length)
    return energy / polygon - 1.0


for edge_count in (3, 4, 7, 50):
    # What is left of the wave out of plane; EA is 1e4 times that of silicone.
    add(
        GROUP,
        f"a straight rod closed to a ring of {edge_count} edges",
        partial(closed_ring, edge_count),
        against="closed form, EI n^2 (2 tan(pi / n))^2 / 2 L",
        tolerance=1e-5,
    )


def star(arms: int, edges_per_arm: int = 4) -> Rod:
    """Return a star of arms in the plane z = 0, each a chain from the common first node."""
    nodes, edges = [np.zeros(3)], []
    for arm in range(arms):
        angle = 2.0 * np.pi * arm / arms
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        for k in range(edges_per_arm):
            edges.append([0 if k == 0 else len(nodes) - 1, len(nodes)])
            nodes.append(2e-3 * (k + 1) * out)
    return Rod(nodes=np.array(nodes), edges=np.array(edges), radius=2e-4, material=SILICONE)


def star_falls(arms: int, model: str, options: dict[str, float]) -> float:
    """Return how far the arms of a falling star are from turned copies of one, over an arm's length."""
    scene = Scene(
        rods=star(arms),
        fluid=Fluid(viscosity=0.1, model=model, density=0.0),
        gravity=np.array([0.0, 0.0, -9.81]),
    )
    nodes = elapsed(Simulation(scene, threads=1, **options), 2.0)
    assert nodes[0, 2] < -2e-4
    # In local drag weight and drag are alike along the arms, and nothing bends.
    assert model == "RFT" or abs(nodes[4, 2] - nodes[0, 2]) > 1e-5
    first = nodes[1:5]
    copies = [first @ Rotation.from_rotvec([0, 0, 2 * np.pi * k / arms]).as_matrix().T for k in range(arms)]
    return apart(nodes[1:], np.concatenate(copies), 8e-3)


for arms in (3, 5, 8, 16):
    for model in ("RSS", "RFT"):
        for words, options in (("fixed steps", {"dt": 0.02}), ("rtol 1e-4", {"rtol": 1e-4})):
            add(
                GROUP,
                f"a star of {arms} arms falls in {model}, {words}",
                partial(star_falls, arms, model, options),
                against="its own symmetry",
                # What adaptive steps leave to Newton's method, 0.02 rtol of the size, need not be symmetric.
                tolerance=2e-6 if "rtol" in options else 1e-6,
            )


@hard(
    GROUP,
    "a tree with rings in it moves like the same tree numbered backwards",
    against="invariance to the order of nodes and edges",
    tolerance=1e-7,
)
def tree_renumbered() -> float:
    """Return the difference of the motions of a network and of the same one with all numbers reversed.

    It is let go in its rest shape, under its weight: an initial shape apart from that has a twist that
    depends on the path along which frames are carried to each edge.
    """
    nodes = np.array(
        [[0, 0, 0], [2, 0, 0], [3, 2, 0], [1, 2, 0], [4, 3, 1], [5, 5, 1], [0, 3, 1], [-2, 0, 1]]
    )
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [2, 4], [4, 5], [3, 6], [0, 7], [1, 3]])
    last = len(nodes) - 1

    def motion(backwards: bool) -> np.ndarray:
        order = np.arange(len(nodes))[::-1] if backwards else np.arange(len(nodes))
        turned = (last - edges)[::-1, ::-1] if backwards else edges
        rod = Rod(nodes=2e-3 * nodes[order], edges=turned, radius=2e-4, material=SILICONE)
        scene = Scene(rods=rod, fluid=Fluid(viscosity=1.0, density=0.0), gravity=np.array([0.0, 0.0, -9.81]))
        return elapsed(Simulation(scene, dt=1e-2, threads=1), 0.5)[order]

    return apart(motion(True), motion(False), 0.01)
