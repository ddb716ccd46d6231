"""The robot as a rigid swimmer near a no-slip wall, with and without images between head and flagella.

Run with ``python docs/validation/robot_near_wall.py`` (seconds); it prints the tables of walls.md. The
flagella are those of `flagrs.scenarios.robot` in their natural shape and turn at 20 rpm, without twist drag;
the head is a point with the drag of C_t and the couple of C_r. Velocities and the turning of the head follow
from total force and torque of zero, and are averaged over six phases of the flagella.
"""

from __future__ import annotations

import flagrs
import numpy as np
from flagrs import Wall
from flagrs.flow import immersed_edges
from flagrs.validation import wall_reference

#: Viscosity [Pa s], radius of the head, offset of the flagella's axes [m], and their speed [rad/s].
VISCOSITY, HEAD_RADIUS, OFFSET, SPEED = 1.0, 31e-3, 14e-3, flagrs.rpm(20.0)
SCALE = 8.0 * np.pi * VISCOSITY


def turned(nodes: np.ndarray, axes: np.ndarray, phase: float) -> np.ndarray:
    """Return nodes (N, 3) after a turn about axes along x through points (N, 3)."""
    arms, (c, s) = nodes - axes, (np.cos(phase), np.sin(phase))
    return axes + arms @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def cross_matrix(arm: np.ndarray) -> np.ndarray:
    """Return the matrix (3, 3) of the cross product with a vector from the left."""
    return np.cross(arm, np.eye(3)).T


def swim(C_t: float, C_r: float, distance: float | None, coupled: bool, phase: float) -> np.ndarray:
    """Return velocity and angular velocity (6) of the head [m/s, rad/s]."""
    scene = flagrs.scenarios.robot(contact=False)
    assert scene.head is not None
    edges, widths = immersed_edges(scene)
    wet = np.unique(edges)
    edges = np.searchsorted(wet, edges)
    axes = np.zeros((len(wet), 3))
    axes[:, 1] = np.where(wet < scene.head.node, -OFFSET, OFFSET)
    nodes, head = turned(scene.node_array()[wet], axes, phase), scene.node_array()[scene.head.node]
    lift = np.array([0.0, 0.0, distance or 0.0])
    at, wall = nodes + lift, Wall() if distance else None
    count = 3 * len(nodes)
    # Unknowns: force density on the nodes, force of the head on the fluid, velocity and angular velocity.
    matrix, right = np.zeros((count + 9, count + 9)), np.zeros(count + 9)
    matrix[:count, :count] = flagrs.fluid.mobility(at, edges, widths, wall=wall)
    force, motion = slice(count, count + 3), slice(count + 3, None)
    matrix[force, force] = SCALE * np.eye(3) / (C_t * 6.0 * np.pi * VISCOSITY * HEAD_RADIUS)
    if distance:
        there = (head + lift)[None]
        matrix[force, force] += wall_reference.image(there, there, 0.0)[0]
        if coupled:
            images = wall_reference.image(at, np.broadcast_to(there, at.shape), 0.0)
            matrix[:count, force] = images.reshape(count, 3)
            free = flagrs.fluid.mobility(at, edges, widths, targets=there)
            matrix[force, :count] = flagrs.fluid.mobility(at, edges, widths, targets=there, wall=wall) - free
    rigid = np.concatenate([np.concatenate([np.eye(3), -cross_matrix(arm)], axis=1) for arm in nodes - head])
    matrix[:count, motion] = -SCALE * rigid
    matrix[force, motion] = -SCALE * np.eye(3, 6)
    right[:count] = SCALE * np.cross([SPEED, 0.0, 0.0], nodes - axes).ravel()
    lengths, weights = (
        np.linalg.norm(np.diff(nodes[edges], axis=1)[:, 0], axis=1),
        np.zeros((len(nodes),) * 2),
    )
    for (i, j), length in zip(edges, lengths, strict=True):
        weights[np.ix_([i, j], [i, j])] += length / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    matrix[motion, :count] = rigid.T @ np.kron(weights, np.eye(3))
    matrix[motion, force] = np.eye(6, 3)
    matrix[count + 6 :, count + 6 :] += C_r * SCALE * HEAD_RADIUS**3 * np.eye(3)
    return np.linalg.solve(matrix, right)[motion]


def mean(C_t: float, C_r: float, distance: float | None, coupled: bool) -> np.ndarray:
    """Return the mean of `swim` over six phases."""
    phases = 2.0 * np.pi / 6.0 * np.arange(6)
    return np.mean([swim(C_t, C_r, distance, coupled, phase) for phase in phases], axis=0)


def main() -> None:
    """Print the tables."""
    for C_t, C_r in ((4.1, 0.9), (1.2, 1.5)):
        free = mean(C_t, C_r, None, False)
        print(f"\nC_t = {C_t}, C_r = {C_r}: {-1e3 * free[0]:.4f} mm/s without a wall.\n")
        print(
            "| distance, m | speed | drift towards the wall | sideways | turning to the side, 1/h |", end=""
        )
        print(" speed, had the images no say between head and flagella |")
        print("|---|---|---|---|---|---|")
        for distance in (0.09, 0.12, 0.2, 0.3, 0.4, 0.6, 1.0):
            if distance < 1.5 * C_t * HEAD_RADIUS:
                continue  # no point force stands for the head there
            near, alone = (mean(C_t, C_r, distance, coupled) for coupled in (True, False))
            change = 100.0 * (near - free) / -free[0]
            turning, coupled_off = 3600.0 * np.degrees(near[5] - free[5]), 100.0 * (alone[0] / free[0] - 1.0)
            print(
                f"| {distance:g} | {-change[0]:+.2f} % | {-change[2]:+.2f} % | {change[1]:+.2f} % |", end=""
            )
            print(f" {turning:+.2f} deg | {coupled_off:+.1f} % |")


if __name__ == "__main__":
    main()
