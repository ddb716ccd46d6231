"""The unbranched paths that a scene's rods are made of: what one draws and measures along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flagrs.scene import Scene
from flagrs.scene.rod_topology import edges_at_nodes
from flagrs.scene.values import FloatArray, IntArray


@dataclass(frozen=True)
class Path:
    """A run of edges without a branch, all immersed or all dry.

    Attributes
    ----------
    rod : int
        The rod it belongs to.
    nodes : ndarray
        Its nodes (n,) in order; the first comes again at the end of a closed one.
    edges : ndarray
        Its edges (n - 1,) in order, which may point either way.
    radius : ndarray
        Radius (n - 1,) of each edge [m].
    immersed : bool
        Whether the fluid acts on it.
    """

    rod: int
    nodes: IntArray
    edges: IntArray
    radius: FloatArray
    immersed: bool

    @property
    def closed(self) -> bool:
        """Whether it ends where it begins."""
        return bool(self.nodes[0] == self.nodes[-1])


def paths_of(scene: Scene) -> list[Path]:
    """Return the paths of all rods of a scene; each edge is in exactly one."""
    return [path for number in range(len(scene.rods)) for path in _paths_of_rod(scene, number)]


def filaments_of(scene: Scene) -> list[Path]:
    """Return the immersed paths of a scene, its flagella, from base to tip.

    The base is the end at a motor, a clamp, or dry edges of its rod; elsewhere the first node.
    """
    held = _held_nodes(scene)
    return [
        _reversed(path) if path.nodes[-1] in held and path.nodes[0] not in held else path
        for path in paths_of(scene)
        if path.immersed
    ]


def _held_nodes(scene: Scene) -> set[int]:
    """Return the nodes where filaments are driven or held: of motors, clamps and dry edges."""
    held = {scene.node_offset(motor.rod) + motor.node for motor in scene.motors}
    for clamp in scene.clamps:
        held |= {scene.node_offset(clamp.rod) + node for node in clamp.nodes}
    for number, rod in enumerate(scene.rods):
        dry = rod.edge_array()[~rod.immersed_array()]
        held |= set((scene.node_offset(number) + dry).ravel().tolist())
    return held


def _reversed(path: Path) -> Path:
    return Path(path.rod, path.nodes[::-1], path.edges[::-1], path.radius[::-1], path.immersed)


def _paths_of_rod(scene: Scene, number: int) -> list[Path]:
    rod = scene.rods[number]
    edges, wet, radius = rod.edge_array(), rod.immersed_array(), rod.radius_array()
    at_node = edges_at_nodes(edges, len(rod.nodes))
    node_offset, edge_offset = scene.node_offset(number), scene.edge_offset(number)

    def onward(node: int, edge: int) -> int | None:
        """Return the one edge a path goes on with through a node."""
        others = [other for other in at_node[node] if other != edge]
        return others[0] if len(others) == 1 and wet[others[0]] == wet[edge] else None

    left = set(range(len(edges)))
    starts = [
        (node, edge)
        for edge in range(len(edges))
        for node in edges[edge].tolist()
        if onward(node, edge) is None
    ]
    loops = [(int(edges[edge][0]), edge) for edge in range(len(edges))]
    found = []
    for node, first in [*starts, *loops]:
        if first not in left:
            continue
        nodes, along, edge = [node], [], first
        following: int | None = edge
        while following is not None and following in left:
            edge = following
            left.remove(edge)
            along.append(edge)
            node = int(edges[edge].sum()) - nodes[-1]
            nodes.append(node)
            following = onward(node, edge)
        found.append(
            Path(
                number,
                node_offset + np.array(nodes, dtype=np.int64),
                edge_offset + np.array(along, dtype=np.int64),
                radius[along],
                bool(wet[first]),
            )
        )
    return found
