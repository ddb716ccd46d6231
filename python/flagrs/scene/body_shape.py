"""Shapes of rigid bodies, each about its own centre."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import PlainValidator, model_validator

from flagrs import _flagrs
from flagrs.errors import not_allowed
from flagrs.scene.part import Part
from flagrs.scene.values import Array, Bounds, FloatArray, number

_LENGTH = Bounds("m", above=0.0)

#: Semi-axes whose ratio is larger are those of discs and needles, which no set of sources inside resolves.
_MOST_ASPECT = 20.0


class Sphere(Part):
    """A sphere.

    Attributes
    ----------
    radius : float
        Its radius [m].
    """

    radius: Annotated[float, number(_LENGTH)]

    def native_surface(self, accuracy: float) -> _flagrs.BodySurface:
        """Return its surface as the core fits it."""
        return _flagrs.BodySurface.ellipsoid([self.radius] * 3, accuracy)


class Ellipsoid(Part):
    """An ellipsoid along x, y and z.

    Attributes
    ----------
    semi_axes : ndarray
        Half its length along x, y and z (3,) [m]; the longest at most 20 times the shortest.
    """

    semi_axes: Annotated[FloatArray, PlainValidator(Array(((3,),), _LENGTH))]

    @model_validator(mode="after")
    def _check(self) -> Self:
        aspect = float(self.semi_axes.max() / self.semi_axes.min())
        if aspect > _MOST_ASPECT:
            raise not_allowed("semi_axes", self.semi_axes.tolist(), f"within a factor of {_MOST_ASPECT:g}")
        return self

    def native_surface(self, accuracy: float) -> _flagrs.BodySurface:
        """Return its surface as the core fits it."""
        return _flagrs.BodySurface.ellipsoid(self.semi_axes.tolist(), accuracy)


class Capsule(Part):
    """A cylinder along z with hemispheres at its ends.

    Attributes
    ----------
    radius : float
        Radius of the cylinder and of its ends [m].
    length : float
        Length from tip to tip [m], at least twice the radius.
    """

    radius: Annotated[float, number(_LENGTH)]
    length: Annotated[float, number(_LENGTH)]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.length < 2.0 * self.radius:
            raise not_allowed("length", self.length, f"at least twice the radius, {2.0 * self.radius:g} m")
        return self

    def native_surface(self, accuracy: float) -> _flagrs.BodySurface:
        """Return its surface as the core fits it."""
        return _flagrs.BodySurface.cylinder(self.radius, self.length, self.radius, accuracy)


class Cylinder(Part):
    """A cylinder along z with rounded edges.

    Attributes
    ----------
    radius : float
        Its radius [m].
    length : float
        Length from end to end [m].
    edge_radius : float or None
        Radius of the rounding of its edges [m]: at most the radius and half the length. None: a fifth of the
        smaller of the two. The sharper the edges, the more sources they need.
    """

    radius: Annotated[float, number(_LENGTH)]
    length: Annotated[float, number(_LENGTH)]
    edge_radius: Annotated[float, number(_LENGTH)] | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.edge_radius is not None and self.edge_radius > self._largest_rounding:
            raise not_allowed("edge_radius", self.edge_radius, f"at most {self._largest_rounding:g} m")
        return self

    @property
    def _largest_rounding(self) -> float:
        return min(self.radius, 0.5 * self.length)

    @property
    def rounding(self) -> float:
        """Radius of the rounding of its edges [m]."""
        return 0.2 * self._largest_rounding if self.edge_radius is None else self.edge_radius

    def native_surface(self, accuracy: float) -> _flagrs.BodySurface:
        """Return its surface as the core fits it."""
        return _flagrs.BodySurface.cylinder(self.radius, self.length, self.rounding, accuracy)


BodyShape = Sphere | Ellipsoid | Capsule | Cylinder
