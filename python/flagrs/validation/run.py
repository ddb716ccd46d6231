"""Solving validation problems: which, how exactly, and how it went."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from flagrs.errors import SceneError, unknown_option
from flagrs.validation.problem import PROBLEMS, Check, Evidence, Problem


@dataclass(frozen=True)
class Outcome:
    """How a problem went.

    Attributes
    ----------
    problem
        The problem.
    evidence
        What it found; None if it could not be solved.
    error
        Why it could not be solved; empty if it could.
    seconds
        Wall time [s].
    """

    problem: Problem
    evidence: Evidence | None
    error: str
    seconds: float

    @property
    def checks(self) -> tuple[Check, ...]:
        """Its checks; none if it could not be solved."""
        return () if self.evidence is None else self.evidence.checks

    @property
    def passed(self) -> bool:
        """Whether it could be solved, and all of its checks passed."""
        return bool(self.checks) and all(check.passed for check in self.checks)


def chosen(names: Sequence[str] = ()) -> list[Problem]:
    """Return the problems of these names, or all of them.

    Raises
    ------
    SceneError
        If there is no such problem.
    """
    for name in names:
        if name not in PROBLEMS:
            hint = unknown_option(name, PROBLEMS)
            message = str(hint).replace("unknown option", "unknown problem")
            raise SceneError(message, field="only", value=name, allowed=hint.allowed)
    return [PROBLEMS[name] for name in names or PROBLEMS]


def solve(problem: Problem, full: bool = False) -> Outcome:
    """Solve a problem with its quick or its full settings."""
    start = time.perf_counter()
    evidence, error = None, ""
    try:
        evidence = problem.solve(**(problem.full if full else problem.quick))
    except Exception as failure:  # whatever goes wrong in one problem is a row of the table, not its end
        error = f"{type(failure).__name__}: {failure}"
    return Outcome(problem, evidence, error, time.perf_counter() - start)


def validate(names: Sequence[str] = (), full: bool = False) -> list[Outcome]:
    """Solve problems one after the other.

    Parameters
    ----------
    names
        Names of problems; empty for all.
    full
        Whether to use the finer settings.

    Raises
    ------
    SceneError
        If there is no such problem.

    Examples
    --------
    >>> [outcome] = validate(["euler_column"])
    >>> outcome.passed
    True
    """
    return [solve(one, full) for one in chosen(names)]
