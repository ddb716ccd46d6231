"""Loads: forces and torques on a rod, that follow time and may turn with the rod."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, model_validator

from flagrs.errors import SceneError, faulty
from flagrs.scene.part import Part
from flagrs.scene.values import Index, Indices, IntArray, origin
from flagrs.scene.vector_signal import CheckedVectorSignal, VectorInput, is_zero

Frame = Literal["laboratory", "material"]


class PointLoad(Part):
    """A force on a node, or a torque on an edge.

    Attributes
    ----------
    node : int or None
        Node of the rod on which the force acts.
    force : vector, Table of vectors, or function of time
        Force (3,) [N].
    edge : int or None
        Edge of the rod on which the torque acts, and whose material frame counts for
        ``frame="material"``; None: the edge at the node, if there is just one.
    torque : vector, Table of vectors, or function of time
        Torque (3,) [N m].
    frame : str
        Which axes the components refer to: ``laboratory``, or ``material`` for ``m1, m2, t`` of the edge, so
        that the load turns with the rod (a follower load).
    rod : int
        Index of the rod in the scene.

    Examples
    --------
    >>> push = PointLoad(node=4, force=(0.0, 0.0, 1e-3))
    >>> follower = PointLoad(node=4, force=(0.0, 0.0, -1e-3), frame="material")
    """

    if TYPE_CHECKING:
        # What the constructor takes, which is more than the fields hold.
        def __init__(
            self,
            *,
            node: int | None = None,
            force: VectorInput = ...,
            edge: int | None = None,
            torque: VectorInput = ...,
            frame: Frame = "laboratory",
            rod: int = 0,
        ) -> None: ...

    node: Index | None = None
    force: CheckedVectorSignal = Field(default_factory=origin)
    edge: Index | None = None
    torque: CheckedVectorSignal = Field(default_factory=origin)
    frame: Frame = "laboratory"
    rod: Index = 0

    @property
    def acting(self) -> tuple[str, ...]:
        """Which of force and torque are in the equations: those given, or the one that it can be."""
        return _given(self) or (("torque",) if self.node is None else ("force",))

    @model_validator(mode="after")
    def _check(self) -> PointLoad:
        if self.node is None and not is_zero(self.force):
            raise faulty("node", "missing; a force acts on a node", "a node of the rod")
        if self.node is None and self.edge is None:
            raise faulty("node", "neither node nor edge given", "a node for a force, an edge for a torque")
        return self


class LineLoad(Part):
    """A force or a torque per rest length of a rod.

    Attributes
    ----------
    force : vector, Table of vectors, or function of time
        Force per length (3,) [N/m].
    torque : vector, Table of vectors, or function of time
        Torque per length (3,) [N].
    edges : sequence of int or None
        Edges of the rod; None: all.
    frame : str
        ``laboratory`` or ``material``, as for `PointLoad`.
    rod : int
        Index of the rod in the scene.
    """

    if TYPE_CHECKING:
        # What the constructor takes, which is more than the fields hold.
        def __init__(
            self,
            *,
            force: VectorInput = ...,
            torque: VectorInput = ...,
            edges: Sequence[int] | IntArray | None = None,
            frame: Frame = "laboratory",
            rod: int = 0,
        ) -> None: ...

    force: CheckedVectorSignal = Field(default_factory=origin)
    torque: CheckedVectorSignal = Field(default_factory=origin)
    edges: Indices | None = None
    frame: Frame = "laboratory"
    rod: Index = 0

    @property
    def acting(self) -> tuple[str, ...]:
        """Which of force and torque are in the equations: those given, or else the force."""
        return _given(self) or ("force",)

    @model_validator(mode="after")
    def _check(self) -> LineLoad:
        if self.edges == ():
            raise SceneError(
                "edges: a load on no edge loads nothing",
                field="edges",
                value=(),
                allowed="at least one edge, or None for all",
            )
        return self


Load = PointLoad | LineLoad


def _given(load: Load) -> tuple[str, ...]:
    return tuple(name for name in ("force", "torque") if not is_zero(getattr(load, name)))


def load_of(value: Any) -> Any:
    """Return the kind of load that a mapping describes; other values are left as they are."""
    if not isinstance(value, dict):
        return value
    return PointLoad(**value) if "node" in value or "edge" in value else LineLoad(**value)
