"""Repeated timing of versions in turn, so that a busy moment of the machine falls on all of them alike."""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

#: Variables that hold every numerical library to one thread; they are read when it is loaded.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")

#: Shortest sample [s]: long against the clock's resolution and the cost of reading it.
SAMPLE = 0.02

#: Runs something and returns how long it took [s].
Clock = Callable[[], float]


@dataclass(frozen=True)
class Samples:
    """Durations of repeated runs [s]."""

    seconds: tuple[float, ...]

    @property
    def median(self) -> float:
        """Median [s]."""
        return statistics.median(self.seconds)

    @property
    def least(self) -> float:
        """Shortest [s]: what the machine does when nobody else uses it."""
        return min(self.seconds)

    @property
    def spread(self) -> float:
        """Distance of the quartiles over the median [1]."""
        low, _, high = statistics.quantiles(self.seconds, n=4)
        return (high - low) / self.median


def hold_to_one_thread() -> None:
    """Start this program again with one thread for every library, unless that is so already."""
    if any(os.environ.get(name) != "1" for name in ONE_THREAD):
        os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
        sys.stdout.flush()
        os.execv(sys.executable, [sys.executable, *sys.argv])


def wall(call: Callable[[], object]) -> Clock:
    """Return the clock of a call, warmed up; each reading makes as many calls as fill a sample."""
    call()
    begun = time.perf_counter()
    call()
    count = max(1, round(SAMPLE / (time.perf_counter() - begun)))

    def read() -> float:
        begun = time.perf_counter()
        for _ in range(count):
            call()
        return (time.perf_counter() - begun) / count

    return read


def race(clocks: Mapping[str, Clock], repeats: int = 15) -> dict[str, Samples]:
    """Read clocks in turn, one sample of each at a time.

    Parameters
    ----------
    clocks
        What to read, by name.
    repeats
        Samples of each.

    Returns
    -------
    dict
        Samples by name.
    """
    seconds: dict[str, list[float]] = {name: [] for name in clocks}
    for _ in range(repeats):
        for name, clock in clocks.items():
            seconds[name].append(clock())
    return {name: Samples(tuple(values)) for name, values in seconds.items()}
