"""Runs as labelled arrays: an xarray Dataset, NetCDF, pandas, and NumPy's own file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flagrs.errors import FlagrsError
from flagrs.export.tables import frame_columns, node_columns, rods_of_nodes
from flagrs.frame import FIELDS

if TYPE_CHECKING:
    import pandas
    import xarray

    from flagrs.trajectory import Trajectory

#: Dimensions of the fields of a frame after time, by their sizes in `flagrs.frame.FIELDS`.
_DIMENSIONS = {"N": "node", "E": "edge", "M": "motor", "C": "clamp", 3: "axis"}
#: Fields that go by other names or dimensions, or are of use to flagrs alone.
_OWN = ("time", "account", "energy")


def to_xarray(trajectory: Trajectory) -> xarray.Dataset:
    """Return a run as a Dataset, with units as attributes and the scene as JSON.

    Dimensions are ``time``, ``node``, ``edge``, ``motor``, ``clamp``, ``axis`` (x, y, z) and ``energy_part``;
    coordinates say the rod of each node, and ``edges`` and ``radius`` the nodes and radius of each edge.

    Raises
    ------
    FlagrsError
        If xarray is not installed.
    """
    try:
        import xarray
    except ImportError:
        raise FlagrsError("this needs xarray: pip install 'flagrs[xarray]'") from None
    variables: dict[str, Any] = {}
    for name, field in FIELDS.items():
        if name in _OWN:
            continue
        dimensions = ("time", *(_DIMENSIONS.get(size, str(size)) for size in field.shape))
        values = _field(trajectory, name)
        variables[name] = (dimensions, values, {"units": field.unit, "long_name": field.meaning})
    parts = ["stretching", "bending", "twisting"]
    variables["energy"] = (("time", "energy_part"), np.asarray(trajectory.energy), {"units": "J"})
    variables["edges"] = (("edge", "end"), trajectory.edges, {"long_name": "start and end node of each edge"})
    variables["radius"] = (("edge",), trajectory.radius, {"units": "m", "long_name": "radius of each edge"})
    defect = trajectory.energy_budget().relative_defect
    variables["energy_defect"] = (("time",), defect, {"units": "1", "long_name": "energy the steps lost"})
    coordinates = {
        "time": ("time", np.asarray(trajectory.time), {"units": "s", "long_name": "simulated time"}),
        "axis": ("axis", list("xyz")),
        "energy_part": ("energy_part", parts),
        "rod": ("node", rods_of_nodes(trajectory)),
    }
    return xarray.Dataset(variables, coords=coordinates, attrs=_manifest(trajectory))


def to_pandas(trajectory: Trajectory, of: str = "frames") -> pandas.DataFrame:
    """Return a run as a table with units in the names of its columns.

    Parameters
    ----------
    trajectory
        The run.
    of
        ``frames``: a row for each frame, indexed by time; ``nodes``: for each node in each frame.

    Raises
    ------
    FlagrsError
        If pandas is not installed, or for another table.
    """
    try:
        import pandas
    except ImportError:
        raise FlagrsError("this needs pandas: pip install 'flagrs[xarray]'") from None
    if of == "frames":
        return pandas.DataFrame(frame_columns(trajectory)).set_index("time [s]")
    if of == "nodes":
        return pandas.DataFrame(node_columns(trajectory)).set_index(["time [s]", "rod", "node"])
    raise FlagrsError(f"of: {of!r} is not allowed; must be 'frames' or 'nodes'")


def write_netcdf(trajectory: Trajectory, path: Path) -> list[Path]:
    """Write the Dataset of a run as NetCDF."""
    try:
        to_xarray(trajectory).to_netcdf(path, engine="h5netcdf")
    except ModuleNotFoundError:
        raise FlagrsError("this needs h5netcdf: pip install 'flagrs[xarray]'") from None
    return [path]


def write_npz(trajectory: Trajectory, path: Path) -> list[Path]:
    """Write the arrays of a run as NumPy's compressed archive, the scene as JSON among them."""
    arrays = {name: _field(trajectory, name) for name in FIELDS if name != "account"}
    manifest = {name: np.array(text) for name, text in _manifest(trajectory).items()}
    with path.open("wb") as file:
        everything: Any = {"edges": trajectory.edges, "radius": trajectory.radius, **arrays, **manifest}
        np.savez_compressed(file, **everything)
    return [path]


def _field(trajectory: Trajectory, name: str) -> Any:
    method = name == "minimum_gap"
    return np.asarray(trajectory.minimum_gap() if method else getattr(trajectory, name))


def _manifest(trajectory: Trajectory) -> dict[str, str]:
    """Return what tells where a run comes from, as texts."""
    manifest = trajectory.manifest
    return {**manifest, "settings": json.dumps(trajectory.settings), "name": trajectory.scene.name}
