"""Clamps: nodes and edge angles of a rod that are held, or move as prescribed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

import numpy.typing as npt
from pydantic import Field, PlainValidator, model_validator

from flagrs.errors import SceneError, faulty
from flagrs.scene.part import Part
from flagrs.scene.signal import CheckedSignal, Signal
from flagrs.scene.values import Array, Bounds, FloatArray, Index, Indices, IntArray, direction, origin
from flagrs.scene.vector_signal import CheckedVectorSignal, VectorInput, VectorSignal, is_zero


class Rotation(Part):
    """A rigid turn about an axis fixed in space.

    Attributes
    ----------
    axis : ndarray
        Direction (3,) of the axis; the turn is right-handed about it.
    rate : float, Table or function of time
        Angular velocity about the axis [rad/s].
    angle : float, Table or function of time
        Angle about the axis, on top of the turn that `rate` gives [rad]; only its changes count.
    center : ndarray
        A point (3,) of the axis at time zero [m]; it moves along with the clamp.
    """

    if TYPE_CHECKING:
        # What the constructor takes, which is more than the fields hold.
        def __init__(
            self,
            *,
            axis: npt.ArrayLike,
            rate: Signal = 0.0,
            angle: Signal = 0.0,
            center: npt.ArrayLike = ...,
        ) -> None: ...

    axis: Annotated[FloatArray, PlainValidator(direction)]
    rate: CheckedSignal = 0.0
    angle: CheckedSignal = 0.0
    center: Annotated[FloatArray, PlainValidator(Array(((3,),), Bounds("m")))] = Field(default_factory=origin)


class Clamp(Part):
    """Nodes and edge angles of a rod that are held, moved, or turned like a rigid body.

    Attributes
    ----------
    rod : int
        Index of the rod in the scene.
    nodes : tuple of int
        Clamped nodes of the rod.
    edges : tuple of int
        Edges of the rod whose angle is clamped.
    axes : str
        Coordinates of the nodes that are held, some of ``xyz``: ``xyz`` clamps (without edges: pins) them,
        ``yz`` lets them slide along x, ``z`` lets them slide in the plane of x and y.
    angular_velocity : float, Table, TimeFunction or function of time
        Angular velocity of the clamped edges about their tangent, right-handed [rad/s].
    velocity : vector, Table of vectors, or function of time
        Velocity (3,) of the clamped nodes [m/s].
    displacement : vector, Table of vectors, or function of time
        Displacement (3,) of the clamped nodes, on top of what `velocity` gives [m]; only its changes count.
    rotation : Rotation or None
        Rigid turn of the clamped nodes, and of the frames of those clamped edges that have both nodes in the
        clamp.

    Examples
    --------
    >>> import math
    >>> shaken = Clamp(nodes=(0, 1), edges=(0,), displacement=lambda t: (0.0, 1e-3 * math.sin(t), 0.0))
    """

    if TYPE_CHECKING:
        # What the constructor takes, which is more than the fields hold.
        def __init__(
            self,
            *,
            rod: int = 0,
            nodes: Sequence[int] | IntArray = (),
            edges: Sequence[int] | IntArray = (),
            axes: Literal["xyz", "xy", "xz", "yz", "x", "y", "z"] = "xyz",
            angular_velocity: Signal = 0.0,
            velocity: VectorInput = ...,
            displacement: VectorInput = ...,
            rotation: Rotation | None = None,
        ) -> None: ...

    rod: Index = 0
    nodes: Indices = ()
    edges: Indices = ()
    axes: Literal["xyz", "xy", "xz", "yz", "x", "y", "z"] = "xyz"
    angular_velocity: CheckedSignal = 0.0
    velocity: CheckedVectorSignal = Field(default_factory=origin)
    displacement: CheckedVectorSignal = Field(default_factory=origin)
    rotation: Rotation | None = None

    @model_validator(mode="after")
    def _check(self) -> Clamp:
        if not self.nodes and not self.edges:
            raise SceneError(
                "nodes: a clamp without nodes and without edges holds nothing",
                field="nodes",
                value=(),
                allowed="at least one node or edge",
            )
        if not self.edges and self.angular_velocity != 0.0:
            raise SceneError(
                "angular_velocity: given, but the clamp names no edges to turn",
                field="angular_velocity",
                value=self.angular_velocity,
                allowed="0 without edges",
            )
        for name in ("velocity", "displacement"):
            if not self.nodes and not is_zero(getattr(self, name)):
                raise faulty(name, "given, but the clamp names no nodes to move", "0 without nodes")
        if self.rotation is not None and (not self.nodes or self.axes != "xyz"):
            raise faulty("rotation", "given, but the nodes are not held in all directions", "None")
        return self

    def motion(self) -> tuple[VectorSignal, VectorSignal, Rotation | None]:
        """Return what moves the nodes: velocity, displacement, rotation."""
        return self.velocity, self.displacement, self.rotation

    def turning_signals(self) -> list[Signal]:
        """Return the angular velocities that turn edges or nodes [rad/s]."""
        rates: list[Signal] = [self.angular_velocity] if self.edges else []
        return rates if self.rotation is None else [*rates, self.rotation.rate]
