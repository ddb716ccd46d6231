"""Filaments as tubes of their radius: the nearer ones over the farther ones, with a light side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from flagrs.plot.canvas import COLOURS, GREY
from flagrs.results.paths import paths_of
from flagrs.scene import Scene
from flagrs.scene.values import FloatArray, IntArray

#: Points of each round end.
_ROUND = 7


@dataclass(frozen=True)
class Look:
    """What does not change from frame to frame of the tubes of a scene: edges, radii and colours.

    Attributes
    ----------
    edges : ndarray
        Start and end node (E, 2) of each edge.
    radius : ndarray
        Radius (E,) [m].
    tones : ndarray
        Colours (3, E, 3) of rim, body and light side.
    """

    edges: IntArray
    radius: FloatArray
    tones: FloatArray


def look_of(scene: Scene, colours: Sequence[str] = COLOURS) -> Look:
    """Return the look of a scene's rods: a colour for each filament, grey where not immersed."""
    edges = np.zeros((scene.edge_count, 2), dtype=np.int64)
    radius, body = np.zeros(scene.edge_count), np.zeros((scene.edge_count, 3))
    filament = 0
    for path in paths_of(scene):
        edges[path.edges] = np.stack([path.nodes[:-1], path.nodes[1:]], axis=1)
        radius[path.edges] = path.radius
        body[path.edges] = to_rgb(colours[filament % len(colours)] if path.immersed else GREY)
        filament += path.immersed
    light = 0.55 * body + 0.45
    return Look(edges, radius, np.stack([0.5 * body, body, light]))


def tubes(look: Look, nodes: FloatArray) -> PolyCollection:
    """Return the tubes of a shape as polygons.

    Parameters
    ----------
    look
        Their look.
    nodes
        Positions (N, 3): across, up, and towards the viewer.
    """
    drawn = PolyCollection([], linewidths=0.0, antialiaseds=True)
    place(drawn, look, nodes)
    return drawn


def place(drawn: PolyCollection, look: Look, nodes: FloatArray, scale: float = 1.0) -> None:
    """Move tubes to another shape (N, 3), with lengths of the radius times a scale."""
    ends, radius = nodes[look.edges], scale * look.radius
    # The light comes from above and from the left.
    lit = 0.3 * radius[:, None] * np.array([-0.5, 0.85])
    shapes = np.concatenate(
        [
            _capsules(ends[:, :, :2], radius, 0.0),
            _capsules(ends[:, :, :2], 0.86 * radius, 1.0),
            _capsules(ends[:, :, :2] + lit[:, None], 0.34 * radius, 1.0),
        ]
    )
    # Rims lie a radius behind the axis and light sides a radius before it, so that edges that follow each
    # other do not cover each other's; tubes that cross are two radii apart, so that the nearer one covers the
    # other.
    depth = ends[:, :, 2].mean(axis=1)
    order = np.argsort(np.concatenate([depth - radius, depth, depth + radius]), kind="stable")
    drawn.set_verts(list(shapes[order]))
    drawn.set_facecolor([tuple(tone) for tone in look.tones.reshape(-1, 3)[order]])


def _capsules(ends: FloatArray, radius: FloatArray, roundness: float) -> FloatArray:
    """Return polygons (E, K, 2) of radius about lines (E, 2, 2), with round ends or cut straight (0)."""
    along = ends[:, 1] - ends[:, 0]
    sizes = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.where(sizes > 0.0, along / np.where(sizes > 0.0, sizes, 1.0), [1.0, 0.0])
    across = along[:, ::-1] * [-1.0, 1.0]
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _ROUND)
    out = (
        roundness * np.cos(angle)[None, :, None] * along[:, None]
        + np.sin(angle)[None, :, None] * across[:, None]
    )
    reach = radius[:, None, None] * out
    polygons: FloatArray = np.concatenate([ends[:, 1, None] + reach, ends[:, 0, None] - reach], axis=1)
    return polygons
