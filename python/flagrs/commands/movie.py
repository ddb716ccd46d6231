"""``flagrs movie``: movies of runs, and that of the supplementary text."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flagrs.errors import SceneError

if TYPE_CHECKING:
    from flagrs.trajectory import Trajectory

#: What stands for the runs of the supplementary text's movie, their pitches over the radius, and where they
#: go.
GEOMETRIES, PITCHES, FOLDER = "geometries", (5.0, 7.0, 9.0), Path("flagrs-runs/movie")


def movie(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="HDF5 files of runs, shown below each other; or 'geometries': the robot with pitches 5, 7 "
            "and 9, run first if need be."
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="Movie: .mp4, .webm or .gif.")] = Path(
        "movie.mp4"
    ),
    label: Annotated[
        list[str] | None, typer.Option(help="Text for a run, in their order; repeatable.")
    ] = None,
    seconds: Annotated[float, typer.Option(help="How long it plays [s].")] = 12.0,
    rate: Annotated[int, typer.Option(help="Pictures a second.")] = 25,
    yaw: Annotated[float, typer.Option(help="Direction of view about z [degrees].")] = -65.0,
    pitch: Annotated[float, typer.Option(help="Direction of view above the xy plane [degrees].")] = 22.0,
    follow: Annotated[bool, typer.Option("--follow", help="Move along with each swimmer.")] = False,
    until: Annotated[float, typer.Option(help="Simulated time of the geometries [s].")] = 60.0,
) -> None:
    """Make a movie of runs."""
    from flagrs.plot.film_strip import encoder_for  # matplotlib takes a while
    from flagrs.plot.movie import movie as write
    from flagrs.progress import ProgressBar
    from flagrs.trajectory import Trajectory

    encoder_for(output)  # says what is wrong before anything runs
    labels = list(label) if label else None
    if [str(file) for file in files] == [GEOMETRIES]:
        runs = _geometries(until)
        labels = labels or [f"pitch / radius = {pitch:g}" for pitch in PITCHES]
    elif GEOMETRIES in map(str, files):
        raise SceneError(f"{GEOMETRIES}: stands alone, for three runs of its own", field="files")
    else:
        runs = [Trajectory.load(file) for file in files]
    with ProgressBar(seconds, "movie", hidden=not sys.stderr.isatty()) as progress:
        write(
            runs,
            output,
            labels=labels,
            seconds=seconds,
            frames_per_second=rate,
            yaw=yaw,
            pitch=pitch,
            follow=follow,
            progress=progress,
        )
    typer.echo(f"movie             {output} ({output.stat().st_size / 1e6:.2f} MB)")


def _geometries(until: float) -> list[Trajectory]:
    """Return the robot's runs with each pitch, of files that are there or after running them."""
    from flagrs import runs, scenarios
    from flagrs.progress import ProgressBar

    FOLDER.mkdir(parents=True, exist_ok=True)
    settings = runs.RunSettings(until=until, save_every=0.1, rtol=1e-3)
    shown = []
    for pitch in PITCHES:
        path = FOLDER / f"pitch-{pitch:g}.h5"
        title = f"pitch {pitch:g}"
        with ProgressBar(until, title, hidden=not sys.stderr.isatty()) as progress:
            shown.append(
                runs.run_to_file(
                    scenarios.robot(normalized_pitch=pitch), path, settings, progress=progress
                ).trajectory
            )
    return shown
