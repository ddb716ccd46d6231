"""All that a run says in single numbers, with units and errors; what means nothing for its scene says why."""

from __future__ import annotations

import html
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flagrs.errors import FlagrsError
from flagrs.measures import spread, window
from flagrs.results.bundle import Bundle, bundle_of
from flagrs.results.swimming import Estimate, rate_of, swimming_of
from flagrs.scene.plausibility import scales_of
from flagrs.scene.values import BoolArray, FloatArray, IntArray
from flagrs.units import prefixed

if TYPE_CHECKING:
    from flagrs.trajectory import Trajectory

#: Frames of a window that measures of bundles look at, evenly spaced; and pairs of edges that windings are
#: integrated over, in all of them, which takes some seconds.
MOST_FRAMES, MOST_PAIRS = 50, 2_000_000


@dataclass(frozen=True)
class ReadOut:
    """One number that was read off a run, or why there is none.

    Attributes
    ----------
    meaning : str
        What it is.
    unit : str
        Its unit.
    estimate : Estimate or None
        Value and standard error (NaN where none is known); None if it means nothing here.
    absent : str
        Why there is none; empty if there is one.
    """

    meaning: str
    unit: str
    estimate: Estimate | None
    absent: str = ""

    @property
    def value(self) -> float:
        """The value.

        Raises
        ------
        FlagrsError
            If there is none, with the reason.
        """
        if self.estimate is None:
            raise FlagrsError(self.absent)
        return self.estimate.value

    def __str__(self) -> str:
        """Return value, error and unit, or why there is none."""
        if self.estimate is None:
            return f"none: {self.absent}"
        scaled, unit = _readable(self.estimate, self.unit)
        moving = "" if self.estimate.stationary else " (not steady: it changes over the window)"
        return f"{scaled}{moving}" if unit == "1" else f"{scaled} {unit}{moving}"


class ReadOuts(Mapping[str, ReadOut]):
    """The read-outs of a run by name; print it for a table.

    Attributes
    ----------
    start, end : float
        The window they are taken over [s].
    """

    def __init__(self, start: float, end: float, items: Mapping[str, ReadOut]) -> None:
        self.start, self.end = start, end
        self._items = dict(items)

    def __getitem__(self, name: str) -> ReadOut:
        """Return a read-out."""
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._items)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._items)

    def __repr__(self) -> str:
        """Return the table."""
        return str(self)

    def __str__(self) -> str:
        """Return a table for a person to read."""
        width = max(len(name) for name in self._items)
        lines = [f"{name:<{width}}  {item}" for name, item in self._items.items()]
        return "\n".join([f"from {self.start:g} s to {self.end:g} s", *lines])

    def _repr_html_(self) -> str:
        """Return the table for a notebook."""
        rows = "".join(
            f"<tr><td style='text-align: left'>{html.escape(item.meaning)}</td>"
            f"<td style='text-align: left'>{html.escape(str(item))}</td></tr>"
            for item in self._items.values()
        )
        return f"<table><caption>{self.start:g} s to {self.end:g} s</caption>{rows}</table>"


def readouts_of(trajectory: Trajectory, start: float | None, end: float | None) -> ReadOuts:
    """Return the read-outs of a run over a window, by default the last half of it.

    Raises
    ------
    FlagrsError
        If fewer than two frames lie in the window.
    """
    inside = window(trajectory.time, start, end)
    times = trajectory.time[inside]
    found: dict[str, ReadOut] = {}

    def put(name: str, meaning: str, unit: str, measure: Callable[[], Estimate]) -> None:
        try:
            found[name] = ReadOut(meaning, unit, measure())
        except FlagrsError as error:
            found[name] = ReadOut(meaning, unit, None, str(error))

    _motion(trajectory, start, end, put)
    _driving(trajectory, inside, start, end, put)
    _bundle(trajectory, np.flatnonzero(inside), put)
    _numbers(trajectory, put)
    return ReadOuts(float(times[0]), float(times[-1]), found)


_Put = Callable[[str, str, str, Callable[[], Estimate]], None]


def _motion(trajectory: Trajectory, start: float | None, end: float | None, put: _Put) -> None:
    for axis, name in enumerate("xyz"):
        put(
            f"velocity_{name}",
            f"velocity along {name}",
            "m/s",
            lambda axis=axis: swimming_of(trajectory, start, end).velocity[axis],  # type: ignore[misc]
        )
    put("speed", "swimming speed", "m/s", lambda: swimming_of(trajectory, start, end).speed)

    def along() -> Estimate:
        found = swimming_of(trajectory, start, end).along_axis
        if found is None:
            raise FlagrsError(
                "the scene has neither shafts nor open filaments, or their directions cancel out"
            )
        return found

    put("velocity_along_axis", "velocity along the swimmer's axis, towards its filaments", "m/s", along)
    put(
        "head_rate",
        "rate of the head about the shafts",
        "rad/s",
        lambda: _exact(trajectory.head_rate(start, end)),
    )


