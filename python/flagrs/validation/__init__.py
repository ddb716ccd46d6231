"""Named problems with known answers, solved by the simulator: the command ``flagrs validate``."""

from flagrs.validation import problems as _problems  # registers them  # noqa: F401
from flagrs.validation.problem import PROBLEMS, Check, Curve, Evidence, Panel, Problem, problem
from flagrs.validation.run import Outcome, chosen, solve, validate

__all__ = [
    "PROBLEMS",
    "Check",
    "Curve",
    "Evidence",
    "Outcome",
    "Panel",
    "Problem",
    "chosen",
    "problem",
    "solve",
    "validate",
]
