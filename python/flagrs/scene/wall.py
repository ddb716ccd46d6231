"""Plane walls and free surfaces."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, PlainValidator

from flagrs.scene.part import Part
from flagrs.scene.values import Array, Bounds, FloatArray, direction, origin, read_only


def _upwards() -> FloatArray:
    return read_only(np.array([0.0, 0.0, 1.0]))


class Wall(Part):
    """A plane that bounds the fluid; everything is on the side its normal points to.

    The flow of regularized Stokeslets satisfies the condition on the wall exactly, by images
    (docs/theory/walls.md); a scene may have one such wall, and any number that only contact knows. With
    `Contact` (method ``barrier``), rods and the head as a sphere cannot pass through any of them, and slide
    on them with friction.

    Attributes
    ----------
    point : ndarray
        A point (3,) of the plane [m].
    normal : ndarray
        Normal (3,), into the fluid; made a unit vector.
    kind : str
        ``no_slip``: the fluid is at rest on it; ``free_surface``: flat, without shear, and nothing crosses
        it; ``contact``: the fluid does not feel it, only contact does.

    Examples
    --------
    >>> floor = Wall(point=(0.0, 0.0, -0.1))
    >>> floor.heights([[0.0, 0.0, 0.0]]).tolist()
    [0.1]
    """

    point: Annotated[FloatArray, PlainValidator(Array(((3,),), Bounds("m")))] = Field(default_factory=origin)
    normal: Annotated[FloatArray, PlainValidator(direction)] = Field(default_factory=_upwards)
    kind: Literal["no_slip", "free_surface", "contact"] = "no_slip"

    @property
    def in_flow(self) -> bool:
        """Whether the fluid feels it."""
        return self.kind != "contact"

    def heights(self, points: Any) -> FloatArray:
        """Return the heights (N,) of points (N, 3) above the plane [m]; negative behind it."""
        heights: FloatArray = (np.asarray(points, dtype=np.float64) - self.point) @ self.normal
        return heights

    def native(self) -> dict[str, Any]:
        """Return the mapping that the native module takes."""
        return {"point": self.point.tolist(), "normal": self.normal.tolist(), "kind": self.kind}
