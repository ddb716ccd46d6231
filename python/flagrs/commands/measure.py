"""``flagrs measure``: the read-outs of a run, with their errors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def measure(
    file: Annotated[Path, typer.Argument(help="HDF5 file of a run, finished or not.")],
    start: Annotated[
        float | None, typer.Option(help="Begin of the window [s]; by default half of the run.")
    ] = None,
    end: Annotated[float | None, typer.Option(help="End of the window [s].")] = None,
) -> None:
    """Print what is read off a run: speed, rates, torques, power, measures of bundles, with their errors."""
    from flagrs.trajectory import Trajectory  # help does without

    typer.echo(Trajectory.load(file).readouts(start, end))
