"""When the frames of a run are taken, and whether there is room for them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from flagrs.errors import FlagrsError
from flagrs.frame import shapes_of
from flagrs.memory import in_words, require_memory
from flagrs.scene import Scene

#: Times a frame is held at once: as it comes, and in the arrays of the trajectory.
COPIES = 2


def frame_times(start: float, end: float, every: float) -> Iterator[float]:
    """Return the times of frames after the start: multiples of the interval, and the end [s]."""
    first, last = _numbers(start, end, every)
    return (min(k * every, end) for k in range(first, last + 1))


def check_frames(scene: Scene, start: float, end: float, every: float) -> None:
    """Raise FlagrsError if the frames of a run are too many to count, or would not fit into memory.

    Parameters
    ----------
    scene
        What runs.
    start, end, every
        Times [s].
    """
    if (end - start) / every > 2.0**52 or every <= math.ulp(end):
        raise FlagrsError(f"save_every: {every:g} s is too short to tell frames apart at t = {end:g} s")
    first, last = _numbers(start, end, every)
    size = 8 * sum(math.prod(shape) for shape in shapes_of(scene).values())
    require_memory(
        f"save_every: {last - first + 2} frames of {in_words(size)}",
        COPIES * size * (last - first + 2),
        "take longer intervals, or run in parts",
    )


def _numbers(start: float, end: float, every: float) -> tuple[int, int]:
    """Return the number of the first frame after the start and that of the last, in intervals."""
    first = math.floor(start / every * (1.0 + 1e-12) + 1e-9) + 1
    return first, max(first, math.ceil(end / every - 1e-9))
