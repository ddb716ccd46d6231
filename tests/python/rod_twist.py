"""Rods twisted by many turns, with a known equilibrium or limit; shared by tests and the validation page."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt
from flagrs import Clamp, Fluid, Material, Rod, Scene, Simulation
from rod_statics import lowest_eigenvalue, ring, settle
from scipy.linalg import eigvals
from scipy.optimize import brentq

Array = npt.NDArray[np.float64]

#: Twirling to whirling: zeta_r Omega L^2 / EI of a clamped filament in local drag, and the frequency over
#: EI / (zeta L^4) (spectral, 40 modes).
WHIRLING = 8.86514
WHIRLING_FREQUENCY = 22.846

# --- Michell's ring, its frames turned ---------------------------------------------------------------------


def turned_ring(edge_count: int, turns: int, stiffness_ratio: float) -> Simulation:
    """Return a flat ring whose frames are turned by whole turns, evenly; it has no natural twist."""
    simulation = Simulation(ring(edge_count, 0.0, stiffness_ratio), threads=1)
    state = simulation.state()
    twist = 2.0 * np.pi * turns
    state["q"][simulation.dof_of_edge] = twist * np.arange(edge_count) / edge_count
    # Whole turns of a closed ring are not seen in its directors: the hinge that closes it carries them.
    closing = simulation.scene.rods[0].hinge_array().tolist().index([edge_count - 1, 0])
    state["twists"][closing] += twist
    simulation.load_state(state)
    return simulation


def critical_turns(edge_count: int, turns: int) -> float:
    """Return ``turns`` over Michell's sqrt(3) EI / GJ, where the ring of this mesh loses its stability."""
    michell = turns / np.sqrt(3.0)
    crossing = brentq(
        lambda share: lowest_eigenvalue(turned_ring(edge_count, turns, michell / share)), 0.5, 1.5, xtol=1e-7
    )
    return float(crossing)


# --- twirling to whirling ----------------------------------------------------------------------------------


def twirling(edge_count: int, speed: float, stiffness_ratio: float, bend: float = 0.0) -> Simulation:
    """Return a straight filament that twirls steadily, turned by a clamp at its base, in local drag.

    Lengths are of order one, EI = 1. The clamped edge reaches half an edge to either side of the wall, so
    that ``L = edge_count + 1/2`` edges.

    Parameters
    ----------
    edge_count
        Free edges.
    speed
        ``zeta_r Omega L^2 / EI``.
    stiffness_ratio
        ``GJ / EI``.
    bend
        Size of a first disturbance over L, a spiral that meets the wall at a right angle.
    """
    edge = 1.0 / (edge_count + 0.5)
    radius = 0.02
    material = Material(youngs_modulus=1e6, density=1000.0)
    fluid = Fluid(viscosity=1.0, density=1000.0, model="RFT")
    drag = 4.0 * np.pi * fluid.viscosity * radius**2
    x = edge * (np.arange(edge_count + 2) - 0.5)
    shape = np.clip(x, 0.0, None) ** 2
    nodes = np.stack([x, bend * shape * np.cos(x), bend * shape * np.sin(x)], axis=1)
    # The torque at a hinge is what turns all edges beyond it.
    torque = speed * edge * np.arange(edge_count, 0, -1)
    theta = -np.concatenate([[0.0], np.cumsum(torque * edge / stiffness_ratio)])
    rod = Rod(
        nodes=nodes,
        rest_nodes=np.stack([x, 0.0 * x, 0.0 * x], axis=1),
        material=material,
        radius=radius,
        EA=1e4,
        EI=1.0,
        GJ=stiffness_ratio,
        theta=theta,
        director=np.array([0.0, 0.0, 1.0]),
    )
    clamp = Clamp(nodes=(0, 1), edges=(0,), angular_velocity=speed / drag)
    return Simulation(Scene(rods=(rod,), fluid=fluid, clamps=(clamp,)), threads=1)


