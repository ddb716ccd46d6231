"""Scenes in which rods touch, with what theory says of them; shared by tests and the validation page."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from flagrs import Clamp, Contact, Fluid, Material, PointLoad, Rod, Scene, Simulation
from flagrs.contact import segment_distance

Array = npt.NDArray[np.float64]

SILICONE = Material(youngs_modulus=1e6, density=1200.0)
GRAVITY = 9.81


def held(rod: int, edge_count: int, **motion: object) -> Clamp:
    """Return the clamp of all of a rod."""
    return Clamp(rod=rod, nodes=tuple(range(edge_count + 1)), edges=tuple(range(edge_count)), **motion)


def radii(scene: Scene) -> Array:
    """Return the radius (E,) of every edge [m]."""
    return np.concatenate([rod.radius_array() for rod in scene.rods])


def pairs_apart(scene: Scene) -> npt.NDArray[np.int64]:
    """Return all pairs (P, 2) of edges of chains that may touch, found without the library's own search."""
    chains, starts = [], []
    for index, rod in enumerate(scene.rods):
        ends = np.concatenate([[0.0], np.cumsum(rod.rest_lengths())])
        chains.append(np.full(len(ends) - 1, index))
        starts.append(np.stack([ends[:-1], ends[1:]], axis=1))
    chain, span, radius = np.concatenate(chains), np.concatenate(starts), radii(scene)
    a, b = np.triu_indices(len(chain), 1)
    along = span[b, 0] - span[a, 1]
    apart = (chain[a] != chain[b]) | (along >= np.pi / 2.0 * (radius[a] + radius[b]))
    return np.stack([a[apart], b[apart]], axis=1)


class Watch:
    """Measures how close edges come, pair by pair."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.edges = simulation.edges
        self.pairs = pairs_apart(simulation.scene)
        self.thickness = radii(simulation.scene)[self.pairs].sum(axis=1)
        self.least = np.inf

    def closest(self) -> float:
        """Return the smallest distance over the sum of radii, and remember it."""
        x = self.simulation.nodes
        (a, b) = self.edges[self.pairs[:, 0]], self.edges[self.pairs[:, 1]]
        distance = segment_distance(x[a[:, 0]], x[a[:, 1]], x[b[:, 0]], x[b[:, 1]])[0]
        now = float((distance / self.thickness).min())
        self.least = min(self.least, now)
        return now


def contact_forces(simulation: Simulation) -> tuple[npt.NDArray[np.int64], Array, Array]:
    """Return pairs of edges (P, 2), the force (P, 3) on the first of each [N] and its size (P,)."""
    state = simulation.state()
    pairs, sizes = state["contact_pairs"].astype(np.int64), state["contact_forces"]
    x, edges = simulation.nodes, simulation.edges
    (a, b) = edges[pairs[:, 0]], edges[pairs[:, 1]]
    _, s, t = segment_distance(x[a[:, 0]], x[a[:, 1]], x[b[:, 0]], x[b[:, 1]])
    along = x[a[:, 0]] + s[:, None] * (x[a[:, 1]] - x[a[:, 0]])
    along -= x[b[:, 0]] + t[:, None] * (x[b[:, 1]] - x[b[:, 0]])
    return pairs, sizes[:, None] * along / np.linalg.norm(along, axis=1)[:, None], sizes


def drag(simulation: Simulation) -> Array:
    """Return the force (N, 3) of the nodes on the fluid [N]."""
    force: Array = (simulation.resistance() @ simulation.velocities.ravel()).reshape(-1, 3)
    return force


# --- a rod on an incline -----------------------------------------------------------------------------------


def incline(angle: float, friction: float, slip_velocity: float, lengthwise: bool = False) -> Scene:
    """Return a short stiff rod on two fixed rails, under gravity tilted by an angle [rad] towards +x.

    It lies across the rails and slides sideways, along them; or, lengthwise, along itself across them.
    """
    length, radius = 0.02, 1e-3
    direction = np.array([0.0, 1.0, 0.0])
    across = np.array([1.0, 0.0, 0.0]) if lengthwise else direction
    rail = np.array([0.0, 1.0, 0.0]) if lengthwise else np.array([1.0, 0.0, 0.0])
    stiff = Material(youngs_modulus=1e9, density=2000.0)
    rails = [
        Rod.straight(
            length=0.2,
            edge_count=20,
            radius=radius,
            material=stiff,
            start=tuple(side * 0.006 * across - 0.1 * rail + np.array([0.0013, 0.0013, 0.0]) * rail),
            direction=tuple(rail),
        )
        for side in (-1.0, 1.0)
    ]
    rod = Rod.straight(
        length=length,
        edge_count=5,
        radius=radius,
        material=stiff,
        start=tuple(-0.5 * length * across + np.array([0.0, 0.0, 2.0 * radius])),
        direction=tuple(across),
    )
    return Scene(
        rods=(rod, *rails),
        fluid=Fluid(viscosity=1.0, model="RFT"),
        clamps=(held(1, 20), held(2, 20)),
        gravity=GRAVITY * np.array([np.sin(angle), 0.0, -np.cos(angle)]),
        contact=Contact(friction=friction, slip_velocity=slip_velocity),
    )


def incline_theory(simulation: Simulation, angle: float) -> float:
    """Return the velocity along the incline [m/s] from the balance of weight, Coulomb's friction and drag."""
    scene = simulation.scene
    contact = scene.contact
    assert contact is not None and contact.slip_velocity is not None
    rod, mu, slip = scene.rods[0], contact.friction, contact.slip_velocity
    count = len(rod.nodes)
    resistance = simulation.resistance()[: 3 * count : 3, : 3 * count : 3].sum()
    volume = np.pi * rod.radius_array()[0] ** 2 * rod.rest_lengths().sum()
    weight = rod.material.density * volume * GRAVITY
    pull, normal = weight * np.sin(angle), weight * np.cos(angle)
    if pull - mu * normal >= resistance * slip:
        return float((pull - mu * normal) / resistance)
    # mu N (v / nu) (2 - v / nu) + zeta v = pull, a quadratic in v / nu, its smaller root.
    a, b = mu * normal, 2.0 * mu * normal + resistance * slip
    return float(slip * 2.0 * pull / (b + np.sqrt(b * b - 4.0 * a * pull)))


def incline_velocity(angle: float, friction: float, slip_velocity: float, lengthwise: bool = False) -> tuple[float, float, float]:
    """Return velocity along the incline, theory's [m/s], and the power of friction [W]."""
    simulation = Simulation(incline(angle, friction, slip_velocity, lengthwise), dt=2e-3, threads=1)
    theory = incline_theory(simulation, angle)
    # Settle, then take as large steps as move the rod by a tenth of its diameter.
    simulation.step(100)
    simulation.dt = min(1e-3 / max(theory, 1e-9), 1.0) * 0.1
    simulation.step(10)
    count = len(simulation.scene.rods[0].nodes)
    velocity = float(simulation.velocities[:count, 0].mean())
    force = drag(simulation)[:count].sum(axis=0)
    rod = simulation.scene.rods[0]
    weight = rod.material.density * np.pi * rod.radius_array()[0] ** 2 * rod.rest_lengths().sum() * simulation.scene.gravity
    _, contact, _ = contact_forces(simulation)
    rubbing = force - weight - contact.sum(axis=0)  # what is left of the balance is friction
    return velocity, theory, float(rubbing[0] * velocity)
