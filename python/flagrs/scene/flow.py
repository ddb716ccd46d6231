"""Background flows: what the fluid does where there is no filament."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, PlainValidator, model_validator

from flagrs.errors import SceneError, not_allowed
from flagrs.scene.part import Part
from flagrs.scene.signal import CheckedSignal
from flagrs.scene.values import Array, Bounds, FloatArray, number, origin, read_only
from flagrs.scene.values import direction as direction_of
from flagrs.scene.vector_signal import CheckedVectorSignal

_POINT = Annotated[FloatArray, PlainValidator(Array(((3,),), Bounds("m")))]


class LinearFlow(Part):
    """A uniform flow and a velocity gradient: ``u(x, t) = U(t) + s(t) G (x - c)``.

    Attributes
    ----------
    velocity : vector, Table of vectors, or function of time
        Velocity (3,) at the center [m/s].
    gradient : ndarray
        Velocity gradient (3, 3), ``du_i/dx_j`` [1/s]; without trace, since the fluid keeps its volume.
    strength : float, Table or function of time
        Factor on the gradient [1].
    center : ndarray
        The point (3,) where the flow is `velocity` [m].

    Examples
    --------
    >>> shear = LinearFlow.shear(rate=2.0)
    >>> shear.gradient[0].tolist()
    [0.0, 2.0, 0.0]
    """

    velocity: CheckedVectorSignal = Field(default_factory=origin)
    gradient: Annotated[FloatArray, PlainValidator(Array(((3, 3),), Bounds("1/s")))] = Field(
        default_factory=lambda: read_only(np.zeros((3, 3)))
    )
    strength: CheckedSignal = 1.0
    center: _POINT = Field(default_factory=origin)

    @model_validator(mode="after")
    def _check(self) -> LinearFlow:
        if abs(float(np.trace(self.gradient))) > 1e-9 * float(np.abs(self.gradient).max()):
            raise not_allowed("gradient", self.gradient.tolist(), "without trace: the fluid keeps its volume")
        return self

    @classmethod
    def uniform(cls, velocity: Any) -> Self:
        """Return the flow of the same velocity (3,) [m/s] everywhere."""
        return cls(velocity=velocity)

    @classmethod
    def shear(cls, rate: float, direction: Any = (1, 0, 0), across: Any = (0, 1, 0), **options: Any) -> Self:
        """Return a simple shear: velocity along `direction` that grows by `rate` [1/s] along `across`."""
        along, normal = direction_of(direction), direction_of(across)
        if abs(float(along @ normal)) > 1e-9:
            raise not_allowed("across", list(across), "perpendicular to direction")
        return cls(gradient=rate * np.outer(along, normal), **options)

    @classmethod
    def extension(
        cls, rate: float, direction: Any = (1, 0, 0), across: Any = (0, 1, 0), **options: Any
    ) -> Self:
        """Return a plane extension: stretching by `rate` [1/s] along `direction`, shrinking `across`."""
        along, normal = direction_of(direction), direction_of(across)
        if abs(float(along @ normal)) > 1e-9:
            raise not_allowed("across", list(across), "perpendicular to direction")
        return cls(gradient=rate * (np.outer(along, along) - np.outer(normal, normal)), **options)

    @classmethod
    def rotation(cls, angular_velocity: Any, **options: Any) -> Self:
        """Return a fluid that turns like a rigid body with angular velocity (3,) [rad/s] about `center`."""
        x, y, z = Array(((3,),), Bounds("rad/s"))(angular_velocity)  # type: ignore[misc]
        return cls(gradient=[[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]], **options)


class PoiseuilleFlow(Part):
    """Flow driven by pressure through a round tube, or between two plates; walls themselves are not in it.

    Attributes
    ----------
    speed : float, Table or function of time
        Speed at the middle [m/s].
    radius : float
        Radius of the tube, or half the distance of the plates [m].
    direction : ndarray
        Direction (3,) of the flow.
    normal : ndarray or None
        Normal (3,) of the plates; None: a round tube.
    center : ndarray
        A point (3,) of the axis or the middle plane [m].
    """

    speed: CheckedSignal
    radius: Annotated[float, number(Bounds("m", above=0.0))]
    direction: Annotated[FloatArray, PlainValidator(direction_of)] = Field(
        default_factory=lambda: read_only(np.array([1.0, 0.0, 0.0]))
    )
    normal: Annotated[
        FloatArray | None, PlainValidator(lambda value: None if value is None else direction_of(value))
    ] = None
    center: _POINT = Field(default_factory=origin)

    @model_validator(mode="after")
    def _check(self) -> PoiseuilleFlow:
        if self.normal is not None and abs(float(self.normal @ self.direction)) > 1e-9:
            raise not_allowed("normal", self.normal.tolist(), "perpendicular to direction")
        return self


def _function(value: Any) -> Any:
    if not callable(value):
        raise not_allowed("", value, "a function of points (M, 3) and time that returns velocities (M, 3)")
    return value if isinstance(value, CheckedFlow) else CheckedFlow(value)


@dataclass(frozen=True)
class CheckedFlow:
    """A function of points and time that gives velocities; what it returns is checked."""

    function: Callable[[FloatArray, float], Any]

    def __call__(self, points: FloatArray, time: float) -> FloatArray:
        """Return the velocities (M, 3) at points (M, 3); raise SceneError if they are none."""
        value = self.function(points, time)
        try:
            velocities = np.ascontiguousarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            velocities = np.zeros(0)
        if velocities.shape != points.shape or not np.isfinite(velocities).all():
            raise SceneError(
                f"background flow {self.function!r} at t = {time:g} s: gave shape {np.shape(value)} or "
                f"values that are not finite; must be finite velocities of shape {points.shape}",
                value=value,
                allowed="finite velocities, one row a point",
            )
        return velocities

    def __repr__(self) -> str:
        """Return the function's own."""
        return repr(self.function)


class FlowFunction(Part):
    """A flow given by a function of points and time.

    Attributes
    ----------
    function : callable
        Called with points (M, 3) [m] and a time [s]; returns velocities (M, 3) [m/s]. It is called once a
        step and attempt, for all points at once.
    reach : float
        Distance over which velocities are differenced for the vorticity [m]: small against the scale on which
        the flow changes.
    """

    function: Annotated[Callable[[FloatArray, float], FloatArray], PlainValidator(_function)]
    reach: Annotated[float, number(Bounds("m", above=0.0))]


Flow = LinearFlow | PoiseuilleFlow | FlowFunction


def flow_of(value: Any) -> Any:
    """Return the kind of flow that a mapping describes; other values are left as they are."""
    if not isinstance(value, dict):
        return value
    if "radius" in value or "speed" in value:
        return PoiseuilleFlow(**value)
    return FlowFunction(**value) if "function" in value else LinearFlow(**value)
