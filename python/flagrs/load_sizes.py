"""How large the loads of a scene are, at the nodes and edges they act on."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from flagrs.scene.values import FloatArray, IntArray
from flagrs.time_step import samples


def nodal_loads(native: Mapping[str, Any], nodes: FloatArray, edges: IntArray) -> FloatArray:
    """Return nodal forces (N, 3) as large as a scene's loads at their largest [N].

    Torques are pairs of forces on the ends of their edge, across it; loads that turn with the rod count as if
    they did not.

    Parameters
    ----------
    native
        The scene as `flagrs.assemble.native_scene` gives it.
    nodes, edges
        Positions (N, 3) [m], and start and end node (E, 2) of the edges.
    """
    forces = np.zeros_like(nodes)
    vectors = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    lengths = np.linalg.norm(vectors, axis=1)
    for load in native["loads"]:
        size = np.array([_largest(signal) for signal in load["signal"]])
        own = np.array(load["edges"], dtype=np.int64)
        match load["kind"]:
            case "node force":
                forces[load["nodes"][0]] += size
            case "force per length":
                for end in (0, 1):
                    np.add.at(forces, edges[own, end], 0.5 * lengths[own, None] * size)
            case "edge torque":
                _add_pairs(forces, edges[own], vectors[own], float(np.linalg.norm(size)) / lengths[own])
            case _:
                _add_pairs(forces, edges[own], vectors[own], np.full(len(own), float(np.linalg.norm(size))))
    for edge, torque in _magnetic_torques(native, nodes):
        at = np.array([edge])
        _add_pairs(forces, edges[at], vectors[at], torque / lengths[at])
    return forces


def _magnetic_torques(native: Mapping[str, Any], nodes: FloatArray) -> Iterator[tuple[int, float]]:
    magnetism = native["magnetism"]
    if magnetism is None:
        return
    reach = float(np.abs(nodes).max())
    field = math.hypot(*(_largest(signal) for signal in magnetism["field"]))
    field += reach * float(np.linalg.norm(magnetism["gradient"]))
    for edge, moment in magnetism["moments"]:
        yield edge, field * math.hypot(*moment)


def _add_pairs(forces: FloatArray, ends: IntArray, vectors: FloatArray, sizes: FloatArray) -> None:
    for (first, last), vector, size in zip(ends, vectors, sizes, strict=True):
        across = np.cross(vector, np.eye(3)[int(np.abs(vector).argmin())])
        force = across / np.linalg.norm(across) * size
        forces[first] -= force
        forces[last] += force


def _largest(signal: Any) -> float:
    """Return the value of largest magnitude of a signal as the core takes it, at sampled instants."""
    if isinstance(signal, float):
        return signal
    if callable(signal[0]):
        values = [_value(signal[0], float(time)) for time in samples()[0]]
    else:
        values = signal[1].tolist()
    return max(values, key=abs)


def _value(function: Any, time: float) -> float:
    # A function that fails says so in the run that reaches this time.
    try:
        value = float(function(time))
    except Exception:
        return 0.0
    return value if math.isfinite(value) else 0.0
