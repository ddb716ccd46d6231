"""What must hold between the fields of a rod before it can be simulated."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from flagrs.errors import SceneError, faulty, not_allowed
from flagrs.scene import rod_topology
from flagrs.scene.values import FloatArray, IntArray

if TYPE_CHECKING:
    from flagrs.scene.rod import Rod

#: 1 + cos of the angle between consecutive tangents below which the curvature binormal has no meaning.
FOLD = 1e-6
#: Ratio of an edge's length to its rest length beyond which the two cannot mean the same rod.
STRETCH = 50.0


def problems(rod: Rod) -> list[SceneError]:
    """Return everything that is wrong with a rod whose fields are valid one by one.

    Later checks need what earlier ones establish, so the first group that finds something is the last one
    run.
    """
    groups: tuple[Callable[[Rod], Iterator[SceneError]], ...] = (
        _topology,
        _hinges,
        _shapes,
        _lengths,
        _geometry,
    )
    for group in groups:
        found = list(group(rod))
        if found:
            return found
    return []


def _topology(rod: Rod) -> Iterator[SceneError]:
    count = len(rod.nodes)
    if count < 2:
        yield not_allowed("nodes", rod.nodes, "an array of at least 2 nodes")
        return
    edges = rod.edge_array()
    if len(edges) == 0:
        yield not_allowed("edges", [], "at least one edge")
        return
    outside = np.flatnonzero((edges >= count).any(axis=1))
    for edge in outside[:1]:
        yield not_allowed(f"edges[{edge}]", edges[edge].tolist(), f"nodes below {count}")
    if len(outside):
        return
    seen: dict[tuple[int, ...], int] = {}
    for edge, ends in enumerate(edges.tolist()):
        if ends[0] == ends[1]:
            yield not_allowed(f"edges[{edge}]", ends, "two different nodes")
        first = seen.setdefault(tuple(sorted(ends)), edge)
        if first != edge:
            yield not_allowed(
                f"edges[{edge}]", ends, f"other than edges[{first}], which joins the same nodes"
            )
    isolated = sorted(set(range(count)) - set(edges.ravel().tolist()))
    if isolated:
        yield faulty(f"nodes[{isolated[0]}]", "isolated node", "an end of at least one edge")


def _hinges(rod: Rod) -> Iterator[SceneError]:
    if rod.hinges is None:
        return
    edges, seen = rod.edge_array(), set()
    for hinge, pair in enumerate(rod.hinges.tolist()):
        field = f"hinges[{hinge}]"
        if max(pair) >= len(edges):
            yield not_allowed(field, pair, f"edges below {len(edges)}")
        elif rod_topology.shared_node(edges, *pair) is None:
            yield not_allowed(field, pair, "two edges that meet at a node")
        elif frozenset(pair) in seen:
            yield not_allowed(field, pair, "different from the hinges before it")
        seen.add(frozenset(pair))


def _shapes(rod: Rod) -> Iterator[SceneError]:
    edges, hinges = len(rod.edge_array()), len(rod.hinge_array())
    if rod.rest_nodes is not None and rod.rest_nodes.shape != rod.nodes.shape:
        yield not_allowed("rest_nodes", rod.rest_nodes, f"an array of shape {rod.nodes.shape}, like nodes")
    for field in ("radius", "EA", "theta", "immersed", "colliding"):
        value = getattr(rod, field)
        if np.ndim(value) == 1 and len(value) != edges:
            yield not_allowed(field, value, f"one value per edge, {edges}")
    if np.ndim(rod.magnetization) == 2 and len(rod.magnetization) != edges:  # type: ignore[arg-type]
        yield not_allowed("magnetization", rod.magnetization, f"one vector per edge, {edges}")
    for field, single in (("EI", 2), ("GJ", 0), ("natural_curvature", 1), ("natural_twist", 0)):
        value = getattr(rod, field)
        if _one_per_hinge(value, field, single) and len(value) != hinges:
            yield not_allowed(field, value, f"one value per hinge, {hinges}")


def _one_per_hinge(value: Any, field: str, single: int) -> bool:
    """Return whether a value's first axis runs over hinges (EI is a number or a 2x2 matrix for each)."""
    return np.ndim(value) == single + 1 or (field == "EI" and np.ndim(value) == 1)


