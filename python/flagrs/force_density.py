"""Force densities that know their edges: on others, dry ones above all, they would drive another flow."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from flagrs.errors import SceneError
from flagrs.scene.values import FloatArray, IntArray


class ForceDensity(np.ndarray[Any, np.dtype[np.float64]]):
    """Force on the fluid per length at nodes (..., N, 3) [N/m], with the immersed edges it lives on.

    An array like any other; slices and frames of it keep `edges`, what is computed from it does not. A dry
    edge beside an immersed one would carry half a hat of their common node's density, so the functions of
    `flagrs.fluid` refuse edges that are not among these.

    Attributes
    ----------
    edges : ndarray or None
        Start and end node (W, 2) of the immersed edges; None: not known.
    """

    edges: IntArray | None

    def __new__(cls, values: FloatArray, edges: IntArray) -> Self:
        """Return a view of values (..., N, 3) on immersed edges (W, 2)."""
        marked = np.asarray(values, dtype=np.float64).view(cls)
        marked.edges = edges
        return marked

    def __array_finalize__(self, source: Any) -> None:
        """Keep the edges in views, as slices are."""
        # Only where the nodes may still be all there: the last two axes of a density are (N, 3).
        same = getattr(source, "shape", ())[-2:] == self.shape[-2:]
        self.edges = getattr(source, "edges", None) if same else None

    def __array_wrap__(self, values: Any, context: Any = None, return_scalar: bool = False) -> Any:
        """Return plain arrays and numbers from computations."""
        plain = np.asarray(values)
        return plain[()] if return_scalar else plain


def check_edges(density: Any, edges: IntArray) -> None:
    """Refuse edges (E, 2) on which a density that knows its own does not live.

    Raises
    ------
    SceneError
        Naming the first of them.
    """
    own = getattr(density, "edges", None)
    if own is None:
        return
    count = 1 + max(int(own.max(initial=0)), int(edges.max(initial=0)))
    names = [np.sort(pairs, axis=1) @ np.array([count, 1]) for pairs in (edges, own)]
    dry = np.flatnonzero(~np.isin(*names))
    if len(dry):
        first = int(dry[0])
        raise SceneError(
            f"edges: edge {first} from node {edges[first, 0]} to {edges[first, 1]} is not allowed; must be "
            "one of the immersed edges, on which this force density lives: take immersed_edges, or flow()",
            field="edges",
            value=edges[first].tolist(),
            allowed="the immersed edges of the scene",
        )
