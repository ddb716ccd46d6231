"""One figure of a whole run, for a person who wants to see what happened."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagrs.plot.canvas import new_figure
from flagrs.plot.rates import draw_energy, draw_head_rate, draw_speed, draw_torque
from flagrs.plot.shape import draw_views, frame_at

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from flagrs.trajectory import Trajectory


def summary(trajectory: Trajectory) -> Figure:
    """Return a figure of speed, head rate, torque, energy and the final shape.

    Parameters
    ----------
    trajectory
        The run. Panels for parts the scene does not have are left out.

    Raises
    ------
    FlagrsError
        If the trajectory has no frames, or matplotlib is missing.
    """
    scene = trajectory.scene
    draw = [draw_speed]
    if scene.head is not None and scene.motors:
        draw.append(draw_head_rate)
    if scene.motors:
        draw.append(draw_torque)
    if len(draw) < 3:
        draw.append(draw_energy)
    last = frame_at(trajectory, None)
    figure = new_figure(12.0, 7.0)
    grid = figure.add_gridspec(2, 6, height_ratios=(1.0, 1.25))
    width = 6 // len(draw)
    for position, panel in enumerate(draw):
        panel(figure.add_subplot(grid[0, position * width : (position + 1) * width]), trajectory)
    views = [figure.add_subplot(grid[1, 2 * position : 2 * position + 2]) for position in range(3)]
    draw_views(views, trajectory, last)
    nodes = f"{scene.node_count} nodes"
    figure.suptitle(f"{scene.name}: {nodes}, shape at t = {trajectory.time[last]:g} s")
    return figure
