"""Speed, head rate, torque and energy over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flagrs.errors import FlagrsError
from flagrs.measures import slope, window
from flagrs.plot.canvas import COLOURS, calm, dress, legend, new_figure, say
from flagrs.plot.table import note
from flagrs.scene.values import BoolArray, FloatArray
from flagrs.units import prefixed, rpm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from flagrs.trajectory import Trajectory


def speed(trajectory: Trajectory) -> Figure:
    """Return a figure of the swimming speed and the head's rate over time.

    Parameters
    ----------
    trajectory
        The run; with fewer than two frames, or without a head and motors, a panel says what is missing.
    """
    figure = new_figure(9.0, 3.6)
    draw_speed(figure.add_subplot(1, 2, 1), trajectory)
    draw_head_rate(figure.add_subplot(1, 2, 2), trajectory)
    figure.suptitle(trajectory.scene.name)
    return figure


def draw_speed(panel: Axes, trajectory: Trajectory) -> None:
    """Draw the velocity along the mean direction of swimming, and its mean."""
    try:
        inside = window(trajectory.time, None, None)
    except FlagrsError as error:
        say(panel, str(error))
        return
    position = trajectory.position()
    mean = slope(trajectory.time[inside], position[inside])
    size = float(np.linalg.norm(mean))
    along = mean / size if size > 0.0 else np.array([1.0, 0.0, 0.0])
    rate = np.gradient(position @ along, trajectory.time)
    largest = max(size, float(np.abs(rate).max()))
    factor, unit = prefixed(largest, "m/s")
    _draw_rate(panel, trajectory.time, factor * rate, inside, factor * size, unit)
    note(panel, "speed", {"time [s]": trajectory.time, f"speed [{unit}]": factor * rate})
    who = "the head" if trajectory.scene.head else "the mean of all nodes"
    dress(panel, "time [s]", f"speed [{unit}]", f"Speed of {who}")


def draw_head_rate(panel: Axes, trajectory: Trajectory) -> None:
    """Draw how fast the head turns about the shafts, and its mean."""
    try:
        inside = window(trajectory.time, None, None)
        angle = trajectory.head_angle()
    except FlagrsError as error:
        say(panel, str(error))
        return
    rate = np.gradient(angle, trajectory.time)
    mean = float(slope(trajectory.time[inside], angle[inside]))
    _draw_rate(panel, trajectory.time, rate / rpm(1.0), inside, mean / rpm(1.0), "rpm")
    note(panel, "head", {"time [s]": trajectory.time, "head rate [rpm]": rate / rpm(1.0)})
    dress(panel, "time [s]", "head rate [rpm]", "Rotation of the head")


def _draw_rate(
    panel: Axes, time: FloatArray, rate: FloatArray, inside: BoolArray, mean: float, unit: str
) -> None:
    panel.plot(time, rate, color=COLOURS[0], linewidth=0.9)
    ends = time[inside][[0, -1]]
    panel.plot(ends, [mean, mean], color=COLOURS[1], linewidth=2.0, label=f"mean {mean:.3g} {unit}")
    calm(panel, rate)
    legend(panel)


def draw_torque(panel: Axes, trajectory: Trajectory) -> None:
    """Draw the torque of each motor."""
    torque = trajectory.torque()
    if not torque.size:
        say(panel, "no motors")
        return
    largest = float(np.abs(torque).max())
    factor, unit = prefixed(largest, "N m")
    for motor in range(torque.shape[1]):
        colour = COLOURS[motor % len(COLOURS)]
        panel.plot(
            trajectory.time,
            factor * torque[:, motor],
            color=colour,
            linewidth=0.9,
            label=f"motor {motor}",
        )
        columns = {"time [s]": trajectory.time, f"torque [{unit}]": factor * torque[:, motor]}
        note(panel, f"motor {motor}", columns)
    calm(panel, factor * torque)
    legend(panel)
    dress(panel, "time [s]", f"torque [{unit}]", "Torque of the motors")


def draw_energy(panel: Axes, trajectory: Trajectory) -> None:
    """Draw the stretching, bending and twisting energy on a logarithmic scale."""
    positive = trajectory.energy > 0.0
    if not positive.any():
        say(panel, "no elastic energy")
        return
    for part, name in enumerate(("stretching", "bending", "twisting")):
        if positive[:, part].any():
            values = np.where(positive[:, part], trajectory.energy[:, part], np.nan)
            panel.semilogy(trajectory.time, values, color=COLOURS[part], linewidth=0.9, label=name)
            note(panel, name, {"time [s]": trajectory.time, "energy [J]": trajectory.energy[:, part]})
    legend(panel)
    dress(panel, "time [s]", "energy [J]", "Elastic energy")
