"""A helical spring pulled along its axis."""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse.linalg import spsolve

from flagrs import Simulation
from flagrs.scene import Fluid, Rod, Scene
from flagrs.scene.values import FloatArray
from flagrs.validation.clamped_rod import EA, EI, GJ, MATERIAL, RADIUS
from flagrs.validation.problem import Check, Evidence, converging, errors_panel, problem

HELIX_RADIUS = 0.01


def _length(pitch: float, turns: float) -> float:
    return turns * math.hypot(pitch, 2.0 * math.pi * HELIX_RADIUS)


def _exact(pitch: float, length: float) -> float:
    """Return displacement over force [m/N] of a spring whose end does not turn sideways."""
    sine = pitch / math.hypot(pitch, 2.0 * math.pi * HELIX_RADIUS)
    cosine = math.sqrt(1.0 - sine**2)
    bending = (HELIX_RADIUS * sine) ** 2 / EI
    return length * (bending + (HELIX_RADIUS * cosine) ** 2 / GJ + sine**2 / EA)


def _found(pitch: float, turns: float, count: int) -> float:
    """Return displacement over force [m/N] of the end, rigidly joined to the axis on which the force acts.

    First and last edge are rigid and taken to end at their middles, so that the mesh errs in second order.
    """
    rod = Rod.helix(
        helix_radius=HELIX_RADIUS,
        pitch=pitch,
        axial_length=pitch * turns,
        edge_count=count,
        radius=RADIUS,
        material=MATERIAL,
        EI=EI,
        GJ=GJ,
        EA=EA,
    )
    simulation = Simulation(Scene(rods=(rod,), fluid=Fluid(viscosity=1.0, model="RFT")), threads=1)
    hessian, nodes = simulation.hessian(), simulation.nodes
    at, angles = simulation.dof_of_node[:, None] + np.arange(3), simulation.dof_of_edge
    ends = np.concatenate([at[:2].ravel(), at[-2:].ravel(), angles[[0, -1]]])
    inner = np.setdiff1d(np.arange(hessian.shape[0]), ends)
    cap = _rigid_cap(nodes, at, int(angles[-1]), hessian.shape[0])
    coupling = hessian @ cap
    response = np.asarray(spsolve(hessian[inner][:, inner], coupling[inner]))
    stiffness = cap.T @ coupling - coupling[inner].T @ response
    return float(np.linalg.solve(stiffness, np.eye(6)[0])[0])


def _rigid_cap(
    nodes: FloatArray, at: np.ndarray[tuple[int, int], np.dtype[np.int64]], angle: int, size: int
) -> FloatArray:
    """Return the motion (size, 6) of the last edge by translations and turns about the axis beside it."""
    cap = np.zeros((size, 6))
    middle = 0.5 * (nodes[-1, 0] + nodes[-2, 0])
    tangent = (nodes[-1] - nodes[-2]) / np.linalg.norm(nodes[-1] - nodes[-2])
    for k, axis in enumerate(np.eye(3)):
        for node in (-2, -1):
            cap[at[node], k] = axis
            cap[at[node], 3 + k] = np.cross(axis, nodes[node] - [middle, 0.0, 0.0])
        cap[angle, 3 + k] = tangent @ axis
    return cap


@problem(
    source="A. E. H. Love, Treatise (1927), section 271; W. Thomson and P. G. Tait (1883)",
    quick={"pitches": (0.005, 0.06), "edge_counts": (60, 120, 240)},
    full={"pitches": (0.005, 0.02, 0.06, 0.2), "edge_counts": (60, 120, 240, 480)},
)
def helical_spring(pitches: tuple[float, ...], edge_counts: tuple[int, ...]) -> Evidence:
    """Elongation of a helical spring under a force along its axis: flat ones twist, steep ones bend."""
    turns = 5.0
    checks: list[Check] = []
    errors = {}
    sizes = 1.0 / np.array(edge_counts, dtype=float)
    for pitch in pitches:
        ratio = []
        for count in edge_counts:
            exact = _exact(pitch, _length(pitch, turns) * (1.0 - 1.0 / count))
            ratio.append(_found(pitch, turns, count) / exact)
        values = np.array(ratio)
        label = f"pitch / R = {pitch / HELIX_RADIUS:g}"
        errors[label] = (sizes, values - 1.0)
        checks.append(
            converging(
                f"elongation over Love's, {label}, {turns:g} turns",
                sizes,
                values,
                1.0,
                tolerance=1e-4,
                reason="fourth order of the mesh error of 24 and 48 edges a turn",
                resolution=f"{', '.join(map(str, edge_counts))} edges",
            )
        )
    panel = errors_panel("Error against the mesh", "1 / edges", "relative error of elongation", errors)
    return Evidence(tuple(checks), (panel,))
