"""Filaments as tubes of their radius: the nearer ones over the farther ones, with a light side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array, vstack

from flagrs.plot.canvas import COLOURS, GREY
from flagrs.results.paths import Path, paths_of
from flagrs.scene import Scene
from flagrs.scene.values import FloatArray, IntArray

if TYPE_CHECKING:
    from matplotlib.collections import PolyCollection

#: Points of each round end.
_ROUND = 7
#: Pieces of an immersed edge.
PIECES = 4


@dataclass(frozen=True)
class Look:
    """What does not change from frame to frame of the tubes of a scene: pieces, radii and colours.

    Immersed paths are drawn as cubic curves through their nodes (E. Catmull and R. Rom, 1974), in `PIECES`
    pieces an edge; dry ones, which are stiff links more often than not, by their straight edges.

    Attributes
    ----------
    curve : sparse array
        Weights (P, N) that make points of the curves of the nodes.
    pieces : ndarray
        First and last point (K, 2) of each piece.
    radius : ndarray
        Radius (K,) [m].
    tones : ndarray
        Colours (3, K, 3) of rim, body and light side.
    """

    curve: csr_array
    pieces: IntArray
    radius: FloatArray
    tones: FloatArray


def look_of(scene: Scene, colours: Sequence[str] = COLOURS) -> Look:
    """Return the look of a scene's rods: a colour for each filament, grey where not immersed."""
    from matplotlib.colors import to_rgb

    weights, pieces, radius, body = [], [], [], []
    filament = points = 0
    for path in paths_of(scene):
        rows = _curve(path, scene.node_count)
        weights.append(rows)
        count = rows.shape[0] - 1
        pieces.append(points + np.stack([np.arange(count), np.arange(1, count + 1)], axis=1))
        radius.append(np.repeat(path.radius, count // len(path.edges)))
        body.append(np.tile(to_rgb(colours[filament % len(colours)] if path.immersed else GREY), (count, 1)))
        filament += path.immersed
        points += count + 1
    shade = np.concatenate(body)
    tones = np.stack([0.5 * shade, shade, 0.55 * shade + 0.45])
    return Look(vstack(weights, format="csr"), np.concatenate(pieces), np.concatenate(radius), tones)


def _curve(path: Path, count: int) -> csr_array:
    """Return weights (P, N) of the nodes for points along a path, `PIECES` of them to an edge."""
    nodes, edges, parts = path.nodes, len(path.edges), PIECES
    before = np.concatenate([nodes[-2:-1] if path.closed else nodes[:1], nodes[:-2]])
    after = np.concatenate([nodes[2:], nodes[1:2] if path.closed else nodes[-1:]])
    corners = np.stack([before, nodes[:-1], nodes[1:], after], axis=1)
    s = (np.arange(parts) / parts)[None, :]
    r = 1.0 - s
    slope, back = 0.5 * s * r * r, -0.5 * s * s * r
    cubic = np.stack(
        [
            -slope,
            (1.0 + 2.0 * s) * r * r - back,
            s * s * (3.0 - 2.0 * s) + slope,
            back,
        ],
        axis=2,
    )
    straight = np.stack([0.0 * s, r, s, 0.0 * s], axis=2)
    values = np.tile(cubic if path.immersed else straight, (edges, 1, 1)).reshape(-1, 4)
    columns = np.repeat(corners, parts, axis=0)
    rows = np.repeat(np.arange(edges * parts), 4)
    last = csr_array(([1.0], ([0], [nodes[-1]])), shape=(1, count))
    curve = csr_array((values.ravel(), (rows, columns.ravel())), shape=(edges * parts, count))
    return vstack([curve, last], format="csr")


def tubes(look: Look, nodes: FloatArray) -> PolyCollection:
    """Return the tubes of a shape as polygons.

    Parameters
    ----------
    look
        Their look.
    nodes
        Positions (N, 3): across, up, and towards the viewer.
    """
    from matplotlib.collections import PolyCollection

    drawn = PolyCollection([], linewidths=0.0, antialiaseds=True)
    place(drawn, look, nodes)
    return drawn


def place(drawn: PolyCollection, look: Look, nodes: FloatArray, scale: float = 1.0) -> None:
    """Move tubes to another shape (N, 3), with lengths of the radius times a scale."""
    ends, radius = (look.curve @ nodes)[look.pieces], scale * look.radius
    # The light comes from above and from the left.
    lit = 0.3 * radius[:, None] * np.array([-0.5, 0.85])
    shapes = np.concatenate(
        [
            _capsules(ends[:, :, :2], radius),
            _capsules(ends[:, :, :2], 0.86 * radius),
            _capsules(ends[:, :, :2] + lit[:, None], 0.34 * radius),
        ]
    )
    # Rims lie a radius behind the axis and light sides a radius before it, so that edges that follow each
    # other do not cover each other's; tubes that cross are two radii apart, so that the nearer one covers the
    # other.
    depth = ends[:, :, 2].mean(axis=1)
    order = np.argsort(np.concatenate([depth - radius, depth, depth + 1.2 * radius]), kind="stable")
    drawn.set_verts(list(shapes[order]))
    drawn.set_facecolor([tuple(tone) for tone in look.tones.reshape(-1, 3)[order]])


def _capsules(ends: FloatArray, radius: FloatArray) -> FloatArray:
    """Return polygons (E, K, 2) of radius about lines (E, 2, 2), with round ends."""
    along = ends[:, 1] - ends[:, 0]
    sizes = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.where(sizes > 0.0, along / np.where(sizes > 0.0, sizes, 1.0), [1.0, 0.0])
    across = along[:, ::-1] * [-1.0, 1.0]
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _ROUND)
    out = np.cos(angle)[None, :, None] * along[:, None] + np.sin(angle)[None, :, None] * across[:, None]
    reach = radius[:, None, None] * out
    polygons: FloatArray = np.concatenate([ends[:, 1, None] + reach, ends[:, 0, None] - reach], axis=1)
    return polygons
