"""The fluid's numerics on plain arrays: regularized Stokeslet segments."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flagrs import _flagrs
from flagrs.body_surface import BodySurface
from flagrs.errors import SceneError
from flagrs.force_density import check_edges
from flagrs.memory import require_memory
from flagrs.scene.shapes import number
from flagrs.scene.values import Bounds, FloatArray, IntArray, index_pairs
from flagrs.scene.wall import Wall
from flagrs.threads import thread_count

__all__ = ["BodySurface", "FastMobility", "hat_weights", "mobility", "velocity"]


def mobility(
    nodes: Any,
    edges: Any,
    epsilon: Any,
    targets: Any = None,
    threads: int | None = None,
    wall: Wall | None = None,
) -> FloatArray:
    """Return the matrix A with ``8 pi mu u = A f`` for nodal force densities f.

    Parameters
    ----------
    nodes
        Positions (N, 3) of the nodes [m].
    edges
        Start and end node (E, 2) of each segment.
    epsilon
        Regularization, one or (E,) [m].
    targets
        Points (M, 3) at which the velocity is taken [m]; None: the nodes.
    threads
        Threads to use; None: ``FLAGRS_THREADS``, else all.
    wall
        A wall or free surface; nodes, and targets or points, are on the side of its normal. None: unbounded
        fluid.

    Returns
    -------
    ndarray
        A (3M, 3N), dimensionless; rows are target components, columns node components. By collocation it is
        not symmetric.

    Raises
    ------
    SceneError
        For arrays of the wrong shape, indices out of range, a regularization that is not positive, or points
        behind the wall.

    Notes
    -----
    Cortez (2018), doi:10.1016/j.jcp.2018.08.055; docs/theory/fluid.md, equations 12 to 14. Each 3x3 block
    is exact to 1e-12, with the images behind a wall as well (docs/theory/walls.md).

    Examples
    --------
    >>> import numpy as np
    >>> nodes = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    >>> mobility(nodes, [[0, 1], [1, 2]], epsilon=0.1).shape
    (9, 9)
    """
    points, pairs, widths = _segments(nodes, edges, epsilon)
    at = points if targets is None else _vectors("targets", targets)
    rows = len(points if at is None else at)
    require_memory(
        f"the mobility of {rows} targets and {len(points)} nodes",
        72.0 * rows * len(points),
        "FastMobility makes its products without it",
    )
    side = _side(wall, {"nodes": points, "targets": points if at is None else at})
    return _flagrs.mobility(points, pairs, widths, at, side, thread_count(threads))


def velocity(
    points: Any,
    nodes: Any,
    edges: Any,
    force_density: Any,
    viscosity: float,
    epsilon: Any,
    threads: int | None = None,
    wall: Wall | None = None,
) -> FloatArray:
    """Return the velocity of the fluid at points.

    Parameters
    ----------
    points
        Where (M, 3) [m].
    nodes, edges, epsilon
        Segments, as in `mobility`.
    force_density
        Force per length on the fluid at the nodes (N, 3) [N/m], linear along each segment.
    viscosity
        Dynamic viscosity [Pa s].
    threads
        Threads to use; None: ``FLAGRS_THREADS``, else all.
    wall
        A wall or free surface; nodes, and targets or points, are on the side of its normal. None: unbounded
        fluid.

    Returns
    -------
    ndarray
        Velocity (M, 3) [m/s].

    Raises
    ------
    SceneError
        As `mobility`, for a viscosity that is not positive, and for edges that are not among the immersed
        ones of a density which a simulation or trajectory gave.

    Examples
    --------
    >>> u = velocity([[0.0, 0.0, 1.0]], [[-1, 0, 0], [1, 0, 0]], [[0, 1]], [[1, 0, 0], [1, 0, 0]], 1.0, 0.1)
    >>> bool(u[0, 0] > 0.0)
    True
    """
    sources, pairs, widths = _segments(nodes, edges, epsilon)
    density = _vectors("force_density", force_density)
    if density.shape != sources.shape:
        raise _wrong("force_density", f"shape {density.shape}", f"of shape {sources.shape}")
    check_edges(force_density, pairs)
    mu = number("viscosity", viscosity, Bounds("Pa s", above=0.0))
    at = _vectors("points", points)
    scaled = density * (1.0 / (8.0 * math.pi * mu))
    side = _side(wall, {"nodes": sources, "points": at})
    flow = _flagrs.velocity(at, sources, pairs, scaled, widths, thread_count(threads))
    if side is None:
        return flow
    segments = (sources, pairs, widths)
    return flow + _flagrs.image_velocity(at, segments, scaled, side, thread_count(threads))


class FastMobility:
    """The mobility of segments as an operator: its products without its matrix, in time proportional to N.

    ``8 pi mu u = A f`` as in `mobility`, by a fast multipole method that errs by no more than it is told.

    Parameters
    ----------
    nodes, edges, epsilon
        Segments, as in `mobility`.
    targets
        Points (M, 3) at which the velocity is taken [m]; None: the nodes.
    error
        Largest error of a component of a product, relative to its largest component: 1e-9 to 0.1.
    threads
        Threads to use; None: ``FLAGRS_THREADS``, else all. Products are the same to the last bit whatever
        their number.

    Raises
    ------
    SceneError
        As `mobility`, and for an error out of range.

    Notes
    -----
    docs/theory/fluid.md, section 10; time and error are measured in docs/performance.md.

    Examples
    --------
    >>> import numpy as np
    >>> nodes = np.linspace([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 500)
    >>> edges = np.stack([np.arange(499), np.arange(1, 500)], axis=1)
    >>> flow = FastMobility(nodes, edges, epsilon=1e-3, error=1e-6).apply(np.ones((500, 3)))
    >>> exact = (mobility(nodes, edges, epsilon=1e-3) @ np.ones(1500)).reshape(-1, 3)
    >>> bool(np.abs(flow - exact).max() <= 1e-6 * np.abs(exact).max())
    True
    """

    def __init__(
        self,
        nodes: Any,
        edges: Any,
        epsilon: Any,
        targets: Any = None,
        error: float = 1e-6,
        threads: int | None = None,
    ) -> None:
        points, pairs, widths = _segments(nodes, edges, epsilon)
        at = None if targets is None else _vectors("targets", targets)
        largest = number("error", error, Bounds("1", at_least=1e-9, at_most=0.1))
        self._edges = pairs
        self._native = _flagrs.FastMobility(points, pairs, widths, at, largest, thread_count(threads))

    def apply(self, force_density: Any) -> FloatArray:
        """Return ``8 pi mu u`` (M, 3) [N/m] for the force density (N, 3) [N/m] at the nodes."""
        density = _vectors("force_density", force_density)
        check_edges(force_density, self._edges)
        return self._native.apply(density)

    def update(self, nodes: Any, targets: Any = None) -> None:
        """Move to other positions (N, 3) [m] of the nodes, and of the targets (M, 3) if there are any."""
        at = None if targets is None else _vectors("targets", targets)
        self._native.update(_vectors("nodes", nodes), at)

    @property
    def bytes(self) -> int:
        """Memory held by all that grows with the scene [bytes]."""
        return self._native.bytes


def hat_weights(nodes: Any, edges: Any, force_density: Any) -> FloatArray:
    """Return nodal forces (N, 3) [N] of a nodal force density (N, 3) [N/m].

    They are the integrals of each node's hat function times the density, which is linear along each edge.
    Total force and torque are exact: ``hat_weights(...).sum(axis=0)`` is the integral of the density.
    """
    points, pairs, _ = _segments(nodes, edges, 1.0)
    density = _vectors("force_density", force_density)
    if density.shape != points.shape:
        raise _wrong("force_density", f"shape {density.shape}", f"of shape {points.shape}")
    check_edges(force_density, pairs)
    return _flagrs.hat_weights(points, pairs, density)


def _side(wall: Wall | None, positions: dict[str, FloatArray]) -> dict[str, Any] | None:
    """Return a wall for the native module, after checking that everything is on its side."""
    if wall is None or not wall.in_flow:
        return None
    for field, points in positions.items():
        heights = wall.heights(points)
        # Points on the wall itself are fluid still, wherever round-off puts them.
        least = -1e-12 * float(np.abs(points - wall.point).max(initial=0.0))
        behind = np.flatnonzero(~(heights >= (least if field != "nodes" else 0.0)))
        if len(behind):
            value = f"{heights[behind[0]]:g} m from the wall"
            raise _wrong(f"{field}[{behind[0]}]", value, "on the side of its normal")
    return wall.native()


def _wrong(field: str, value: Any, allowed: str) -> SceneError:
    return SceneError(
        f"{field}: {value} is not allowed; must be {allowed}", field=field, value=value, allowed=allowed
    )


def _vectors(field: str, value: Any) -> FloatArray:
    try:
        array = np.ascontiguousarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise _wrong(field, repr(value), "numbers of shape (N, 3)") from error
    if array.ndim != 2 or array.shape[1] != 3:
        raise _wrong(field, f"shape {array.shape}", "of shape (N, 3)")
    return array


def _segments(nodes: Any, edges: Any, epsilon: Any) -> tuple[FloatArray, IntArray, FloatArray]:
    points = _vectors("nodes", nodes)
    try:
        pairs = index_pairs(edges)
    except (SceneError, ValueError) as error:
        raise _wrong("edges", repr(edges), "integers >= 0 of shape (E, 2)") from error
    valid = pairs < len(points)
    if not valid.all() or (pairs[:, 0] == pairs[:, 1]).any():
        raise _wrong("edges", "an edge", f"two different nodes in 0..{len(points) - 1}")
    lengths = np.linalg.norm(points[pairs[:, 1]] - points[pairs[:, 0]], axis=1)
    if (lengths == 0.0).any():
        raise _wrong(
            "nodes", f"edge {int(np.argmin(lengths))} of zero length", "distinct at the ends of an edge"
        )
    try:
        widths = np.broadcast_to(np.asarray(epsilon, dtype=np.float64), len(pairs)).copy()
    except ValueError as error:
        raise _wrong(
            "epsilon", f"shape {np.shape(epsilon)}", f"a number or of shape ({len(pairs)},)"
        ) from error
    return points, pairs, widths
