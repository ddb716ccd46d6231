"""A scene: rods, fluid, head, motors, clamps, loads and contact, in SI units."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
import numpy.typing as npt
from pydantic import Field, PlainValidator, field_validator, model_validator

from flagrs.errors import SceneError, combined, faulty
from flagrs.scene import codec, scene_checks
from flagrs.scene.clamp import Clamp
from flagrs.scene.contact_model import Contact
from flagrs.scene.fluid_model import Fluid
from flagrs.scene.head import Head
from flagrs.scene.load import Load, load_of
from flagrs.scene.magnetic_field import MagneticField
from flagrs.scene.motor import Motor
from flagrs.scene.part import Part
from flagrs.scene.plan import Plan, plan_of
from flagrs.scene.rod import Rod
from flagrs.scene.values import Array, Bounds, FloatArray, IntArray, origin
from flagrs.scene.wall import Wall


class Scene(Part):
    """Everything that is simulated, and nothing that depends on how.

    The parts of several rods are numbered one rod after the other: node `i` of rod `r` is node
    ``scene.node_offset(r) + i`` of the scene.

    Attributes
    ----------
    rods : sequence of Rod
        The rods, at least one.
    fluid : Fluid or None
        The fluid around them; None: vacuum.
    head : Head or None
        The robot's head.
    motors, clamps, loads : sequence of Motor, Clamp, and PointLoad or LineLoad
        What drives, holds and loads the rods. A single part may stand for a list of one.
    magnetic_field : MagneticField or None
        The field that magnetised rods are in.
    walls : sequence of Wall
        Plane walls and free surfaces, on whose side everything is; one of them may be in the flow.
    contact : Contact or None
        How touching edges are kept apart; None: they pass through each other.
    gravity : ndarray
        Gravitational acceleration (3,) [m/s^2].
    name : str
        Name for files and figures.
    """

    if TYPE_CHECKING:
        # What the constructor takes, which is more than the fields hold.
        def __init__(
            self,
            *,
            rods: Rod | Sequence[Rod],
            fluid: Fluid | None = None,
            head: Head | None = None,
            motors: Motor | Sequence[Motor] = (),
            clamps: Clamp | Sequence[Clamp] = (),
            loads: Load | Sequence[Load] = (),
            magnetic_field: MagneticField | None = None,
            walls: Wall | Sequence[Wall] = (),
            contact: Contact | None = None,
            gravity: npt.ArrayLike = ...,
            name: str = "scene",
        ) -> None: ...

    rods: tuple[Rod, ...]
    fluid: Fluid | None = None
    head: Head | None = None
    motors: tuple[Motor, ...] = ()
    clamps: tuple[Clamp, ...] = ()
    loads: tuple[Load, ...] = ()
    magnetic_field: MagneticField | None = None
    walls: tuple[Wall, ...] = ()
    contact: Contact | None = None
    gravity: Annotated[FloatArray, PlainValidator(Array(((3,),), Bounds("m/s^2")))] = Field(
        default_factory=origin
    )
    name: str = "scene"

    @field_validator("rods", "motors", "clamps", "loads", "walls", mode="before")
    @classmethod
    def _listed(cls, value: Any) -> Any:
        """Let a single part stand for a list of one."""
        return (value,) if isinstance(value, Part) else value

    @field_validator("loads", mode="before")
    @classmethod
    def _kinds_of_load(cls, value: Any) -> Any:
        """Tell point loads from line loads, so that errors speak of the right one."""
        return tuple(map(load_of, value)) if isinstance(value, list | tuple) else value

    @model_validator(mode="after")
    def _check(self) -> Scene:
        if not self.rods:
            raise faulty("rods", "a scene without rods", "at least one rod")
        found = scene_checks.problems(self)
        if found:
            raise combined(found)
        return self

    @cached_property
    def _offsets(self) -> IntArray:
        """First node, edge and hinge (R + 1, 3) of every rod in the scene, and how many there are."""
        counts = [[0, 0, 0]]
        counts += [[len(rod.nodes), len(rod.edge_array()), len(rod.hinge_array())] for rod in self.rods]
        return np.cumsum(counts, axis=0, dtype=np.int64)

    @property
    def node_count(self) -> int:
        """Number of nodes of all rods."""
        return int(self._offsets[-1, 0])

    @property
    def edge_count(self) -> int:
        """Number of edges of all rods."""
        return int(self._offsets[-1, 1])

    @property
    def hinge_count(self) -> int:
        """Number of hinges of all rods."""
        return int(self._offsets[-1, 2])

    def node_offset(self, rod: int) -> int:
        """Return the scene's number of the first node of a rod."""
        return int(self._offsets[rod, 0])

    def edge_offset(self, rod: int) -> int:
        """Return the scene's number of the first edge of a rod."""
        return int(self._offsets[rod, 1])

    def hinge_offset(self, rod: int) -> int:
        """Return the scene's number of the first hinge of a rod."""
        return int(self._offsets[rod, 2])

    def node_array(self) -> FloatArray:
        """Return the initial positions (N, 3) of all nodes [m]."""
        return np.concatenate([rod.nodes for rod in self.rods])

    def plan(self) -> Plan:
        """Return what is simulated, what is left out and what a step costs; print it to read it."""
        return plan_of(self)

    def _repr_html_(self) -> str:
        """Show it in a notebook."""
        from flagrs.notebook import scene_html  # it reads scenes, so it is above this module

        return scene_html(self)

    def digest(self) -> str:
        """Return a hash of the whole description: scenes with the same one are the same scene."""
        return hashlib.sha256(self.to_json().encode()).hexdigest()

    def to_json(self) -> str:
        """Return the scene as JSON text; numbers come back to the last bit.

        Raises
        ------
        SceneError
            If a signal is a Python function, which cannot be written: use a `Table`.
        """
        return codec.to_json(self)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Return the scene that `to_json` wrote."""
        data: dict[str, Any] = codec.from_json(text)
        return cls(**data)

    def to_toml(self, path: str | Path) -> None:
        """Write the scene as a TOML file; numbers come back to the last bit.

        Raises
        ------
        SceneError
            If a signal is a Python function, which cannot be written: use a `Table`.
        """
        from flagrs.scene import toml  # toml reads scenes, so it is above this module

        toml.write(self, Path(path))

    @classmethod
    def from_toml(cls, path: str | Path) -> Scene:
        """Return the scene described by a TOML file.

        Besides the fields of the parts, a rod may say ``shape = "helix"`` or ``"straight"`` with the
        arguments of that constructor, and a file may say ``scenario = "robot"`` with a table
        ``[parameters]``.

        Raises
        ------
        SceneError
            If the file is not TOML, or does not describe a scene.
        """
        from flagrs.scene import toml  # toml reads scenes, so it is above this module

        return toml.read(Path(path))


def check_scene(scene: object) -> None:
    """Raise SceneError unless it is a scene."""
    if not isinstance(scene, Scene):
        raise SceneError(
            f"scene: {type(scene).__name__} is not allowed; must be a flagrs.Scene",
            field="scene",
            value=scene,
            allowed="a flagrs.Scene",
        )
