"""Rods at rest: equilibria by motion and by Newton's method, and the lowest stiffness at an equilibrium."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh
from scipy.sparse.linalg import spsolve

from flagrs import Scene, Simulation
from flagrs.errors import FlagrsError
from flagrs.scene import PointLoad
from flagrs.scene.values import FloatArray
from flagrs.scene.vector_signal import vector_at


def settle(scene: Scene) -> Simulation:
    """Return a simulation at rest: overdamped steps that grow until nothing moves any more.

    Raises
    ------
    FlagrsError
        If it does not come to rest in 400 steps.
    """
    simulation = Simulation(scene, rtol=None, threads=1)
    size = float(np.ptp(simulation.nodes, axis=0).max())
    for _ in range(400):
        simulation.step()
        if np.abs(simulation.velocities).max() * simulation.dt < 1e-13 * size and simulation.dt > 1e3:
            return simulation
        simulation.dt *= 1.5
    raise FlagrsError("the rod does not come to rest")


def applied(scene: Scene, simulation: Simulation) -> FloatArray:
    """Return the force of weight and point loads on each degree of freedom (ndof,) of a scene of one rod [N].

    Computed here and not asked of the simulator: half of an edge's weight is on each of its ends.
    """
    rod = scene.rods[0]
    weight = rod.material.density * np.pi * rod.radius_array() ** 2 * rod.rest_lengths()
    force = np.zeros(len(simulation.gradient()))
    for edge, (a, b) in enumerate(rod.edge_array()):
        for node in (a, b):
            at = simulation.dof_of_node[node]
            force[at : at + 3] += 0.5 * weight[edge] * scene.gravity
    for load in scene.loads:
        if not isinstance(load, PointLoad) or load.node is None:
            raise FlagrsError("only forces on nodes are known here")
        at = simulation.dof_of_node[load.node]
        force[at : at + 3] += vector_at(load.force, 0.0)
    return force


def free_dofs(
    scene: Scene, simulation: Simulation, axes: tuple[int, ...] = (0, 1, 2)
) -> npt.NDArray[np.intp]:
    """Return the degrees of freedom that no clamp holds: coordinates of some axes, and all angles."""
    clamp = scene.clamps[0]
    nodes = np.setdiff1d(np.arange(len(simulation.nodes)), clamp.nodes)
    edges = np.setdiff1d(np.arange(len(simulation.edges)), clamp.edges)
    moving = simulation.dof_of_node[nodes][:, None] + np.array(axes)
    return np.concatenate([moving.ravel(), simulation.dof_of_edge[edges]]).astype(np.intp)


def balance(scene: Scene, simulation: Simulation, axes: tuple[int, ...]) -> None:
    """Place a scene of one clamped rod at its equilibrium in the span of some axes, stable or not.

    Newton's method on the simulator's gradient and Hessian, from where it stands.

    Raises
    ------
    FlagrsError
        If it does not converge in 30 iterations.
    """
    dofs, force = free_dofs(scene, simulation, axes), applied(scene, simulation)
    at = simulation.dof_of_node[:, None] + np.arange(3)
    size = float(np.ptp(simulation.nodes))
    for _ in range(30):
        rest = (simulation.gradient() - force)[dofs]
        change = np.zeros(len(force))
        change[dofs] = spsolve(simulation.hessian()[dofs][:, dofs], -rest)
        simulation.set_state(simulation.nodes + change[at], simulation.theta + change[simulation.dof_of_edge])
        if np.abs(change[at]).max() < 1e-12 * size:
            return
    raise FlagrsError("Newton's method found no equilibrium")


def lowest_stiffness(scene: Scene, simulation: Simulation, length: float, axes: tuple[int, ...]) -> float:
    """Return the lowest eigenvalue [N/m] of the Hessian where a clamped rod stands.

    Parameters
    ----------
    scene, simulation
        The rod, at an equilibrium.
    length
        What angles are multiplied by [m].
    axes
        Coordinates that deform beside the angles: by symmetry, those across the plane of the equilibrium
        deform on their own. A stiff direction left out spoils no digits.
    """
    dofs = free_dofs(scene, simulation, axes)
    unit = np.ones(len(simulation.gradient()))
    unit[simulation.dof_of_edge] = 1.0 / length
    hessian = simulation.hessian()[dofs][:, dofs].toarray() * unit[dofs] * unit[dofs][:, None]
    return float(eigh(hessian, eigvals_only=True, subset_by_index=(0, 0))[0])
