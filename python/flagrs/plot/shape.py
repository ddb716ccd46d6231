"""The shape of the rods at one instant, seen along two or three axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flagrs.errors import FlagrsError
from flagrs.plot.canvas import GREY, dress, new_figure
from flagrs.plot.table import note
from flagrs.results.paths import paths_of
from flagrs.scene import Rod, Scene
from flagrs.scene.rod_topology import edges_at_nodes
from flagrs.scene.values import FloatArray, IntArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from flagrs.trajectory import Trajectory

#: Axes across, up, and towards the viewer with its sign; and the name of each view.
VIEWS = ((0, 1, 2, 1.0, "from +z"), (0, 2, 1, -1.0, "from -y"), (1, 2, 0, 1.0, "from +x"))


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
    for panel, (across, up, out, sign, name) in zip(axes, VIEWS, strict=True):
        draw_rods(panel, trajectory.scene, factor * nodes, factor, (across, up, out, sign))
        dress(panel, f"{'xyz'[across]} [{unit}]", f"{'xyz'[up]} [{unit}]", f"seen {name}")
        panel.set_aspect("equal", adjustable="datalim")
        for number, path in enumerate(paths_of(trajectory.scene)):
            places = factor * nodes[path.nodes]
            columns = {f"{'xyz'[axis]} [{unit}]": places[:, axis] for axis in range(3)}
            note(panel, f"rod {path.rod}, path {number}", {"node": path.nodes, **columns})


def unit_of(size: float) -> tuple[float, str]:
    """Return the factor and the name of the length unit in which a size [m] reads best."""
    for factor, unit in ((1.0, "m"), (1e3, "mm"), (1e6, "µm"), (1e9, "nm")):
        if size * factor >= 1.0:
            return factor, unit
    return 1e9, "nm"


def draw_rods(
    panel: Axes, scene: Scene, nodes: FloatArray, factor: float, view: tuple[int, int, int, float]
) -> None:
    """Draw rods as tubes of their radius, and the head, into axes in a unit of length.

    Parameters
    ----------
    panel
        Where to.
    scene
        The scene.
    nodes
        Positions (N, 3) in the unit of the axes.
    factor
        That unit in metres, inverted.
    view
        Axes across, up and out, and the sign of the direction from which the last is looked along.
    """
    from matplotlib.patches import Circle

    from flagrs.plot.tubes import look_of, place, tubes

    across, up, out, sign = view
    seen = nodes[:, [across, up, out]] * [1.0, 1.0, sign]
    look = look_of(scene)
    drawn = tubes(look, seen)
    place(drawn, look, seen, factor)
    panel.add_collection(drawn)
    low, high = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
    if scene.head is not None:
        middle = seen[scene.node_offset(scene.head.rod) + scene.head.node]
        radius = factor * scene.head.radius
        low, high = np.minimum(low, middle[:2] - radius), np.maximum(high, middle[:2] + radius)
        centre = (float(middle[0]), float(middle[1]))
        panel.add_patch(Circle(centre, radius, facecolor="#d9d9d9", edgecolor="none", alpha=0.6, zorder=0.9))
        panel.add_patch(Circle(centre, radius, facecolor="none", edgecolor=GREY, zorder=3.0))
    thick = factor * float(look.radius.max())
    panel.update_datalim([low - thick, high + thick])
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
