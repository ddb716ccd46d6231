"""Curvature and tension along every filament over time, as colours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flagrs.assemble import rest_lengths_of
from flagrs.errors import FlagrsError
from flagrs.measures import spread
from flagrs.plot.canvas import dress, new_figure
from flagrs.plot.shape import unit_of
from flagrs.plot.table import note
from flagrs.results.paths import Path, filaments_of
from flagrs.results.strain import curvatures, hinges_of, tensions
from flagrs.scene.values import FloatArray
from flagrs.units import prefixed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from flagrs.trajectory import Trajectory

#: Filaments that get a panel, the first ones; and frames that are drawn, evenly spaced.
MOST_PANELS, MOST_FRAMES = 6, 1500


def curvature(trajectory: Trajectory) -> Figure:
    """Return a figure of how much more curved than at rest every filament is, along it and over time.

    Arc length is that of the rest shape, from base to tip; curvature is that of
    `flagrs.results.strain.curvatures`. Less that of the rest shape, because a kink of it would hide all else.

    Parameters
    ----------
    trajectory
        The run; of more than six filaments the first six are drawn.

    Raises
    ------
    FlagrsError
        If there are fewer than two frames, or no filament is immersed.
    """
    return _figure(trajectory, "curvature")


def tension(trajectory: Trajectory) -> Figure:
    """Return a figure of the tension along every filament over time, positive where stretched.

    Parameters
    ----------
    trajectory
        The run; of more than six filaments the first six are drawn.

    Raises
    ------
    FlagrsError
        If there are fewer than two frames, or no filament is immersed.
    """
    return _figure(trajectory, "tension")


def _figure(trajectory: Trajectory, what: str) -> Figure:
    scene = trajectory.scene
    filaments = filaments_of(scene)
    if len(trajectory) < 2:
        raise FlagrsError(f"a kymograph needs two frames; the trajectory has {len(trajectory)}")
    if not filaments:
        raise FlagrsError("a kymograph needs an immersed filament; the scene has none")
    shown = filaments[:MOST_PANELS]
    frames = spread(len(trajectory), MOST_FRAMES)
    nodes, time = trajectory.nodes[frames], trajectory.time[frames]
    rest = rest_lengths_of(scene)
    if what == "curvature":
        shape = np.concatenate([rod.rest_array() for rod in scene.rods])
        values = curvatures(scene, nodes) - curvatures(scene, shape)
    else:
        values = tensions(scene, nodes)
    panels = [
        _along(path, rest, values, _hinge_numbers(trajectory) if what == "curvature" else None)
        for path in shown
    ]
    factor, unit = unit_of(max(float(borders[-1]) for borders, _ in panels))
    largest = max(float(np.abs(rows).max()) for _, rows in panels)
    force, force_unit = prefixed(largest, "N") if what == "tension" else (1.0 / factor, f"1/{unit}")
    figure = new_figure(8.0, 1.1 + 1.9 * len(panels))
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    top = (
        float(np.quantile(np.abs(np.concatenate([rows.ravel() for _, rows in panels])), 0.998)) * force or 1.0
    )
    times = np.concatenate([time[:1], 0.5 * (time[1:] + time[:-1]), time[-1:]])
    word = "curvature beyond rest" if what == "curvature" else what
    label = f"{word} [{force_unit}]"
    mesh = None
    for number, (panel, (borders, rows)) in enumerate(zip(axes, panels, strict=True)):
        mesh = panel.pcolormesh(
            times, factor * borders, force * rows.T, vmin=-top, vmax=top, cmap="RdBu_r", rasterized=True
        )
        name = f"filament {number}" + (f" of {len(filaments)}" if len(filaments) > len(shown) else "")
        dress(
            panel,
            "time [s]" if number == len(panels) - 1 else "",
            f"arc length [{unit}]",
            f"{word}, {name}",
        )
        panel.grid(False)
        middle = 0.5 * factor * (borders[1:] + borders[:-1])
        note(
            panel,
            f"filament {number}",
            {"time [s]": time[:, None], f"arc length [{unit}]": middle, label: force * rows},
        )
    if mesh is not None:
        figure.colorbar(mesh, ax=list(axes), label=label, extend="both")
    return figure


def _along(
    path: Path, rest: FloatArray, values: FloatArray, hinges: dict[frozenset[int], int] | None
) -> tuple[FloatArray, FloatArray]:
    """Return borders (n + 1,) of cells along a path [m], and the values (T, n) in them."""
    arc = np.concatenate([[0.0], np.cumsum(rest[path.edges])])
    if hinges is None:
        return arc, values[:, path.edges]
    numbers = [
        hinges.get(frozenset(pair))
        for pair in zip(path.edges[:-1].tolist(), path.edges[1:].tolist(), strict=True)
    ]
    if None in numbers or not numbers:
        raise FlagrsError("a filament with edges that no hinge joins has no curvature there")
    # A hinge stands for the halves of its two edges.
    middles = 0.5 * (arc[1:] + arc[:-1])
    return middles, values[:, [number for number in numbers if number is not None]]


def _hinge_numbers(trajectory: Trajectory) -> dict[frozenset[int], int]:
    return {frozenset(pair): k for k, pair in enumerate(hinges_of(trajectory.scene).tolist())}
