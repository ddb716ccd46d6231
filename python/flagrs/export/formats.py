"""The formats that runs can be written in, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from flagrs.errors import FlagrsError, file_error, not_allowed
from flagrs.export.arrays import write_netcdf, write_npz
from flagrs.export.tables import write_csv
from flagrs.export.vtkhdf import write_vtkhdf

if TYPE_CHECKING:
    from flagrs.trajectory import Trajectory


@dataclass(frozen=True)
class Format:
    """A format: the ending of its files, what it is, and what writes a run and returns the files."""

    suffix: str
    what: str
    write: Callable[[Trajectory, Path], list[Path]]


FORMATS = {
    "vtkhdf": Format(".vtkhdf", "poly data over time, for ParaView", write_vtkhdf),
    "xarray": Format(".nc", "NetCDF, for xarray", write_netcdf),
    "npz": Format(".npz", "NumPy's archive of arrays", write_npz),
    "csv": Format(".csv", "two tables, of frames and of nodes", write_csv),
}


def export(trajectory: Trajectory, to: str, path: str | Path) -> list[Path]:
    """Write a run for other programs, replacing what is there, and return the files written.

    Parameters
    ----------
    trajectory
        The run.
    to
        ``vtkhdf``, ``xarray`` (NetCDF), ``npz`` or ``csv``.
    path
        The file.

    Raises
    ------
    SceneError
        For another format.
    FlagrsError
        If there are no frames, or a package is missing.
    FileError
        If a file cannot be written; an `OSError`.
    """
    if to not in FORMATS:
        raise not_allowed("to", to, ", ".join(FORMATS))
    if not len(trajectory):
        raise FlagrsError("the trajectory has no frames to export")
    try:
        return FORMATS[to].write(trajectory, Path(path))
    except FlagrsError:
        raise
    except OSError as error:
        raise file_error(path, error, "cannot be written") from None
