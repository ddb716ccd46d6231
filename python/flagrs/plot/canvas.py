"""What all figures share: how they are made, their colours, and the message when matplotlib is missing."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np

from flagrs.errors import FlagrsError
from flagrs.plot.printed import width_wanted
from flagrs.scene.values import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Okabe and Ito's palette, told apart by people with any kind of colour vision.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
GREY = "#8a8a8a"


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size in inches, or `printed` width, known to no window system.

    Raises
    ------
    FlagrsError
        If matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise FlagrsError("figures need matplotlib: pip install 'flagrs[plot]'") from None
    wanted = width_wanted.get()
    if wanted is not None:
        # Letters do not shrink along, so that a narrow figure needs some more of its height.
        width, height = wanted, min(height * (wanted / width) ** 0.8, 9.5)
    return Figure(figsize=(width, height), layout="constrained")


def dress(axes: Axes, x: str, y: str, title: str = "") -> None:
    """Label the axes and lighten the frame."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title:
        axes.set_title(title, fontsize="medium", loc="left")
    axes.grid(True, color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def say(axes: Axes, message: str) -> None:
    """Write a message in the middle of axes that have nothing to show."""
    lines = textwrap.fill(message, 36)
    text = axes.text(0.5, 0.5, lines, transform=axes.transAxes, ha="center", va="center", color=GREY)
    text.set_in_layout(False)
    axes.set_axis_off()


def legend(axes: Axes) -> None:
    """Add a legend that stays readable over lines."""
    axes.legend(loc="best", fontsize="small", framealpha=0.85, edgecolor="none")


def calm(axes: Axes, values: FloatArray) -> None:
    """Widen the vertical range to a few per cent of the values, so that round-off does not fill the panel."""
    low, high, least = float(values.min()), float(values.max()), 0.05 * float(np.abs(values).max())
    if high - low < least:
        middle = (low + high) / 2.0
        axes.set_ylim(middle - least, middle + least)
