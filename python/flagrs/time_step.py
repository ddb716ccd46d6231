"""Sizes and rates of a scene that steps are measured by, and the explicit scheme's limit."""

from __future__ import annotations

import numpy as np

from flagrs.errors import SceneError
from flagrs.scene import Rod, Scene
from flagrs.scene.flow import Flow, LinearFlow, PoiseuilleFlow
from flagrs.scene.signal import Signal, Table, signal_value
from flagrs.scene.values import FloatArray

#: Turn of the fastest motor or clamp in a step [rad]: speed and head rate of the robot at 20 rpm are then
#: within 0.1 % of their limit for vanishing steps (docs/validation/rods.md, "Schemes").
TURN_PER_STEP = 0.05

#: Share of the explicit scheme's stability limit.
STABLE_SHARE = 0.2


#: Fractional part of the golden section, whose multiples are spread most evenly.
GOLDEN = 0.6180339887498949

#: Local error of a step over the relative error asked for (measured: docs/performance.md, "rtol holds").
LOCAL_SHARE = 0.2


#: Largest local error of a step, in edges: a larger one turns edges by more than their frames and drag allow.
EDGE_SHARE = 7e-3


def local_tolerance(scene: Scene, rtol: float) -> float:
    """Return the local error that steps may have, relative to each filament's size, and an edge's at most."""
    edges = min(float(np.median(rod.rest_lengths())) / rod_size(rod) for rod in scene.rods)
    return min(LOCAL_SHARE * rtol, EDGE_SHARE * edges)


def size(scene: Scene) -> float:
    """Return the length that relative errors refer to [m].

    The largest over the rods of the root mean square distance of the rest shape from its principal axis, the
    helix radius of a flagellum; for rods straighter than that, a twentieth of the length.
    """
    return max(rod_size(rod) for rod in scene.rods)


def rod_size(rod: Rod) -> float:
    """Return the size of one rod across its axis [m], as `size` takes it."""
    nodes = rod.rest_array()
    spread = np.linalg.svd(nodes - nodes.mean(axis=0), compute_uv=False)
    across = float(np.sqrt((spread[1:] ** 2).sum() / len(nodes)))
    return max(across, float(rod.rest_lengths().sum()) / 20.0)


def prescribed_rotations(scene: Scene) -> list[Signal]:
    """Return the angular speeds of motors and clamps [rad/s]."""
    signals: list[Signal] = [motor.speed for motor in scene.motors if motor.speed is not None]
    return signals + [signal for clamp in scene.clamps for signal in clamp.turning_signals()]


def fastest_rate(scene: Scene) -> float:
    """Return the largest prescribed angular speed or rate of a background flow [rad/s]; 0 without any."""
    turned = [largest(signal) for signal in prescribed_rotations(scene)]
    flows = () if scene.fluid is None else scene.fluid.background
    return max([*turned, *map(_flow_rate, flows)], default=0.0)


def _flow_rate(flow: Flow) -> float:
    """Return the largest rate at which a flow strains or turns what is in it [1/s]."""
    if isinstance(flow, LinearFlow):
        return float(np.linalg.norm(flow.gradient)) * largest(flow.strength)
    if isinstance(flow, PoiseuilleFlow):
        return 2.0 * largest(flow.speed) / flow.radius
    return 0.0


def samples() -> tuple[FloatArray, float]:
    """Return the times at which functions of time are looked at [s], and how much later once more [s].

    They are spread evenly over ten seconds, and over the decades below, at distances that are no multiples of
    a period.
    """
    even = 10.0 * ((np.arange(1, 201) * GOLDEN) % 1.0)
    decades = 10.0 ** (1.0 - 7.0 * ((np.arange(1, 101) * GOLDEN) % 1.0))
    return np.sort(np.concatenate([even, decades])), 1e-6


def _sample(signal: Signal, time: float) -> float:
    """Return a signal's value [rad/s]; 0 where it has none, which the run may never reach."""
    try:
        return signal_value(signal, time)
    except SceneError:
        return 0.0


def largest(signal: Signal) -> float:
    """Return the largest magnitude of a signal, of a function of time over the first ten seconds."""
    if isinstance(signal, Table):
        return float(np.abs(signal.values).max())
    if callable(signal):
        return max(abs(_sample(signal, float(time))) for time in samples()[0])
    return abs(float(signal))


def explicit_limit(resistance: FloatArray, mass: FloatArray) -> float:
    """Return the explicit scheme's stability limit [s], 2 over the largest eigenvalue of M^-1 Res.

    Parameters
    ----------
    resistance
        Resistance (3N, 3N) of the nodes [N s/m].
    mass
        Mass (3N,) that goes with each row [kg].
    """
    rates = np.linalg.eigvals(resistance / mass[:, None])
    return 2.0 / float(np.abs(rates).max()) if np.abs(rates).max() > 0.0 else np.inf
