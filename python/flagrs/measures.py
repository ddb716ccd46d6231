"""What is read off a trajectory: slopes over a window, and angles about an axis."""

from __future__ import annotations

import numpy as np

from flagrs.errors import FlagrsError
from flagrs.scene.values import BoolArray, FloatArray


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


def slope(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return the least-squares slope of values (T, ...) against time (T,)."""
    centred = time - time.mean()
    rate: FloatArray = np.tensordot(centred, values - values.mean(axis=0), axes=1) / (centred @ centred)
    return rate


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
