"""What must hold between the walls of a scene and everything else."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from flagrs.errors import SceneError, faulty, not_allowed
from flagrs.scene.flow import FlowFunction, LinearFlow, PoiseuilleFlow
from flagrs.scene.signal import Signal
from flagrs.scene.values import FloatArray

if TYPE_CHECKING:
    from flagrs.scene.rod import Rod
    from flagrs.scene.scene import Scene
    from flagrs.scene.wall import Wall

#: Immersed nodes up to which a wall may be in the flow: there, products are always made with the matrix.
LARGEST_NEAR_WALL = 2000

#: Speed on a wall, over that at the distance of the rods, that counts as none.
AT_REST = 1e-9


def problems(scene: Scene) -> Iterator[SceneError]:
    """Yield everything that walls do not allow."""
    if not scene.walls:
        return
    yield from _contact(scene)
    yield from _fluid(scene)
    yield from _sides(scene)
    yield from _head(scene)
    yield from _background(scene)


def wall_in_flow(scene: Scene) -> Wall | None:
    """Return the wall that the fluid feels, if there is one."""
    return next((wall for wall in scene.walls if wall.in_flow), None)


def _contact(scene: Scene) -> Iterator[SceneError]:
    if scene.contact is not None and scene.contact.method != "barrier":
        yield not_allowed("contact.method", scene.contact.method, "'barrier' in a scene with walls")


def _fluid(scene: Scene) -> Iterator[SceneError]:
    fluid = scene.fluid
    felt = [position for position, wall in enumerate(scene.walls) if wall.in_flow]
    if fluid is None or not felt:
        return
    if len(felt) > 1:
        finding = f"walls[{felt[0]}] is in the flow already"
        allowed = (
            "the only wall in the flow (images of images are not taken), or kind='contact' to leave it out"
        )
        yield faulty(f"walls[{felt[1]}].kind", finding, allowed)
    if fluid.model == "RFT":
        allowed = (
            "'RSS' in a scene with a wall that the fluid feels: resistive force theory knows no walls; "
            "Wall(kind='contact') keeps rods off without a say in the flow"
        )
        yield not_allowed("fluid.model", fluid.model, allowed)
    if fluid.model == "RSS":
        immersed = sum(len(np.unique(rod.edge_array()[rod.immersed_array()])) for rod in scene.rods)
        if fluid.far_field_nodes is not None and immersed >= fluid.far_field_nodes:
            allowed = f"None or above {immersed}, as products near a wall are made with the matrix"
            yield not_allowed("fluid.far_field_nodes", fluid.far_field_nodes, allowed)
        elif immersed > LARGEST_NEAR_WALL:
            finding = f"{immersed} immersed nodes near a wall"
            yield faulty(
                f"walls[{felt[0]}].kind", finding, f"at most {LARGEST_NEAR_WALL}: there is no far field"
            )


def _sides(scene: Scene) -> Iterator[SceneError]:
    barrier = scene.contact is not None and scene.contact.method == "barrier"
    for number, rod in enumerate(scene.rods):
        radius, touching = node_radii(rod), np.zeros(len(rod.nodes), dtype=bool)
        if barrier and scene.contact is not None:
            touching[rod.edge_array()[rod.colliding_array()]] = True
            # Contact lets surfaces overlap by its tolerance.
            radius = np.where(touching, (1.0 - scene.contact.tolerance_or_default()) * radius, radius)
        for position, wall in enumerate(scene.walls):
            if not (wall.in_flow and scene.fluid is not None) and not touching.any():
                continue  # nothing feels it
            heights = wall.heights(rod.nodes)
            gap = heights - radius
            node = int(np.argmin(gap))
            if not gap[node] > 0.0:
                yield faulty(
                    f"rods[{number}].nodes[{node}]",
                    f"{heights[node]:.4g} m from walls[{position}], a gap of {gap[node]:.4g} m",
                    f"more than {radius[node]:.4g} m from it, on the side of its normal",
                )


def node_radii(rod: Rod) -> FloatArray:
    """Return the largest radius (N,) of the edges at each node [m]."""
    radii = np.zeros(len(rod.nodes))
    for end in range(2):
        np.maximum.at(radii, rod.edge_array()[:, end], rod.radius_array())
    return radii


def _head(scene: Scene) -> Iterator[SceneError]:
    head, wall = scene.head, wall_in_flow(scene)
    if head is None:
        return
    at = scene.rods[head.rod].nodes[[head.node]]
    if wall is not None and scene.fluid is not None and head.C_t > 0.0:
        allowed = (
            "None, or with C_t = 0, in a scene with a wall in the flow: a point head stirs no flow, so its "
            "force would lack an image; Wall(kind='contact') is not in the flow"
        )
        yield faulty("head", "a point head near a wall", allowed)
    if scene.contact is not None and scene.contact.head_radius is not None:
        least = scene.contact.head_radius * (1.0 - scene.contact.tolerance_or_default())
        for position, near in enumerate(scene.walls):
            height = float(near.heights(at)[0])
            if not height > least:
                finding = f"{height:.4g} m from walls[{position}]"
                yield faulty("head.node", finding, f"more than {least:.4g} m from it, by contact.head_radius")


def _background(scene: Scene) -> Iterator[SceneError]:
    wall = wall_in_flow(scene)
    if wall is None or scene.fluid is None:
        return
    distance = float(np.abs(wall.heights(scene.node_array())).max())
    for position, flow in enumerate(scene.fluid.background):
        if isinstance(flow, FlowFunction):
            continue  # what it does on the wall is up to its author
        if not _satisfies(flow, wall, distance):
            words = (
                "at rest on the wall" if wall.kind == "no_slip" else "along the surface, without shear on it"
            )
            yield faulty(
                f"fluid.background[{position}]", "it does not know the wall", f"a flow that is {words}"
            )


def _satisfies(flow: LinearFlow | PoiseuilleFlow, wall: Wall, distance: float) -> bool:
    """Return whether a flow satisfies the condition on a wall, to round-off over a distance [m]."""
    n = wall.normal
    along = np.eye(3) - np.outer(n, n)
    if isinstance(flow, PoiseuilleFlow):
        if flow.normal is None or not np.allclose(np.abs(flow.normal @ n), 1.0, atol=AT_REST):
            return False
        height = abs(float(wall.heights(flow.center[None])[0]))
        wanted = flow.radius if wall.kind == "no_slip" else 0.0
        return abs(height - wanted) <= AT_REST * flow.radius
    gradient, least = flow.gradient, AT_REST * float(np.abs(flow.gradient).max())
    shift = wall.point - flow.center
    uniform, linear = _constant(flow.velocity), gradient @ (shift @ n * n)
    if wall.kind == "no_slip":
        # The velocity at the foot of the center, and its changes along the wall.
        offset = 0.0 if uniform is None else np.abs(uniform + linear).max()
        return (
            uniform is not None
            and offset <= least * distance
            and bool((np.abs(gradient @ along) <= least).all())
        )
    # Nothing crosses the surface anywhere on it, and the flow along it does not change with the height.
    across = np.abs(n @ gradient @ along).max() + np.abs(along @ gradient @ n).max()
    if uniform is None:
        return False
    crossing = abs(float((uniform + linear) @ n))
    return bool(across <= least) and crossing <= AT_REST * (
        float(np.abs(uniform).max()) + least / AT_REST * distance
    )


def _constant(signal: Signal | FloatArray | object) -> FloatArray | None:
    """Return a vector signal's value if it is the same at all times."""
    return signal if isinstance(signal, np.ndarray) else None
