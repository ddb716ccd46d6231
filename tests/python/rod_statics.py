"""Rods with a known equilibrium or stability limit, shared by the tests and the validation page."""

from __future__ import annotations

import numpy as np
from flagrs import Scene, Simulation, scenarios
from scipy.linalg import eigh
from scipy.optimize import brentq

#: Factor on a ring's EA: Michell's rod is inextensible; stretching shifts the limit by -EI / (2 EA R^2).
STIFFENING = 1e4


def settle(scene: Scene) -> Simulation:
    """Return a simulation at rest: overdamped steps that grow until nothing moves any more."""
    simulation = Simulation(scene, threads=1)
    size = float(np.ptp(simulation.nodes, axis=0).max())
    for _ in range(400):
        simulation.step()
        if np.abs(simulation.velocities).max() * simulation.dt < 1e-13 * size and simulation.dt > 1e3:
            return simulation
        simulation.dt *= 1.5
    raise AssertionError("the rod does not come to rest")


def cantilever_tip(load: float, edge_count: int) -> np.ndarray:
    """Return vertical and horizontal tip deflection over the length, of ``scenarios.cantilever``."""
    scene = scenarios.cantilever(normalized_load=load, edge_count=edge_count)
    tip = settle(scene).nodes[-1] / cantilever_length(scene)
    return np.array([-tip[2], 1.0 - tip[0]])


def cantilever_length(scene: Scene) -> float:
    """Return the length from the wall at x = 0 to the tip of the unloaded cantilever [m]."""
    return float(scene.rods[0].rest_array()[-1, 0])


def cantilever_compliance(scene: Scene) -> float:
    """Return EI / (EA L^2)."""
    rod = scene.rods[0]
    return float(rod.EI_array()[0, 0, 0] / (rod.EA_array()[0] * cantilever_length(scene) ** 2))


def ring(edge_count: int, twist: float, stiffness_ratio: float) -> Scene:
    """Return a flat, almost inextensible ring with ``EI / GJ = stiffness_ratio`` and a total twist [rad]."""
    scene = scenarios.twisted_ring(twist=twist, edge_count=edge_count, perturbation=0.0)
    rod = scene.rods[0]
    bending = float(rod.EI_array()[0, 0, 0])
    stiff = rod.replace(EI=bending, GJ=bending / stiffness_ratio, EA=STIFFENING * rod.EA_array())
    return scene.replace(rods=(stiff,))


def michell(stiffness_ratio: float) -> float:
    """Return Michell's critical total twist, 2 pi sqrt(3) EI / GJ [rad]."""
    return 2.0 * np.pi * np.sqrt(3.0) * stiffness_ratio


def lowest_stiffness(edge_count: int, twist: float, stiffness_ratio: float) -> float:
    """Return `lowest_eigenvalue` of a flat ring with this natural twist, its frames not turned."""
    return lowest_eigenvalue(Simulation(ring(edge_count, twist, stiffness_ratio), threads=1))


def lowest_eigenvalue(simulation: Simulation) -> float:
    """Return a ring's lowest eigenvalue of the Hessian over EI / L^3, motions without deformation left out.

    These are six rigid motions and the turning of all material frames about the centreline, which costs
    nothing where the rod is naturally straight and its section round. Angles count as displacements by L.
    """
    rod = simulation.scene.rods[0]
    length = float(rod.rest_lengths().sum())
    scale = float(rod.EI_array()[0, 0, 0]) / length**3
    nodes, edges = simulation.nodes, simulation.edges
    tangents = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    at, angles = simulation.dof_of_node[:, None] + np.arange(3), simulation.dof_of_edge
    hessian = simulation.hessian().toarray()
    unit = np.ones(len(hessian))
    unit[angles] = 1.0 / length
    hessian = unit[:, None] * hessian * unit / scale
    free = np.zeros((len(hessian), 7))
    for k, axis in enumerate(np.eye(3)):
        free[at[:, k], k] = 1.0
        free[at, 3 + k] = np.cross(axis, nodes)
        free[angles, 3 + k] = tangents @ axis * length
    free[angles, 6] = 1.0
    basis, _ = np.linalg.qr(free)
    deforming = np.eye(len(hessian)) - basis @ basis.T
    # The motions without deformation are moved out of the way, far above the eigenvalue looked for.
    shifted = deforming @ hessian @ deforming + 1e6 * basis @ basis.T
    return float(eigh(shifted, eigvals_only=True, subset_by_index=(0, 0))[0])


def critical_twist(edge_count: int, stiffness_ratio: float) -> float:
    """Return the total twist [rad] at which the flat ring of this mesh loses its stability."""
    limit = michell(stiffness_ratio)
    crossing = brentq(
        lambda twist: lowest_stiffness(edge_count, twist * limit, stiffness_ratio), 0.5, 1.5, xtol=1e-7
    )
    return float(crossing * limit)