def _driving(
    trajectory: Trajectory, inside: BoolArray, start: float | None, end: float | None, put: _Put
) -> None:
    for number in range(len(trajectory.scene.motors)):
        torque = trajectory.motor_torque[inside, number]
        put(f"torque_{number}", f"torque of motor {number}", "N m", lambda torque=torque: _mean(torque))  # type: ignore[misc]
    put("power", "power of the motors", "W", lambda: _power(trajectory, start, end))
    put("efficiency", "Purcell's efficiency", "1", lambda: _exact(trajectory.efficiency(start, end)))


def _power(trajectory: Trajectory, start: float | None, end: float | None) -> Estimate:
    trajectory.mean_power(start, end)  # says what is missing
    return _mean(trajectory.power()[window(trajectory.time, start, end)])


def _bundle(trajectory: Trajectory, inside: IntArray, put: _Put) -> None:
    frames = inside[spread(len(inside), MOST_FRAMES)]

    def of(measure: Callable[[Bundle], FloatArray]) -> FloatArray:
        return measure(bundle_of(trajectory, frames))

    def wound(measure: Callable[[Bundle], FloatArray], cost: Callable[[Bundle], int]) -> FloatArray:
        one = bundle_of(trajectory, frames[:1])
        most = MOST_PAIRS // max(1, cost(one))
        if most < 2:
            raise FlagrsError(
                f"{cost(one)} pairs of edges a frame take long: ask trajectory.bundle(frames) for it"
            )
        return measure(bundle_of(trajectory, frames[spread(len(frames), most)]))

    def smallest() -> Estimate:
        gaps = trajectory.minimum_gap()[inside]
        if not np.isfinite(gaps).any():
            raise FlagrsError("no pair of edges is watched for contact")
        return _exact(float(gaps.min()))

    put("smallest_gap", "smallest gap between colliding edges, of one filament too", "m", smallest)
    put(
        "filament_gap",
        "smallest gap between two filaments",
        "m",
        lambda: _exact(float(wound(Bundle.gap, lambda one: one.linking_cost).min())),
    )
    put("tip_spread", "distance of the tips from their middle", "m", lambda: _mean(of(Bundle.tip_spread)))
    put(
        "phase_lag",
        "largest phase between two helices, mean over time",
        "rad",
        lambda: _mean(_alike(of(Bundle.phase_lag)).max(axis=1)),
    )
    put("twist", "twist of a filament, mean, in turns", "1", lambda: _mean(of(Bundle.twist).mean(axis=1)))
    put(
        "writhe",
        "writhe of a filament, mean",
        "1",
        lambda: _mean(wound(Bundle.writhe, lambda one: one.writhe_cost).mean(axis=1)),
    )
    put(
        "linking",
        "how often two filaments wind about each other, mean",
        "1",
        lambda: _mean(wound(Bundle.linking, lambda one: one.linking_cost).mean(axis=1)),
    )


def _numbers(trajectory: Trajectory, put: _Put) -> None:
    scales = scales_of(trajectory.scene)

    def driven(value: float) -> Estimate:
        if value <= 0.0:
            raise FlagrsError("no fluid, or nothing is driven at a prescribed rate")
        return _exact(value)

    put("reynolds", "Reynolds number of the fastest drive", "1", lambda: driven(scales.reynolds))
    put("sperm_number", "sperm number of the softest rod", "1", lambda: driven(scales.sperm_number))
    put("slenderness", "contour over radius of the stoutest rod", "1", lambda: _exact(scales.slenderness))


def _alike(lags: FloatArray) -> FloatArray:
    """Return the sizes of phase lags (T, K), if they mean something at all times."""
    lost = int(np.isnan(lags).any(axis=1).sum())
    if lost:
        raise FlagrsError(f"in {lost} of {len(lags)} frames two filaments are too unlike to have a phase lag")
    return np.abs(lags)


def _exact(value: float) -> Estimate:
    return Estimate(value, float("nan"), True)


def _mean(values: FloatArray) -> Estimate:
    """Return the mean over time of values at frames, with the error of blocks."""
    return rate_of(values, np.ones(len(values)), float(np.abs(values).mean()))


#: Units that are written with a prefix.
_PREFIXED = ("m/s", "m", "W", "N m", "N")


def _readable(estimate: Estimate, unit: str) -> tuple[Estimate, str]:
    """Return an estimate in the unit it reads best in."""
    if unit not in _PREFIXED or estimate.value == 0.0:
        return estimate, unit
    size = max(abs(estimate.value), estimate.error if np.isfinite(estimate.error) else 0.0)
    factor, name = prefixed(size, unit)
    return Estimate(factor * estimate.value, factor * estimate.error, estimate.stationary), name
