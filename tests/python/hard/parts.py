"""Rods, clamps and ways of running that several hard cases share."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from flagrs import Clamp, Fluid, Material, PointLoad, Rod, Scene, Simulation

Array = npt.NDArray[np.float64]

SILICONE = Material(youngs_modulus=1e6, density=1200.0)
LOCAL = Fluid(viscosity=1.0, model="RFT")


def arc(length: float, turn: float, edge_count: int) -> Array:
    """Return the nodes (N, 3) of a chain of equal edges that turns by an angle [rad] in z = 0 [m]."""
    angle = turn * (np.arange(edge_count) + 0.5) / edge_count
    edges = length / edge_count * np.stack([np.cos(angle), np.sin(angle), np.zeros(edge_count)], axis=1)
    return np.concatenate([np.zeros((1, 3)), np.cumsum(edges, axis=0)])


def straight(length: float, edge_count: int) -> Array:
    """Return the nodes (N, 3) of a straight rod along x [m]."""
    return np.linspace(0.0, length, edge_count + 1)[:, None] * [1.0, 0.0, 0.0]


def placed(nodes: Array, shift: tuple[float, float, float]) -> Array:
    """Return nodes (N, 3) moved by a shift (3,) [m]."""
    return np.asarray(nodes + np.array(shift))


def bow(scale: float = 1.0, material: Material = SILICONE, edge_count: int = 8, **options: Any) -> Rod:
    """Return a straight rod of 20 mm times a scale, let go from an arc of a quarter turn."""
    return Rod(
        nodes=scale * arc(0.02, np.pi / 2.0, edge_count),
        rest_nodes=scale * straight(0.02, edge_count),
        radius=scale * 0.5e-3,
        material=material,
        **options,
    )


def settle(scene: Scene, growth: float = 1.5, **options: Any) -> Simulation:
    """Return a simulation at rest: steps that grow until nothing moves any more."""
    simulation = Simulation(scene, threads=1, **({"rtol": None} | options))
    size = float(np.ptp(simulation.nodes, axis=0).max())
    for _ in range(300):
        simulation.step()
        if np.abs(simulation.velocities).max() * simulation.dt < 1e-12 * size and simulation.dt > 1e3:
            return simulation
        simulation.dt *= growth
    raise AssertionError("the rod does not come to rest")


def cantilever(nodes: Array, force: Array, rod: dict[str, Any] | None = None) -> Scene:
    """Return a chain whose first edge is clamped, with a force (3,) on its last node [N]."""
    options = {"radius": 1e-3, "material": SILICONE} | (rod or {})
    return Scene(
        rods=Rod(nodes=nodes, **options),
        fluid=LOCAL,
        clamps=Clamp(nodes=(0, 1), edges=(0,)),
        loads=PointLoad(node=len(nodes) - 1, force=force),
    )


def elapsed(simulation: Simulation, until: float) -> Array:
    """Return the nodes (N, 3) at a time, without a file [m]."""
    trajectory = simulation.run(until=until, save_every=until, path=False)
    return np.asarray(trajectory.nodes[-1])


def apart(found: Array, reference: Array, size: float) -> float:
    """Return the largest distance of nodes over a size."""
    return float(np.linalg.norm(found - reference, axis=-1).max() / size)
