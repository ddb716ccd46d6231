"""A report of a validation: Markdown with every check, and a figure of each problem as PNG and PDF."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from flagrs.plot.canvas import COLOURS, GREY, dress, legend, new_figure
from flagrs.validation.problem import Evidence, Panel
from flagrs.validation.run import Outcome
from flagrs.validation.table import HEADS, cells, markdown_table, summary
from flagrs.version import installed_version

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

#: Curves with a label from which on a legend stands beside its panel.
MOST_INSIDE = 4

#: Name of the report in its folder.
REPORT = "validation.md"


def write_report(folder: Path, outcomes: Sequence[Outcome], full: bool) -> Path:
    """Write the report of a validation into a folder, which is made if need be, and return its path.

    Figures need matplotlib; without it the report says that there are none.
    """
    folder.mkdir(parents=True, exist_ok=True)
    drawable = find_spec("matplotlib") is not None
    parts = [_opening(outcomes, full)]
    if not drawable:
        parts.append("Figures are missing: matplotlib is not installed.")
    for outcome in outcomes:
        image = None
        if drawable and outcome.evidence is not None and outcome.evidence.panels:
            image = f"{outcome.problem.name}.png"
            picture = draw(outcome.evidence)
            picture.savefig(folder / image, dpi=160)
            picture.savefig(folder / f"{outcome.problem.name}.pdf")
        parts.append(_section(outcome, image))
    path = folder / REPORT
    path.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    return path


def _opening(outcomes: Sequence[Outcome], full: bool) -> str:
    rows = [
        (
            f"[{outcome.problem.name}](#{outcome.problem.name})",
            outcome.problem.about,
            f"{sum(check.passed for check in outcome.checks)} of {len(outcome.checks)}",
            f"{outcome.seconds:.1f}",
            "yes" if outcome.passed else "**NO**",
        )
        for outcome in outcomes
    ]
    settings = "full" if full else "quick"
    system = f"{platform.system()} {platform.machine()}, {os.cpu_count()} processors"
    command = f"flagrs validate{' --full' if full else ''}"
    return "\n\n".join(
        [
            "# Validation",
            f"flagrs {installed_version()} with {settings} settings (`{command}`),\n"
            f"on {system}, Python {platform.python_version()}.\n{summary(outcomes)}.",
            "Expected values are published or computed by code that shares nothing with the simulator.\n"
            "Found values of a sequence of meshes or steps are extrapolated to zero size;\n"
            "the order is that of the three finest, with the theoretical one in brackets.\n"
            "Deviations are relative unless marked `abs.`",
            markdown_table(("problem", "what it is", "checks passed", "seconds", "passed"), rows),
        ]
    )


def _section(outcome: Outcome, image: str | None) -> str:
    problem = outcome.problem
    parts = [f"## {problem.name}", problem.about, f"Source: {problem.source}."]
    if outcome.error:
        parts.append(f"Could not be solved: {outcome.error}")
    if image is not None:
        parts.append(f"![{problem.about}]({image})")
    if outcome.checks:
        parts.append(markdown_table((*HEADS, "with"), [(*cells(c), c.resolution) for c in outcome.checks]))
        reasons = dict.fromkeys(check.reason for check in outcome.checks)
        parts.append("Tolerance: " + "; ".join(reasons) + ".")
    return "\n\n".join(parts)


def draw(evidence: Evidence) -> Figure:
    """Return the figure of a problem, its panels side by side.

    Raises
    ------
    FlagrsError
        If matplotlib is not installed.
    """
    count = len(evidence.panels)
    figure = new_figure(4.4 * count, 3.5)
    for axes, panel in zip(figure.subplots(1, count, squeeze=False)[0], evidence.panels, strict=True):
        _draw_panel(axes, panel)
    return figure


def _draw_panel(axes: Axes, panel: Panel) -> None:
    drawn = -1
    for curve in panel.curves:
        guide = curve.style == "--"
        drawn += not (guide or curve.paired)
        colour = GREY if guide else COLOURS[drawn % len(COLOURS)]
        axes.plot(curve.x, curve.y, curve.style, color=colour, label=curve.label or None, markersize=4)
    axes.set_xscale(panel.x_axis)
    axes.set_yscale(panel.y_axis)
    dress(axes, panel.x, panel.y, panel.title)
    if panel.x_axis == "log":
        _mark_few(axes.xaxis)
    if panel.y_axis == "log":
        _mark_few(axes.yaxis)
    labels = sum(bool(curve.label) for curve in panel.curves)
    if labels > MOST_INSIDE:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="small", edgecolor="none")
    elif labels:
        legend(axes)


def _mark_few(axis: Axis) -> None:
    """Label a logarithmic axis at 1, 2 and 5 of each decade where it spans less than two, else at decades."""
    from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    if high < 100.0 * low:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(LogFormatterSciNotation(labelOnlyBase=False, minor_thresholds=(10, 10)))
    axis.set_minor_formatter(NullFormatter())
