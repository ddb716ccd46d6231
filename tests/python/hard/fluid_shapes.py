"""The fluid's segments where they are hardest: any regularization, and rods that touch, cross or coincide."""

from __future__ import annotations

from functools import partial

import flagrs.fluid
import numpy as np
import numpy.typing as npt
from flagrs import Fluid, Material, Rod, Scene, Simulation
from scipy.integrate import quad_vec

from hard.case import add

GROUP = "Fluid"

Array = npt.NDArray[np.float64]
STIFF = Material(youngs_modulus=1e12, density=2000.0)
SOFT = Material(youngs_modulus=1e6, density=2000.0)
WEIGHT = np.array([0.0, 0.0, -9.81])


def quadrature(target: Array, start: Array, end: Array, epsilon: float) -> Array:
    """Return the velocity (2, 3, 3) that unit densities at the two ends of an edge give at a point.

    The integral over the edge of hat function times regularized Stokeslet (docs/theory/fluid.md, section 2).
    """
    length = float(np.linalg.norm(end - start))

    def integrand(a: float) -> Array:
        d = target - (start + a * (end - start))
        r = np.sqrt(d @ d + epsilon**2)
        block = (1.0 / r + epsilon**2 / r**3) * np.eye(3) + np.outer(d, d) / r**3
        return length * np.stack([(1.0 - a) * block, a * block])

    # Where the point is nearest the integrand peaks, over a width of epsilon: breaks crowd towards it.
    nearest = float(np.clip((target - start) @ (end - start) / length**2, 0.0, 1.0))
    width = np.geomspace(1e-8, 1.0, 33)
    breaks = np.unique(np.clip(np.concatenate([[0.0, nearest, 1.0], nearest - width, nearest + width]), 0, 1))
    return np.asarray(quad_vec(integrand, 0.0, 1.0, points=breaks[1:-1], epsrel=1e-12, limit=2000)[0])


def mobility(nodes: Array, edges: npt.NDArray[np.int64], epsilon: Array) -> Array:
    """Return the matrix (3N, 3N) from force densities to 8 pi mu times velocities, by quadrature."""
    matrix = np.zeros((len(nodes), 3, len(nodes), 3))
    for edge, (first, last) in enumerate(edges):
        for target in range(len(nodes)):
            blocks = quadrature(nodes[target], nodes[first], nodes[last], epsilon[edge])
            matrix[target, :, first] += blocks[0]
            matrix[target, :, last] += blocks[1]
    return matrix.reshape(3 * len(nodes), -1)


BENT = np.array([[0.0, 0, 0], [1, 0, 0], [1.6, 0.8, 0], [1.6, 1.2, 0.9]])


def regularized(ratio: float) -> float:
    """Return the largest error of the mobility of a bent chain of unit edges, over its largest entry."""
    edges = np.array([[0, 1], [1, 2], [2, 3]])
    found = flagrs.fluid.mobility(BENT, edges, ratio)
    expected = mobility(BENT, edges, np.full(3, ratio))
    return float(np.abs(found - expected).max() / np.abs(expected).max())


for ratio in (1e-6, 1e-4, 1e-2, 1.0, 10.0):
    add(
        GROUP,
        f"regularization over edge length {ratio:g}",
        partial(regularized, ratio),
        against="adaptive quadrature of the kernel",
        tolerance=1e-11,
    )


def fall(
    rods: list[Array], epsilon: float | str = "slender", material: Material = STIFF, step: float = 1e-4
) -> Array:
    """Return the velocities (N, 3) with which rods begin to fall [m/s], in the third step."""
    scene = Scene(
        rods=[Rod(nodes=nodes, radius=2e-4, material=material) for nodes in rods],
        fluid=Fluid(viscosity=1.0, epsilon=epsilon, twist_drag=False, density=0.0),
        gravity=WEIGHT,
    )
    simulation = Simulation(scene, dt=step, threads=1)
    simulation.step(3)
    return simulation.velocities


