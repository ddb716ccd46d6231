"""How much memory there is, and refusing what would take more before it is taken."""

from __future__ import annotations

import math
import os
import resource
from pathlib import Path

from flagrs.errors import FlagrsError

_CONTROL_GROUP = Path("/sys/fs/cgroup")


def available_memory() -> float:
    """Return how much memory this process may still take [bytes]; infinite where nothing is known of it."""
    return min(_of_the_machine(), _of_the_control_group(), _of_the_process())


def require_memory(what: str, size: float, advice: str) -> None:
    """Raise FlagrsError if something is larger than the memory there is.

    Parameters
    ----------
    what
        What is large, as the subject of a sentence.
    size
        How large [bytes].
    advice
        What to do instead.
    """
    there = available_memory()
    if not size <= there:
        raise FlagrsError(
            f"{what} would take {in_words(size)} of {in_words(there)} memory there is; {advice}"
        )


def in_words(size: float) -> str:
    """Return a number of bytes for a person to read."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if size < 1000:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:.3g} TB"


def _of_the_machine() -> float:
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            name, _, amount = line.partition(":")
            if name == "MemAvailable":
                return 1024.0 * float(amount.split()[0])
        return math.inf
    except (OSError, ValueError):
        pages = os.sysconf("SC_PHYS_PAGES")  # macOS says no more than this
        return float(pages * os.sysconf("SC_PAGE_SIZE"))


def _of_the_control_group() -> float:
    try:
        most = float((_CONTROL_GROUP / "memory.max").read_text(encoding="ascii"))  # "max" is no number
        return most - float((_CONTROL_GROUP / "memory.current").read_text(encoding="ascii"))
    except (OSError, ValueError):
        return math.inf


def _of_the_process() -> float:
    most = resource.getrlimit(resource.RLIMIT_AS)[0]
    if most == resource.RLIM_INFINITY:
        return math.inf
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (OSError, ValueError):
        return float(most)
    return float(most - pages * os.sysconf("SC_PAGE_SIZE"))
