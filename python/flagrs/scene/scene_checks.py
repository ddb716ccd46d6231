"""What must hold between the parts of a scene before it can be simulated."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from flagrs.errors import SceneError, faulty, not_allowed
from flagrs.scene import wall_checks
from flagrs.scene.part import different
from flagrs.scene.rod_topology import edges_at_nodes

if TYPE_CHECKING:
    from flagrs.scene.clamp import Clamp
    from flagrs.scene.head import Head
    from flagrs.scene.load import Load
    from flagrs.scene.motor import Motor
    from flagrs.scene.rod import Rod
    from flagrs.scene.scene import Scene


def problems(scene: Scene) -> list[SceneError]:
    """Return everything that is wrong between parts that are valid one by one."""
    # An index out of range makes the other checks meaningless, so those wait until all indices are right.
    found = list(_indices(scene))
    if found:
        return found
    return [*_head(scene), *_motors(scene), *_clamps(scene), *_buoyancy(scene), *wall_checks.problems(scene)]


def _indices(scene: Scene) -> Iterator[SceneError]:
    for field, part in _named_parts(scene):
        if part.rod >= len(scene.rods):
            yield not_allowed(f"{field}.rod", part.rod, f"a rod below {len(scene.rods)}")
            continue
        rod = scene.rods[part.rod]
        limits = {"node": len(rod.nodes), "shaft": len(rod.edge_array()), "edge": len(rod.edge_array())}
        for name, limit in limits.items():
            index = getattr(part, name, None)
            if index is not None and index >= limit:
                yield not_allowed(f"{field}.{name}", index, f"below {limit}")
        limits = {"nodes": len(rod.nodes), "edges": len(rod.edge_array())}
        for name, limit in limits.items():
            for position, index in enumerate(getattr(part, name, None) or ()):
                if index >= limit:
                    yield not_allowed(f"{field}.{name}[{position}]", index, f"below {limit}")


def _named_parts(scene: Scene) -> Iterator[tuple[str, Head | Motor | Clamp | Load]]:
    """Yield every part that sits on a rod, with its path."""
    if scene.head is not None:
        yield "head", scene.head
    for name in ("motors", "clamps", "loads"):
        for position, part in enumerate(getattr(scene, name)):
            yield f"{name}[{position}]", part


def _buoyancy(scene: Scene) -> Iterator[SceneError]:
    fluid = scene.fluid
    if fluid is not None and fluid.density is None and scene.gravity.any():
        allowed = "given [kg/m^3] in a scene with gravity: 1000 for water, 0 to leave buoyancy out"
        yield not_allowed("fluid.density", None, allowed)


def _head(scene: Scene) -> Iterator[SceneError]:
    if scene.head is None:
        return
    rod = scene.rods[scene.head.rod]
    meeting = set(edges_at_nodes(rod.edge_array(), len(rod.nodes))[scene.head.node])
    if len(meeting) != 2:
        yield not_allowed(
            "head.node", scene.head.node, f"a node with exactly two neighbours, not {len(meeting)}"
        )
    elif not any(meeting == set(hinge) for hinge in rod.hinge_array().tolist()):
        # Without one the head would resist the mean turning of two edges that turn as they like.
        yield faulty("head.node", "no hinge joins the two edges at the head", "a node with a hinge")


def edges_of_head(scene: Scene, head: Head) -> list[int]:
    """Return the edges of its rod that are fixed to a head: those at its node but shafts of motors there."""
    rod = scene.rods[head.rod]
    here = (motor for motor in scene.motors if (motor.rod, motor.node) == (head.rod, head.node))
    shafts = {motor.shaft for motor in here}
    return [
        edge for edge in edges_at_nodes(rod.edge_array(), len(rod.nodes))[head.node] if edge not in shafts
    ]


def _motors(scene: Scene) -> Iterator[SceneError]:
    used: dict[tuple[int, int], int] = {}
    for position, motor in enumerate(scene.motors):
        field = f"motors[{position}]"
        here = hinges_of_motor(scene.rods[motor.rod], motor)
        if len(here) != 1:
            at_node = np.flatnonzero(scene.rods[motor.rod].hinge_nodes() == motor.node)
            edges = sorted(set(scene.rods[motor.rod].hinge_array()[at_node].ravel().tolist()))
            if len(at_node) == 1:
                yield not_allowed(
                    f"{field}.shaft", motor.shaft, f"one of the edges {edges} of the hinge at the node"
                )
            else:
                yield not_allowed(
                    f"{field}.node", motor.node, f"a node with exactly one hinge, not {len(at_node)}"
                )
            continue
        first = used.setdefault((motor.rod, here[0]), position)
        if first != position:
            yield faulty(
                f"{field}.node", f"motors[{first}] drives the same hinge", "the only motor of its hinge"
            )


def hinges_of_motor(rod: Rod, motor: Motor) -> list[int]:
    """Return the hinges at the motor's node of which the shaft is one edge; a valid motor has one."""
    at_node = np.flatnonzero(rod.hinge_nodes() == motor.node)
    if len(at_node) > 1:
        return []
    return [int(hinge) for hinge in at_node if motor.shaft in rod.hinge_array()[hinge]]


def _clamps(scene: Scene) -> Iterator[SceneError]:
    nodes: dict[tuple[int, int], int] = {}
    edges: dict[tuple[int, int], int] = {}
    for position, clamp in enumerate(scene.clamps):
        field = f"clamps[{position}]"
        for node in clamp.nodes:
            first = nodes.setdefault((clamp.rod, node), position)
            if different(clamp.motion(), scene.clamps[first].motion()):
                yield faulty(
                    f"{field}.nodes", f"node {node} is moved differently by clamps[{first}]", "clamped once"
                )
        for edge in clamp.edges:
            first = edges.setdefault((clamp.rod, edge), position)
            if clamp.angular_velocity != scene.clamps[first].angular_velocity:
                yield faulty(
                    f"{field}.edges", f"edge {edge} is turned differently by clamps[{first}]", "clamped once"
                )
    for position, motor in enumerate(scene.motors):
        first = edges.get((motor.rod, motor.shaft), -1)
        if first >= 0:
            finding = f"the angle of edge {motor.shaft} is held by clamps[{first}]"
            yield faulty(f"motors[{position}].shaft", finding, "an edge free to turn")
