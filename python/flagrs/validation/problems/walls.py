"""Rods and helices near a no-slip wall."""

from __future__ import annotations

import math

import numpy as np

from flagrs import fluid
from flagrs.scene import Wall
from flagrs.scene.values import FloatArray, IntArray
from flagrs.validation import wall_reference
from flagrs.validation.filaments import SLENDER
from flagrs.validation.problem import Check, Evidence, problem

_REASON = "slender-body theory, of the order of (a/h)^2, and (h/L)^2 of the ends"


def _chain(nodes: FloatArray) -> IntArray:
    return np.stack([np.arange(len(nodes) - 1), np.arange(1, len(nodes))], axis=1)


@problem(
    source="D. J. Jeffrey and Y. Onishi, Q. J. Mech. Appl. Math. 34 (1981) 129; a cylinder's capacitance",
    quick={"ratios": (20.0,), "edge_count": 240},
    full={"ratios": (10.0, 20.0, 40.0), "edge_count": 600},
)
def cylinder_near_a_wall(ratios: tuple[float, ...], edge_count: int) -> Evidence:
    """Force per length on the middle of a long rod that moves near a wall, in three directions."""
    checks = []
    for ratio in ratios:
        radius = 1.0 / ratio
        nodes = np.linspace([-0.1 * edge_count, 0.0, 1.0], [0.1 * edge_count, 0.0, 1.0], edge_count + 1)
        matrix = fluid.mobility(nodes, _chain(nodes), SLENDER * radius, wall=Wall())
        alpha = math.acosh(ratio)
        exact = 2.0 / alpha, 4.0 / alpha, 4.0 / (alpha - math.tanh(alpha))
        names = "along its axis", "across it, along the wall", "towards the wall"
        for axis, (name, expected) in enumerate(zip(names, exact, strict=True)):
            motion = np.zeros(nodes.shape)
            motion[:, axis] = 8.0
            density = np.linalg.solve(matrix, motion.ravel()).reshape(-1, 3)
            found = float(density[edge_count // 2, axis])
            tolerance = 0.35 / ratio**2 + (1.0 / (0.1 * edge_count)) ** 2
            quantity = f"force per length over $\\pi\\mu U$, h/a = {ratio:g}, {name}"
            checks.append(
                Check(
                    quantity, found, expected, tolerance, _REASON, resolution=f"{edge_count} edges of h / 5"
                )
            )
    return Evidence(tuple(checks))


@problem(
    source="images of Ainley et al. (2008), corrected by Smith (2009), and Gauss quadrature in NumPy",
    quick={"heights": (9e-3, 30e-3), "edge_count": 25},
    full={"heights": (9e-3, 15e-3, 30e-3, 60e-3, 120e-3), "edge_count": 50},
)
def helix_near_a_wall(heights: tuple[float, ...], edge_count: int) -> Evidence:
    """Resistances of a helix, the flagellum of the robot, with its axis along a wall."""
    checks = []
    turn = np.linspace(0.0, 2.0 * np.pi * 95.4 / 44.52, edge_count + 1)
    epsilon = SLENDER * 1.6e-3
    for height in heights:
        nodes = 1e-3 * np.stack(
            [44.52 / (2.0 * np.pi) * turn, 6.36 * np.cos(turn), 6.36 * np.sin(turn)], axis=1
        )
        nodes = nodes + np.array([0.0, 0.0, height])
        edges, centre = _chain(nodes), nodes.mean(axis=0)
        ours = fluid.mobility(nodes, edges, epsilon, wall=Wall())
        theirs = wall_reference.mobility(nodes, edges, epsilon)
        found, expected = (
            wall_reference.resistance(nodes, edges, matrix, centre) for matrix in (ours, theirs)
        )
        scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        checks += [
            Check(
                f"largest error of a scaled resistance, axis at {1e3 * height:g} mm",
                float(np.abs((found - expected) / scale).max()),
                0.0,
                1e-9,
                "quadrature on both sides, 1e-12, times the condition number of the matrix",
                absolute=True,
                resolution=f"{edge_count} edges",
            ),
            Check(
                f"drag towards the wall over $\\mu$, axis at {1e3 * height:g} mm, m",
                float(8.0 * np.pi * found[2, 2]),
                float(8.0 * np.pi * expected[2, 2]),
                1e-9,
                "the same",
                resolution=f"{edge_count} edges",
            ),
        ]
    return Evidence(tuple(checks))
