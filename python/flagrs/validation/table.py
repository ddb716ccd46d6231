"""What problems found, as tables: plain text for a terminal, Markdown for a report."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table as TextTable

from flagrs.validation.problem import Check, Problem
from flagrs.validation.run import Outcome

#: Columns of the tables of checks.
HEADS = ("quantity", "found", "expected", "deviation", "tolerance", "order", "passed")

#: Least width of the tables on a terminal, in characters.
WIDTH = 110

_WORDS = (
    (r"\\sqrt\{([^}]*)\}", r"sqrt(\1)"),
    (r"\\[,;]", " "),
    (r"\\cdot", "*"),
    (r"\\(\w+)", r"\1 "),
    ("[${}]", ""),
)


def plain(text: str) -> str:
    """Return a text with formulas in TeX as a terminal shows it."""
    for pattern, word in _WORDS:
        text = re.sub(pattern, word, text)
    return re.sub(" +", " ", text)


def cells(check: Check) -> tuple[str, ...]:
    """Return the cells of a check's row, as `HEADS` names them."""
    unit = " abs." if check.absolute else ""
    order = "" if check.order is None else f"{check.order:.2f}"
    if check.expected_order is not None:
        order += f" ({check.expected_order:g})"
    return (
        check.quantity,
        f"{check.found:.8g}",
        f"{check.expected:.8g}",
        f"{check.deviation:+.1e}{unit}",
        f"{check.tolerance:.1e}",
        order,
        "yes" if check.passed else "NO",
    )


def text_table(outcome: Outcome) -> TextTable:
    """Return the checks of a problem as a table for a terminal."""
    table = TextTable(
        title=_headline(outcome),
        title_justify="left",
        caption_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    table.caption = f"source: {plain(outcome.problem.source)}"
    for k, head in enumerate(HEADS):
        table.add_column(head, justify="left" if k in (0, 6) else "right", no_wrap=k > 0)
    for check in outcome.checks:
        table.add_row(*(plain(cell) for cell in cells(check)))
    if outcome.error:
        table.add_row(outcome.error, "", "", "", "", "", "NO")
    return table


def _headline(outcome: Outcome) -> str:
    return f"{outcome.problem.name}, {outcome.seconds:.1f} s: {plain(outcome.problem.about)}"


def problem_table(problems: Iterable[Problem]) -> TextTable:
    """Return what problems there are."""
    table = TextTable("problem", "what it is", "source")
    for problem in problems:
        table.add_row(problem.name, plain(problem.about), plain(problem.source))
    return table


def markdown_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
    lines += [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join(lines)


def summary(outcomes: Sequence[Outcome]) -> str:
    """Return in a line how many problems and checks passed, and in what time."""
    checks = [check for outcome in outcomes for check in outcome.checks]
    passed, good = sum(outcome.passed for outcome in outcomes), sum(check.passed for check in checks)
    seconds = sum(outcome.seconds for outcome in outcomes)
    text = f"{passed} of {len(outcomes)} problems passed, {good} of {len(checks)} checks, in {seconds:.0f} s"
    failed = [outcome.problem.name for outcome in outcomes if not outcome.passed]
    return f"{text}; failed: {', '.join(failed)}" if failed else text
