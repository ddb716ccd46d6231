"""How far every edge is from the others it may touch: gaps by edge, where a frame has the smallest alone."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from flagrs.assemble import EXCLUSION_FACTOR, edges_of, radii_of, rest_lengths_of
from flagrs.contact import segment_distance
from flagrs.scene import Scene
from flagrs.scene.values import BoolArray, FloatArray, IntArray


class EdgeGaps:
    """The gaps of the colliding edges of a scene, surface to surface, up to a largest one.

    Neighbours along a rod are no pairs, as in contact (docs/theory/contact.md): those with a way along the
    rods, by rest lengths, shorter than ``exclusion_factor`` times the sum of their radii.

    Parameters
    ----------
    scene
        The scene; without contact, its edges are compared as with the default contact.
    reach
        Largest gap that is looked for [m]; farther edges have this one.
    owner
        Numbers (E,) of groups of edges: only edges of different ones are compared, and none of those below 0.
        None: all colliding edges.
    """

    def __init__(self, scene: Scene, reach: float, owner: IntArray | None = None) -> None:
        self._edges = edges_of(scene)
        self._radius = radii_of(scene)
        self._colliding = np.concatenate([rod.colliding_array() for rod in scene.rods])
        if owner is not None:
            self._colliding = owner >= 0
        self._owner = owner
        self.reach = reach
        rest = rest_lengths_of(scene)
        given = None if scene.contact is None else scene.contact.exclusion_factor
        self._factor = EXCLUSION_FACTOR if given is None else given
        self._arcs = _Arcs(
            self._edges, rest, scene.node_count, 2.0 * self._factor * float(self._radius.max())
        )

    def at(self, nodes: FloatArray) -> FloatArray:
        """Return the smallest gap (E,) of every edge in a shape (N, 3) [m]; negative where edges overlap."""
        gaps = np.full(len(self._edges), self.reach)
        pairs, between = self.pairs(nodes)
        for side in (0, 1):
            np.minimum.at(gaps, pairs[:, side], between)
        return gaps

    def pairs(self, nodes: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return pairs (K, 2) of edges that may be in reach in a shape (N, 3), and their gaps (K,) [m]."""
        pairs = self._candidates(nodes)
        if not len(pairs):
            return pairs, np.zeros(0)
        a, b = self._edges[pairs[:, 0]], self._edges[pairs[:, 1]]
        distance, _, _ = segment_distance(nodes[a[:, 0]], nodes[a[:, 1]], nodes[b[:, 0]], nodes[b[:, 1]])
        return pairs, distance - self._radius[pairs].sum(axis=1)

    def _candidates(self, nodes: FloatArray) -> IntArray:
        """Return the pairs (K, 2) of edges that may be within reach and are no neighbours."""
        ends = nodes[self._edges]
        half = 0.5 * float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max())
        limit = 2.0 * half + 2.0 * float(self._radius.max()) + self.reach
        colliding = np.flatnonzero(self._colliding)
        near = cKDTree(ends[colliding].mean(axis=1)).query_pairs(limit, output_type="ndarray")
        pairs: IntArray = colliding[near].reshape(-1, 2)
        if self._owner is not None:
            pairs = pairs[self._owner[pairs[:, 0]] != self._owner[pairs[:, 1]]]
        free: IntArray = pairs[~self._excluded(pairs)]
        return free

    def _excluded(self, pairs: IntArray) -> BoolArray:
        a, b = self._edges[pairs[:, 0]], self._edges[pairs[:, 1]]
        shortest = np.min([self._arcs.between(a[:, i], b[:, j]) for i in (0, 1) for j in (0, 1)], axis=0)
        limits = self._factor * self._radius[pairs].sum(axis=1)
        # Edges that share a node are neighbours whatever the factor.
        excluded: BoolArray = (shortest < limits) | (shortest == 0.0)
        return excluded


class _Arcs:
    """Lengths along the rods between nodes, up to a limit."""

    def __init__(self, edges: IntArray, rest: FloatArray, count: int, limit: float) -> None:
        graph = csr_array((rest, (edges[:, 0], edges[:, 1])), shape=(count, count))
        rows, columns, lengths = [], [], []
        block = max(1, 2**22 // count)
        for start in range(0, count, block):
            some = np.arange(start, min(start + block, count))
            arcs = dijkstra(graph, directed=False, indices=some, limit=limit)
            row, column = np.nonzero(np.isfinite(arcs))
            rows.append(some[row])
            columns.append(column)
            lengths.append(arcs[row, column])
        keys = np.concatenate(rows) * count + np.concatenate(columns)
        order = np.argsort(keys)
        self._count, self._keys, self._lengths = count, keys[order], np.concatenate(lengths)[order]

    def between(self, a: IntArray, b: IntArray) -> FloatArray:
        """Return the lengths (K,) between nodes (K,) and others; infinite beyond the limit."""
        keys = a * self._count + b
        place = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        return np.where(self._keys[place] == keys, self._lengths[place], np.inf)
