"""Motions with known invariants or limits, shared by the tests and the validation page."""

from __future__ import annotations

import numpy as np
from flagrs import Fluid, Material, Rod, Scene, Simulation

#: Lim et al.'s flagellum, short: helix radius, pitch and axial length, rod radius, regularization [m].
HELIX = {"helix_radius": 6.36e-3, "pitch": 7 * 6.36e-3, "axial_length": 45e-3, "radius": 1.6e-3}
EPSILON = 1.65e-3


def moved(scene: Scene, rotation: np.ndarray, shift: np.ndarray) -> Scene:
    """Return the scene with its rods rotated about the origin, then shifted [m]."""

    def place(nodes: np.ndarray) -> np.ndarray:
        return nodes @ rotation.T + shift

    rods = [rod.replace(nodes=place(rod.nodes), rest_nodes=place(rod.rest_array())) for rod in scene.rods]
    return scene.replace(rods=tuple(rods))


def imbalance(simulation: Simulation) -> tuple[float, float]:
    """Make a step and return total force and torque on a free robot over the sums of their parts' sizes.

    Everything that acts from outside is computed here, from the resistance before the step, the new
    velocities and the arms of the new positions, at which the balance of the step is taken: drag of the
    nodes, drag and couple of the head (equations 15 to 18), twist drag about the new tangents.
    """
    scene = simulation.scene
    fluid, head, rod = scene.fluid, scene.head, scene.rods[0]
    assert fluid is not None and head is not None
    resistance, theta = simulation.resistance(), simulation.theta
    simulation.step()
    nodes, edges, velocities = simulation.nodes, simulation.edges, simulation.velocities
    forces = (resistance @ velocities.ravel()).reshape(-1, 3)
    forces[head.node] += head.C_t * 6.0 * np.pi * fluid.viscosity * head.radius * velocities[head.node]
    tangents = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    drag = 4.0 * np.pi * fluid.viscosity * rod.radius_array() ** 2 * rod.rest_lengths() * rod.immersed_array()
    spin = (simulation.theta - theta) / simulation.dt
    twists = (drag * spin * fluid.twist_drag)[:, None] * tangents
    # The head turns as its edges do on average by rest length: across their tangents with their ends, about
    # them with their angle.
    held = np.flatnonzero((edges == head.node).any(axis=1))
    levers = nodes[edges[held, 1]] - nodes[edges[held, 0]]
    opening = velocities[edges[held, 1]] - velocities[edges[held, 0]]
    turning = np.cross(levers, opening) / (levers**2).sum(axis=1)[:, None] + spin[held, None] * tangents[held]
    turn = np.average(turning, axis=0, weights=rod.rest_lengths()[held])
    couple = head.C_r * 8.0 * np.pi * fluid.viscosity * head.radius**3 * turn
    torques = np.concatenate([np.cross(nodes, forces), twists, couple[None]])
    return _share(forces.sum(axis=0), forces), _share(torques.sum(axis=0), torques)


def _share(total: np.ndarray, parts: np.ndarray) -> float:
    return float(np.linalg.norm(total) / np.linalg.norm(parts, axis=1).sum())


def soft_helix(youngs_modulus: float, edge_count: int = 12) -> Scene:
    """Return a free helix in Lim et al.'s fluid, without twist drag."""
    material = Material(youngs_modulus=youngs_modulus, density=1260.0)
    rod = Rod.helix(**HELIX, material=material, edge_count=edge_count)
    return Scene(rods=(rod,), fluid=Fluid(viscosity=1.0, epsilon=EPSILON, twist_drag=False))


def linear_growth(simulation: Simulation, dt: float) -> float:
    """Return the largest factor by which a small disturbance at rest grows in an explicit step of dt [s].

    The scheme's linear map is ``(M + dt^2 H) q' = (2 M - dt Res) q - (M - dt Res) q_before``, with the
    elastic Hessian H; rigid motions, which neither grow nor decay, are left out.
    """
    size = len(simulation.mass)
    rows = (simulation.dof_of_node[:, None] + np.arange(3)).ravel()
    resistance = np.zeros((size, size))
    resistance[np.ix_(rows, rows)] = simulation.resistance()
    mass = np.diag(simulation.mass)
    implicit = mass + dt**2 * simulation.hessian().toarray()
    step = np.linalg.solve(implicit, np.hstack([2.0 * mass - dt * resistance, dt * resistance - mass]))
    factors = np.linalg.eigvals(np.vstack([step, np.eye(size, 2 * size)]))
    return float(np.abs(factors[np.abs(factors - 1.0) > 1e-4]).max())


def linear_limit(simulation: Simulation) -> float:
    """Return the step [s] at which a small disturbance begins to grow in the linear map."""
    bound = simulation.stable_step()
    low, high = 0.9 * bound, 3.0 * bound
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if linear_growth(simulation, middle) < 1.0 + 1e-9 else (low, middle)
    return low


def disturbance_grows(scene: Scene, dt: float, steps: int = 2000) -> bool:
    """Return whether a disturbance of 1e-7 m becomes faster in an explicit run.

    It is followed while it is small, up to 1e-4 m/s. No step may be made in parts: shorter ones are stable
    and would cut the disturbance down.
    """
    simulation = Simulation(scene, scheme="explicit", dt=dt, threads=1)
    noise = np.random.default_rng(1).normal(size=simulation.nodes.shape)
    simulation.set_state(simulation.nodes + 1e-7 * noise)
    speeds = []
    for _ in range(40):
        simulation.step(steps // 40)
        assert simulation.statistics["rejected_steps"] == 0
        speeds.append(float(np.abs(simulation.velocities).max()))
        if speeds[-1] > 1e-4:
            return True
    return speeds[-1] > speeds[9]
