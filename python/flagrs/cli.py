"""The command ``flagrs``: run scenes, draw them, repeat the studies, validate, check the installation."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from flagrs.commands.export import export
from flagrs.commands.measure import measure
from flagrs.commands.movie import movie
from flagrs.commands.new import new, schema
from flagrs.commands.plot import check_image, draw, plot
from flagrs.commands.view import view
from flagrs.errors import FlagrsError, SceneError
from flagrs.version import installed_version

# What runs and reads scenes is imported by the commands that need it: help takes no second then.
if TYPE_CHECKING:
    from flagrs.runs import Run
    from flagrs.scene import Scene
    from flagrs.trajectory import Trajectory

#: Clamps that the report of a run tells of.
MOST_CLAMPS = 4

app = typer.Typer(
    help="Soft helical filaments swimming at low Reynolds number.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    rich_markup_mode=None,  # it takes units in brackets for markup
)

#: Exit codes: what the user asked for cannot be, and what was asked for did not work out.
BAD_INPUT, FAILED = 2, 1


def _print_version(asked: bool) -> None:
    if asked:
        typer.echo(f"flagrs {installed_version()}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    pass


@app.command("scenarios")
def list_scenarios() -> None:
    """List the scenes that can be run by name, with their parameters."""
    from rich.console import Console
    from rich.table import Table as TextTable

    from flagrs import scenarios

    table = TextTable("scenario", "what it is", "parameters and defaults")
    for name, summary in scenarios.list().items():
        options = ", ".join(f"{key}={value!r}" for key, value in scenarios.parameters(name).items())
        table.add_row(name, summary, options)
    Console(markup=False).print(table)


@app.command()
def run(
    scene: Annotated[str, typer.Argument(help="A TOML file, or the name of a scenario.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="HDF5 file; by default NAME.h5.")
    ] = None,
    until: Annotated[float, typer.Option(help="Simulated time to run to [s].")] = 10.0,
    save_every: Annotated[float, typer.Option(help="Simulated time between frames [s].")] = 0.1,
    scheme: Annotated[str, typer.Option(help="Scheme in time.")] = "overdamped",
    dt: Annotated[float | None, typer.Option(help="Length of fixed steps [s].")] = None,
    rtol: Annotated[
        float | None, typer.Option(help="Relative error of adaptive steps; 1e-3 unless --dt is given.")
    ] = None,
    threads: Annotated[int | None, typer.Option(help="Threads; else FLAGRS_THREADS.")] = None,
    changes: Annotated[
        list[str] | None,
        typer.Option("--set", help="Parameter or field to change, such as rpm=30; repeatable."),
    ] = None,
    figure: Annotated[Path | None, typer.Option(help="Image file for a figure of the run.")] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Start anew, replacing an earlier run.")] = False,
    plan: Annotated[bool, typer.Option("--plan", help="Only say what would run and what it costs.")] = False,
) -> None:
    """Run a scene into a file; an interrupted run goes on where it was."""
    from flagrs.progress import ProgressBar
    from flagrs.runs import RunSettings, run_to_file

    described = scene_from(scene, changes or [])
    if plan:
        typer.echo(described.plan())
        return
    path = output or Path(f"{described.name}.h5")
    settings = RunSettings(
        until=until,
        save_every=save_every,
        scheme=scheme,
        dt=dt,
        rtol="auto" if rtol is None else rtol,
        threads=threads,
    )
    for warning in described.plan().warnings:
        typer.echo(f"warning: {warning}", err=True)
    if figure is not None:
        check_image(figure)
    try:
        with ProgressBar(until, described.name, hidden=not sys.stderr.isatty()) as progress:
            done = run_to_file(described, path, settings, fresh=fresh, progress=progress)
    except KeyboardInterrupt:
        _say_what_is_saved(path)
        raise
    typer.echo(_report(done, path))
    if figure is not None:
        draw(done.trajectory, figure)


@app.command("suggest")
def suggest_settings(
    scene: Annotated[str, typer.Argument(help="A TOML file, or the name of a scenario.")],
    error: Annotated[float, typer.Option(help="Relative error wanted.")] = 1e-2,
    changes: Annotated[
        list[str] | None,
        typer.Option("--set", help="Parameter or field to change, such as rpm=30; repeatable."),
    ] = None,
) -> None:
    """Say with which settings a scene is simulated to an error, and what no setting cures."""
    from flagrs.suggestion import suggest

    typer.echo(suggest(scene_from(scene, changes or []), error))


@app.command()
def study(
    which: Annotated[Literal["convergence", "geometries"], typer.Argument(help="The study.")],
    directory: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for runs and results.")
    ] = None,
    duration: Annotated[float, typer.Option(help="Simulated time of each run [s].")] = 100.0,
    dt: Annotated[float | None, typer.Option(help="Length of fixed steps [s].")] = None,
    rtol: Annotated[
        float | None, typer.Option(help="Relative error of adaptive steps; 1e-3 unless --dt is given.")
    ] = None,
    scheme: Annotated[str, typer.Option(help="Scheme in time.")] = "overdamped",
    processes: Annotated[
        int | None, typer.Option(help="Worker processes; by default one per processor.")
    ] = None,
) -> None:
    """Repeat a study of Lim et al.: speed against rpm, for meshes or for geometries."""
    from flagrs import study as studies  # the other commands do without

    carry_out = studies.convergence if which == "convergence" else studies.geometries
    try:
        result = carry_out(
            directory or Path("flagrs-runs") / which,
            duration=duration,
            rtol="auto" if rtol is None else rtol,
            dt=dt,
            scheme=scheme,
            processes=processes,
        )
    except KeyboardInterrupt:
        typer.echo("stopped; what was run is saved, and the same command goes on", err=True)
        raise
    _print_rows(result.rows)
    typer.echo(f"{len(result.rows)} runs in {result.wall_seconds:.1f} s: {result.table}, {result.figure}")
    failed = [row for row in result.rows if row["error"]]
    for row in failed:
        typer.echo(f"failed: {row['file']}: {row['error']}", err=True)
    if failed:
        raise typer.Exit(FAILED)


@app.command()
def validate(
    full: Annotated[bool, typer.Option("--full", help="Finer meshes and longer runs: some minutes.")] = False,
    only: Annotated[
        list[str] | None, typer.Option("--only", help="Name of a problem to solve; repeatable.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="Folder for a report, Markdown with figures as PNG and PDF.")
    ] = None,
    listed: Annotated[bool, typer.Option("--list", help="Only say what problems there are.")] = False,
) -> None:
    """Solve problems with known answers and compare: found, expected, tolerance, order of convergence."""
    from rich.console import Console

    from flagrs import validation  # the other commands do without
    from flagrs.validation import table
    from flagrs.validation.report import write_report

    console = Console(markup=False, highlight=False)
    console.width = max(console.width, table.WIDTH)
    problems = validation.chosen(only or ())
    if listed:
        console.print(table.problem_table(problems))
        return
    outcomes = []
    for problem in problems:
        outcomes.append(validation.solve(problem, full))
        console.print(table.text_table(outcomes[-1]))
    typer.echo(table.summary(outcomes))
    if report is not None:
        typer.echo(f"saved             {write_report(report, outcomes, full)}")
    if not all(outcome.passed for outcome in outcomes):
        raise typer.Exit(FAILED)


@app.command()
def doctor() -> None:
    """Say what this installation is made of, and try it."""
    from flagrs import doctor as examination  # the other commands do without

    for name, value in examination.report().items():
        typer.echo(f"{name:<18}{value}")
    typer.echo(f"{'smoke run':<18}{examination.smoke_run()}")


def scene_from(name: str, changes: Sequence[str]) -> Scene:
    """Return the scene of a TOML file or a scenario, with changes of the form ``key=value``.

    Raises
    ------
    SceneError
        If there is no such file or scenario, or a change is not allowed.
    """
    from flagrs import scenarios
    from flagrs.scene import toml

    options = dict(_change(text) for text in changes)
    path = Path(name)
    if path.suffix != ".toml":
        return scenarios.build(name, toml.changed({}, options))
    if not path.exists():
        raise SceneError(f"{name}: no such file", field="scene", value=name)
    return toml.read(path, options)


def _change(text: str) -> tuple[str, Any]:
    """Return key and value of ``key=value``; the value is TOML, or a plain word."""
    key, equals, value = text.partition("=")
    if not equals or not key:
        raise SceneError(f"--set {text}: must be of the form key=value", field="--set", value=text)
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key, value


def _report(done: Run, path: Path) -> str:
    from flagrs.runs import measured
    from flagrs.step_choice import steps_in_words
    from flagrs.units import rpm

    trajectory = done.trajectory
    values = measured(trajectory)
    simulated = float(trajectory.time[-1]) if len(trajectory) else 0.0
    lines = []
    if done.skipped:
        lines.append(f"{path} holds this run already, finished; --fresh repeats it")
    if done.resumed_at is not None:
        lines.append(f"went on from t = {done.resumed_at:g} s")
    if values["swimming_speed"] is not None:
        speed = f"{1e3 * values['swimming_speed']:.4g} mm/s"
        lines.append(f"swimming speed    {speed}{_certainty(trajectory)}")
    if values["head_rate"] is not None:
        lines.append(f"head rate         {values['head_rate'] / rpm(1.0):.4g} rpm")
    if values["efficiency"] is not None:
        lines.append(f"efficiency        {100 * values['efficiency']:.3g} %")
    lines += _clamps(trajectory)
    wall = trajectory.wall_seconds
    factor = f", {simulated / wall:.3g} times real time" if wall > 0.0 else ""
    lines.append(f"wall time         {wall:.3g} s for {simulated:g} s simulated{factor}")
    steps, given = trajectory.settings["rtol"], trajectory.settings["dt"]
    lines.append(f"steps             {steps_in_words(steps, given)}")
    lines.append(f"saved             {path} ({len(trajectory)} frames)")
    return "\n".join(lines)


def _clamps(trajectory: Trajectory) -> list[str]:
    """Return a line for each of the first clamps: its mean force and torque over the last half of the run."""
    lines = []
    later = slice(len(trajectory) // 2, None)
    for clamp in range(min(MOST_CLAMPS, len(trajectory.scene.clamps)) if len(trajectory) else 0):
        try:
            force, torque, _ = trajectory.reaction(clamp)
        except FlagrsError:  # a file of before reactions were recorded
            return []
        held, turned = (", ".join(f"{x:.3g}" for x in part[later].mean(axis=0)) for part in (force, torque))
        lines.append(f"clamp {clamp:<12}({held}) N, ({turned}) N m on average")
    return lines


def _certainty(trajectory: Trajectory) -> str:
    """Return the standard error of the speed in words, where it is known, and whether it still changes."""
    from flagrs.results.swimming import swimming_of

    try:
        speed = swimming_of(trajectory, None, None).speed
    except FlagrsError:
        return ""  # too few frames
    known = f" ± {1e3 * speed.error:.1g}" if speed.error > 1e-9 * speed.value else ""
    return known if speed.stationary else f"{known}, not steady yet"


def _say_what_is_saved(path: Path) -> None:
    from flagrs.trajectory import Trajectory

    try:
        trajectory = Trajectory.load(path)
    except (FlagrsError, OSError):
        typer.echo("stopped; nothing was saved yet", err=True)
        return
    until = f" up to t = {trajectory.time[-1]:g} s" if len(trajectory) else ""
    typer.echo(
        f"stopped; {path} holds {len(trajectory)} frames{until}, and the same command goes on", err=True
    )


def _print_rows(rows: Sequence[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.table import Table as TextTable

    from flagrs.units import rpm

    table = TextTable("pitch / R", "nodes", "rpm", "speed [mm/s]", "head [rpm]", "wall [s]")
    for row in rows:
        speed, head = row["swimming_speed"], row["head_rate"]
        table.add_row(
            f"{row['normalized_pitch']:g}",
            str(row["nodes"]),
            f"{row['rpm']:g}",
            "failed" if speed is None else f"{1e3 * speed:.4f}",
            "" if head is None else f"{head / rpm(1.0):.4f}",
            f"{row['wall_seconds']:.1f}",
        )
    Console(markup=False).print(table)


for command in (plot, view, movie, measure, export, new, schema):
    app.command()(command)


def main() -> None:
    """Run the command line; errors of the user's making end it with one clean message and no traceback."""
    try:
        app()
    except SceneError as error:
        typer.echo(f"error: {error}", err=True)
        sys.exit(BAD_INPUT)
    except (FlagrsError, OSError) as error:
        typer.echo(f"error: {error}", err=True)
        sys.exit(FAILED)
