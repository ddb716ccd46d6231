"""The numbers that a figure shows, as a table: each drawing function notes what it draws."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from flagrs.errors import FlagrsError, file_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Series:
    """One thing drawn into a panel: columns of equal length by name with unit, such as ``time [s]``."""

    panel: str
    name: str
    columns: Mapping[str, Any]


_DRAWN: WeakKeyDictionary[Any, list[Series]] = WeakKeyDictionary()


def note(axes: Axes, name: str, columns: Mapping[str, Any]) -> None:
    """Keep the numbers of what was drawn into axes; arrays are broadcast against each other."""
    arrays = np.broadcast_arrays(*(np.asarray(values) for values in columns.values()))
    flat = {key: np.array(values).ravel() for key, values in zip(columns, arrays, strict=True)}
    _DRAWN.setdefault(axes, []).append(Series("", name, flat))


def series_of(figure: Figure) -> list[Series]:
    """Return everything that a figure of flagrs shows, in the order of its panels."""
    found = []
    for number, axes in enumerate(figure.axes):
        title = axes.get_title(loc="left") or axes.get_title() or f"panel {number + 1}"
        found += [Series(title, series.name, series.columns) for series in _DRAWN.get(axes, [])]
    return found


def save_table(figure: Figure, path: str | Path) -> Path:
    """Write the numbers that a figure shows as a CSV file, one row for each point.

    Columns are ``panel``, ``series`` and all quantities of the figure, with their units; where a panel has no
    such quantity its cells are empty.

    Parameters
    ----------
    figure
        A figure of this package.
    path
        The file; one that is there is replaced.

    Raises
    ------
    FlagrsError
        If the figure shows no numbers.
    FileError
        If the file cannot be written; an `OSError`.
    """
    series = series_of(figure)
    if not series:
        raise FlagrsError("the figure shows no numbers to save")
    names = list(dict.fromkeys(name for one in series for name in one.columns))
    place = Path(path)
    try:
        with place.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["panel", "series", *names])
            for one in series:
                columns = [one.columns.get(name) for name in names]
                for row in range(len(next(iter(one.columns.values())))):
                    cells = ["" if column is None else repr(column[row].item()) for column in columns]
                    writer.writerow([one.panel, one.name, *cells])
    except (OSError, ValueError) as error:
        raise file_error(place, error, "cannot be written") from None
    return place