def falling(ratio: float) -> float:
    """Return the error of the velocity of a falling rod against quadrature and a dense solve."""
    nodes = 5e-3 * np.arange(4)[:, None] * [1.0, 0.0, 0.0]
    edges = np.array([[0, 1], [1, 2], [2, 3]])
    epsilon = ratio * 5e-3
    # Large blobs resist bending so much that even a stiff rod takes a while to bend.
    found = fall([nodes], epsilon, step=1.0).mean(axis=0)[2]
    density = np.linalg.solve(mobility(nodes, edges, np.full(3, epsilon)), np.tile([0.0, 0, 1], 4))
    weights = 5e-3 * np.array([0.5, 1.0, 1.0, 0.5])
    resistance = 8.0 * np.pi * float((weights * density.reshape(4, 3)[:, 2]).sum())
    weight = 2000.0 * 9.81 * np.pi * 2e-4**2 * 15e-3
    return float(-found * resistance / weight - 1.0)


for ratio in (1e-6, 1e-3, 1e-1, 1.0, 10.0):
    # The rod bends by its weight against a stiff section, which moves the middle by less than that.
    add(
        GROUP,
        f"a rod falls with regularization over edge length {ratio:g}",
        partial(falling, ratio),
        against="quadrature of the kernel and a dense solve",
        tolerance=1e-4,
    )


def line(start: tuple[float, float, float], along: tuple[float, float, float]) -> Array:
    """Return the nodes (4, 3) of a straight rod of three edges, 15 mm long."""
    direction = np.array(along) / np.linalg.norm(along)
    return np.asarray(1e-3 * np.array(start) + 5e-3 * np.arange(4)[:, None] * direction)


FIRST = line((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


def touching(second: Array, shift: tuple[float, float, float]) -> float:
    """Return by how much two rods that touch fall differently from two a millionth of a millimetre off."""
    found = fall([FIRST, second])
    near = fall([FIRST, second + 1e-9 * np.array(shift)])
    return float(np.abs(found - near).max() / np.abs(near).max())


TOUCHING: dict[str, tuple[Array, tuple[float, float, float]]] = {
    "crossing rods, middles in one point": (line((7.5, -7.5, 0.0), (0, 1, 0)), (0, 0, 1)),
    "crossing rods, a node on an edge": (line((7.5, 0.0, 0.0), (0, 1, 0)), (0, -1, 0)),
    "collinear rods, end on end": (line((15.0, 0.0, 0.0), (1, 0, 0)), (1, 0, 0)),
    "collinear rods that overlap by half": (line((7.5, 0.0, 0.0), (1, 0, 0)), (0, 1, 0)),
    "rods that share an end at a sharp angle": (line((0.0, 0.0, 0.0), (1, 0.01, 0)), (0, 1, 0)),
}
for words, (second, shift) in TOUCHING.items():
    add(
        GROUP,
        words,
        partial(touching, second, shift),
        against="the same rods 1 nm apart: the velocity is continuous",
        tolerance=1e-4,
        may_refuse=True,
    )


def coincident(away: float) -> float:
    """Return the error of the velocity of two rods on each other against one of twice the weight."""
    both = fall([FIRST, FIRST + np.array([0.0, away, 0.0])])
    alone = fall([FIRST])
    return float(np.abs(both[:4] - 2.0 * alone).max() / np.abs(alone).max())


add(
    GROUP,
    "two rods in the same place",
    partial(coincident, 0.0),
    against="one rod of twice the weight",
    tolerance=1e-6,
    may_refuse=True,
)
for away in (1e-12, 1e-9, 1e-7):
    add(
        GROUP,
        f"two rods {away:g} m apart",
        partial(coincident, away),
        against="one rod of twice the weight",
        tolerance=1e-3,
    )


def folded(degrees: float) -> float:
    """Return by how much a folded rod falls differently from its two legs joined by nothing."""
    angle = np.radians(180.0 - degrees)
    leg = np.arange(1, 4)[:, None] * 5e-3
    back = leg[-1] * [1.0, 0.0, 0.0] - leg * np.array([np.cos(angle), np.sin(angle), 0.0])
    nodes = np.concatenate([np.zeros((1, 3)), leg * [1.0, 0.0, 0.0], back])
    found = fall([nodes], material=SOFT)
    mirrored = fall([nodes[::-1]], material=SOFT)[::-1]
    return float(np.abs(found - mirrored).max() / np.abs(found).max())


for degrees in (170.0, 178.0, 179.9):
    add(
        GROUP,
        f"a rod folded by {degrees:g} degrees falls",
        partial(folded, degrees),
        against="the same rod numbered from its other end",
        tolerance=1e-5,
        may_refuse=degrees > 179.5,
    )
