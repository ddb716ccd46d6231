"""How a bundle forms and holds: gaps, phases, winding and tips of filaments over time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from flagrs.errors import FlagrsError
from flagrs.measures import spread
from flagrs.plot.canvas import COLOURS, dress, legend, new_figure, say
from flagrs.plot.shape import unit_of
from flagrs.plot.table import note
from flagrs.results.bundle import Bundle
from flagrs.scene.values import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from flagrs.trajectory import Trajectory

#: Frames that are measured, evenly spaced.
MOST_FRAMES = 400
#: Lines that a legend still tells apart.
MOST_NAMED = 7


def bundle(trajectory: Trajectory) -> Figure:
    """Return a figure of the gaps, phase lags, winding and spread of tips of filaments over time.

    Parameters
    ----------
    trajectory
        The run; panels of what its filaments do not have say why.

    Raises
    ------
    FlagrsError
        If the trajectory has no frames, or the scene no immersed filament.
    """
    if not len(trajectory):
        raise FlagrsError("the trajectory has no frames to draw")
    frames = spread(len(trajectory), MOST_FRAMES)
    measured = trajectory.bundle(frames)
    figure = new_figure(9.0, 6.4)
    panels = figure.subplots(2, 2, sharex=True).ravel()
    pairs = [f"{a} and {b}" for a, b in measured.pairs]
    others = [f"{k} against 0" for k in range(1, len(measured.filaments))]
    _panel(panels[0], measured, Bundle.gap, ("gap", "m", "Gap between filaments"), pairs)
    _panel(panels[1], measured, Bundle.phase_lag, ("phase lag", "rad", "Phase lag of helices"), others)
    tips = ("spread", "m", "Tips: distance from their middle")
    _panel(panels[2], measured, lambda b: b.tip_spread()[:, None], tips, ["tips"])
    _panel(panels[3], measured, Bundle.linking, ("linking", "1", "Winding about each other"), pairs)
    for panel in panels[2:]:
        panel.set_xlabel("time [s]")
    figure.suptitle(trajectory.scene.name)
    return figure


def _panel(
    panel: Axes,
    measured: Bundle,
    measure: Callable[[Bundle], FloatArray],
    texts: tuple[str, str, str],
    names: list[str],
) -> None:
    """Draw a measure, called and in a unit as the texts say under a title, or why there is none."""
    word, unit, title = texts
    try:
        values = measure(measured)
    except FlagrsError as error:
        say(panel, str(error))
        return
    if unit != "m":
        _lines(panel, measured.time, values, f"{word} [{unit}]", title, names)
        return
    factor, unit = unit_of(float(np.abs(values).max()))
    _lines(panel, measured.time, factor * values, f"{word} [{unit}]", title, names)
    panel.set_ylim(bottom=0.0)


def _lines(
    panel: Axes, time: FloatArray, values: FloatArray, label: str, title: str, names: list[str]
) -> None:
    for number, (row, name) in enumerate(zip(values.T, names, strict=True)):
        panel.plot(time, row, color=COLOURS[number % len(COLOURS)], linewidth=1.2, label=name)
        note(panel, name, {"time [s]": time, label: row})
    dress(panel, "", label, title)
    if 1 < len(names) <= MOST_NAMED:
        legend(panel)
