"""Resistances of rigid tubes by the method of fundamental solutions, without any slenderness assumed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from flagrs.validation.filaments import Array, X
from flagrs.validation.rigid_helix import Helix, Propulsion


@dataclass(frozen=True)
class Tube:
    """A tube of given radius about a centreline, closed by hemispheres beyond its ends."""

    centre: Callable[[Array], Array]
    tangent: Callable[[Array], Array]
    length: float
    radius: float

    def points(self, radius: float, step: float, around: int) -> Array:
        """Points on the surface a distance `radius` from the centreline, in rings `step` apart, staggered."""
        arcs = np.linspace(0.0, self.length, math.ceil(self.length / step) + 1)
        out = [self._ring(arc, 1.0, radius, 0.0, around, k) for k, arc in enumerate(arcs)]
        caps = max(2, round(around / 4))
        for arc, outward in ((0.0, -1.0), (self.length, 1.0)):
            for k in range(1, caps + 1):
                latitude = math.pi / 2.0 * k / caps
                count = max(1, round(around * math.cos(latitude))) if k < caps else 1
                out.append(self._ring(arc, outward, radius, latitude, count, k))
        return np.concatenate(out)

    def _ring(
        self, arc: float, outward: float, radius: float, latitude: float, count: int, stagger: int
    ) -> Array:
        centre, tangent = self.centre(np.array(arc)), outward * self.tangent(np.array(arc))
        first = np.cross(tangent, np.eye(3)[np.argmin(np.abs(tangent))])
        first /= np.linalg.norm(first)
        second = np.cross(tangent, first)
        angle = 2.0 * math.pi * (np.arange(count) + 0.5 * (stagger % 2)) / count
        ring = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
        surface: Array = centre + radius * (math.sin(latitude) * tangent + math.cos(latitude) * ring)
        return surface


def surface_solution(tube: Tube, step: float = 1.0, around: int = 6, depth: float = 0.5) -> Propulsion:
    """Resistances of a rigid tube along x by the method of fundamental solutions.

    Point forces on the tube of `depth` times the radius, in rings `step` radii apart with `around` points
    each, are fitted to the velocity at about twice as many points of the surface. No slenderness is assumed:
    what is left is the error of the fit, which a finer one tells.
    """
    a = tube.radius
    sources = tube.points(depth * a, step * a, around)
    surface = tube.points(a, step * a / 1.4, round(1.4 * around))
    offset = surface[:, None] - sources[None]
    inverse = 1.0 / np.linalg.norm(offset, axis=2)
    flow = (offset * inverse[:, :, None] ** 1.5)[:, :, :, None] * (offset * inverse[:, :, None] ** 1.5)[
        :, :, None, :
    ]
    for k in range(3):
        flow[:, :, k, k] += inverse
    matrix = flow.transpose(0, 2, 1, 3).reshape(3 * len(surface), 3 * len(sources))
    motions = np.stack([np.tile(X, (len(surface), 1)).ravel(), np.cross(X, surface).ravel()], axis=1)
    q, r = scipy.linalg.qr(matrix, mode="economic", overwrite_a=True, check_finite=False)
    fitted = scipy.linalg.solve_triangular(r, q.T @ (8.0 * math.pi * motions))
    moved, turned = fitted[:, 0].reshape(-1, 3), fitted[:, 1].reshape(-1, 3)
    return Propulsion(
        drag=float(moved[:, 0].sum()),
        thrust=float(turned[:, 0].sum()),
        coupled_torque=float(np.cross(sources, moved)[:, 0].sum()),
        torque=float(np.cross(sources, turned)[:, 0].sum()),
    )


def helix_tube(helix: Helix) -> Tube:
    """Return the tube about a helix."""
    return Tube(helix.centre, helix.tangent, helix.contour, helix.thickness)


def straight_tube(length: float, axis: int) -> Tube:
    """Return a capsule of unit radius whose centreline lies along or, for axis 1, across x."""
    direction = np.eye(3)[axis]
    return Tube(lambda arc: np.asarray(arc)[..., None] * direction, lambda arc: direction, length, 1.0)
