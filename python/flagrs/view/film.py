"""What the viewer shows of a run: its frames as small integers in one block of bytes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from flagrs.measures import spread
from flagrs.plot.canvas import COLOURS
from flagrs.results.gaps import EdgeGaps
from flagrs.results.paths import Path, paths_of
from flagrs.results.strain import tensions
from flagrs.scene.values import FloatArray, IntArray

if TYPE_CHECKING:
    from flagrs.trajectory import Trajectory

#: Bytes of a node and of an edge in a frame: three coordinates and two fields; a director and two fields.
NODE_BYTES, EDGE_BYTES = 8, 5
#: Largest gap that is told apart, over the radius of the thickest rod.
REACH = 4.0


@dataclass
class Film:
    """A run for the viewer.

    Attributes
    ----------
    header : dict
        What JSON can hold: names, sizes, paths, fields with units and ranges, and where arrays are.
    data : bytes
        The arrays one after the other, each from a multiple of 8 bytes.
    """

    header: dict[str, Any]
    data: bytearray = field(default_factory=bytearray)

    def add(self, array: npt.NDArray[Any]) -> dict[str, Any]:
        """Append an array and return where it is."""
        self.data += bytes(-len(self.data) % 8)
        place = {"at": len(self.data), "count": int(array.size), "type": array.dtype.str}
        self.data += np.ascontiguousarray(array).tobytes()
        return place


@dataclass(frozen=True)
class Coloured:
    """What filaments can be coloured by: values (F, N) of nodes or (F, E) of edges."""

    name: str
    label: str
    unit: str
    of: str
    values: FloatArray
    signed: bool = False


def film_of(trajectory: Trajectory, largest: int) -> Film:
    """Return the film of a trajectory, of as many evenly spaced frames as a number of bytes holds."""
    scene = trajectory.scene
    size = NODE_BYTES * scene.node_count + EDGE_BYTES * scene.edge_count
    frames = spread(len(trajectory), max(2, int(largest / size)))
    time, nodes = trajectory.time[frames], trajectory.nodes[frames]
    centre = 0.5 * (nodes.min(axis=1) + nodes.max(axis=1))
    offsets = nodes - centre[:, None]
    unit = float(np.abs(offsets).max()) / 32767.0 or 1.0
    balls = _balls(trajectory)
    low, high = nodes.min(axis=(0, 1)), nodes.max(axis=(0, 1))
    for ball in balls:
        low = np.minimum(low, nodes[:, ball["node"]].min(axis=0) - ball["radius"])
        high = np.maximum(high, nodes[:, ball["node"]].max(axis=0) + ball["radius"])
    film = Film(
        {
            "name": scene.name,
            "frames": len(frames),
            "all_frames": len(trajectory),
            "nodes": scene.node_count,
            "edges": scene.edge_count,
            "unit": unit,
            "box": [low.tolist(), high.tolist()],
            "paths": [_path(path, number) for number, path in enumerate(_coloured(paths_of(scene)))],
            "balls": balls,
            "swims": scene.head is not None or not scene.clamps,
        }
    )
    film.header["arrays"] = {
        "time": film.add(time.astype("<f8")),
        "centre": film.add(centre.astype("<f4")),
        "follow": film.add(trajectory.position()[frames].astype("<f4")),
        "nodes": film.add(np.round(offsets / unit).astype("<i2")),
        "directors": film.add(np.round(127.0 * trajectory.material_directors(frames)).astype("<i1")),
    }
    film.header["fields"] = [_field(film, field) for field in _fields(trajectory, frames)]
    return film


def _coloured(paths: list[Path]) -> list[Path]:
    """Return the paths with the immersed ones first, so that colours count filaments."""
    return sorted(paths, key=lambda path: not path.immersed)


def _path(path: Path, number: int) -> dict[str, Any]:
    return {
        "nodes": path.nodes.tolist(),
        "edges": path.edges.tolist(),
        "radius": path.radius.tolist(),
        "wet": path.immersed,
        "colour": COLOURS[number % len(COLOURS)] if path.immersed else "#8a8a8a",
    }


def _balls(trajectory: Trajectory) -> list[dict[str, Any]]:
    """Return the head, and marks at motors and clamped nodes, as balls at nodes."""
    scene = trajectory.scene
    found: list[dict[str, Any]] = []
    thickest = [float(rod.radius_array().max()) for rod in scene.rods]
    for motor in scene.motors:
        node = scene.node_offset(motor.rod) + motor.node
        found.append({"kind": "motor", "node": node, "radius": 1.6 * thickest[motor.rod]})
    for clamp in scene.clamps:
        for node in clamp.nodes:
            number = scene.node_offset(clamp.rod) + node
            found.append({"kind": "clamp", "node": number, "radius": 1.35 * thickest[clamp.rod]})
    if scene.head is not None:
        node = scene.node_offset(scene.head.rod) + scene.head.node
        found.append({"kind": "head", "node": node, "radius": scene.head.radius})
    return found


def _fields(trajectory: Trajectory, frames: IntArray) -> list[Coloured]:
    """Return what filaments can be coloured by."""
    scene, nodes = trajectory.scene, trajectory.nodes[frames]
    speed = np.linalg.norm(trajectory.velocities[frames], axis=2)
    density = np.linalg.norm(trajectory.force_density[frames], axis=2)
    found = [Coloured("speed", "speed", "m/s", "nodes", speed)]
    if density.any():
        found.append(Coloured("force", "force on the fluid per length", "N/m", "nodes", density))
    found.append(Coloured("tension", "tension", "N", "edges", tensions(scene, nodes), signed=True))
    reach = REACH * max(float(rod.radius_array().max()) for rod in scene.rods)
    gaps = EdgeGaps(scene, reach)
    near = np.stack([gaps.at(shape) for shape in nodes])
    if (near < reach).any():
        found.append(Coloured("contact", "gap to the nearest filament", "m", "edges", np.maximum(near, 0.0)))
    return found


def _field(film: Film, field: Coloured) -> dict[str, Any]:
    """Return the entry of a field, scaled to bytes between its extremes, which outliers do not set."""
    sizes = np.abs(field.values)
    top = float(np.quantile(sizes, 0.998)) or float(sizes.max()) or 1.0
    low = -top if field.signed else 0.0
    scaled = np.clip((field.values - low) / (top - low), 0.0, 1.0)
    return {
        "name": field.name,
        "label": field.label,
        "unit": field.unit,
        "of": field.of,
        "signed": field.signed,
        "low": low,
        "high": top,
        "array": film.add(np.round(255.0 * scaled).astype("<u1")),
    }
