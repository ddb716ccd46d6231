"""The step a simulation takes when none is asked for: no filament turns, bends or moves by much in it."""

from __future__ import annotations

import math

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from flagrs.native_loads import largest_speed
from flagrs.relaxation import Network, Relaxation
from flagrs.scene import Scene
from flagrs.scene.signal import Table, signal_value
from flagrs.scene.values import FloatArray
from flagrs.time_step import TURN_PER_STEP, prescribed_rotations, samples

#: Share of its relaxation time that a step follows a filament by.
RELAXATION_SHARE = 1e-2
#: Displacement, in sizes of a filament, below which its relaxation is not worth following.
NOTICED = 1e-2
#: Share of its size that a filament without much relaxation may move in a step.
MOVE_PER_STEP = 0.05
#: Share of the time in which a function of time changes by itself.
VARIATION_SHARE = 0.3
#: Turn within the sampled span below which a function of time says nothing of the motion [rad].
STILL = 1e-6
#: The step of a scene in which nothing has a time scale [s].
STEP_OF_NOTHING = 1e-2


def default_step(scene: Scene) -> float:
    """Return the step of fixed length [s].

    The least of what its filaments ask for: a turn of 0.05 rad of a motor or clamp; where a function of time
    drives it, 0.3 of the time in which that varies; a hundredth of the relaxation time of a filament that is
    not in equilibrium at the start, or a step that moves it by a twentieth of its size. Where nothing of the
    kind is going on, a hundredth of the slowest relaxation time.

    Raises
    ------
    SceneError
        If a function of time gives anything but a finite number.
    """
    network = Network(scene)
    steps = [_turning_step(signal) for signal in prescribed_rotations(scene)]
    relaxations = network.relaxations()
    steps += _unbalanced(network, relaxations)
    steps = [step for step in steps if np.isfinite(step) and step > 0.0]
    if steps:
        return float(min(steps))
    slowest = max((found.time for found in relaxations), default=0.0)
    return _rounded(RELAXATION_SHARE * slowest) if slowest > 0.0 else STEP_OF_NOTHING


def _turning_step(signal: object) -> float:
    """Return the step in which a motor or clamp turns by little [s]; infinite if it is still."""
    if isinstance(signal, Table):
        rate = float(np.abs(signal.values).max())
        return TURN_PER_STEP / rate if rate > 0.0 else np.inf
    if not callable(signal):
        rate = abs(float(signal))  # type: ignore[arg-type]
        return TURN_PER_STEP / rate if rate > 0.0 else np.inf
    times, spacing = samples()
    values = np.array([signal_value(signal, time) for time in times])
    later = np.array([signal_value(signal, time + spacing) for time in times])
    rate = float(np.abs(values).max())
    if rate * float(times.max()) < STILL:
        return np.inf
    # Jumps are seen by few samples and cannot be followed by steps; what nine in ten stay below can.
    slope = float(np.quantile(np.abs(later - values), 0.9)) / spacing
    return min(TURN_PER_STEP / rate, VARIATION_SHARE * rate / slope if slope > 0.0 else np.inf)


def _unbalanced(network: Network, relaxations: list[Relaxation]) -> list[float]:
    """Return the steps that filaments out of equilibrium ask for [s]."""
    forces = network.loads() - network.gradient()
    moved = _clamp_speeds(network)
    steps = []
    for found in relaxations:
        dofs = found.dofs
        # Where the forces would take it in its own time, free motions included: (K + rate R) u = F.
        stiffness = network.stiffness[dofs][:, dofs]
        resistance = network.resistance[dofs][:, dofs]
        matrix = (stiffness + found.eigenvalue * resistance).tocsc()
        displaced = scipy.sparse.linalg.spsolve(matrix, forces[dofs])
        at_nodes = np.isin(dofs, (network.node_dofs[:, None] + np.arange(3)).ravel())
        amplitude = float(np.abs(displaced[at_nodes]).max(initial=0.0)) / found.size
        label = network.labels[dofs[0]]
        amplitude = max(amplitude, float(moved[label]) * found.time / found.size)
        if amplitude <= NOTICED and network.stressed:
            # Stress without a force, as in a twisted ring, may be unstable: it may move as far as its energy
            # takes the slowest mode.
            own = resistance.diagonal()[at_nodes].sum() / 3.0
            reach = math.sqrt(2.0 * network.energy(label) / (found.eigenvalue * own))
            amplitude = max(amplitude, reach / found.size)
        if not np.isfinite(amplitude) or amplitude > NOTICED:
            steps.append(_rounded(RELAXATION_SHARE * found.time))
        elif amplitude > 0.0:
            steps.append(_rounded(MOVE_PER_STEP * found.time / amplitude))
    return steps


def _rounded(step: float) -> float:
    """Return a step to three digits: the last ones of an eigenvalue change with the machine."""
    return float(f"{step:.2e}")


def _clamp_speeds(network: Network) -> FloatArray:
    """Return the fastest velocity of a clamp beside each filament [m/s]."""
    speeds = np.zeros(network.labels.max(initial=-1) + 2)
    scene = network.scene
    offset = np.concatenate([[0], np.cumsum([len(rod.nodes) for rod in scene.rods])])
    ends = network.edges
    for clamp in scene.clamps:
        speed = largest_speed(clamp)
        if speed > 0.0 and len(clamp.nodes):
            held = offset[clamp.rod] + np.array(clamp.nodes)
            beside = np.unique(ends[np.isin(ends, held).any(axis=1)])
            labels = np.unique(network.labels[network.node_dofs[beside]])
            speeds[labels] = np.maximum(speeds[labels], speed)
    speeds[-1] = 0.0
    return speeds
