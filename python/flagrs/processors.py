"""How many processors there are for this process."""

import os


def usable_processors() -> int:
    """Return how many processors this process may run on, which may be fewer than the machine has."""
    if hasattr(os, "sched_getaffinity"):  # not on macOS and Windows
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
