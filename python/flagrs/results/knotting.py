"""How curves wind: writhe of one, linking of two, by Gauss's integral over pairs of edges."""

from __future__ import annotations

from typing import Any

import numpy as np

from flagrs.errors import SceneError
from flagrs.scene.values import FloatArray

#: Pairs of edges at a time, to bound memory.
_BLOCK = 1 << 20


def writhe(curve: Any) -> float:
    """Return the writhe of a polygon [1]: its signed crossings, averaged over all directions of view.

    Parameters
    ----------
    curve
        Points (n, 3) in order; a closed curve ends in its first point. An open one is not closed: its writhe
        is Gauss's integral over the curve as it is, which is no topological number.

    Raises
    ------
    SceneError
        If the array has another shape, or a point that is not finite.

    Notes
    -----
    The integral over two straight edges is the area of a spherical quadrilateral (K. Klenin and J. Langowski,
    Biopolymers 54, 307, 2000, method 1a); neighbours contribute nothing.

    Examples
    --------
    >>> writhe([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0]])
    0.0
    """
    points = _points("curve", curve)
    return 2.0 * _gauss(points, None)


def linking(first: Any, second: Any) -> float:
    """Return Gauss's linking integral of two polygons [1]: how often one winds about the other.

    For two closed curves it is their linking number, an integer; for open ones the part of it that their own
    length makes, nearly the turns of a double helix that is long compared with its radius.

    Parameters
    ----------
    first, second
        Points (n, 3) and (m, 3) in order; closed curves end in their first point.

    Raises
    ------
    SceneError
        If an array has another shape, or a point that is not finite.
    """
    return _gauss(_points("first", first), _points("second", second))


def _gauss(a: FloatArray, b: FloatArray | None) -> float:
    """Return Gauss's integral over 4 pi of all edges of two curves, or over each pair of one curve's once."""
    edges = len(a) - 1
    rows = max(1, _BLOCK // max(1, (edges if b is None else len(b) - 1)))
    total = 0.0
    for start in range(0, edges, rows):
        i = np.arange(start, min(start + rows, edges))
        if b is None:
            first, second = np.nonzero(np.arange(edges)[None, :] > i[:, None] + 1)
            first = i[first]
            other = a
        else:
            first, second = np.repeat(i, len(b) - 1), np.tile(np.arange(len(b) - 1), len(i))
            other = b
        total += float(_areas(a[first], a[first + 1], other[second], other[second + 1]).sum())
    return total / (4.0 * np.pi)


def _areas(p1: FloatArray, p2: FloatArray, p3: FloatArray, p4: FloatArray) -> FloatArray:
    """Return the signed area (K,) of directions in which the edges p1 p2 and p3 p4 are seen to cross."""
    r13, r14, r23, r24 = p3 - p1, p4 - p1, p3 - p2, p4 - p2
    normals = [np.cross(r13, r14), np.cross(r14, r24), np.cross(r24, r23), np.cross(r23, r13)]
    sizes = [np.linalg.norm(normal, axis=1) for normal in normals]
    flat = np.min(sizes, axis=0) <= 1e-14 * np.maximum(np.max(sizes, axis=0), 1e-300)
    unit = [normal / np.maximum(size, 1e-300)[:, None] for normal, size in zip(normals, sizes, strict=True)]
    area = np.zeros(len(p1))
    for k in range(4):
        area += np.arcsin(np.clip(np.einsum("ij,ij->i", unit[k], unit[(k + 1) % 4]), -1.0, 1.0))
    side = np.einsum("ij,ij->i", np.cross(p4 - p3, p2 - p1), r13)
    # Edges in one plane cross in no direction; where they touch, the integral is not defined.
    signed: FloatArray = np.where(flat, 0.0, area * np.sign(side))
    return signed


def _points(field: str, curve: Any) -> FloatArray:
    points = np.asarray(curve, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 2 or not np.isfinite(points).all():
        raise SceneError(
            f"{field}: shape {points.shape} is not allowed; must be finite numbers of shape (n, 3), n >= 2",
            field=field,
            value=points.shape,
            allowed="finite numbers of shape (n, 3), n >= 2",
        )
    return points
