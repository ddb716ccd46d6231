"""Prescribed functions of time: a number, a table, or any Python function."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from pydantic import PlainValidator, model_validator

from flagrs.errors import SceneError, not_allowed
from flagrs.scene.part import Part
from flagrs.scene.values import Array, Bounds, FloatArray


class Table(Part):
    """A function of time given at instants, linear between them and held constant outside.

    Attributes
    ----------
    times : ndarray
        Instants (n,) [s], strictly increasing, n >= 1.
    values : ndarray
        Values (n,) at the instants, or vectors (n, 3), in the unit of the field the table is given for.

    Examples
    --------
    >>> ramp = Table(times=[0.0, 2.0], values=[0.0, 4.0])
    >>> ramp(1.0), ramp(5.0)
    (2.0, 4.0)
    """

    times: Annotated[FloatArray, PlainValidator(Array((("n",),), Bounds("s")))]
    values: Annotated[FloatArray, PlainValidator(Array((("n",), ("n", 3)), Bounds("1")))]

    @model_validator(mode="after")
    def _check(self) -> Table:
        if self.times.size == 0:
            raise not_allowed("times", [], "at least one instant")
        steps = np.diff(self.times)
        if (steps <= 0.0).any():
            worst = int(np.argmax(steps <= 0.0)) + 1
            raise not_allowed(f"times[{worst}]", self.times[worst], "later than the instant before it")
        if len(self.values) != len(self.times):
            raise not_allowed("values", self.values, f"as many values as times, {self.times.size}")
        return self

    def __call__(self, time: float) -> float:
        """Return the value at a time [s]."""
        return float(np.interp(time, self.times, self.values))


#: Length [s] below which nothing of a function needs to be found by itself, where none is given.
RESOLUTION = 1e-2


def _function(value: Any) -> Any:
    if not callable(value):
        raise not_allowed("function", value, "a function of time")
    return value


class TimeFunction(Part):
    """A function of time with what the steps should know of it.

    A bare Python function will do where it is smooth. Every step looks at a function in panels no longer than
    its resolution, whatever the tolerance, so that a pulse as long as that is always found.

    Attributes
    ----------
    function : callable
        Value at a time [s], in the unit of the field it is given for: a finite number at every time.
    breaks : ndarray
        Instants (n,) [s], strictly increasing, at which the function may jump or have a corner: adaptive
        steps end there.
    resolution : float
        Length [s] below which nothing of the function needs to be found by itself; 10 ms if not given. A step
        of more than ten thousand such lengths is looked at in ten thousand panels.

    Examples
    --------
    >>> switch = TimeFunction(function=lambda time: 2.0 if time > 1.0 else 0.0, breaks=[1.0])
    >>> switch(0.5), switch(1.5)
    (0.0, 2.0)
    """

    function: Annotated[Callable[[float], float], PlainValidator(_function)]
    breaks: Annotated[FloatArray, PlainValidator(Array((("n",),), Bounds("s")))] = np.zeros(0)
    resolution: Annotated[float, PlainValidator(Array(((),), Bounds("s", above=0.0)))] = RESOLUTION

    @model_validator(mode="after")
    def _check(self) -> TimeFunction:
        steps = np.diff(self.breaks)
        if (steps <= 0.0).any():
            worst = int(np.argmax(steps <= 0.0)) + 1
            raise not_allowed(f"breaks[{worst}]", self.breaks[worst], "later than the instant before it")
        return self

    def __call__(self, time: float) -> float:
        """Return the value at a time [s]."""
        return self.function(time)


Signal = float | Table | TimeFunction | Callable[[float], float]

_number = Array(((),), Bounds("1"))


def scalar_signal(value: Any) -> Any:
    """Return a number, a table of numbers or a function as it is; raise SceneError for anything else."""
    if isinstance(value, dict):
        value = TimeFunction(**value) if "function" in value else Table(**value)
    if isinstance(value, Table) and value.values.ndim != 1:
        raise not_allowed("values", value.values, f"an array of shape ({len(value.times)},)")
    if callable(value):
        return value
    return _number(value)


#: Annotation of a field that holds a signal; None is for the field's own default only.
CheckedSignal = Annotated[Signal, PlainValidator(scalar_signal)]
CheckedSignalOrNone = Annotated[
    Signal | None, PlainValidator(lambda value: None if value is None else scalar_signal(value))
]


def signal_value(signal: Signal, time: float) -> float:
    """Return a signal's value at a time.

    Parameters
    ----------
    signal
        A number, a `Table`, a `TimeFunction` or a function of time.
    time
        Time [s].

    Raises
    ------
    SceneError
        If a function gives anything but a finite number.
    """
    if isinstance(signal, int | float):
        return float(signal)
    value = signal(time)
    try:
        number = math.nan if isinstance(value, str | bytes) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise SceneError(
            f"signal {signal!r} at t = {time:g} s: gave {value!r}; must be a finite number",
            value=value,
            allowed="a finite number",
        )
    return number
