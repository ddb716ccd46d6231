"""The shape of the rods at one instant, seen along two or three axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flagrs.errors import FlagrsError
from flagrs.plot.canvas import COLOURS, GREY, dress, new_figure
from flagrs.scene import Rod, Scene
from flagrs.scene.rod_topology import edges_at_nodes
from flagrs.scene.values import FloatArray, IntArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from flagrs.trajectory import Trajectory

#: Horizontal axis, vertical axis and name of each view.
VIEWS = ((0, 1, "from +z"), (0, 2, "from -y"), (1, 2, "from +x"))


def shape(trajectory: Trajectory, time: float | None = None) -> Figure:
    """Return a figure of the rods in three views at equal scale.

    Parameters
    ----------
    trajectory
        The run.
    time
        Instant [s]; the nearest frame is drawn, by default the last.

    Raises
    ------
    FlagrsError
        If the trajectory has no frames.
    """
    figure = new_figure(11.0, 4.0)
    axes = [figure.add_subplot(1, 3, position + 1) for position in range(3)]
    frame = frame_at(trajectory, time)
    draw_views(axes, trajectory, frame)
    figure.suptitle(f"{trajectory.scene.name} at t = {trajectory.time[frame]:g} s")
    return figure


def frame_at(trajectory: Trajectory, time: float | None) -> int:
    """Return the index of the frame nearest to a time [s]; None is the last."""
    if not len(trajectory):
        raise FlagrsError("the trajectory has no frames to draw")
    return len(trajectory) - 1 if time is None else int(np.abs(trajectory.time - time).argmin())


def draw_views(axes: Sequence[Axes], trajectory: Trajectory, frame: int) -> None:
    """Draw a frame into three axes, one per view, with the same unit on all."""
    nodes = trajectory.nodes[frame]
    factor, unit = unit_of(float(np.ptp(nodes, axis=0).max()))
    for panel, (across, up, name) in zip(axes, VIEWS, strict=True):
        _draw_view(panel, trajectory.scene, factor * nodes, factor, (across, up))
        dress(panel, f"{'xyz'[across]} [{unit}]", f"{'xyz'[up]} [{unit}]", f"seen {name}")
        panel.set_aspect("equal", adjustable="datalim")


def unit_of(size: float) -> tuple[float, str]:
    """Return the factor and the name of the length unit in which a size [m] reads best."""
    for factor, unit in ((1.0, "m"), (1e3, "mm"), (1e6, "µm"), (1e9, "nm")):
        if size * factor >= 1.0:
            return factor, unit
    return 1e9, "nm"


def _draw_view(panel: Axes, scene: Scene, nodes: FloatArray, factor: float, plane: tuple[int, int]) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Circle

    colour = 0
    for number, rod in enumerate(scene.rods):
        offset = scene.node_offset(number)
        lines = nodes[offset : offset + len(rod.nodes)][:, plane][rod.edge_array()]
        dry = lines[~rod.immersed_array()]
        panel.add_collection(LineCollection(list(dry), colors=GREY, linewidths=2.0))
        for piece in filaments(rod):
            panel.add_collection(
                LineCollection(list(lines[piece]), colors=COLOURS[colour % len(COLOURS)], linewidths=2.0)
            )
            colour += 1
    if scene.head is not None:
        middle = nodes[scene.node_offset(scene.head.rod) + scene.head.node][list(plane)]
        radius = factor * scene.head.radius
        panel.add_patch(
            Circle((middle[0], middle[1]), radius, facecolor="#d9d9d9", edgecolor=GREY, alpha=0.5)
        )
    panel.autoscale_view()


def filaments(rod: Rod) -> list[IntArray]:
    """Return the edges of each connected immersed piece of a rod, such as the flagella of a robot."""
    edges, left = rod.edge_array(), set(np.flatnonzero(rod.immersed_array()).tolist())
    at_node = edges_at_nodes(edges, len(rod.nodes))
    pieces = []
    while left:
        reached, front = set(), [min(left)]
        while front:
            edge = front.pop()
            if edge in left:
                left.remove(edge)
                reached.add(edge)
                front += [other for node in edges[edge].tolist() for other in at_node[node]]
        pieces.append(np.array(sorted(reached), dtype=np.int64))
    return pieces
