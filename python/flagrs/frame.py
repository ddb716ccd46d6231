"""What is known at one instant of a run: the fields of a frame, their shapes and units, and their check."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flagrs.budget import WIDTH
from flagrs.errors import FlagrsError
from flagrs.scene import Scene
from flagrs.scene.values import FloatArray


@dataclass(frozen=True)
class Field:
    """Shape (N nodes, E edges, M motors, C clamps), unit and meaning of one array of a frame."""

    shape: tuple[str | int, ...]
    unit: str
    meaning: str


FIELDS: dict[str, Field] = {
    "time": Field((), "s", "time since the start"),
    "nodes": Field(("N", 3), "m", "positions of the nodes"),
    "theta": Field(("E",), "rad", "angles of the material frames"),
    "velocities": Field(("N", 3), "m/s", "velocities of the nodes"),
    "force_density": Field(
        ("N", 3), "N/m", "force on the fluid per length at the nodes, 0 where not immersed"
    ),
    "motor_angle": Field(("M",), "rad", "angles of the shafts relative to their housings"),
    "motor_speed": Field(("M",), "rad/s", "angular velocities of the shafts relative to their housings"),
    "motor_torque": Field(("M",), "N m", "torques on the shafts"),
    "clamp_force": Field(("C", 3), "N", "forces of the clamps on what they hold"),
    "clamp_torque": Field(("C", 3), "N m", "torques of the clamps about their first nodes"),
    "clamp_power": Field(("C",), "W", "powers that the clamps spend"),
    "minimum_gap": Field((), "m", "smallest surface-to-surface distance, infinite without pairs"),
    "contacts": Field((), "1", "number of touching pairs of edges"),
    "account": Field((WIDTH,), "1", "energies, balances and extremes so far, as flagrs.budget reads them"),
    "energy": Field((3,), "J", "stretching, bending and twisting energy"),
}


#: Fields that files of before have not; they are read as NaN.
ADDED = ("clamp_force", "clamp_torque", "clamp_power")


def shapes_of(scene: Scene) -> dict[str, tuple[int, ...]]:
    """Return the shape of every field for a scene."""
    sizes = {"N": scene.node_count, "E": scene.edge_count, "M": len(scene.motors), "C": len(scene.clamps)}
    return {
        name: tuple(sizes[size] if isinstance(size, str) else size for size in field.shape)
        for name, field in FIELDS.items()
    }


def checked(frame: Mapping[str, Any], shapes: Mapping[str, tuple[int, ...]]) -> dict[str, FloatArray]:
    """Return a copy of a frame as float64 arrays.

    Raises
    ------
    FlagrsError
        If a field is missing, unknown, of the wrong shape or not finite; only `minimum_gap` may be infinite.
    """
    if frame.keys() != shapes.keys():
        odd = ", ".join(sorted(frame.keys() ^ shapes.keys()))
        raise FlagrsError(f"frame: missing or unknown fields: {odd}")
    arrays = {name: np.array(frame[name], dtype=np.float64) for name in shapes}
    for name, array in arrays.items():
        if array.shape != shapes[name]:
            raise FlagrsError(f"frame: {name} has shape {array.shape}, must be {shapes[name]}")
        finite = np.isfinite(array) | ((array == np.inf) if name == "minimum_gap" else False)
        if not finite.all():
            worst = tuple(int(i) for i in np.unravel_index(int(np.argmin(finite)), array.shape))
            where = f"{name}{list(worst)}" if worst else name
            time = float(arrays["time"])
            raise FlagrsError(
                f"frame at t = {time:g} s: {where} is {array[worst]}; only finite frames are recorded"
            )
    return arrays
