"""Figures for print: the widths of a column and of a page, and letters that fit them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Literal

from flagrs.errors import not_allowed

Size = Literal["screen", "column", "page"]

#: Widths [inches]: a column of 86 mm and a page of 178 mm, as the journals of the American Physical Society
#: and of the Royal Society have them; None leaves a figure as large as it reads best on a screen.
WIDTHS: dict[str, float | None] = {"screen": None, "column": 86.0 / 25.4, "page": 178.0 / 25.4}

#: Width of the figure being made [inches], and dots per inch it is saved with.
width_wanted: ContextVar[float | None] = ContextVar("width_wanted", default=None)
DOTS = {"screen": 150, "column": 400, "page": 400}


@contextmanager
def printed(size: Size = "column") -> Iterator[None]:
    """Make the figures within of the width of a column (86 mm) or a page (178 mm), in letters of 8 points.

    Parameters
    ----------
    size
        ``column``, ``page``, or ``screen`` for figures as they are.

    Raises
    ------
    SceneError
        For another size.

    Examples
    --------
    >>> with printed("page"):
    ...     pass
    """
    if size not in WIDTHS:
        raise not_allowed("size", size, ", ".join(WIDTHS))
    width = WIDTHS[size]
    if width is None:
        yield
        return
    from matplotlib import rc_context

    token = width_wanted.set(width)
    try:
        with rc_context(
            {
                "font.size": 8.0,
                "axes.titlesize": 8.0,
                "axes.labelsize": 8.0,
                "legend.fontsize": 7.0,
                "xtick.labelsize": 7.0,
                "ytick.labelsize": 7.0,
                "figure.titlesize": 8.0,
                "axes.linewidth": 0.6,
                "lines.linewidth": 1.0,
                "savefig.dpi": DOTS[size],
                "pdf.fonttype": 42,  # letters stay letters
                "svg.fonttype": "none",
            }
        ):
            yield
    finally:
        width_wanted.reset(token)
