"""The studies of Lim et al.: convergence with the mesh, and three geometries of the flagella."""

from __future__ import annotations

import csv
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flagrs import plot, scenarios, sweep
from flagrs.runs import RunSettings
from flagrs.step_choice import RelativeError
from flagrs.sweep import Case

RPMS = tuple(float(rpm) for rpm in range(5, 55, 5))
#: 37, 41, 45, 51, 59 and 73 nodes, as in Lim et al., and one mesh more, of 81; in metres.
EDGE_LENGTHS = (9e-3, 8e-3, 7e-3, 6e-3, 5e-3, 4e-3, 3.5e-3)
PITCHES = (5.0, 7.0, 9.0)


@dataclass(frozen=True)
class Study:
    """A finished study.

    Attributes
    ----------
    rows : list of dict
        One row for each run: its parameters, ``swimming_speed`` [m/s], ``head_rate`` [rad/s], ``power`` [W],
        ``efficiency`` [1], ``minimum_gap`` [m], ``wall_seconds`` [s], ``file`` and ``error``.
    table : Path
        The rows as a CSV file.
    figure : Path
        Speed and head rate against rpm.
    wall_seconds : float
        Wall time of this call [s]; runs an earlier call had finished add nothing to it.
    """

    rows: list[dict[str, Any]]
    table: Path
    figure: Path
    wall_seconds: float


def convergence(
    directory: str | Path = "flagrs-runs/convergence",
    *,
    rpms: Sequence[float] = RPMS,
    edge_lengths: Sequence[float] = EDGE_LENGTHS,
    duration: float = 100.0,
    save_every: float = 0.1,
    rtol: RelativeError = "auto",
    dt: float | None = None,
    scheme: str = "overdamped",
    processes: int | None = None,
    progress: bool = True,
) -> Study:
    """Run the robot of pitch 7 on several meshes and speeds.

    Parameters
    ----------
    directory
        Where runs, table and figure go; runs that are there already are not repeated.
    rpms
        Speeds of the motors [1/min].
    edge_lengths
        Least lengths of the flagella's edges [m].
    duration
        Simulated time of each run [s].
    save_every
        Simulated time between frames [s].
    rtol, dt, scheme
        Relative error of adaptive steps, length of fixed ones [s] and scheme; see `flagrs.Simulation`.
    processes
        Number of worker processes; by default one for each processor.
    progress
        Whether to show a progress bar.
    """
    settings = RunSettings(until=duration, save_every=save_every, rtol=rtol, dt=dt, scheme=scheme)
    cases = [
        _robot_case(settings, rpm=rpm, edge_length=edge_length)
        for edge_length in edge_lengths
        for rpm in rpms
    ]
    return _carry_out(cases, Path(directory), "convergence", "nodes", "{} nodes", processes, progress)


def geometries(
    directory: str | Path = "flagrs-runs/geometries",
    *,
    rpms: Sequence[float] = RPMS,
    pitches: Sequence[float] = PITCHES,
    duration: float = 100.0,
    save_every: float = 0.1,
    rtol: RelativeError = "auto",
    dt: float | None = None,
    scheme: str = "overdamped",
    processes: int | None = None,
    progress: bool = True,
) -> Study:
    """Run the robot with flagella of several pitches, at several speeds, on the mesh of 5 mm.

    Parameters
    ----------
    directory
        Where runs, table and figure go; runs that are there already are not repeated.
    rpms
        Speeds of the motors [1/min].
    pitches
        Pitches over the helix radius [1].
    duration
        Simulated time of each run [s].
    save_every
        Simulated time between frames [s].
    rtol, dt, scheme
        Relative error of adaptive steps, length of fixed ones [s] and scheme; see `flagrs.Simulation`.
    processes
        Number of worker processes; by default one for each processor.
    progress
        Whether to show a progress bar.
    """
    settings = RunSettings(until=duration, save_every=save_every, rtol=rtol, dt=dt, scheme=scheme)
    cases = [_robot_case(settings, rpm=rpm, normalized_pitch=pitch) for pitch in pitches for rpm in rpms]
    return _carry_out(
        cases, Path(directory), "geometries", "normalized_pitch", "pitch / R = {:g}", processes, progress
    )


def _robot_case(settings: RunSettings, **changes: Any) -> Case:
    parameters = {**scenarios.parameters("robot"), **changes}
    scene = scenarios.robot(**changes)
    telling = {name: parameters[name] for name in ("normalized_pitch", "edge_length", "rpm")}
    return Case("robot", scene, settings, {"nodes": scene.node_count, **telling})


def _carry_out(
    cases: Iterable[Case],
    directory: Path,
    name: str,
    by: str,
    label: str,
    processes: int | None,
    progress: bool,
) -> Study:
    """Run the cases, and write their table and their figure."""
    started = time.perf_counter()
    rows = [_row(result) for result in sweep.run(cases, directory, processes=processes, progress=progress)]
    rows.sort(key=lambda row: (row["normalized_pitch"], row["nodes"], row["rpm"]))
    table, figure = directory / f"{name}.csv", directory / f"{name}.png"
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    plot.study(rows, by, label).savefig(figure, dpi=150)
    return Study(rows, table, figure, time.perf_counter() - started)


def _row(result: sweep.Result) -> dict[str, Any]:
    columns = ("swimming_speed", "head_rate", "power", "efficiency", "minimum_gap")
    return {
        **result.case.parameters,
        **{column: result.measured.get(column) for column in columns},
        "wall_seconds": result.wall_seconds,
        "file": result.path.name,
        "error": result.error,
    }
