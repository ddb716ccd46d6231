"""What is read off a trajectory: slopes over a window, and angles about an axis."""

from __future__ import annotations

import numpy as np

from flagrs.errors import FlagrsError
from flagrs.scene.values import BoolArray, FloatArray, IntArray


def window(time: FloatArray, start: float | None, end: float | None) -> BoolArray:
    """Return which instants lie in a window, by default the last half of the run.

    Raises
    ------
    FlagrsError
        If fewer than two frames do.
    """
    if len(time) == 0:
        raise FlagrsError("the trajectory has no frames")
    start = (float(time[0]) + float(time[-1])) / 2.0 if start is None else start
    end = float(time[-1]) if end is None else end
    inside: BoolArray = (time >= start) & (time <= end)
    if inside.sum() < 2:
        raise FlagrsError(
            f"{int(inside.sum())} frames between {start:g} s and {end:g} s; a rate needs at least 2 "
            f"(the trajectory runs from {time[0]:g} s to {time[-1]:g} s)"
        )
    return inside


def spread(count: int, most: int) -> IntArray:
    """Return at most so many of 0 .. count - 1, evenly spaced, the first and the last among them."""
    every = max(1, -(-(count - 1) // max(1, most - 1)))
    return np.unique(np.append(np.arange(0, count, every), count - 1)).astype(np.int64)


def slope(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return the least-squares slope of values (T, ...) against time (T,)."""
    centred = time - time.mean()
    rate: FloatArray = np.tensordot(centred, values - values.mean(axis=0), axes=1) / (centred @ centred)
    return rate


#: Sine of the angle to an axis below which a vector's turning about it says nothing of its body's.
NEARLY_ALONG = 0.3


def along(axis: FloatArray, vectors: FloatArray) -> BoolArray:
    """Return which of the vectors (T, 3) run nearly along an axis (3,)."""
    sines = np.linalg.norm(np.cross(axis, vectors), axis=1) / np.linalg.norm(vectors, axis=1)
    near: BoolArray = sines <= NEARLY_ALONG * np.linalg.norm(axis)
    return near


def spin_about(axis: FloatArray, vectors: FloatArray, theta: FloatArray) -> FloatArray:
    """Return the angle (T,) about an axis (3,) of a body fixed to an edge, from zero [rad].

    Between two frames it is the turn of the edge's tangent, that of ``vectors`` (T, 3), and the change of the
    angle ``theta`` (T,) of its material frame: its spin, because reference frames do not spin in time.
    """
    unit = axis / np.linalg.norm(axis)
    tangents = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    turned = np.cross(tangents[:-1], tangents[1:]) @ unit
    spun = np.diff(theta) * (0.5 * (tangents[:-1] + tangents[1:]) @ unit)
    return np.concatenate([[0.0], np.cumsum(turned + spun)])


def angle_about(axis: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return the continued angle (T,) of vectors (T, 3) about an axis (3,), right-handed and from zero [rad].

    Turns are followed from frame to frame, so a vector must turn by less than half a turn between two frames.

    Raises
    ------
    FlagrsError
        If a vector is along the axis, where its angle has no meaning.
    """
    along = axis / np.linalg.norm(axis)
    across = vectors - (vectors @ along)[:, None] * along
    sizes = np.linalg.norm(across, axis=1)
    if (sizes <= 1e-6 * np.linalg.norm(vectors, axis=1)).any():
        raise FlagrsError("the arms of the head are along the axis of the shafts; no angle about it")
    first = across[0] / sizes[0]
    second = np.cross(along, first)
    angle: FloatArray = np.unwrap(np.arctan2(across @ second, across @ first))
    return angle
