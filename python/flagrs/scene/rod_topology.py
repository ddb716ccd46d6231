"""How the edges of a rod hang together: shared nodes, hinges, neighbours."""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations

import numpy as np

from flagrs.scene.values import IntArray


@lru_cache(maxsize=256)
def chain(node_count: int) -> IntArray:
    """Return the edges (node_count - 1, 2) of a chain of nodes; kept, since scenes of many rods ask often."""
    first = np.arange(node_count - 1, dtype=np.int64)
    edges: IntArray = np.stack([first, first + 1], axis=1)
    edges.setflags(write=False)
    return edges


def edges_at_nodes(edges: IntArray, node_count: int) -> list[list[int]]:
    """Return for each node the edges that end or start at it, in increasing order."""
    found: list[list[int]] = [[] for _ in range(node_count)]
    for edge, ends in enumerate(edges.tolist()):
        for node in ends:
            found[node].append(edge)
    return found


def all_hinges(edges: IntArray, node_count: int) -> IntArray:
    """Return a hinge (e, f) for every pair of edges that meet at a node, node by node.

    Where one of the two ends at the node and the other starts there, the ending one comes first; for a chain
    the hinges are therefore the consecutive edges in order.
    """
    pairs = []
    for node, meeting in enumerate(edges_at_nodes(edges, node_count)):
        for a, b in combinations(meeting, 2):
            reverse = edges[b, 1] == node and edges[a, 0] == node
            pairs.append((b, a) if reverse else (a, b))
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def shared_node(edges: IntArray, first: int, second: int) -> int | None:
    """Return the node two edges have in common, or None if they have none or are the same edge."""
    common = set(edges[first].tolist()) & set(edges[second].tolist())
    return int(common.pop()) if len(common) == 1 else None


def far_end(edges: IntArray, edge: int, node: int) -> int:
    """Return the end of an edge that is not `node`."""
    start, end = edges[edge].tolist()
    return int(end if start == node else start)
