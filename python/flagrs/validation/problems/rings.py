"""Michell's ring: a twisted ring that leaves its plane."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq

from flagrs import Simulation, scenarios
from flagrs.scene import Scene
from flagrs.validation.clamped_rod import STIFFENING
from flagrs.validation.problem import Check, Curve, Evidence, Panel, converging, errors_panel, problem


def ring(edge_count: int, twist: float, stiffness_ratio: float, turns: int = 0) -> Scene:
    """Return a flat, almost inextensible ring with a total twist.

    Parameters
    ----------
    edge_count
        Number of edges.
    twist
        Total twist [rad].
    stiffness_ratio
        EI / GJ.
    turns
        Turns of the twist that the material frames make along the ring; the rest is made by an opposite
        natural twist of frames that do not turn, which should be the same.
    """
    scene = scenarios.twisted_ring(
        twist=twist - 2.0 * math.pi * turns, edge_count=edge_count, perturbation=0.0
    )
    rod = scene.rods[0]
    bending = float(rod.EI_array()[0, 0, 0])
    natural = np.broadcast_to(np.asarray(rod.natural_twist, dtype=float), edge_count)
    # At the hinge that closes the ring, edge angles fall back from the last to the first.
    closing = np.abs(np.diff(rod.hinge_array(), axis=1)[:, 0]) > 1
    natural = natural - 2.0 * math.pi * turns * closing
    stiff = rod.replace(
        EI=bending,
        GJ=bending / stiffness_ratio,
        EA=STIFFENING * rod.EA_array(),
        natural_twist=natural,
        theta=2.0 * math.pi * turns * np.arange(edge_count) / edge_count,
    )
    return scene.replace(rods=(stiff,))


def michell(stiffness_ratio: float) -> float:
    """Return Michell's critical total twist, 2 pi sqrt(3) EI / GJ [rad]."""
    return 2.0 * math.pi * math.sqrt(3.0) * stiffness_ratio


def lowest_stiffness(edge_count: int, twist: float, stiffness_ratio: float, turns: int = 0) -> float:
    """Return `lowest_eigenvalue` of a `ring`."""
    return lowest_eigenvalue(Simulation(ring(edge_count, twist, stiffness_ratio, turns), threads=1))


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


def critical_twist(edge_count: int, stiffness_ratio: float, turns: int = 0) -> float:
    """Return the total twist [rad] at which the flat ring of this mesh loses its stability."""
    limit = michell(stiffness_ratio)
    crossing = brentq(
        lambda twist: lowest_stiffness(edge_count, twist * limit, stiffness_ratio, turns), 0.5, 1.5, xtol=1e-7
    )
    return float(crossing * limit)


@problem(
    source="J. H. Michell, Messenger of Math. 19 (1889) 68; E. E. Zajac, J. Appl. Mech. 29 (1962) 136",
    quick={"ratios": (0.73,), "turns": (0, 1), "edge_counts": (12, 24, 48)},
    full={"ratios": (0.73, 1.5), "turns": (0, 2), "edge_counts": (12, 24, 48)},
)
def twisted_ring(ratios: tuple[float, ...], turns: tuple[int, ...], edge_counts: tuple[int, ...]) -> Evidence:
    """Twist at which a closed ring of a naturally straight rod leaves its plane, 2 pi sqrt(3) EI / GJ."""
    sizes = 1.0 / np.array(edge_counts, dtype=float)
    checks: list[Check] = []
    errors = {}
    for ratio, wound in product(ratios, turns):
        label = f"EI/GJ = {ratio:g}, frames turned by {wound}"
        found = np.array([critical_twist(count, ratio, wound) for count in edge_counts]) / michell(ratio)
        # Extrapolated once with order two; `converging` does it again with order four.
        once = (4.0 * found[1:] - found[:-1]) / 3.0
        checks.append(
            converging(
                f"critical twist over Michell's, {label}",
                sizes[1:],
                once,
                1.0,
                order=4.0,
                order_tolerance=0.3,
                tolerance=2e-4,
                reason="sixth order of the mesh error of 12, 24 and 48 edges, extrapolated twice: 5e-5",
                resolution=f"{', '.join(map(str, edge_counts))} edges",
            )
        )
        errors[label] = (sizes, found - 1.0)
    shares = np.linspace(0.0, 1.3, 14)
    middle = edge_counts[-2]
    lowest = np.array([lowest_stiffness(middle, x * michell(ratios[0]), ratios[0]) for x in shares])
    panels = (
        Panel(
            "Softest deformation of the ring",
            "twist over Michell's",
            "lowest eigenvalue $\\cdot\\,L^3/EI$",
            (
                Curve(shares, lowest, f"{middle} edges"),
                Curve(np.ones(2), np.array([0.0, lowest.max()]), "theory", "--"),
            ),
        ),
        errors_panel("Error against the mesh", "1 / edges", "relative error of the critical twist", errors),
    )
    return Evidence(tuple(checks), panels)
