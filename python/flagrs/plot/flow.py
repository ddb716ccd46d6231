"""The flow that filaments drive, in a plane: speed in colour, streamlines, and the swimmer before it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from flagrs.errors import not_allowed
from flagrs.flow import in_fluid
from flagrs.plot.canvas import dress, new_figure
from flagrs.plot.shape import draw_rods, frame_at, unit_of
from flagrs.plot.table import note
from flagrs.scene.shapes import number, whole
from flagrs.scene.values import Bounds, FloatArray
from flagrs.units import prefixed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from flagrs.trajectory import Trajectory

#: Axes across, up, and towards the viewer of each plane, with the sign of the last.
PLANES = {"xy": (0, 1, 2, 1.0), "xz": (0, 2, 1, -1.0), "yz": (1, 2, 0, 1.0)}


def flow(
    trajectory: Trajectory,
    time: float | None = None,
    plane: str = "xy",
    at: float | None = None,
    margin: float = 0.4,
    points: int = 90,
) -> Figure:
    """Return a figure of the flow in a plane at one instant, in the laboratory.

    It is the flow that the immersed edges drive (`Trajectory.flow`): a head stirs none, and background flows
    are not in it.

    Parameters
    ----------
    trajectory
        The run.
    time
        Instant [s]; the nearest frame is drawn, by default the last.
    plane
        ``xy``, ``xz`` or ``yz``.
    at
        Where the plane cuts the third axis [m]; None: the middle of the swimmer.
    margin
        How far the picture goes beyond the swimmer, over its largest extent.
    points
        Points along the longer side of the picture.

    Raises
    ------
    FlagrsError
        If the trajectory has no frames, or the fluid is not of regularized Stokeslet segments.
    SceneError
        For an option out of range.
    """
    if plane not in PLANES:
        raise not_allowed("plane", plane, ", ".join(PLANES))
    number("margin", margin, Bounds("1", at_least=0.0, at_most=100.0))
    count = whole("points", points, least=4)
    across, up, out, sign = PLANES[plane]
    frame = frame_at(trajectory, time)
    nodes = trajectory.nodes[frame]
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    head = trajectory.scene.head
    if head is not None:
        middle = trajectory.position()[frame]
        low, high = np.minimum(low, middle - head.radius), np.maximum(high, middle + head.radius)
    spread = margin * float((high - low).max())
    depth = float(0.5 * (low + high)[out]) if at is None else number("at", at, Bounds("m"))
    step = (float((high - low)[[across, up]].max()) + 2.0 * spread) / (count - 1)
    x = np.arange(low[across] - spread, high[across] + spread + 0.5 * step, step)
    y = np.arange(low[up] - spread, high[up] + spread + 0.5 * step, step)
    grid = np.zeros((len(y), len(x), 3))
    grid[..., across], grid[..., up], grid[..., out] = x[None, :], y[:, None], depth
    # Behind a wall there is no fluid, and nothing moves.
    velocity, wet = np.zeros_like(grid), in_fluid(trajectory.scene, grid.reshape(-1, 3))
    if wet.any():
        velocity.reshape(-1, 3)[wet] = trajectory.flow(grid.reshape(-1, 3)[wet], frame)
    speed = np.linalg.norm(velocity, axis=2)
    factor, unit = unit_of(float((high - low).max()))
    fast, fast_unit = prefixed(float(speed.max()), "m/s")
    tall = len(y) / len(x)
    figure = new_figure(8.0, max(2.6, 6.4 * tall + 1.0))
    panel = figure.add_subplot()
    top = float(np.quantile(fast * speed, 0.995)) or 1.0
    colours = panel.pcolormesh(
        factor * x, factor * y, fast * speed, vmin=0.0, vmax=top, cmap="viridis", shading="gouraud"
    )
    inside = velocity[..., [across, up]]
    if inside.any():
        panel.streamplot(
            factor * x,
            factor * y,
            inside[..., 0],
            inside[..., 1],
            color="white",
            linewidth=0.6,
            density=1.3,
            arrowsize=0.7,
        )
    figure.colorbar(colours, ax=panel, label=f"speed [{fast_unit}]", extend="max", shrink=0.9)
    draw_rods(panel, trajectory.scene, factor * nodes, factor, (across, up, out, sign))
    names = "xyz"
    when, where = f"t = {trajectory.time[frame]:g} s", f"{names[out]} = {factor * depth:.3g} {unit}"
    title = f"{trajectory.scene.name}: flow of the filaments at {when}, {where}"
    dress(panel, f"{names[across]} [{unit}]", f"{names[up]} [{unit}]", title)
    panel.set_aspect("equal")
    panel.set_xlim(factor * x[0], factor * x[-1])
    panel.set_ylim(factor * y[0], factor * y[-1])
    _note(panel, factor * x, factor * y, fast * velocity, f"[{unit}]", f"[{fast_unit}]", (across, up))
    return figure


def _note(
    panel: Any,
    x: FloatArray,
    y: FloatArray,
    velocity: FloatArray,
    length: str,
    rate: str,
    plane: tuple[int, int],
) -> None:
    names = "xyz"
    columns = {f"{names[plane[0]]} {length}": x[None, :], f"{names[plane[1]]} {length}": y[:, None]}
    columns |= {f"u_{names[axis]} {rate}": velocity[..., axis] for axis in range(3)}
    columns[f"speed {rate}"] = np.linalg.norm(velocity, axis=2)
    note(panel, "flow", columns)
