"""The picture of the swimming robot in the README: what `make figure` runs.

The robot of Lim et al., pitch 7, swims for 100 s at 20 rpm on a mesh of 2.5 mm. Drawn are its
shape at four instants, flagella as thick as they are, and its speed and the head's rotation over time.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import flagrs
from flagrs.plot.rates import draw_head_rate, draw_speed
from flagrs.progress import ProgressBar
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

INSTANTS = (0.0, 5.0, 20.0, 100.0)
FLAGELLA = ("#0072b2", "#d55e00")
#: What the pictures show [mm], and how wide they are [inch].
LEFT, RIGHT, HEIGHT, WIDTH = -66.0, 114.0, 66.0, 5.4


def main() -> None:
    """Run the robot and draw it beside this file."""
    end = INSTANTS[-1]
    simulation = flagrs.Simulation(flagrs.scenarios.robot(edge_length=2.5e-3))
    with ProgressBar(end, "robot", hidden=not sys.stderr.isatty()) as progress:
        trajectory = simulation.run(end, 0.1, path=False, progress=progress)
    path = Path(__file__).with_name("robot.png")
    draw(trajectory).savefig(path, dpi=130)
    print(f"swimming speed {1e3 * trajectory.swimming_speed():.4g} mm/s, drawn {path}")


def draw(trajectory: flagrs.Trajectory) -> Figure:
    """Return the figure: four shapes, one below the other, and the speed over time."""
    tall = WIDTH * HEIGHT / (RIGHT - LEFT)
    figure = plt.figure(figsize=(WIDTH + 4.0, len(INSTANTS) * tall + 0.6))
    width, height = figure.get_size_inches()
    for row, instant in enumerate(INSTANTS):
        low = 0.55 + (len(INSTANTS) - 1 - row) * tall
        axes = figure.add_axes((0.1 / width, low / height, WIDTH / width, tall / height))
        draw_shape(axes, trajectory, instant)
        axes.set_xticks(range(-50, 101, 50) if row == len(INSTANTS) - 1 else [])
    axes.set_xlabel("x [mm]")
    left, tall = (WIDTH + 0.9) / width, (height - 1.9) / 2.0
    for row, panel in enumerate((draw_speed, draw_head_rate)):
        low = 0.55 + (1 - row) * (tall + 0.95)
        panel(figure.add_axes((left, low / height, 2.9 / width, tall / height)), trajectory)
    return figure


def draw_shape(axes: Axes, trajectory: flagrs.Trajectory, instant: float) -> None:
    """Draw the robot seen from +z at an instant, what is nearer above what is farther."""
    frame = int(abs(trajectory.time - instant).argmin())
    rod, head = trajectory.scene.rods[0], trajectory.scene.head
    assert head is not None
    nodes = 1e3 * trajectory.nodes[frame]
    edges, wet = rod.edge_array(), rod.immersed_array()
    points_per_mm = 72.0 * WIDTH / (RIGHT - LEFT)
    thickness = 2e3 * float(rod.radius_array().mean()) * points_per_mm
    start = 1e3 * trajectory.nodes[0, head.node]
    axes.axvline(start[0], color="#888888", linewidth=0.8, linestyle=(0, (4, 3)), zorder=1.5)
    middle = nodes[head.node]
    axes.add_patch(
        Circle((middle[0], middle[1]), 1e3 * head.radius, facecolor="#e4e4e4", edgecolor="#999999", zorder=1)
    )
    depth = nodes[edges][:, :, 2].mean(axis=1)
    for edge in depth.argsort():
        colour = FLAGELLA[0 if edge < head.node else 1] if wet[edge] else "#666666"
        line = [nodes[edges[edge]][:, :2]]
        # A white rim under each edge separates what crosses in front from what crosses behind.
        axes.add_collection(
            LineCollection(line, colors="white", linewidths=1.35 * thickness, zorder=2 + depth[edge] / 1e3)
        )
        axes.add_collection(
            LineCollection(
                line, colors=colour, linewidths=thickness, capstyle="round", zorder=2 + depth[edge] / 1e3
            )
        )
    axes.text(LEFT + 2.0, HEIGHT / 2 - 3.0, f"{instant:g} s", va="top", fontsize=11)
    axes.set_xlim(LEFT, RIGHT)
    axes.set_ylim(-HEIGHT / 2, HEIGHT / 2)
    axes.set_yticks([])
    for side in ("top", "left", "right", "bottom"):
        axes.spines[side].set_visible(False)


if __name__ == "__main__":
    main()
