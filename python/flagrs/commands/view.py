"""``flagrs view``: a run in three dimensions, as a page of HTML."""

from __future__ import annotations

import sys
import webbrowser
from pathlib import Path
from typing import Annotated, Any

import typer


def view(
    file: Annotated[Path, typer.Argument(help="HDF5 file of a run, finished or not.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Page; by default FILE.html.")] = None,
    colour: Annotated[
        str, typer.Option(help="What to colour by: filament, speed, force, tension or contact.")
    ] = "filament",
    follow: Annotated[bool, typer.Option("--follow", help="Let the camera follow the swimmer.")] = False,
    play: Annotated[bool, typer.Option("--play", help="Begin to play at once.")] = False,
    megabytes: Annotated[float, typer.Option(help="Size that the frames take at most [MB].")] = 3.0,
    opened: Annotated[
        bool | None,
        typer.Option("--open/--no-open", help="Open it in a browser; by default if a person is there."),
    ] = None,
) -> None:
    """Make a page that shows a run in three dimensions, in any browser and without a network."""
    from flagrs.trajectory import Trajectory  # help does without

    options: dict[str, Any] = {"colour": colour, "follow": follow, "play": play, "megabytes": megabytes}
    page = Trajectory.load(file).view(**options)
    path = page.save(output or file.with_suffix(".html"))
    typer.echo(f"page              {path} ({path.stat().st_size / 1e6:.2f} MB)")
    if sys.stdout.isatty() if opened is None else opened:
        webbrowser.open(path.resolve().as_uri())
