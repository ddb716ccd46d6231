"""``flagrs plot``: figures of a run, and the numbers they show."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from flagrs.errors import FileError, SceneError, file_error, not_allowed

if TYPE_CHECKING:
    from flagrs.trajectory import Trajectory

Kind = Literal["summary", "speed", "shape", "flow", "curvature", "tension", "bundle"]
Size = Literal["screen", "column", "page"]


def plot(
    file: Annotated[Path, typer.Argument(help="HDF5 file of a run, finished or not.")],
    kind: Annotated[Kind, typer.Argument(help="What to draw.")] = "summary",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Image; by default FILE.png or FILE-KIND.png.")
    ] = None,
    size: Annotated[
        Size, typer.Option(help="Width: as reads best on a screen, a column of 86 mm, a page of 178 mm.")
    ] = "screen",
    save: Annotated[
        Path | None, typer.Option("--save", help="CSV file for the numbers that the figure shows.")
    ] = None,
    time: Annotated[
        float | None, typer.Option(help="Instant of a shape or flow [s]; by default the last.")
    ] = None,
    plane: Annotated[Literal["xy", "xz", "yz"], typer.Option(help="Plane of a flow.")] = "xy",
) -> None:
    """Draw a run: summary, speed, shape, flow in a plane, curvature and tension over time, or the bundle."""
    from flagrs.trajectory import Trajectory  # help does without

    name = f"{file.stem}.png" if kind == "summary" else f"{file.stem}-{kind}.png"
    image = output or file.with_name(name)
    check_image(image)
    options: dict[str, Any] = {}
    if kind in ("shape", "flow"):
        options["time"] = time
    elif time is not None:
        raise SceneError(
            f"--time: {kind} is drawn over all times; give it with shape or flow", field="--time"
        )
    if kind == "flow":
        options["plane"] = plane
    draw(Trajectory.load(file), image, kind, size, save, options)


def draw(
    trajectory: Trajectory,
    image: Path,
    kind: Kind = "summary",
    size: Size = "screen",
    table: Path | None = None,
    options: dict[str, Any] | None = None,
) -> None:
    """Draw a figure into a file, and its numbers into another if one is given, and say so."""
    from flagrs import plot as figures  # matplotlib takes a while
    from flagrs.plot.printed import DOTS

    with figures.printed(size):
        figure = getattr(figures, kind)(trajectory, **(options or {}))
        try:
            figure.savefig(image, dpi=DOTS[size])
        except OSError as error:
            raise file_error(image, error, "cannot be written") from None
    typer.echo(f"drawn             {image}")
    if table is not None:
        typer.echo(f"numbers           {figures.save_table(figure, table)}")


def check_image(path: Path) -> None:
    """Raise SceneError, before anything runs, for an image of a kind that cannot be drawn."""
    from matplotlib.backend_bases import FigureCanvasBase  # matplotlib takes a while

    known = FigureCanvasBase.get_supported_filetypes()
    if path.suffix.removeprefix(".").lower() not in known:
        raise not_allowed("figure", str(path), "a file ending in ." + ", .".join(sorted(known)))
    if not path.parent.is_dir():
        raise FileError(path, f"there is no folder {str(path.parent)!r}")
