"""Loads, magnetism and background flows of a scene as plain arrays for the native core."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flagrs.errors import faulty
from flagrs.scene import (
    Clamp,
    LinearFlow,
    LineLoad,
    PointLoad,
    PoiseuilleFlow,
    Rod,
    Scene,
    Table,
    TimeFunction,
    VectorSignal,
)
from flagrs.scene.flow import Flow
from flagrs.scene.signal import RESOLUTION, Signal
from flagrs.scene.values import FloatArray
from flagrs.scene.vector_signal import components, is_zero, vector_at


def native_signal(signal: Signal, field: str) -> Any:
    """Return a number, samples (times, values), or a function with its breaks, resolution and field."""
    if isinstance(signal, Table):
        return np.array(signal.times), np.array(signal.values)
    if isinstance(signal, TimeFunction):
        return signal.function, np.array(signal.breaks), signal.resolution, field
    if callable(signal):
        return signal, np.zeros(0), RESOLUTION, field
    return float(signal)


def native_vector(signal: VectorSignal, field: str) -> list[Any]:
    """Return a vector signal as three signals of the core."""
    return [native_signal(component, field) for component in components(signal)]


def native_loads(scene: Scene, given: Scene) -> list[dict[str, Any]]:
    """Return the loads, each a force or a torque with its place, frame and three signals.

    Parameters
    ----------
    scene
        The scene of the moment.
    given
        The scene that the equations were made from: what acts there is here even if it is zero now.
    """
    found = []
    for position, load in enumerate(scene.loads):
        place = _point(scene, load, position) if isinstance(load, PointLoad) else _line(scene, load)
        for kind, signal, where in place:
            if ("torque" if "torque" in kind else "force") in given.loads[position].acting:
                material = load.frame == "material"
                found.append(
                    {
                        "kind": kind,
                        "material": material,
                        "signal": native_vector(signal, f"loads[{position}]"),
                        **where,
                    }
                )
    return found


def _point(scene: Scene, load: PointLoad, position: int) -> list[tuple[str, VectorSignal, dict[str, Any]]]:
    rod = scene.rods[load.rod]
    needs_edge = load.frame == "material" or not is_zero(load.torque)
    edge = load.edge if load.edge is not None else (_edge_at(rod, load, position) if needs_edge else 0)
    if load.frame == "material" and load.node is not None and load.node not in rod.edge_array()[edge]:
        raise faulty(
            f"loads[{position}].edge", f"edge {edge} does not end at node {load.node}", "an edge that does"
        )
    node = 0 if load.node is None else load.node
    where = {
        "nodes": [scene.node_offset(load.rod) + node],
        "edges": [scene.edge_offset(load.rod) + edge],
    }
    return [("node force", load.force, where), ("edge torque", load.torque, where)]


def _edge_at(rod: Rod, load: PointLoad, position: int) -> int:
    here = np.flatnonzero((rod.edge_array() == load.node).any(axis=1))
    if len(here) != 1:
        raise faulty(
            f"loads[{position}].edge",
            f"missing, and node {load.node} has {len(here)} edges",
            "one of its edges",
        )
    return int(here[0])


def _line(scene: Scene, load: LineLoad) -> list[tuple[str, VectorSignal, dict[str, Any]]]:
    own = range(len(scene.rods[load.rod].edge_array())) if load.edges is None else load.edges
    where = {"nodes": [], "edges": [scene.edge_offset(load.rod) + edge for edge in own]}
    return [("force per length", load.force, where), ("torque per length", load.torque, where)]


def native_magnetism(scene: Scene) -> dict[str, Any] | None:
    """Return the moments of magnetised edges and the field they are in; None without either."""
    field = scene.magnetic_field
    moments = [
        (scene.edge_offset(k) + edge, moment.tolist())
        for k, rod in enumerate(scene.rods)
        if rod.magnetization is not None
        for edge, moment in enumerate(moments_of(rod))
    ]
    if field is None or not moments:
        return None
    return {
        "moments": moments,
        "field": native_vector(field.field, "magnetic_field.field"),
        "gradient": field.gradient.tolist(),
    }


def moments_of(rod: Rod) -> FloatArray:
    """Return the magnetic moment (E, 3) of each edge on ``m1, m2, t`` [A m^2]: magnetization times volume."""
    volume = math.pi * rod.radius_array() ** 2 * rod.rest_lengths()
    given = np.zeros(3) if rod.magnetization is None else rod.magnetization
    return np.broadcast_to(given, (len(volume), 3)) * volume[:, None]


def native_flows(scene: Scene) -> list[dict[str, Any]]:
    """Return the background flows."""
    flows = () if scene.fluid is None else scene.fluid.background
    return [_flow(flow, f"fluid.background[{position}]") for position, flow in enumerate(flows)]


def _flow(flow: Flow, field: str) -> dict[str, Any]:
    if isinstance(flow, LinearFlow):
        return {
            "kind": "linear",
            "velocity": native_vector(flow.velocity, f"{field}.velocity"),
            "gradient": flow.gradient.tolist(),
            "strength": native_signal(flow.strength, f"{field}.strength"),
            "center": flow.center.tolist(),
        }
    if isinstance(flow, PoiseuilleFlow):
        return {
            "kind": "poiseuille",
            "direction": flow.direction.tolist(),
            "normal": None if flow.normal is None else flow.normal.tolist(),
            "center": flow.center.tolist(),
            "radius": flow.radius,
            "speed": native_signal(flow.speed, f"{field}.speed"),
        }
    return {"kind": "function", "function": flow.function, "reach": flow.reach}


def largest_load(scene: Scene, load: PointLoad | LineLoad) -> float:
    """Return the force per length that a load puts on its rod, at the instants it is sampled [N/m]."""
    length = float(scene.rods[load.rod].rest_lengths().sum())
    force, torque = (
        max(float(np.linalg.norm(vector_at(signal, time))) for time in _instants(signal))
        for signal in (load.force, load.torque)
    )
    if isinstance(load, LineLoad):
        return force + torque / length
    return force / length + torque / length**2


def largest_speed(clamp: Clamp) -> float:
    """Return the largest speed at which a clamp shifts its nodes, at sampled instants [m/s]."""
    given = max(float(np.linalg.norm(vector_at(clamp.velocity, time))) for time in _instants(clamp.velocity))
    if is_zero(clamp.displacement):
        return given
    times = _instants(clamp.displacement)
    places = np.array([vector_at(clamp.displacement, time) for time in times])
    steps = (
        np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(times) if len(times) > 1 else np.zeros(1)
    )
    return given + float(steps.max())


def _instants(signal: VectorSignal) -> FloatArray:
    if isinstance(signal, Table):
        return signal.times
    return np.zeros(1) if isinstance(signal, np.ndarray) else np.linspace(0.0, 1.0, 11)
