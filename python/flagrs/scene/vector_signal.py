"""Vectors that follow time: three numbers, three signals, a table of vectors, or a function of time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import PlainValidator

from flagrs.errors import SceneError, not_allowed
from flagrs.scene.signal import Signal, Table, scalar_signal, signal_value
from flagrs.scene.values import Array, Bounds, FloatArray, origin

#: What a constructor takes for a vector signal.
VectorInput = npt.ArrayLike | Sequence[Signal] | Table | Callable[[float], Sequence[float] | FloatArray]
VectorSignal = FloatArray | tuple[Signal, Signal, Signal] | Table | Callable[[float], Sequence[float]]

_numbers = Array(((3,),), Bounds("1"))
ALLOWED = "three numbers, three signals, a flagrs.Table of vectors (n, 3), or a function of time"


def _vector_signal(value: Any) -> Any:
    if isinstance(value, dict):
        value = Table(**value)
    if isinstance(value, Table):
        if value.values.ndim != 2:
            raise not_allowed("values", value.values, f"an array of shape ({len(value.times)}, 3)")
        return value
    if callable(value):
        return value if isinstance(value, VectorFunction) else VectorFunction(value)
    if isinstance(value, list | tuple) and any(
        isinstance(item, dict | Table) or callable(item) for item in value
    ):
        if len(value) != 3:
            raise not_allowed("", value, ALLOWED)
        return tuple(scalar_signal(item) for item in value)
    return _numbers(value)


#: Annotation of a field that holds a vector that follows time.
CheckedVectorSignal = Annotated[VectorSignal, PlainValidator(_vector_signal)]


@dataclass(frozen=True)
class VectorFunction:
    """A function of time that gives vectors; what it returns is checked."""

    function: Callable[[float], Sequence[float]]

    def __call__(self, time: float) -> FloatArray:
        """Return the vector (3,) at a time [s]; raise SceneError for anything but three finite numbers."""
        value = self.function(time)
        try:
            array = np.asarray(value, dtype=np.float64)
            fits = array.shape == (3,) and bool(np.isfinite(array).all())
        except (TypeError, ValueError):
            fits = False
        if not fits:
            raise SceneError(
                f"signal {self.function!r} at t = {time:g} s: gave {value!r}; must be three finite numbers",
                value=value,
                allowed="three finite numbers",
            )
        return array

    def __repr__(self) -> str:
        """Return the function's own."""
        return repr(self.function)


class _Remembered:
    """The last vector of a function, so that its three components cost one call an instant."""

    def __init__(self, function: VectorFunction) -> None:
        self._function = function
        self._time = np.nan
        self._value: FloatArray = origin()

    def component(self, axis: int) -> Callable[[float], float]:
        def at(time: float) -> float:
            if time != self._time:
                self._value = self._function(time)
                self._time = time
            return float(self._value[axis])

        return at


def components(signal: VectorSignal) -> tuple[Signal, Signal, Signal]:
    """Return the three components of a vector signal, each a signal of its own."""
    if isinstance(signal, np.ndarray):
        return float(signal[0]), float(signal[1]), float(signal[2])
    if isinstance(signal, tuple):
        return signal
    if isinstance(signal, Table):
        x, y, z = (Table(times=signal.times, values=column) for column in signal.values.T)
        return x, y, z
    function = signal if isinstance(signal, VectorFunction) else VectorFunction(signal)
    last = _Remembered(function)
    return last.component(0), last.component(1), last.component(2)


def vector_at(signal: VectorSignal, time: float) -> FloatArray:
    """Return the vector (3,) at a time [s].

    Raises
    ------
    SceneError
        If a function gives anything but finite numbers.
    """
    return np.array([signal_value(component, time) for component in components(signal)])


def is_zero(signal: VectorSignal) -> bool:
    """Return whether the vector is the constant zero."""
    return isinstance(signal, np.ndarray) and not signal.any()
