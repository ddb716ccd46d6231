"""Constant forces on nodes."""

from __future__ import annotations

from typing import Annotated

from pydantic import PlainValidator

from flagrs.scene.part import Part
from flagrs.scene.values import Array, Bounds, FloatArray, Index


class PointLoad(Part):
    """A constant force on one node.

    Attributes
    ----------
    node : int
        Node of the rod that is loaded.
    force : ndarray
        Force (3,) [N].
    rod : int
        Index of the rod in the scene.
    """

    node: Index
    force: Annotated[FloatArray, PlainValidator(Array(((3,),), Bounds("N")))]
    rod: Index = 0
