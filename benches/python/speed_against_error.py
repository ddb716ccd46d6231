"""Wall time against error on four named problems: scheme x step or error asked for, edge length, fluid model.

Run ``python benches/python/speed_against_error.py [--document docs/performance.md]``. Errors are the largest
distance of a node from the reference at any frame, relative to the size of the filaments; the reference is an
adaptive run at 1e-8, and its own error is how far it moves when asked for 1e-7. Meshes and fluids are told
apart by speed, head rate and torque of the robot, because their nodes differ.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import flagrs
import numpy as np
from clock import hold_to_one_thread
from document import document_option, machine, publish, table
from flagrs.plot.canvas import dress, new_figure
from flagrs.time_step import size

FIGURE = Path(__file__).parents[2] / "docs" / "images" / "speed_against_error.png"
ERRORS = (1e-1, 3e-2, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
REFERENCE, CHECK = 1e-8, 1e-7


@dataclass(frozen=True)
class Problem:
    """A scene, how long it runs, and the steps of the schemes of fixed step.

    Attributes
    ----------
    name : str
        What it is called.
    build : callable
        Returns the scene.
    until, every : float
        Simulated time and time between frames [s].
    steps : tuple of float
        Steps of the first-order scheme [s].
    explicit : tuple of float
        Steps of the explicit scheme [s].
    """

    name: str
    build: Callable[..., flagrs.Scene]
    until: float
    every: float
    steps: tuple[float, ...]
    explicit: tuple[float, ...] = ()


def one_flagellum(**options: Any) -> flagrs.Scene:
    return flagrs.scenarios.clamped_flagella(count=1, contact=False, **options)


def two_flagella(**options: Any) -> flagrs.Scene:
    return flagrs.scenarios.clamped_flagella(count=2, contact=False, **options)


def robot(**options: Any) -> flagrs.Scene:
    return flagrs.scenarios.robot(rpm=20.0, contact=False, **options)


def bent_rod(**options: Any) -> flagrs.Scene:
    fluid = {"model": "RSS", **options.pop("fluid", {})}
    return flagrs.scenarios.relaxing_rod(fluid=fluid, **options)


PROBLEMS = (
    Problem(
        "one spinning flagellum", one_flagellum, 2.0, 0.1, (20e-3, 10e-3, 5e-3, 2e-3, 1e-3), (1e-3, 5e-4)
    ),
    Problem("two flagella", two_flagella, 2.0, 0.1, (20e-3, 10e-3, 5e-3, 2e-3, 1e-3), (1e-3, 5e-4)),
    Problem("robot", robot, 10.0, 0.5, (48e-3, 24e-3, 12e-3, 6e-3, 3e-3), (5e-4,)),
    Problem("bent rod", bent_rod, 2.0, 0.1, (0.1, 0.05, 0.02, 0.01, 0.005)),
)


@dataclass(frozen=True)
class Result:
    """One run: how it was made, its error, its cost."""

    method: str
    setting: float
    error: float
    seconds: float
    counts: Mapping[str, float]


def run(scene: flagrs.Scene, problem: Problem, **options: Any) -> tuple[flagrs.Trajectory, dict[str, float]]:
    simulation = flagrs.Simulation(scene, threads=1, **options)
    trajectory = simulation.run(problem.until, problem.every, path=False)
    return trajectory, simulation.statistics


def distance(a: flagrs.Trajectory, b: flagrs.Trajectory, scene: flagrs.Scene) -> float:
    return float(np.linalg.norm(a.nodes - b.nodes, axis=2).max() / size(scene))


def study(problem: Problem) -> tuple[list[Result], float]:
    """Return the runs of a problem, and the error of their reference."""
    scene = problem.build()
    reference, _ = run(scene, problem, rtol=REFERENCE)
    own = distance(run(scene, problem, rtol=CHECK)[0], reference, scene)
    methods: list[tuple[str, str, float, dict[str, Any]]] = []
    methods += [("adaptive", "rtol", error, {"rtol": error}) for error in ERRORS]
    methods += [("overdamped, first order", "dt", step, {"dt": step}) for step in problem.steps]
    methods += [("explicit", "dt", step, {"dt": step, "scheme": "explicit"}) for step in problem.explicit]
    results = []
    for name, _, setting, options in methods:
        try:
            found, counts = run(scene, problem, **options)
        except flagrs.ConvergenceError as error:
            print(f"{problem.name}, {name} {setting:g}: {error}")
            continue
        error = distance(found, reference, scene)
        results.append(Result(name, setting, error, counts["seconds_total"] / problem.until, counts))
    return results, own


def time_steps(studies: Mapping[str, tuple[list[Result], float]]) -> str:
    rows = []
    for name, (results, _) in studies.items():
        for result in results:
            rows.append(
                [
                    name,
                    result.method,
                    f"{result.setting:.0e}",
                    f"{result.error:.1e}",
                    f"{1e3 * result.seconds:.0f}",
                    f"{1.0 / result.seconds:.1f}",
                    f"{result.counts['steps']:.0f}",
                    f"{result.counts['newton_iterations']:.0f}",
                    f"{result.counts['krylov_iterations']:.0f}",
                ]
            )
    head = (
        "problem",
        "method",
        "rtol or dt [s]",
        "error",
        "ms per simulated s",
        "times real time",
        "steps",
        "Newton",
        "GMRES",
    )
    errors = "; ".join(f"{name} {own:.0e}" for name, (_, own) in studies.items())
    return f"{table(head, rows)}\n\nThe references move by this much from rtol 1e-7 to 1e-8: {errors}."


def rtol_holds(studies: Mapping[str, tuple[list[Result], float]]) -> str:
    """Return the errors of adaptive runs over those asked for."""
    rows = []
    for name, (results, _) in studies.items():
        adaptive = {result.setting: result.error for result in results if result.method == "adaptive"}
        rows.append([name, *(f"{adaptive[error] / error:.2f}" for error in ERRORS)])
    return table(("error / rtol", *(f"{error:.0e}" for error in ERRORS)), rows)


@dataclass(frozen=True)
class Measures:
    """Speed [m/s], head rate [rad/s] and motor torque [N m] of the robot, late; and what the run cost."""

    values: tuple[float, float, float]
    seconds: float
    nodes: int


def robot_measures(**options: Any) -> Measures:
    scene = flagrs.scenarios.robot(rpm=20.0, **options)
    simulation = flagrs.Simulation(scene, threads=1, rtol=1e-4)
    trajectory = simulation.run(30.0, 0.1, path=False)
    torque = float(trajectory.torque()[trajectory.time > 18.0].mean())
    values = (trajectory.swimming_speed(start=18.0), trajectory.head_rate(start=18.0), torque)
    return Measures(values, simulation.statistics["seconds_total"] / 30.0, scene.node_count)


def mesh_and_fluid() -> str:
    """Return what mesh, regularization and fluid model are worth on the robot."""
    edges = (9e-3, 7e-3, 5e-3, 3.5e-3, 2.5e-3)
    models: dict[str, dict[str, Any]] = {
        "Lim et al.'s epsilon": {},
        "epsilon = sqrt(e) a": {"fluid": {"epsilon": "slender"}},
        "no twist drag": {"twist_drag": False},
        "RFT, Gray-Hancock": {"fluid": {"model": "RFT"}},
    }
    rows: list[list[str]] = []
    ours: list[float] = []
    for name, options in models.items():
        measured = {edge: robot_measures(edge_length=edge, **options) for edge in edges}
        # First order in the edge, from the finest mesh and the one with edges twice as long.
        limit = [2.0 * fine - coarse for fine, coarse in zip(measured[2.5e-3].values, measured[5e-3].values)]
        ours = ours or limit
        rows += [_robot_row(f"{name}, {1e3 * edge:g} mm", found, limit) for edge, found in measured.items()]
        rows.append([f"{name}, edges to zero", "", "", *_shown(limit), *_apart(limit, ours)])
    head = ("robot at 20 rpm", "nodes", "ms per simulated s", "speed [mm/s]", "head [rad/s]", "torque [uN m]")
    note = (
        "The last three columns compare speed, head rate and torque: of a mesh with the same model's limit "
        "for edges to zero (extrapolated from 5 and 2.5 mm), and of a model's limit with that of "
        "Lim et al.'s epsilon."
    )
    return f"{table((*head, 'speed', 'head', 'torque'), rows)}\n\n{note}"


def _robot_row(name: str, found: Measures, limit: Sequence[float]) -> list[str]:
    cost = [str(found.nodes), f"{1e3 * found.seconds:.1f}"]
    return [name, *cost, *_shown(found.values), *_apart(found.values, limit)]


def _shown(values: Sequence[float]) -> list[str]:
    speed, rate, torque = values
    return [f"{1e3 * speed:.4f}", f"{rate:.5f}", f"{1e6 * torque:.2f}"]


def _apart(values: Sequence[float], reference: Sequence[float]) -> list[str]:
    return [f"{100.0 * (value / best - 1.0):+.1f} %" for value, best in zip(values, reference)]


def draw(studies: Mapping[str, tuple[list[Result], float]]) -> None:
    figure = new_figure(9.0, 7.0)
    axes = figure.subplots(2, 2)
    markers = {"adaptive": "o", "overdamped, first order": "s", "explicit": "^"}
    for axis, (name, (results, own)) in zip(axes.flat, studies.items()):
        for method, marker in markers.items():
            chosen = [result for result in results if result.method == method]
            if chosen:
                errors = [result.error for result in chosen]
                axis.loglog(errors, [1e3 * result.seconds for result in chosen], marker + "-", label=method)
        axis.axvline(own, color="0.7", linestyle=":", label="error of the reference")
        x, y = "largest error of a node / size of the filament", "wall time per simulated second [ms]"
        dress(axis, x, y, name)
    axes.flat[0].legend()
    FIGURE.parent.mkdir(exist_ok=True)
    figure.savefig(FIGURE, dpi=130)


def main() -> None:
    hold_to_one_thread()
    document = document_option(__doc__ or "")
    studies = {problem.name: study(problem) for problem in PROBLEMS}
    draw(studies)
    tables = (time_steps(studies), rtol_holds(studies), mesh_and_fluid())
    text = "\n\n".join((machine("numpy"), *tables))
    publish("speed-against-error", text, document)


if __name__ == "__main__":
    main()
