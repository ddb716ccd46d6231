"""Numbers and arrays as fields of a scene: finite, of a known shape, within bounds, read-only."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

import numpy as np
import numpy.typing as npt
from pydantic import PlainValidator

from flagrs.errors import not_allowed

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
ArrayT = TypeVar("ArrayT", bound=np.ndarray[Any, Any])


@dataclass(frozen=True)
class Bounds:
    """The values a quantity may take, its unit, and what to ask when it is far too small or too large."""

    unit: str
    above: float = -math.inf
    at_least: float = -math.inf
    at_most: float = math.inf
    below: float = math.inf
    if_small: str = ""
    if_large: str = ""

    def __str__(self) -> str:
        """Return the allowed range in words."""
        limits = [
            f"{sign} {limit:g}"
            for sign, limit in (
                (">", self.above),
                (">=", self.at_least),
                ("<", self.below),
                ("<=", self.at_most),
            )
            if math.isfinite(limit)
        ]
        if not limits:
            return "a finite number"
        return " and ".join(limits) + ("" if self.unit == "1" else f" {self.unit}")

    def contains(self, values: FloatArray) -> BoolArray:
        """Return which of the values are finite and within the bounds."""
        inside: BoolArray = (
            np.isfinite(values)
            & (values > self.above)
            & (values >= self.at_least)
            & (values < self.below)
            & (values <= self.at_most)
        )
        return inside

    def hint(self, value: float) -> str:
        """Return the likely mistake behind a value outside the bounds, or an empty string."""
        if value <= max(self.above, self.at_least):
            return self.if_small
        return self.if_large if value >= min(self.below, self.at_most) else ""


@dataclass(frozen=True)
class Array:
    """A validator of real arrays: one of the shapes (a letter stands for any length), all within bounds.

    The shape ``()`` gives a float, the others a read-only float64 array.
    """

    shapes: tuple[tuple[int | str, ...], ...]
    bounds: Bounds

    def __call__(self, value: Any) -> float | FloatArray:
        """Return the value as a float or a read-only array; raise SceneError if it is neither."""
        array = _real(value)
        if array is None or not any(_fits(array.shape, shape) for shape in self.shapes):
            raise not_allowed("", value if array is None else array, self._shape_text())
        inside = self.bounds.contains(array)
        if not inside.all():
            worst = np.unravel_index(int(np.argmin(inside)), array.shape)
            index = f"[{', '.join(str(int(i)) for i in worst)}]" if array.ndim else ""
            bad = float(array[worst])
            allowed = str(self.bounds)
            if not math.isfinite(bad) and "finite" not in allowed:
                allowed = f"finite and {allowed}"
            raise not_allowed(index, bad, allowed, self.bounds.hint(bad))
        return float(array) if array.ndim == 0 else read_only(array)

    def _shape_text(self) -> str:
        kinds = [
            "a number" if not shape else "an array of shape (" + ", ".join(map(str, shape)) + ")"
            for shape in self.shapes
        ]
        return " or ".join(kinds)


def _real(value: Any) -> FloatArray | None:
    """Return a copy of the value as float64, or None where it is not made of real numbers."""
    try:
        array = np.array(value)
    except ValueError:  # nested sequences of unequal lengths
        return None
    return array.astype(np.float64) if array.dtype.kind in "iuf" else None


def _fits(shape: tuple[int, ...], pattern: tuple[int | str, ...]) -> bool:
    return len(shape) == len(pattern) and all(
        isinstance(want, str) or have == want for have, want in zip(shape, pattern, strict=True)
    )


def read_only(array: ArrayT) -> ArrayT:
    """Return the array after locking it against writing."""
    array.setflags(write=False)
    return array


def number(bounds: Bounds) -> PlainValidator:
    """Return the validator of a finite number within bounds."""
    return PlainValidator(Array(((),), bounds))


def optional_number(bounds: Bounds) -> PlainValidator:
    """Return the validator of a finite number within bounds, or None."""
    return optional_array(((),), bounds)


def optional_array(shapes: tuple[tuple[int | str, ...], ...], bounds: Bounds) -> PlainValidator:
    """Return the validator of an array of one of the shapes within bounds, or None."""
    check = Array(shapes, bounds)
    return PlainValidator(lambda value: None if value is None else check(value))


def optional_index_pairs() -> PlainValidator:
    """Return the validator of an (n, 2) array of indices, or None."""
    return PlainValidator(lambda value: None if value is None else index_pairs(value))


def index(value: Any) -> int:
    """Return an index of a node, edge or rod: an integer from 0 up (no counting from the end)."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 0:
        raise not_allowed("", value, "an integer >= 0")
    return int(value)


def indices(value: Any) -> tuple[int, ...]:
    """Return distinct indices as a tuple."""
    array = np.array(value)
    if array.ndim != 1 or (array.size and array.dtype.kind not in "iu"):
        raise not_allowed("", value, "a list of integers >= 0")
    found = tuple(index(item) for item in array.tolist())
    if len(set(found)) != len(found):
        raise not_allowed("", value, "a list without repetitions")
    return found


def index_pairs(value: Any) -> IntArray:
    """Return pairs of indices as a read-only (n, 2) int64 array."""
    array = np.array(value)
    if array.size == 0:
        return read_only(np.zeros((0, 2), dtype=np.int64))
    if array.ndim != 2 or array.shape[1] != 2 or array.dtype.kind not in "iu" or array.min() < 0:
        raise not_allowed("", value, "an array of shape (n, 2) of integers >= 0")
    return read_only(array.astype(np.int64))


def switches(value: Any) -> bool | BoolArray:
    """Return a bool, or a read-only array of one bool per edge."""
    array = np.array(value)
    if array.dtype.kind != "b" or array.ndim > 1:
        raise not_allowed("", value, "true, false or an array of shape (E,) of them")
    return bool(array) if array.ndim == 0 else read_only(array)


def flag(value: Any) -> bool:
    """Return a bool given as one; no number or word stands for it."""
    if not isinstance(value, bool | np.bool_):
        raise not_allowed("", value, "true or false")
    return bool(value)


def direction(value: Any) -> FloatArray:
    """Return a direction as a read-only unit vector."""
    vector = np.array(Array(((3,),), Bounds("1"))(value))
    norm = float(np.linalg.norm(vector))
    if norm == 0.0:
        raise not_allowed("", value, "a vector that is not zero")
    # A unit vector stays what it is to the last bit, so that files give back the same scene.
    return read_only(vector if abs(norm - 1.0) < 1e-15 else vector / norm)


def origin() -> FloatArray:
    """Return the read-only zero vector, the default of fields that hold one."""
    return read_only(np.zeros(3))


Index = Annotated[int, PlainValidator(index)]
Indices = Annotated[tuple[int, ...], PlainValidator(indices)]
Flag = Annotated[bool, PlainValidator(flag)]
