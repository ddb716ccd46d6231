"""What problems with contact share: held rods, forces of contact and drag, weights."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from flagrs import Clamp, Material, Rod, Simulation
from flagrs.contact import segment_distance

Array = npt.NDArray[np.float64]

SILICONE = Material(youngs_modulus=1e6, density=1200.0)
GRAVITY = 9.81


def held(rod: int, edge_count: int, **motion: Any) -> Clamp:
    """Return the clamp of all of a rod."""
    return Clamp(rod=rod, nodes=tuple(range(edge_count + 1)), edges=tuple(range(edge_count)), **motion)


def contact_forces(simulation: Simulation) -> tuple[npt.NDArray[np.int64], Array, Array]:
    """Return pairs of edges (P, 2), the force (P, 3) on the first of each [N] and its size (P,)."""
    state = simulation.state()
    pairs, sizes = state["contact_pairs"].astype(np.int64), state["contact_forces"]
    x, edges = simulation.nodes, simulation.edges
    (a, b) = edges[pairs[:, 0]], edges[pairs[:, 1]]
    _, s, t = segment_distance(x[a[:, 0]], x[a[:, 1]], x[b[:, 0]], x[b[:, 1]])
    along = x[a[:, 0]] + s[:, None] * (x[a[:, 1]] - x[a[:, 0]])
    along -= x[b[:, 0]] + t[:, None] * (x[b[:, 1]] - x[b[:, 0]])
    return pairs, sizes[:, None] * along / np.linalg.norm(along, axis=1)[:, None], sizes


def drag(simulation: Simulation) -> Array:
    """Return the force (N, 3) of the nodes on the fluid [N]."""
    force: Array = (simulation.resistance() @ simulation.velocities.ravel()).reshape(-1, 3)
    return force


def firm(material: Material, radius: float, length: float) -> float:
    """Return a stiffness of contact [Pa] by which surfaces meet nearly at their radii.

    At centrelines a sum of radii apart it bears the force per length that bends a free rod on the wavelength
    of its slowest vibration: what theory for rods that touch at a given distance is compared with.
    """
    bending = material.youngs_modulus * np.pi * radius**4 / 4.0 / (length / 4.73) ** 3
    return float(bending / (0.1 * 2.0 * radius * (np.log(2.0) + 0.5)))


def unrolled(nodes: Array) -> Array:
    """Return the straight shape (N, 3) with the edges of a curved one [m]."""
    straight = np.zeros_like(nodes)
    straight[1:, 0] = np.cumsum(np.linalg.norm(np.diff(nodes, axis=0), axis=1))
    return straight


def weight(rod: Rod) -> float:
    """Return the weight of a rod of constant radius [N]."""
    return float(
        rod.material.density * np.pi * rod.radius_array()[0] ** 2 * rod.rest_lengths().sum() * GRAVITY
    )
