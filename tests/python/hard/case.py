"""What a hard case is: a scene, an independent answer, and how far off the result may be."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from flagrs import FlagrsError, StabilityWarning
from flagrs.guards import FlagrsWarning

#: All cases by name, in the order in which they were defined.
CASES: dict[str, HardCase] = {}


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    Attributes
    ----------
    verdict
        ``right``, ``wrong``, ``refused`` (a clear error, or a warning of instability) or ``unclear`` (an
        error that says nothing useful).
    error
        Error found, in the measure of the case; NaN if refused.
    seconds
        Wall time [s].
    message
        First line of the error, if any.
    """

    verdict: str
    error: float
    seconds: float
    message: str = ""


@dataclass(frozen=True)
class HardCase:
    """A case: `measure` returns the error, a number or an array, or raises FlagrsError.

    Attributes
    ----------
    name, group
        Name of the case, and the heading it stands under.
    against
        What the result is compared with.
    tolerance
        Largest error that counts as right.
    refused
        Whether the scene is one that must be refused with a clear error.
    may_refuse
        Whether a clear error is as good as the right answer.
    awaited
        Why the case is known to be wrong; None: it is right. It fails strictly: a cure must remove this.
    slow
        Whether it takes more than half a minute.
    """

    name: str
    group: str
    against: str
    measure: Callable[[], Any] = field(repr=False)
    tolerance: float = np.nan
    refused: bool = False
    may_refuse: bool = False
    awaited: str | None = None
    slow: bool = False

    @property
    def expected(self) -> tuple[str, ...]:
        """The verdicts that count as passed."""
        if self.refused:
            return ("refused",)
        return ("right", "refused") if self.may_refuse else ("right",)

    def outcome(self) -> Outcome:
        """Run the case."""
        start = time.perf_counter()
        try:
            with warnings.catch_warnings():
                # A run that is said to be unstable has given no answer; other guards do not change it.
                warnings.simplefilter("ignore", FlagrsWarning)
                warnings.simplefilter("error", StabilityWarning)
                error = float(np.max(np.abs(self.measure())))
        except (FlagrsError, StabilityWarning) as refusal:
            words = str(refusal).splitlines()[0]
            clear = len(words) > 20 and "nan" not in words.lower()
            return Outcome("refused" if clear else "unclear", np.nan, time.perf_counter() - start, words)
        # A NaN compares as wrong.
        verdict = "right" if error <= self.tolerance else "wrong"
        return Outcome(verdict, error, time.perf_counter() - start)


def hard(
    group: str, name: str, *, against: str, tolerance: float = np.nan, **options: Any
) -> Callable[[Callable[[], Any]], Callable[[], Any]]:
    """Register a function as a case."""

    def register(measure: Callable[[], Any]) -> Callable[[], Any]:
        add(group, name, measure, against=against, tolerance=tolerance, **options)
        return measure

    return register


def add(group: str, name: str, measure: Callable[[], Any], **options: Any) -> None:
    """Register a case; names are unique."""
    if name in CASES:
        raise ValueError(f"two hard cases of the name {name!r}")
    CASES[name] = HardCase(name=name, group=group, measure=measure, **options)