def _lengths(rod: Rod) -> Iterator[SceneError]:
    edges = rod.edge_array()
    lengths, rest = _edge_lengths(rod.nodes, edges), rod.rest_lengths()
    for field, values in (("nodes", lengths), ("rest_nodes", rest)):
        if field == "rest_nodes" and rod.rest_nodes is None:
            continue
        # Round-off of the positions themselves: below this a length is noise.
        floor = 1e-13 * np.abs(getattr(rod, field)).max()
        for edge in np.flatnonzero(values <= floor)[:1]:
            ends = edges[edge].tolist()
            yield faulty(
                f"{field}[{ends[1]}]",
                f"coincides with node {ends[0]}",
                f"apart from it, as edge {edge} has no length",
            )
            return
    ratio = np.maximum(lengths / rest, rest / lengths)
    worst = int(np.argmax(ratio))
    if ratio[worst] > STRETCH:
        yield faulty(
            f"rest_nodes[{edges[worst, 1]}]",
            f"edge {worst} of {lengths[worst]:.3g} m with a rest length of {rest[worst]:.3g} m",
            f"within a factor of {STRETCH:g}",
            "nodes and rest_nodes in the same unit?",
        )
    radius, contour = rod.radius_array(), float(rest.sum())
    worst = int(np.argmax(radius))
    if radius[worst] > contour / 2.0:
        yield not_allowed(
            "radius" if np.ndim(rod.radius) == 0 else f"radius[{worst}]",
            float(radius[worst]),
            f"at most half the contour length, {contour / 2.0:g} m",
            "looks like millimetres: radius and nodes in the same unit?",
        )


def _geometry(rod: Rod) -> Iterator[SceneError]:
    for field, nodes in (("nodes", rod.nodes), ("rest_nodes", rod.rest_nodes)):
        if nodes is not None:
            yield from _folds(field, nodes, rod.edge_array(), rod.hinge_array())
    if rod.director is not None:
        start, end = rod.nodes[rod.edge_array()[0]]
        across = np.cross(rod.director, end - start)
        sizes = np.linalg.norm(rod.director) * np.linalg.norm(end - start)
        if np.linalg.norm(across) <= 1e-6 * sizes:
            yield not_allowed(
                "director", rod.director.tolist(), "not parallel to the first edge, and not zero"
            )
    # As given: `EI_array` makes symmetric what is so but for round-off.
    stiffness = np.asarray(0.0 if rod.EI is None else rod.EI)
    given = stiffness.ndim
    for where, matrix in enumerate(stiffness.reshape(-1, 2, 2) if given >= 2 else ()):
        apart = abs(matrix[0, 1] - matrix[1, 0])
        if apart > 1e-12 * np.abs(matrix).max() or np.linalg.eigvalsh(matrix)[0] <= 0.0:
            field = f"EI[{where}]" if given == 3 else "EI"
            yield not_allowed(field, matrix.tolist(), "a symmetric positive definite 2x2 matrix [N m^2]")
            return


def _folds(field: str, nodes: FloatArray, edges: IntArray, hinges: IntArray) -> Iterator[SceneError]:
    """Yield an error for each hinge whose two edges lie on each other."""
    for first, second in hinges.tolist():
        node = rod_topology.shared_node(edges, first, second)
        if node is None:
            continue
        into = nodes[node] - nodes[rod_topology.far_end(edges, first, node)]
        out = nodes[rod_topology.far_end(edges, second, node)] - nodes[node]
        cosine = float(into @ out / (np.linalg.norm(into) * np.linalg.norm(out)))
        if 1.0 + cosine < FOLD:
            yield faulty(
                f"{field}[{node}]",
                f"edges {first} and {second} are antiparallel",
                "a turn of less than 180 degrees",
            )


def _edge_lengths(nodes: FloatArray, edges: IntArray) -> FloatArray:
    lengths: FloatArray = np.linalg.norm(nodes[edges[:, 1]] - nodes[edges[:, 0]], axis=1)
    return lengths
