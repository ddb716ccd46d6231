"""Makes tables of walls.md: rods and helices near walls, a rod that slides on one.

Run with ``python docs/validation/make_wall_tables.py`` (about a minute); it prints them. ``--quick``
leaves out the one that simulates.
"""

from __future__ import annotations

import sys

import flagrs
import numpy as np
from flagrs import Contact, Fluid, Material, Rod, Scene, Simulation, Wall
from flagrs.validation import wall_reference

SOFT = Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1260.0)


def chain(nodes: np.ndarray) -> np.ndarray:
    """Return the edges of a chain."""
    return np.stack([np.arange(len(nodes) - 1), np.arange(1, len(nodes))], axis=1)


def cylinder() -> None:
    """Force per length in the middle of a long rod, against infinite cylinders."""
    print("\n| h / a | along the axis | across, along the wall | towards the wall |\n|---|---|---|---|")
    for ratio in (3, 5, 10, 20, 40):
        height = 1.0
        radius = height / ratio
        nodes = np.linspace([-60.0, 0.0, height], [60.0, 0.0, height], 601)
        matrix = flagrs.fluid.mobility(nodes, chain(nodes), np.sqrt(np.e) * radius, wall=Wall())
        alpha = np.arccosh(height / radius)
        row = [str(ratio)]
        for axis, exact in enumerate(
            (2 * np.pi / alpha, 4 * np.pi / alpha, 4 * np.pi / (alpha - np.tanh(alpha)))
        ):
            velocity = np.zeros(nodes.shape)
            velocity[:, axis] = 8 * np.pi
            found = np.linalg.solve(matrix, velocity.ravel()).reshape(-1, 3)[300, axis]
            row.append(f"{exact:.4f}, {100 * (found / exact - 1):+.2f} %")
        print("| " + " | ".join(row) + " |")


def helix(height: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the flagellum of the robot, with its axis along x at a height."""
    turn = np.linspace(0.0, 95.4 / 44.52 * 2 * np.pi, count)
    nodes = np.stack(
        [44.52e-3 * turn / (2 * np.pi), 6.36e-3 * np.cos(turn), height + 6.36e-3 * np.sin(turn)], 1
    )
    return nodes, chain(nodes)


def helices() -> None:
    """Resistances of a helix above a wall: against quadrature, and over those in unbounded fluid."""
    print("\n| axis above the wall, mm | edges | matrix against quadrature | asymmetry |", end="")
    print(" drag along the axis | across | towards the wall | torque | torque by 1 m/s along, N m |")
    print("|---|---|---|---|---|---|---|---|---|")
    epsilon = np.sqrt(np.e) * 1.6e-3
    for height in (9e-3, 15e-3, 30e-3, 60e-3, 120e-3):
        for count in (26, 51):
            nodes, edges = helix(height, count)
            near = flagrs.fluid.mobility(nodes, edges, epsilon, wall=Wall())
            error = np.abs(near - wall_reference.mobility(nodes, edges, epsilon)).max() / np.abs(near).max()
            centre = nodes.mean(axis=0)
            walled = wall_reference.resistance(nodes, edges, near, centre)
            free = flagrs.fluid.mobility(nodes, edges, epsilon)
            free = wall_reference.resistance(nodes, edges, free, centre)
            scale = np.sqrt(np.outer(np.diag(walled), np.diag(walled)))
            apart = np.abs((walled - walled.T) / scale).max()
            factors = [walled[k, k] / free[k, k] for k in (0, 1, 2, 3)]
            print(
                f"| {1e3 * height:g} | {count - 1} | {error:.0e} | {apart:.1e} | "
                + " | ".join(f"{factor:.3f}" for factor in factors)
                + f" | {8 * np.pi * walled[3, 0]:.4g} |"
            )


def short_rod() -> None:
    """A short rod far from walls, against the image of a point force."""
    print("\n| h / length | along the wall: slowed by | 9/16 of R / 6 pi mu h | towards it | 9/8 |")
    print("|---|---|---|---|---|")
    for ratio in (2, 5, 10, 50):
        nodes = np.linspace([0.0, -0.5, ratio], [0.0, 0.5, ratio], 21)
        walls = (None, Wall())
        matrices = [flagrs.fluid.mobility(nodes, chain(nodes), 0.05, wall=wall) for wall in walls]
        row = [str(ratio)]
        for axis, factor in ((0, 9 / 16), (2, 9 / 8)):
            drag = [
                8 * np.pi * wall_reference.resistance(nodes, chain(nodes), matrix, nodes[10])[axis, axis]
                for matrix in matrices
            ]
            row += [f"{1 - drag[0] / drag[1]:.5f}", f"{factor * drag[0] / (6 * np.pi * ratio):.5f}"]
        print("| " + " | ".join(row) + " |")


def slope() -> None:
    """A rod on an inclined wall with friction: where it begins to slide, and how fast."""
    print("\n| slope over friction | speed along the wall, mm/s | least height over radius |")
    print("|---|---|---|")
    for share in (0.5, 0.9, 1.1, 1.5):
        angle = np.arctan(0.4 * share)
        rod = Rod(nodes=np.linspace([0, 0, 1e-3], [20e-3, 0, 1e-3], 5), radius=1e-3, material=SOFT)
        scene = Scene(
            rods=rod,
            fluid=Fluid(viscosity=0.1, density=0.0),
            gravity=9.81 * np.array([np.sin(angle), 0, -np.cos(angle)]),
            walls=Wall(),
            contact=Contact(friction=0.4),
        )
        simulation = Simulation(scene, rtol=1e-3)
        trajectory = simulation.run(until=2.0, save_every=0.1)
        moved = trajectory.nodes[-1, :, 0].mean() - trajectory.nodes[10, :, 0].mean()
        least = trajectory.nodes[:, :, 2].min() / 1e-3
        print(f"| {share:g} | {1e3 * moved / 1.0:.5f} | {least:.4f} |")


if __name__ == "__main__":
    cylinder()
    short_rod()
    helices()
    if "--quick" not in sys.argv:
        slope()
