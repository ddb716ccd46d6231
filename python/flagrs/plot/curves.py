"""Speed against rpm, one line for each mesh or geometry of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from flagrs.errors import FlagrsError
from flagrs.plot.canvas import COLOURS, dress, legend, new_figure
from flagrs.plot.table import note
from flagrs.units import rpm

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARKERS = "osD^vP*"


def study(rows: Sequence[Mapping[str, Any]], by: str, label: str = "{}") -> Figure:
    """Return a figure of swimming speed and head rate against the speed of the motors.

    Parameters
    ----------
    rows
        The table of a study: mappings with ``rpm`` [1/min], ``swimming_speed`` [m/s], ``head_rate`` [rad/s]
        and the column named by `by`. Rows of failed runs, without a speed, are left out.
    by
        Column whose values each get a line.
    label
        Text of a line's legend, with ``{}`` for the value.

    Raises
    ------
    FlagrsError
        If no row has a speed, or one lacks a column.
    """
    for number, row in enumerate(rows):
        missing = [name for name in ("rpm", "swimming_speed", "head_rate", by) if name not in row]
        if missing:
            raise FlagrsError(f"rows[{number}]: no {', '.join(missing)}; the columns are {', '.join(row)}")
    usable = [row for row in rows if row["swimming_speed"] is not None]
    if not usable:
        raise FlagrsError("no run of the study has a speed to draw")
    figure = new_figure(10.0, 4.4)
    left, right = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2)
    for number, value in enumerate(sorted({row[by] for row in usable})):
        line = sorted((row for row in usable if row[by] == value), key=lambda row: float(row["rpm"]))
        motor = [row["rpm"] for row in line]
        speeds = [1e3 * row["swimming_speed"] for row in line]
        heads = [row["head_rate"] / rpm(1.0) for row in line]
        style: dict[str, Any] = {
            "color": COLOURS[number % len(COLOURS)],
            "marker": _MARKERS[number % len(_MARKERS)],
            "markersize": 4,
            "linewidth": 1.2,
            "label": label.format(value),
        }
        left.plot(motor, speeds, **style)
        right.plot(motor, heads, **style)
        note(left, style["label"], {"motor speed [rpm]": motor, "swimming speed [mm/s]": speeds})
        note(right, style["label"], {"motor speed [rpm]": motor, "head rate [rpm]": heads})
    dress(left, "motor speed [rpm]", "swimming speed [mm/s]", "Swimming speed")
    dress(right, "motor speed [rpm]", "head rate [rpm]", "Rotation of the head")
    for panel in (left, right):
        panel.set_xlim(left=0.0)
        legend(panel)
    return figure
