"""What the NumPy and Numba versions of a chain's elasticity start from: constants and reference frames."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import flagrs
import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Chain:
    """A chain of N nodes in a state, E = N - 1 edges, H = N - 2 hinges, 4N - 1 degrees of freedom.

    Attributes
    ----------
    q : ndarray
        Degrees of freedom ``x0 y0 z0 theta0 x1 ...`` [m, rad].
    tangents, directors : ndarray
        Tangents and first directors (E, 3) of the reference frames.
    twists : ndarray
        Reference twist (H,) [rad].
    lengths, voronoi : ndarray
        Rest lengths (E,) and Voronoi lengths (H,) [m].
    curvatures, natural_twists : ndarray
        Natural curvature (H, 2) and natural twist (H,).
    stretching, bending, twisting : ndarray
        EA (E,) [N], EI (H,) and GJ (H,) [N m^2].
    """

    q: FloatArray
    tangents: FloatArray
    directors: FloatArray
    twists: FloatArray
    lengths: FloatArray
    voronoi: FloatArray
    curvatures: FloatArray
    natural_twists: FloatArray
    stretching: FloatArray
    bending: FloatArray
    twisting: FloatArray


def chain_of(scene: flagrs.Scene) -> Chain:
    """Return the chain of a scene with a single rod, at its initial shape, with frames of its own."""
    rod = scene.rods[0]
    director, theta = rod.director, rod.theta
    if director is None or theta is None:
        raise ValueError("the rod must have a director and edge angles")
    rest = rod.rest_array()
    lengths = np.linalg.norm(np.diff(rest, axis=0), axis=1)
    count = len(rest)
    q = np.zeros(4 * count)
    q.reshape(count, 4)[:, :3] = rod.nodes
    q.reshape(count, 4)[:-1, 3] = theta
    rest_tangents, rest_directors = _space_parallel(rest, director)
    tangents, directors = _space_parallel(rod.nodes, director)
    return Chain(
        q=q[:-1],
        tangents=tangents,
        directors=directors,
        twists=np.zeros(count - 2),
        lengths=lengths,
        voronoi=0.5 * (lengths[:-1] + lengths[1:]),
        curvatures=_curvatures(rest_tangents, rest_directors),
        natural_twists=np.zeros(count - 2),
        stretching=rod.EA_array(),
        bending=rod.EI_array()[:, 0, 0],
        twisting=rod.GJ_array(),
    )


def _space_parallel(nodes: FloatArray, first: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return tangents and directors (E, 3), transported along the chain from the first edge."""
    edges = np.diff(nodes, axis=0)
    tangents = edges / np.linalg.norm(edges, axis=1)[:, None]
    director = first - (first @ tangents[0]) * tangents[0]
    directors = [director / np.linalg.norm(director)]
    for old, new in pairwise(tangents):
        axis, cosine, d = np.cross(old, new), old @ new, directors[-1]
        directors.append(d * cosine + np.cross(axis, d) + axis * (axis @ d) / (1.0 + cosine))
    return tangents, np.array(directors)


def _curvatures(tangents: FloatArray, m1: FloatArray) -> FloatArray:
    """Return integrated curvatures (H, 2) of a shape with these tangents and material directors (E, 3)."""
    m2 = np.cross(tangents, m1)
    cosine = np.einsum("hi,hi->h", tangents[:-1], tangents[1:])
    kb = 2.0 * np.cross(tangents[:-1], tangents[1:]) / (1.0 + cosine)[:, None]
    kappa_1 = 0.5 * np.einsum("hi,hi->h", kb, m2[:-1] + m2[1:])
    kappa_2 = -0.5 * np.einsum("hi,hi->h", kb, m1[:-1] + m1[1:])
    return np.stack([kappa_1, kappa_2], axis=1)


def dense(band: FloatArray) -> FloatArray:
    """Return the square matrix (n, n) of a band (21, n) with entry (i, j) at ``[10 + i - j, j]``."""
    size = band.shape[1]
    full = np.zeros((size, size))
    for offset in range(-10, 11):
        columns = np.arange(max(0, -offset), min(size, size - offset))
        full[columns + offset, columns] = band[10 + offset, columns]
    return full
