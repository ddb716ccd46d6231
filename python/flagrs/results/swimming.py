"""The swimming velocity with its uncertainty, in the laboratory and along the swimmer's own axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import stdtrit

from flagrs.errors import FlagrsError
from flagrs.measures import window
from flagrs.results.paths import filaments_of
from flagrs.scene.rod_topology import far_end
from flagrs.scene.values import FloatArray

if TYPE_CHECKING:
    from flagrs.trajectory import Trajectory

#: Numbers of blocks that a window is split into: the standard error is the largest that any of them gives.
BLOCKS = (4, 8, 16, 32)
#: Fewest intervals between frames in a window, and in a block.
LEAST, LEAST_IN_BLOCK = 8, 2
#: A window is not stationary if its rate has a trend that chance gives with this probability, and that
#: changes the speed by more than this share from one end to the other.
CHANCE, SHARE = 1e-3, 0.02


@dataclass(frozen=True)
class Estimate:
    """A mean over time and its standard error, in the same unit.

    The error is that of blocks (H. Flyvbjerg and H. G. Petersen, J. Chem. Phys. 91, 461, 1989): as long as
    there are enough that are longer than the motion remembers, it is one standard deviation of the mean. NaN
    where a window is too short to tell.

    Attributes
    ----------
    value, error : float
        The mean, and its standard error.
    stationary : bool
        Whether the rate shows no trend over the window.
    """

    value: float
    error: float
    stationary: bool

    def __str__(self) -> str:
        """Return value and error with as many digits as the error leaves meaning."""
        if not np.isfinite(self.error) or self.error <= 1e-12 * abs(self.value):  # none, or round-off
            return f"{self.value:.4g}"
        digits = int(np.floor(np.log10(self.error)))
        lead = int(np.floor(np.log10(abs(self.value)))) if self.value else digits
        shown = max(1, min(lead - digits + 2, 6))
        return f"{self.value:#.{shown}g} ± {self.error:.2g}"


@dataclass(frozen=True)
class Swimming:
    """How a swimmer moves in a window of a run.

    Attributes
    ----------
    start, end : float
        The window [s].
    velocity : tuple of Estimate
        Along x, y and z of the laboratory [m/s].
    speed : Estimate
        Size of the mean velocity [m/s]; its error is that along the mean direction.
    along_axis : Estimate or None
        Velocity along the swimmer's own axis as it turns, positive towards the filaments [m/s]; None without
        an axis.
    """

    start: float
    end: float
    velocity: tuple[Estimate, Estimate, Estimate]
    speed: Estimate
    along_axis: Estimate | None

    @property
    def stationary(self) -> bool:
        """Whether neither speed nor velocity along the axis has a trend over the window."""
        return self.speed.stationary and (self.along_axis is None or self.along_axis.stationary)


def swimming_of(trajectory: Trajectory, start: float | None, end: float | None) -> Swimming:
    """Return how the swimmer of a run moves in a window, by default the last half of the run.

    Raises
    ------
    FlagrsError
        If clamps hold filaments and there is no head, or fewer than nine frames lie in the window.
    """
    if trajectory.scene.head is None and trajectory.scene.clamps:
        raise FlagrsError("no swimming velocity: clamps hold or move the filaments")
    inside = window(trajectory.time, start, end)
    if inside.sum() <= LEAST:
        raise FlagrsError(
            f"{int(inside.sum())} frames in the window; a velocity with its error needs {LEAST + 1}"
        )
    time, position = trajectory.time[inside], trajectory.position()[inside]
    steps, spans = np.diff(position, axis=0), np.diff(time)
    mean = steps.sum(axis=0) / spans.sum()
    size = float(np.linalg.norm(mean))
    unit = mean / size if size > 0.0 else np.array([1.0, 0.0, 0.0])
    velocity = tuple(rate_of(steps[:, axis], spans, size) for axis in range(3))
    ahead = rate_of(steps @ unit, spans, size)
    speed = Estimate(size, ahead.error, ahead.stationary)
    axes = axis_of(trajectory)
    along = None
    if axes is not None:
        middle = axes[inside]
        middle = middle[:-1] + middle[1:]
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        along = rate_of(np.einsum("ij,ij->i", steps, middle), spans, size)
    return Swimming(float(time[0]), float(time[-1]), (velocity[0], velocity[1], velocity[2]), speed, along)


def axis_of(trajectory: Trajectory) -> FloatArray | None:
    """Return the swimmer's axis (T, 3): the mean direction of shafts, or of filaments from base to tip.

    None if there are neither, or the directions cancel out.
    """
    scene, nodes = trajectory.scene, trajectory.nodes
    arms = []
    for motor in scene.motors:
        outer = far_end(scene.rods[motor.rod].edge_array(), motor.shaft, motor.node)
        offset = scene.node_offset(motor.rod)
        arms.append(nodes[:, offset + outer] - nodes[:, offset + motor.node])
    if not arms:
        arms = [
            nodes[:, path.nodes[-1]] - nodes[:, path.nodes[0]]
            for path in filaments_of(scene)
            if not path.closed
        ]
    if not arms:
        return None
    total: FloatArray = np.sum([arm / np.linalg.norm(arm, axis=1, keepdims=True) for arm in arms], axis=0)
    sizes = np.linalg.norm(total, axis=1, keepdims=True)
    if (sizes < 1e-3 * len(arms)).any():
        return None
    unit: FloatArray = total / sizes
    return unit


def rate_of(steps: FloatArray, spans: FloatArray, scale: float) -> Estimate:
    """Return the mean rate of steps (n,) made in spans of time (n,) [s].

    Parameters
    ----------
    steps, spans
        How far it went from frame to frame, and how long that took.
    scale
        Speed with which a trend is compared.
    """
    value = float(steps.sum() / spans.sum())
    errors = [0.0]
    for count in BLOCKS:
        if len(steps) >= LEAST_IN_BLOCK * count:
            rates = _block_rates(steps, spans, count)
            errors.append(float(rates.std(ddof=1) / np.sqrt(count)))
    if len(errors) == 1:
        return Estimate(value, float("nan"), True)
    error = max(errors)
    return Estimate(value, error, not _has_trend(steps, spans, scale))


def _has_trend(steps: FloatArray, spans: FloatArray, scale: float) -> bool:
    """Return whether the rate has a trend over the window: Student's test of the slope of block rates."""
    count = next((n for n in (16, 8) if len(steps) >= LEAST_IN_BLOCK * n), 4)
    rates, place = _block_rates(steps, spans, count), np.arange(count) - (count - 1) / 2.0
    slope = float(place @ rates / (place @ place))
    residual = rates - rates.mean() - slope * place
    spread = float(np.sqrt(residual @ residual / (count - 2) / (place @ place)))
    largest = float(stdtrit(count - 2, 1.0 - CHANCE / 2.0))
    return abs(slope) > largest * spread and abs(slope) * (count - 1) > SHARE * abs(scale)


def _block_rates(steps: FloatArray, spans: FloatArray, count: int) -> FloatArray:
    """Return the rates of parts of a window with as many frames each, but for one."""
    edges = np.linspace(0, len(steps), count + 1).round().astype(np.int64)[:-1]
    rates: FloatArray = np.add.reduceat(steps, edges) / np.add.reduceat(spans, edges)
    return rates
