"""Runs as tables: one row for each frame, or for each node in each frame; and as CSV files."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flagrs.budget import budget_of
from flagrs.scene.values import FloatArray, IntArray

if TYPE_CHECKING:
    from flagrs.trajectory import Trajectory


def frame_columns(trajectory: Trajectory) -> dict[str, FloatArray]:
    """Return what there is once a frame: columns (T,) by name with unit."""
    columns: dict[str, FloatArray] = {"time [s]": np.asarray(trajectory.time)}
    position = trajectory.position()
    columns |= {f"position_{axis} [m]": position[:, k] for k, axis in enumerate("xyz")}
    for motor in range(len(trajectory.scene.motors)):
        columns[f"motor_{motor}_angle [rad]"] = trajectory.motor_angle[:, motor]
        columns[f"motor_{motor}_speed [rad/s]"] = trajectory.motor_speed[:, motor]
        columns[f"motor_{motor}_torque [N m]"] = trajectory.motor_torque[:, motor]
    parts = ("stretching", "bending", "twisting")
    columns |= {f"{part}_energy [J]": trajectory.energy[:, k] for k, part in enumerate(parts)}
    budget = budget_of(np.asarray(trajectory.account))
    columns |= {f"{source}_work [J]": values for source, values in budget.sources.items()}
    columns |= {f"{sink}_loss [J]": values for sink, values in budget.sinks.items()}
    columns["energy_defect [1]"] = budget.relative_defect
    columns["minimum_gap [m]"] = trajectory.minimum_gap()
    columns["contacts [1]"] = trajectory.contacts.astype(np.float64)
    return columns


def rods_of_nodes(trajectory: Trajectory) -> IntArray:
    """Return the rod (N,) that each node belongs to."""
    sizes = [len(rod.nodes) for rod in trajectory.scene.rods]
    return np.repeat(np.arange(len(sizes)), sizes)


def node_columns(trajectory: Trajectory, frame: int | slice = slice(None)) -> dict[str, Any]:
    """Return what there is at every node of some frames: columns (F N,) by name with unit."""
    chosen = np.arange(len(trajectory))[frame if isinstance(frame, slice) else slice(frame, frame + 1)]
    count = trajectory.scene.node_count
    columns: dict[str, Any] = {
        "time [s]": np.repeat(np.asarray(trajectory.time)[chosen], count),
        "rod": np.tile(rods_of_nodes(trajectory), len(chosen)),
        "node": np.tile(np.arange(count), len(chosen)),
    }
    fields = (
        ("", "m", trajectory.nodes),
        ("v", "m/s", trajectory.velocities),
        ("f", "N/m", trajectory.force_density),
    )
    for letter, unit, values in fields:
        rows = values[chosen].reshape(-1, 3)
        columns |= {f"{letter}{axis} [{unit}]": rows[:, k] for k, axis in enumerate("xyz")}
    return columns


def write_csv(trajectory: Trajectory, path: Path) -> list[Path]:
    """Write tables, FILE.csv of the frames and FILE-nodes.csv of the nodes in them; return their paths."""
    nodes = path.with_name(f"{path.stem}-nodes{path.suffix}")
    _rows(path, [frame_columns(trajectory)])
    _rows(nodes, (node_columns(trajectory, frame) for frame in range(len(trajectory))))
    return [path, nodes]


def _rows(path: Path, blocks: list[dict[str, Any]] | Iterator[dict[str, Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        for number, columns in enumerate(blocks):
            if number == 0:
                writer.writerow(columns)
            # Python's own numbers are written so that they come back to the last bit.
            writer.writerows(zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True))
