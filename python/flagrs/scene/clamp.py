"""Clamps: nodes and edge angles of a rod whose motion is prescribed."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, PlainValidator, model_validator

from flagrs.errors import SceneError
from flagrs.scene.part import Part
from flagrs.scene.signal import CheckedSignal
from flagrs.scene.values import Array, Bounds, FloatArray, Index, Indices, origin


class Clamp(Part):
    """Nodes held or moved at a constant velocity, edges held or turned about their tangent.

    Attributes
    ----------
    rod : int
        Index of the rod in the scene.
    nodes : tuple of int
        Clamped nodes of the rod.
    edges : tuple of int
        Edges of the rod whose angle is clamped.
    angular_velocity : float, Table, TimeFunction or function of time
        Angular velocity of the clamped edges about their tangent, right-handed [rad/s].
    velocity : ndarray
        Velocity (3,) of the clamped nodes [m/s].
    """

    rod: Index = 0
    nodes: Indices = ()
    edges: Indices = ()
    angular_velocity: CheckedSignal = 0.0
    velocity: Annotated[FloatArray, PlainValidator(Array(((3,),), Bounds("m/s")))] = Field(
        default_factory=origin
    )

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
        if not self.nodes and self.velocity.any():
            raise SceneError(
                "velocity: given, but the clamp names no nodes to move",
                field="velocity",
                value=self.velocity,
                allowed="0 without nodes",
            )
        return self