def whirling_modes(edge_count: int, speed: float, stiffness_ratio: float) -> Array:
    """Return the eigenvalues of a small disturbance of the twirling filament, over EI / (zeta L^4), complex.

    The linear operator is that of resistance and Hessian, with what the Hessian leaves out: the twisting
    moment per edge that the fluid balances follows the tangent and has no potential
    (docs/theory, "Holonomy"; the second derivative of a spin has the antisymmetric part -[t]_x / 2).
    """
    simulation = twirling(edge_count, speed, stiffness_ratio)
    hessian = simulation.hessian().toarray()
    moments = simulation.gradient()[simulation.dof_of_edge]
    nodes, edges = simulation.nodes, simulation.edges
    vectors = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    for moment, vector, ends in zip(moments, vectors, edges, strict=True):
        x, y, z = vector / np.linalg.norm(vector) ** 3
        spin = 0.5 * moment * np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        for i, own in enumerate(ends):
            for j, other in enumerate(ends):
                rows = simulation.dof_of_node[own] + np.arange(3)
                columns = simulation.dof_of_node[other] + np.arange(3)
                hessian[np.ix_(rows, columns)] += (1.0 if i == j else -1.0) * spin
    across = np.array([1, 2])
    free = np.arange(2, len(nodes))
    at = (simulation.dof_of_node[free][:, None] + across).ravel()
    in_fluid = (3 * free[:, None] + across).ravel()
    resistance = simulation.resistance()
    # L = 1: zeta is the resistance of a node in the middle over its share of the length.
    zeta = resistance[3 * (edge_count // 2) + 1, 1::3].sum() * (edge_count + 0.5)
    among = resistance[np.ix_(in_fluid, in_fluid)]
    modes: Array = eigvals(-np.linalg.solve(among, hessian[np.ix_(at, at)])) * zeta
    return modes


def growth(edge_count: int, speed: float, stiffness_ratio: float) -> float:
    """Return the largest growth rate of a disturbance of the twirling filament."""
    return float(whirling_modes(edge_count, speed, stiffness_ratio).real.max())


def whirling_speed(edge_count: int, stiffness_ratio: float) -> float:
    """Return ``zeta_r Omega L^2 / EI`` at which the filament of this mesh begins to whirl."""
    return float(brentq(lambda speed: growth(edge_count, speed, stiffness_ratio), 6.0, 11.0, xtol=1e-8))


# --- localized buckling ------------------------------------------------------------------------------------

#: PyElastica's case: length, EI, GJ, and the dimensionless moment M L / EI and tension T L^2 / EI of its
#: equilibrium at a slack of 3 and 27 turns.
BUCKLED_LENGTH, BUCKLED_EI, BUCKLED_GJ = 100.0, 1.345, 0.789
MOMENT, TENSION = 98.541, 2900.99


def buckled_cosine(s: Array) -> Array:
    """Return the cosine between tangent and axis of the localized solution, at ``s`` from its middle."""
    least = MOMENT**2 / (2.0 * TENSION) - 1.0
    width = np.sqrt(0.5 * TENSION * (1.0 - least)) / BUCKLED_LENGTH
    cosine: Array = 1.0 - (1.0 - least) / np.cosh(width * s) ** 2
    return cosine


def buckled_rod(edge_count: int) -> Scene:
    """Return a rod that starts near the localized solution, its end edges clamped with 27 turns between them.

    The clamped edges reach half an edge beyond either end, so that ``L = edge_count - 1`` edges.
    """
    edge = BUCKLED_LENGTH / (edge_count - 1)
    fine = np.linspace(-0.5, 0.5, 200 * edge_count + 1) * edge * edge_count
    cosine = buckled_cosine(0.5 * (fine[1:] + fine[:-1]))
    step = np.diff(fine)
    # The axial moment is conserved: psi' = (M / EI) / (1 + cos phi).
    precession = np.cumsum(MOMENT / BUCKLED_LENGTH / (1.0 + cosine) * step)
    sine = np.sqrt(1.0 - cosine**2)
    tangent = np.stack([cosine, sine * np.cos(precession), sine * np.sin(precession)], axis=1)
    points = np.concatenate([np.zeros((1, 3)), np.cumsum(tangent * step[:, None], axis=0)])[::200]
    straight = np.zeros((edge_count + 1, 3))
    straight[:, 0] = edge * np.arange(edge_count + 1)
    up = np.array([0.0, 0.0, 1.0])
    rod = Rod(
        nodes=points,
        rest_nodes=straight,
        material=Material(youngs_modulus=1e6, density=1000.0),
        radius=0.35,
        EA=1e5,
        EI=BUCKLED_EI,
        GJ=BUCKLED_GJ,
        theta=np.linspace(0.0, end_angle(points, up, MOMENT * BUCKLED_EI / BUCKLED_GJ), edge_count),
        director=up,
    )
    ends = (0, 1, edge_count - 1, edge_count)
    clamp = Clamp(nodes=ends, edges=(0, edge_count - 1))
    return Scene(rods=(rod,), fluid=Fluid(viscosity=1.0, density=1000.0, model="RFT"), clamps=(clamp,))


def end_angle(points: Array, director: Array, near: float) -> float:
    """Return the angle of the last edge nearest to ``near`` at which its frame stands like the first edge's.

    Both ends point the same way. Twist and writhe together are then whole turns, also on a coarse mesh.
    """
    vectors = np.diff(points, axis=0)
    tangents = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    moved = director
    for old, new in pairwise(tangents):
        axis = np.cross(old, new)
        moved = (old @ new) * moved + np.cross(axis, moved) + (axis @ moved) / (1.0 + old @ new) * axis
    angle = np.arctan2(tangents[-1] @ np.cross(moved, director), moved @ director)
    return float(angle + 2.0 * np.pi * np.round((near - angle) / (2.0 * np.pi)))


def least_cosine(edge_count: int) -> float:
    """Return the least cosine between tangent and axis at rest, between edges by a parabola."""
    simulation = settle(buckled_rod(edge_count))
    vectors = np.diff(simulation.nodes, axis=0)
    cosine = vectors[:, 0] / np.linalg.norm(vectors, axis=1)
    k = int(np.argmin(cosine))
    left, here, right = cosine[k - 1 : k + 2]
    return float(here - (right - left) ** 2 / (8.0 * (left - 2.0 * here + right)))
