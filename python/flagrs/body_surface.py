"""What the fluid does to a rigid body on its own: resistance and flow, by point forces inside it."""

from __future__ import annotations

from typing import Any

import numpy as np

from flagrs.errors import not_allowed
from flagrs.scene.body_shape import BodyShape
from flagrs.scene.shapes import number
from flagrs.scene.values import Array, Bounds, FloatArray

_ACCURACY = Bounds("1", at_least=1e-6, at_most=0.1)
_VISCOSITY = Bounds("Pa s", above=0.0)


class BodySurface:
    """The surface of a rigid body as the flow sees it: point forces inside it, fitted to no slip on it.

    As many sources are taken as the accuracy needs, which is judged by the velocity that they leave on other
    points of the surface (docs/theory/bodies.md).

    Parameters
    ----------
    shape
        `flagrs.Sphere`, `flagrs.Ellipsoid`, `flagrs.Capsule` or `flagrs.Cylinder`.
    accuracy
        Largest error of the resistance, relative to itself: 1e-6 to 0.1.

    Raises
    ------
    SceneError
        For anything else as shape, an accuracy out of range, or one that the shape does not reach: sharp
        edges and slender bodies need many sources, and more than 800 are not taken.

    Examples
    --------
    >>> import flagrs, numpy as np
    >>> drag = flagrs.fluid.BodySurface(flagrs.Sphere(radius=2.0), accuracy=1e-4).resistance(viscosity=1.0)
    >>> bool(abs(drag[0, 0] / (6 * np.pi * 2.0) - 1) < 1e-4)
    True
    """

    def __init__(self, shape: BodyShape, accuracy: float = 1e-3) -> None:
        if not isinstance(shape, BodyShape):
            raise not_allowed("shape", shape, "a Sphere, Ellipsoid, Capsule or Cylinder")
        self._shape = shape
        self._native = shape.native_surface(number("accuracy", accuracy, _ACCURACY))

    @property
    def shape(self) -> BodyShape:
        """The shape."""
        return self._shape

    @property
    def sources(self) -> FloatArray:
        """Positions (S, 3) of the point forces, about the centre of the shape [m]."""
        return self._native.sources

    @property
    def points(self) -> FloatArray:
        """Positions (P, 3) of the points of the surface that they are fitted to [m]."""
        return self._native.points

    @property
    def error(self) -> float:
        """Estimated error of the resistance, relative to itself."""
        return self._native.error

    @property
    def slip(self) -> float:
        """Velocity left on the surface over its own: the root mean square, of the worst rigid motion."""
        return self._native.slip

    def resistance(self, viscosity: float) -> FloatArray:
        """Return the resistance (6, 6) about the centre of the shape.

        Rows are the force [N] and torque [N m] of the body on the fluid, columns its velocity [m/s] and
        angular velocity [rad/s]. The viscosity is in Pa s.
        """
        return self._native.resistance(number("viscosity", viscosity, _VISCOSITY))

    def flow(self, points: Any, motion: Any, viscosity: float = 1.0) -> FloatArray:
        """Return the velocity (M, 3) [m/s] of the fluid at points outside the body, which moves.

        Parameters
        ----------
        points
            Where (M, 3), about the centre of the shape [m].
        motion
            Velocity and angular velocity (6,) of the body [m/s, rad/s].
        viscosity
            Dynamic viscosity [Pa s]; the flow does not depend on it.
        """
        at = np.asarray(Array((("M", 3),), Bounds("m"))(points))
        moved = np.asarray(Array(((6,),), Bounds("m/s, rad/s"))(motion))
        mu = number("viscosity", viscosity, _VISCOSITY)
        forces = self._native.forces(moved.tolist(), mu)
        apart = at[:, None, :] - self.sources[None, :, :]
        distance = np.linalg.norm(apart, axis=2)[..., None]
        along = (apart * forces).sum(axis=2)[..., None]
        flow: FloatArray = (forces / distance + apart * along / distance**3).sum(axis=1) / (8.0 * np.pi * mu)
        return flow
