"""``flagrs export``: runs for ParaView, xarray, NumPy and spreadsheets."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer


def export(
    file: Annotated[Path, typer.Argument(help="HDF5 file of a run, finished or not.")],
    to: Annotated[
        Literal["vtkhdf", "xarray", "npz", "csv"],
        typer.Option("--to", help="For ParaView, xarray (NetCDF), NumPy, or tables."),
    ] = "vtkhdf",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="File; by default FILE with another ending.")
    ] = None,
) -> None:
    """Write a run in a format of other programs."""
    from flagrs.export import FORMATS  # the other commands do without
    from flagrs.export import export as write
    from flagrs.trajectory import Trajectory  # help does without

    path = output or file.with_suffix(FORMATS[to].suffix)
    for written in write(Trajectory.load(file), to, path):
        typer.echo(f"exported          {written} ({written.stat().st_size / 1e6:.2f} MB)")
