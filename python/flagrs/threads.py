"""How many threads to use."""

from __future__ import annotations

from flagrs import _flagrs
from flagrs.errors import not_allowed
from flagrs.scene.shapes import whole

#: More threads than any machine has cores would only cost memory and time.
MOST_THREADS = 256


def thread_count(asked: int | None) -> int:
    """Return the number of threads to use: as asked, else ``FLAGRS_THREADS``, else the machine's.

    Raises
    ------
    SceneError
        If the number asked for is not an integer from 1 to 256.
    """
    if asked is not None and whole("threads", asked) > MOST_THREADS:
        raise not_allowed("threads", asked, f"an integer from 1 to {MOST_THREADS}")
    return min(_flagrs.thread_count(asked), MOST_THREADS)
