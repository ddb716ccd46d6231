"""What a validation problem is: a function from settings to evidence, with its source."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.optimize import brentq

from flagrs.scene.values import FloatArray

Axis = Literal["linear", "log"]


@dataclass(frozen=True)
class Check:
    """One number found, and what it should be.

    Attributes
    ----------
    quantity
        What the number is, with its normalization.
    found, expected
        The simulator's number and that of an independent computation, in the same unit.
    tolerance
        Largest deviation that passes: relative to `expected`, or in its unit where `absolute`.
    reason
        Where the tolerance comes from: what error is left, and how large it was measured or derived to be.
    absolute
        Whether deviation and tolerance are differences, not ratios.
    resolution
        Meshes or steps it was found with.
    order
        Observed order of convergence; None where there is no sequence.
    expected_order, order_tolerance
        Order that theory demands, and how far the observed one may be off.
    """

    quantity: str
    found: float
    expected: float
    tolerance: float
    reason: str
    absolute: bool = False
    resolution: str = ""
    order: float | None = None
    expected_order: float | None = None
    order_tolerance: float = 0.1

    @property
    def deviation(self) -> float:
        """Found less expected, over expected unless `absolute`."""
        difference = self.found - self.expected
        return difference if self.absolute else difference / abs(self.expected)

    @property
    def passed(self) -> bool:
        """Whether value and order are within their tolerances; a NaN is not."""
        if not abs(self.deviation) <= self.tolerance:
            return False
        if self.expected_order is None:
            return True
        return self.order is not None and abs(self.order - self.expected_order) <= self.order_tolerance


@dataclass(frozen=True)
class Curve:
    """One line or set of marks of a panel.

    Attributes
    ----------
    x, y
        Abscissae and ordinates (K,).
    label
        What the legend calls it; empty: nothing.
    style
        Marks and line as matplotlib writes them; ``--`` is drawn grey, as a guide to the eye.
    paired
        Whether it has the colour of the curve before it, with which it is compared.
    """

    x: FloatArray
    y: FloatArray
    label: str = ""
    style: str = "o-"
    paired: bool = False


@dataclass(frozen=True)
class Panel:
    """One pair of axes of a problem's figure."""

    title: str
    x: str
    y: str
    curves: tuple[Curve, ...]
    x_axis: Axis = "linear"
    y_axis: Axis = "linear"


@dataclass(frozen=True)
class Evidence:
    """What a problem found: at least one check, and panels for a figure."""

    checks: tuple[Check, ...]
    panels: tuple[Panel, ...] = ()


@dataclass(frozen=True)
class Problem:
    """A named problem with a known answer.

    Attributes
    ----------
    name
        Name on the command line: that of the function.
    about
        One sentence: the first of the function's docstring.
    source
        Where the expected values are published or derived.
    solve
        The function; its arguments are settings such as numbers of edges.
    quick, full
        Settings for a look (all problems together in less than a minute) and for a judgement.
    """

    name: str
    about: str
    source: str
    solve: Callable[..., Evidence]
    quick: Mapping[str, Any]
    full: Mapping[str, Any]


#: All problems by name, in the order in which their files are imported.
PROBLEMS: dict[str, Problem] = {}


def problem(
    *, source: str, quick: Mapping[str, Any], full: Mapping[str, Any]
) -> Callable[[Callable[..., Evidence]], Callable[..., Evidence]]:
    """Register a function that returns evidence as a problem under its own name."""

    def register(solve: Callable[..., Evidence]) -> Callable[..., Evidence]:
        about = (inspect.getdoc(solve) or "").partition("\n")[0]
        PROBLEMS[solve.__name__] = Problem(solve.__name__, about, source, solve, quick, full)
        return solve

    return register


def observed_order(sizes: FloatArray, values: FloatArray, limit: float) -> float:
    """Return the order of convergence of a sequence, NaN if it does not converge.

    It comes from the three finest values alone, whatever they converge to, so that neither an error of the
    model nor one of the expected value looks like one of the mesh. Of two values it is that of their distance
    to the limit.

    Parameters
    ----------
    sizes
        Edge lengths or steps (K,), falling, in any unit.
    values
        What was found with them (K,).
    limit
        The value expected for size zero.
    """
    if len(values) == 2:
        first, last = np.abs(values - limit)
        return float(np.log(first / last) / np.log(sizes[0] / sizes[1])) if last > 0.0 else math.nan
    (h0, h1, h2), (v0, v1, v2) = sizes[-3:], values[-3:]
    if v1 == v2:
        return math.nan
    ratio = (v0 - v1) / (v1 - v2)

    def excess(order: float) -> float:
        return float((h0**order - h1**order) / (h1**order - h2**order) - ratio)

    low, high = 0.05, 12.0
    return float(brentq(excess, low, high)) if excess(low) < 0.0 < excess(high) else math.nan


def extrapolated(sizes: FloatArray, values: FloatArray, order: float) -> float:
    """Return Richardson's extrapolation of a sequence to size zero, from the two finest, at a given order."""
    ratio = (sizes[-2] / sizes[-1]) ** order
    return float((ratio * values[-1] - values[-2]) / (ratio - 1.0))


def converging(
    quantity: str,
    sizes: FloatArray,
    values: FloatArray,
    expected: float,
    *,
    tolerance: float,
    reason: str,
    order: float = 2.0,
    order_tolerance: float = 0.1,
    resolution: str = "",
    absolute: bool = False,
) -> Check:
    """Return the check of a sequence: its limit by extrapolation, and its order.

    Parameters
    ----------
    quantity, expected, tolerance, reason, resolution, absolute, order_tolerance
        As in `Check`.
    sizes, values
        Edge lengths or steps (K,), falling, and what was found with them (K,).
    order
        The order that theory demands, at which the limit is extrapolated.
    """
    return Check(
        quantity,
        extrapolated(sizes, values, order),
        expected,
        tolerance,
        reason,
        absolute=absolute,
        resolution=resolution,
        order=observed_order(sizes, values, expected),
        expected_order=order,
        order_tolerance=order_tolerance,
    )


def errors_panel(
    title: str, size: str, what: str, curves: Mapping[str, tuple[FloatArray, FloatArray]], order: float = 2.0
) -> Panel:
    """Return a panel of errors against edge length or step, with a line of the order demanded.

    Parameters
    ----------
    title
        Title of the panel.
    size, what
        What is on the axes, with units.
    curves
        Sizes (K,) and errors (K,), of any sign, by label.
    order
        Slope of the dashed line, drawn below the first curve.
    """
    drawn = [Curve(sizes, np.abs(errors), label) for label, (sizes, errors) in curves.items()]
    sizes, errors = next(iter(curves.values()))
    line = 0.5 * abs(errors[0]) * (sizes / sizes[0]) ** order
    drawn.append(Curve(sizes, line, f"order {order:g}", "--"))
    return Panel(title, size, what, tuple(drawn), "log", "log")
