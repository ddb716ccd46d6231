"""Runs for ParaView and VTK: a VTKHDF file of poly data over time, written with h5py alone."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from flagrs.results.paths import paths_of
from flagrs.results.strain import tensions
from flagrs.scene import Scene
from flagrs.scene.values import FloatArray, IntArray

if TYPE_CHECKING:
    from flagrs.trajectory import Trajectory

#: Frames written at once; rows and columns of the sphere that stands for a head.
BLOCK, ROWS, COLUMNS = 64, 12, 20
#: What a cell is, in the array ``part``.
IMMERSED, DRY, HEAD = 0, 1, 2
#: The kinds of cells that poly data have, in the order in which VTK counts them.
_KINDS = ("Vertices", "Lines", "Polygons", "Strips")


def write_vtkhdf(trajectory: Trajectory, path: Path) -> list[Path]:
    """Write a run as VTKHDF, version 2.0: temporal poly data.

    Filaments are lines with ``radius``, so that a tube filter shows them as they are, and ``velocity``,
    ``force_density``, ``tension`` and ``director`` at their points; a head is a sphere of polygons. Cells
    have ``rod`` and ``part``: 0 immersed, 1 dry, 2 head. Topology is written once, frames in blocks.

    Notes
    -----
    The format is described at docs.vtk.org, "VTKHDF format specification".
    """
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 0], dtype=np.int64)
        root.attrs.create("Type", b"PolyData", dtype="S8")
        points = _write_topology(root, trajectory.scene)
        _write_steps(root, trajectory, points)
        _write_frames(root, trajectory, points)
    return [path]


def _write_topology(root: h5py.Group, scene: Scene) -> int:
    """Write the cells, which are the same at all times, and return the number of points."""
    paths = paths_of(scene)
    head = scene.head is not None
    cells: dict[str, list[IntArray]] = {kind: [] for kind in _KINDS}
    cells["Lines"] = [path.nodes for path in paths]
    cells["Polygons"] = _sphere_faces(scene.node_count) if head else []
    for kind, members in cells.items():
        group = root.create_group(kind)
        sizes = np.array([len(member) for member in members], dtype=np.int64)
        ids = np.concatenate(members) if members else np.zeros(0, dtype=np.int64)
        group["NumberOfCells"] = np.array([len(members)], dtype=np.int64)
        group["NumberOfConnectivityIds"] = np.array([len(ids)], dtype=np.int64)
        group["Connectivity"] = ids.astype(np.int64)
        group["Offsets"] = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    faces = len(cells["Polygons"])
    rods = [path.rod for path in paths] + [scene.head.rod if scene.head else 0] * faces
    parts = [IMMERSED if path.immersed else DRY for path in paths] + [HEAD] * faces
    root["CellData/rod"], root["CellData/part"] = np.array(rods), np.array(parts)
    points = scene.node_count + (_sphere().shape[0] if head else 0)
    root["NumberOfPoints"] = np.array([points], dtype=np.int64)
    return points


def _write_steps(root: h5py.Group, trajectory: Trajectory, points: int) -> None:
    """Write the times, and where the values of each are."""
    count = len(trajectory)
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(count)
    steps["Values"] = np.asarray(trajectory.time)
    none = np.zeros(count, dtype=np.int64)
    steps["PartOffsets"], steps["NumberOfParts"] = none, none + 1
    steps["PointOffsets"] = np.arange(count, dtype=np.int64) * points
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((count, len(_KINDS)), dtype=np.int64)
    for name in ("rod", "part"):
        steps[f"CellDataOffsets/{name}"] = none
    for name in ("velocity", "force_density", "tension", "director"):
        steps[f"PointDataOffsets/{name}"] = steps["PointOffsets"][()]
    steps["PointDataOffsets/radius"] = none


def _write_frames(root: h5py.Group, trajectory: Trajectory, points: int) -> None:
    scene, count = trajectory.scene, len(trajectory)
    nodes = scene.node_count
    data = root.create_group("PointData")
    # Compressed mildly: a head's points have no values of their own.
    filters: dict[str, Any] = {"dtype": np.float32, "compression": "gzip", "compression_opts": 1}
    placed = root.create_dataset("Points", (count * points, 3), dtype=np.float64, chunks=(points, 3))
    vectors = {
        name: data.create_dataset(name, (count * points, 3), chunks=(points, 3), **filters)
        for name in ("velocity", "force_density", "director")
    }
    pulled = data.create_dataset("tension", (count * points,), chunks=(points,), **filters)
    directors = trajectory.each_director()
    share = _EdgesAtNodes(trajectory.edges, nodes)
    radius = np.zeros(points)
    radius[:nodes] = share.mean(trajectory.radius)
    data["radius"] = radius
    for start in range(0, count, BLOCK):
        frames = np.arange(start, min(start + BLOCK, count))
        shape = np.asarray(trajectory.nodes[frames])
        rows = slice(start * points, (start + len(frames)) * points)
        full = np.zeros((len(frames), points, 3))
        full[:, :nodes] = shape
        if scene.head is not None:
            middle = trajectory.position()[frames]
            full[:, nodes:] = middle[:, None] + scene.head.radius * _sphere()
        placed[rows] = full.reshape(-1, 3)
        values = {
            "velocity": np.asarray(trajectory.velocities[frames]),
            "force_density": np.asarray(trajectory.force_density[frames]),
            "director": np.stack([share.mean(one) for one in islice(directors, len(frames))]),
        }
        for name, value in values.items():
            full[:, :nodes], full[:, nodes:] = value, 0.0
            vectors[name][rows] = full.reshape(-1, 3)
        tension = np.zeros((len(frames), points))
        tension[:, :nodes] = np.stack([share.mean(one) for one in tensions(scene, shape)])
        pulled[rows] = tension.ravel()


class _EdgesAtNodes:
    """Means over the edges that meet at each node."""

    def __init__(self, edges: IntArray, count: int) -> None:
        self._ends, self._count = edges.ravel(), count
        self._meeting = np.maximum(np.bincount(self._ends, minlength=count), 1)

    def mean(self, values: FloatArray) -> FloatArray:
        """Return the mean (N, ...) at every node of values (E, ...) of the edges."""
        total = np.zeros((self._count, *values.shape[1:]))
        np.add.at(total, self._ends, np.repeat(values, 2, axis=0))
        mean: FloatArray = total / self._meeting.reshape(-1, *([1] * (values.ndim - 1)))
        return mean


def _sphere() -> FloatArray:
    """Return points of a unit sphere: a pole, rings, a pole."""
    polar = np.pi * np.arange(1, ROWS) / ROWS
    around = 2.0 * np.pi * np.arange(COLUMNS) / COLUMNS
    rings = np.stack(
        [
            np.outer(np.sin(polar), np.cos(around)),
            np.outer(np.sin(polar), np.sin(around)),
            np.outer(np.cos(polar), np.ones(COLUMNS)),
        ],
        axis=2,
    )
    return np.concatenate([[[0.0, 0.0, 1.0]], rings.reshape(-1, 3), [[0.0, 0.0, -1.0]]])


def _sphere_faces(first: int) -> list[IntArray]:
    """Return the polygons of the sphere, outwards, with its points numbered from `first`."""
    last = first + 1 + (ROWS - 1) * COLUMNS
    faces: list[Any] = []
    for k in range(COLUMNS):
        after = (k + 1) % COLUMNS
        faces.append([first, first + 1 + k, first + 1 + after])
        for row in range(ROWS - 2):
            above, below = first + 1 + row * COLUMNS, first + 1 + (row + 1) * COLUMNS
            faces.append([above + k, below + k, below + after, above + after])
        lowest = first + 1 + (ROWS - 2) * COLUMNS
        faces.append([lowest + k, last, lowest + after])
    return [np.array(face, dtype=np.int64) for face in faces]
