"""Rigid filaments as polygons of regularized Stokeslet segments, in a fluid of 1 Pa s."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from flagrs import fluid

Array = npt.NDArray[np.float64]

#: Regularization over radius that matches slender-body theory.
SLENDER = math.exp(0.5)
#: The coordinate axis along which filaments lie.
X = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class Filament:
    """Nodes (N, 3) [m], edges (E, 2) and regularization of every edge (E,) [m]."""

    nodes: Array
    edges: npt.NDArray[np.int64]
    epsilon: Array

    def density(self, velocity: Array) -> Array:
        """Force per length on the fluid (N, 3) [N/m] at nodal velocities (N, 3) [m/s]."""
        matrix = fluid.mobility(self.nodes, self.edges, self.epsilon, threads=1)
        density = np.linalg.solve(matrix, 8.0 * math.pi * velocity.ravel())
        return np.asarray(density, dtype=np.float64).reshape(-1, 3)

    def forces(self, velocity: Array) -> Array:
        """Nodal forces on the fluid (N, 3) [N]."""
        return fluid.hat_weights(self.nodes, self.edges, self.density(velocity))

    def drag(self, axis: int) -> float:
        """Drag along a coordinate axis at 1 m/s [N]."""
        return float(self.forces(np.tile(np.eye(3)[axis], (len(self.nodes), 1))).sum(axis=0)[axis])


def chain(nodes: Array, epsilon: float | Array) -> Filament:
    """Return an open filament."""
    count = len(nodes) - 1
    edges = np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)
    return Filament(nodes, edges, np.broadcast_to(np.asarray(epsilon, dtype=float), count).copy())


def straight(length: float, count: int, epsilon: float) -> Filament:
    """Return a straight filament of equal edges along x."""
    return chain(np.linspace(0.0, length, count + 1)[:, None] * X, epsilon)


def graded_rod(length: float, epsilon: float, growth: float = 1.15) -> Filament:
    """Return a straight filament whose edges are as long as epsilon at the ends and grow inwards."""
    half = [0.0]
    edge = epsilon
    while half[-1] < length / 2.0:
        half.append(half[-1] + edge)
        edge *= growth
    along = np.array(half) * (length / 2.0 / half[-1])
    return chain(np.concatenate([along, length - along[-2::-1]])[:, None] * X, epsilon)


def torus(ratio: float, count: int) -> Filament:
    """Return a ring of unit radius about z: the polygon whose perimeter is the circle's."""
    angle = 2.0 * math.pi * np.arange(count) / count
    radius = math.pi / count / math.sin(math.pi / count)
    nodes = radius * np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    edges = np.stack([np.arange(count), (np.arange(count) + 1) % count], axis=1)
    return Filament(nodes, edges, np.full(count, SLENDER * ratio))


def torus_drag(ratio: float, count: int) -> float:
    """Axial drag of a torus over that of a sphere around it, F / (6 pi mu U (R + a))."""
    return torus(ratio, count).drag(2) / (6.0 * math.pi * (1.0 + ratio))


def spheroid(aspect: float, count: int) -> Filament:
    """Return a prolate spheroid of unit equatorial radius: segments between its foci, as thick as it."""
    focus = math.sqrt(aspect**2 - 1.0)
    along = -focus * np.cos(np.linspace(0.0, math.pi, count + 1))
    middle = (along[1:] + along[:-1]) / 2.0
    return chain(along[:, None] * X, SLENDER * np.sqrt(1.0 - (middle / focus) ** 2))
