"""The material directors of the edges in the frames of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any

import numpy as np

from flagrs import _flagrs
from flagrs.assemble import edges_of, native_scene
from flagrs.scene import Scene
from flagrs.scene.values import FloatArray, IntArray

#: Parts of the way between two saved frames over which directors are carried.
PARTS = 4


def directors(
    scene: Scene,
    time: FloatArray,
    nodes: FloatArray,
    theta: FloatArray,
    frames: IntArray,
    state: Mapping[str, Any] | None = None,
) -> FloatArray:
    """Return the material director m1 (F, E, 3) of the edges at some frames.

    Parameters
    ----------
    scene, time, nodes, theta, state
        As in `each_director`.
    frames
        Which frames (F,), in increasing order.
    """
    wanted = {int(frame): place for place, frame in enumerate(frames)}
    found = np.zeros((len(frames), theta.shape[1], 3))
    last = int(frames[-1]) + 1 if len(frames) else 0
    for frame, director in enumerate(each_director(scene, time, nodes, theta, state, last)):
        if frame in wanted:
            found[wanted[frame]] = director
    return found


def each_director(
    scene: Scene,
    time: FloatArray,
    nodes: FloatArray,
    theta: FloatArray,
    state: Mapping[str, Any] | None = None,
    end: int | None = None,
) -> Iterator[FloatArray]:
    """Yield the material director m1 (E, 3) of the edges, frame by frame from the first.

    The simulation carries reference directors along with the tangents, from step to step, and saves the
    angles `theta` against them (docs/theory/rods.md). Here they are carried along cubic curves through the
    saved frames, which is another way, by some degrees a minute. With a checkpoint, which holds the
    simulation's own, what has come of that is spread evenly over the time up to it: a tenth of a degree is
    left of it in steady motion.

    Parameters
    ----------
    scene
        The scene, from whose initial shape the frames start.
    time, nodes, theta
        Instants (T,) [s], positions (T, N, 3) [m] and angles (T, E) [rad] of all frames.
    state
        The checkpoint.
    end
        How many frames; None: all.
    """
    known, drift = -1, np.zeros(theta.shape[1])
    if state is not None and "directors" in state:
        reached = float(np.ravel(state["time"])[0]) * (1.0 + 1e-12)
        known = int(np.searchsorted(time, reached, "right")) - 1
        for reference, tangents in islice(_carried(scene, time, nodes), known, known + 1):
            own = transported(state["directors"], state["tangents"], tangents)
            drift = angles_about(tangents, reference, own)
    for frame, (reference, tangents) in enumerate(islice(_carried(scene, time, nodes), end)):
        share = (time[frame] - time[0]) / (time[known] - time[0]) if known > 0 else 0.0
        angle = (theta[frame] + share * drift)[:, None]
        yield np.cos(angle) * reference + np.sin(angle) * np.cross(tangents, reference)


def _carried(scene: Scene, time: FloatArray, nodes: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield directors (E, 3) that never spin, from the initial shape on, and tangents, at each frame."""
    edges = edges_of(scene)
    begin = _flagrs.Simulation(native_scene(scene), "overdamped", 1.0, 1).state()
    reference, tangents = begin["directors"], begin["tangents"]
    for frame in range(len(time)):
        for shape in _between(time, nodes, frame) if frame else (nodes[0],):
            after = _tangents(shape, edges)
            reference, tangents = transported(reference, tangents, after), after
        yield reference, tangents


def angles_about(axis: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the angles (E,) from vectors (E, 3) to others about unit axes (E, 3), in (-pi, pi] [rad]."""
    sine = np.einsum("ij,ij->i", axis, np.cross(first, second))
    angle: FloatArray = np.arctan2(sine, np.einsum("ij,ij->i", first, second))
    return angle


def transported(vectors: FloatArray, before: FloatArray, after: FloatArray) -> FloatArray:
    """Return vectors (E, 3) carried by the smallest rotation from unit tangents (E, 3) to others.

    Where a tangent turns back on itself the rotation is not unique, and the vector is taken across as it is.
    """
    axis = np.cross(before, after)
    half = np.maximum(1.0 + np.einsum("ij,ij->i", before, after), 1e-10)[:, None]
    dot = np.einsum("ij,ij->i", before, after)[:, None]
    along = np.einsum("ij,ij->i", axis, vectors)[:, None]
    moved = vectors * dot + np.cross(axis, vectors) + axis * along / half
    moved -= np.einsum("ij,ij->i", moved, after)[:, None] * after
    sizes = np.linalg.norm(moved, axis=1, keepdims=True)
    carried: FloatArray = moved / np.maximum(sizes, 1e-300)
    return carried


def _tangents(nodes: FloatArray, edges: IntArray) -> FloatArray:
    arms = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    unit: FloatArray = arms / np.linalg.norm(arms, axis=1, keepdims=True)
    return unit


def _between(time: FloatArray, nodes: FloatArray, frame: int) -> Iterator[FloatArray]:
    """Yield shapes on the way from the frame before to a frame, itself the last: a cubic Hermite curve."""
    before, after = frame - 1, frame
    span = float(time[after] - time[before])
    slopes = [_slope(time, nodes, k) * span for k in (before, after)]
    for part in np.arange(1, PARTS + 1) / PARTS:
        s, r = part, 1.0 - part
        yield (
            (1.0 + 2.0 * s) * r * r * nodes[before]
            + s * r * r * slopes[0]
            + s * s * (3.0 - 2.0 * s) * nodes[after]
            - s * s * r * slopes[1]
        )


def _slope(time: FloatArray, nodes: FloatArray, frame: int) -> FloatArray:
    """Return the velocities of the nodes at a frame, of the parabola through it and its neighbours."""
    last = len(time) - 1
    middle = min(max(frame, 1), last - 1) if last > 1 else None
    if middle is None:
        rate: FloatArray = (nodes[last] - nodes[0]) / (time[last] - time[0])
        return rate
    a, b = time[middle] - time[middle - 1], time[middle + 1] - time[middle]
    first, second = (nodes[middle] - nodes[middle - 1]) / a, (nodes[middle + 1] - nodes[middle]) / b
    at_middle, bend = (b * first + a * second) / (a + b), (second - first) / (a + b)
    offset = time[frame] - time[middle]
    parabola: FloatArray = at_middle + 2.0 * bend * offset
    return parabola
