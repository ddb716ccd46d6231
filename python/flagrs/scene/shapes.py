"""Positions of the nodes of straight and helical rods."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from flagrs.errors import SceneError, not_allowed
from flagrs.scene.values import Array, Bounds, FloatArray

Handedness = Literal["left", "right"]
Vector = Sequence[float] | npt.NDArray[np.float64]

_vector = Array(((3,),), Bounds("m"))


#: More edges than any rod has, below what would exhaust memory before it is looked at.
MOST_EDGES = 10_000_000


def vector(field: str, value: Vector) -> FloatArray:
    """Return a (3,) array of finite numbers; raise SceneError naming the field otherwise."""
    return np.asarray(_named(field, _vector, value))


def length(field: str, value: float) -> float:
    """Return a positive finite length [m]; raise SceneError naming the field otherwise."""
    return number(field, value, Bounds("m", above=0.0))


def number(field: str, value: float, bounds: Bounds) -> float:
    """Return a finite number within bounds; raise SceneError naming the field otherwise."""
    return float(_named(field, Array(((),), bounds), value))


def whole(field: str, value: object, least: int = 1) -> int:
    """Return an integer of at least `least`; raise SceneError naming the field otherwise."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise not_allowed(field, value, f"an integer >= {least}")
    return int(value)


def _named(field: str, check: Array, value: Vector | float) -> float | FloatArray:
    try:
        return check(value)
    except SceneError as error:
        raise error.within(field) from None


def checked_count(value: object) -> int:
    """Return a number of edges; raise SceneError for one that is no count or larger than any computation."""
    count = whole("edge_count", value)
    if count > MOST_EDGES:
        raise not_allowed("edge_count", value, f"at most {MOST_EDGES}")
    return count


def edge_count(contour: float, edge_length: float) -> int:
    """Return how many edges of at least `edge_length` fit into a contour, both in metres.

    The quotient is rounded down, as in Lim et al.; 1e-9 of slack keeps 0.3 m / 0.1 m at 3.
    """
    edge_length = length("edge_length", edge_length)
    ratio = contour / edge_length * (1.0 + 1e-9)
    if ratio >= MOST_EDGES:
        raise not_allowed("edge_length", edge_length, f"such that there are at most {MOST_EDGES} edges")
    count = math.floor(ratio)
    if count < 1:
        raise not_allowed(
            "edge_length", edge_length, f"at most the contour length, {contour:g} m", "given in mm?"
        )
    return count


def straight_nodes(total: float, count: int, start: Vector, direction: Vector) -> FloatArray:
    """Return the nodes (count + 1, 3) of a straight line of equal edges [m]."""
    along = np.linspace(0.0, total, count + 1)
    return vector("start", start) + along[:, None] * frame(direction)[0]


@dataclass(frozen=True)
class Helix:
    """The size of a helix [m]: radius of its centreline, advance per turn, and total advance."""

    radius: float
    pitch: float
    axial_length: float

    @property
    def contour(self) -> float:
        """Arc length [m]."""
        return self.axial_length / self.pitch * math.hypot(2.0 * math.pi * self.radius, self.pitch)


def helix_nodes(
    helix: Helix,
    count: int,
    handedness: Handedness,
    *,
    point: Vector = (0.0, 0.0, 0.0),
    direction: Vector = (1.0, 0.0, 0.0),
    phase: float = 0.0,
) -> FloatArray:
    """Return the nodes of a helix, equally spaced along it.

    Parameters
    ----------
    helix
        Size of the helix.
    count
        Number of edges; the last node is at the axial length.
    handedness
        ``right``: turning counter-clockwise, seen against the direction of the axis, while advancing along
        it.
    point, direction
        Where the axis starts [m], and which way it goes.
    phase
        Angle of the first node about the axis [rad]; for an axis along x, 0 is +y.

    Returns
    -------
    ndarray
        Positions (count + 1, 3) [m].
    """
    turns = {"left": -1.0, "right": 1.0}
    if handedness not in turns:
        raise not_allowed("handedness", handedness, "'left' or 'right'")
    along, first, second = frame(direction)
    axial = np.linspace(0.0, helix.axial_length, count + 1)[:, None]
    angle = phase + turns[handedness] * 2.0 * math.pi * axial / helix.pitch
    return (
        vector("point", point)
        + axial * along
        + helix.radius * (np.cos(angle) * first + np.sin(angle) * second)
    )


def frame(direction: Vector) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return a right-handed orthonormal frame whose first vector is along `direction`.

    It is the frame x, y, z turned by the smallest rotation that takes x to the direction.
    """
    given = vector("direction", direction)
    size = float(np.linalg.norm(given))
    if size == 0.0:
        raise not_allowed("direction", list(given), "a vector that is not zero")
    d = given / size
    if d[0] < -1.0 + 1e-6:  # nearly opposite to x, where the smallest rotation is not unique: about z
        first = np.array([0.0, -1.0, 0.0])
    else:
        first = np.array([-d[1], 1.0 - d[1] ** 2 / (1.0 + d[0]), -d[1] * d[2] / (1.0 + d[0])])
    first = first - (first @ d) * d
    first /= np.linalg.norm(first)
    return d, first, np.cross(d, first)
