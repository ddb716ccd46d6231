"""The step a simulation takes when none is asked for."""

from __future__ import annotations

import numpy as np

from flagrs.scene import Rod, Scene
from flagrs.scene.signal import Signal, Table
from flagrs.scene.values import FloatArray

#: Turn of the fastest motor or clamp in a step [rad]: speed and head rate of the robot at 20 rpm are then
#: within 0.1 % of their limit for vanishing steps (docs/validation/rods.md, "Schemes").
TURN_PER_STEP = 0.05

#: Share of the explicit scheme's stability limit.
STABLE_SHARE = 0.2


#: Local error of a step over the relative error asked for (measured: docs/performance.md, "rtol holds").
LOCAL_SHARE = 0.2


def size(scene: Scene) -> float:
    """Return the length that relative errors refer to [m].

    The largest over the rods of the root mean square distance of the rest shape from its principal axis, the
    helix radius of a flagellum; for rods straighter than that, a twentieth of the length.
    """
    return max(_size_of(rod) for rod in scene.rods)


def _size_of(rod: Rod) -> float:
    nodes = rod.rest_array()
    spread = np.linalg.svd(nodes - nodes.mean(axis=0), compute_uv=False)
    across = float(np.sqrt((spread[1:] ** 2).sum() / len(nodes)))
    return max(across, float(rod.rest_lengths().sum()) / 20.0)


def fastest_rate(scene: Scene) -> float:
    """Return the largest prescribed angular speed [rad/s]; 0 if nothing turns as prescribed."""
    signals: list[Signal] = [motor.speed for motor in scene.motors if motor.speed is not None]
    signals += [clamp.angular_velocity for clamp in scene.clamps if clamp.edges]
    return max((largest(signal) for signal in signals), default=0.0)


def largest(signal: Signal) -> float:
    """Return the largest magnitude of a signal, of a function of time over the first ten seconds."""
    if isinstance(signal, Table):
        return float(np.abs(signal.values).max())
    if callable(signal):
        return max(abs(float(signal(time))) for time in np.linspace(0.0, 10.0, 101))
    return abs(float(signal))


def relaxation_time(scene: Scene) -> float:
    """Return the slowest bending relaxation time of a free rod [s].

    Drag over bending, zeta L^4 / (4.73^4 EI), with 4.73 the first root of cos(k) cosh(k) = 1. Without a
    fluid it is the period of the slowest bending vibration, 2 pi sqrt(rho A L^4 / EI) / 4.73^2.
    """
    times = []
    for rod in scene.rods:
        length = float(rod.rest_lengths().sum())
        stiffness = float(rod.EI_array()[:, 0, 0].min()) if len(rod.hinge_array()) else np.inf
        radius = float(rod.radius_array().mean())
        if scene.fluid is not None and scene.fluid.model != "none":
            logarithm = np.log(2.0 * length / radius) + 0.5
            drag = 4.0 * np.pi * scene.fluid.viscosity / logarithm
            times.append(drag * length**4 / (4.73**4 * stiffness))
        else:
            mass = float(rod.density_array().mean()) * np.pi * radius**2
            times.append(2.0 * np.pi * np.sqrt(mass * length**4 / stiffness) / 4.73**2)
    return float(max(times))


def default_step(scene: Scene) -> float:
    """Return the step of the implicit schemes [s]: a small turn, or a part of the relaxation time."""
    rate = fastest_rate(scene)
    if rate > 0.0:
        return TURN_PER_STEP / rate
    relaxation = relaxation_time(scene)
    return relaxation / 100.0 if relaxation > 0.0 else 1e-2


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
