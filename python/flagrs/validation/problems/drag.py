"""Drag of tori, spheroids and cylinders, and the integrals that it is made of."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import quad

from flagrs import Simulation, fluid
from flagrs.scene import Fluid, Material, Rod, Scene
from flagrs.validation.drag_references import cylinder_series, spheroid_drag, torus_reference
from flagrs.validation.filaments import SLENDER, graded_rod, spheroid, torus, torus_drag
from flagrs.validation.problem import Check, Curve, Evidence, Panel, converging, errors_panel, problem

_TORUS_REASON = "slender-body theory, 0.2 (a/R)^2 ln(8R/a), and 3e-6 of the mesh's fourth order"


def _torus_tolerance(ratio: float) -> float:
    return 0.3 * ratio**2 * math.log(8.0 / ratio) + 3e-6


@problem(
    source="R. Cortez, D. Cromer and L. Fauci; quadrature of the regularized Stokeslet by QUADPACK",
    quick={"count": 20},
    full={"count": 300},
)
def segment_integrals(count: int) -> Evidence:
    """Flow of a regularized Stokeslet segment with a linear force density, against adaptive quadrature."""
    rng = np.random.default_rng(7)
    worst = 0.0
    for _ in range(count):
        ends, density = rng.normal(size=(2, 3)), rng.normal(size=(2, 3))
        epsilon = 10.0 ** rng.uniform(-2.0, 0.5)
        point = ends[0] + rng.uniform(-0.5, 1.5) * (ends[1] - ends[0]) + epsilon * rng.normal(size=3)
        found = fluid.velocity(point[None], ends, [[0, 1]], density, 1.0, epsilon)[0]

        def flow(s: float, axis: int, ends=ends, density=density, point=point, epsilon=epsilon) -> float:  # type: ignore[no-untyped-def]
            offset = point - ends[0] - s * (ends[1] - ends[0])
            force = density[0] + s * (density[1] - density[0])
            square = float(offset @ offset)
            top = (square + 2.0 * epsilon**2) * force[axis] + (offset @ force) * offset[axis]
            return float(top / (square + epsilon**2) ** 1.5)

        length = float(np.linalg.norm(ends[1] - ends[0]))
        exact = np.array(
            [quad(flow, 0.0, 1.0, args=(k,), epsabs=1e-13, epsrel=1e-12, limit=200)[0] for k in range(3)]
        )
        exact *= length / (8.0 * math.pi)
        worst = max(worst, float(np.abs(found - exact).max() / np.abs(exact).max()))
    check = Check(
        "largest relative error of a velocity",
        worst,
        0.0,
        1e-10,
        "accuracy of the quadrature; the integrals themselves are exact to 2e-14 (docs/validation/fluid.md)",
        absolute=True,
        resolution=f"{count} random segments, eps 0.01 to 3",
    )
    return Evidence((check,))


@problem(
    source="S. R. Majumdar and M. E. O'Neill, ZAMP 28 (1977) 541; force rings inside the section",
    quick={"ratios": (1e-2, 1e-3), "edge_counts": (12, 24, 48)},
    full={"ratios": (1e-2, 3e-3, 1e-3), "edge_counts": (12, 24, 48, 96, 192)},
)
def torus_axial_drag(ratios: tuple[float, ...], edge_counts: tuple[int, ...]) -> Evidence:
    """Drag of a ring that moves along its axis."""
    sizes = 2.0 * np.pi / np.array(edge_counts, dtype=float)
    checks: list[Check] = []
    errors = {}
    for ratio in ratios:
        exact = torus_reference(ratio)
        drags = np.array([torus_drag(ratio, count) for count in edge_counts])
        errors[f"a/R = {ratio:g}"] = (sizes, drags / exact - 1.0)
        checks.append(
            converging(
                f"drag over $6\\pi\\mu U(R+a)$, a/R = {ratio:g}",
                sizes,
                drags,
                exact,
                tolerance=_torus_tolerance(ratio),
                reason=_TORUS_REASON,
                order_tolerance=0.15,
                resolution=f"{', '.join(map(str, edge_counts))} edges",
            )
        )
    panel = errors_panel("Error against the mesh", "edge length / R", "relative error of the drag", errors)
    return Evidence(tuple(checks), (panel,))


@problem(
    source="A. T. Chwang and T. Y.-T. Wu, J. Fluid Mech. 67 (1975) 787",
    quick={"aspects": (10.0, 100.0), "edge_counts": (20, 40, 80)},
    full={"aspects": (10.0, 30.0, 100.0, 1000.0), "edge_counts": (20, 40, 80, 160)},
)
def spheroid_drags(aspects: tuple[float, ...], edge_counts: tuple[int, ...]) -> Evidence:
    """Drag of prolate spheroids along and across their axis."""
    checks: list[Check] = []
    errors = {}
    sizes = 1.0 / np.array(edge_counts, dtype=float)
    for aspect in aspects:
        for axis, name in ((0, "along"), (1, "across")):
            exact = spheroid_drag(aspect, axis)
            drags = np.array([spheroid(aspect, count).drag(axis) for count in edge_counts])
            label = f"{name}, aspect {aspect:g}"
            errors[label] = (sizes, drags / exact - 1.0)
            checks.append(
                Check(
                    f"drag {label}, over $6\\pi\\mu bU$",
                    drags[-1] / (6.0 * math.pi),
                    exact / (6.0 * math.pi),
                    0.25 * math.log(aspect) / aspect**2 + 0.8 / edge_counts[-1] ** 2,
                    "slender-body theory, 0.25 (b/l)^2 ln(l/b), and the mesh's 0.6 / edges^2 at aspect 1000",
                    resolution=f"{edge_counts[-1]} edges",
                )
            )
    panel = errors_panel("Error against the mesh", "1 / edges", "relative error of the drag", errors)
    return Evidence(tuple(checks), (panel,))


@problem(
    source="G. K. Batchelor, J. Fluid Mech. 44 (1970) 419; J. B. Keller and S. I. Rubinow (1976)",
    quick={"slenderness": (2e4, 2e6)},
    full={"slenderness": (2e4, 2e5, 2e6, 2e7)},
)
def cylinder_drags(slenderness: tuple[float, ...]) -> Evidence:
    """Drag of long cylinders along and across their axis, against a series in 1 / ln(L/a)."""
    checks: list[Check] = []
    curves: list[Curve] = []
    small = np.array([1.0 / math.log(ratio) for ratio in slenderness])
    for axis, name in ((0, "along"), (1, "across")):
        differences = []
        for ratio, eps in zip(slenderness, small, strict=True):
            found, exact = graded_rod(ratio, SLENDER).drag(axis), cylinder_series(ratio, axis, 4)
            differences.append(abs(found / exact - 1.0))
            checks.append(
                Check(
                    f"drag {name} over $\\mu UL$, L/a = {ratio:g}",
                    found / ratio,
                    exact / ratio,
                    10.0 * float(eps) ** 4,
                    "the series' fifth term, 4 to 9.5 times ln(L/a)^-4",
                )
            )
        curves.append(Curve(small, np.array(differences), name))
    curves.append(Curve(small, 5.0 * small**4, "fourth power", "--"))
    panel = Panel(
        "Cylinder", "1 / ln(L/a)", "relative difference from four terms", tuple(curves), "log", "log"
    )
    return Evidence(tuple(checks), (panel,))


@problem(
    source="weight over the exact drag of a torus: S. R. Majumdar and M. E. O'Neill, ZAMP 28 (1977) 541",
    quick={"ratio": 1e-2, "edge_counts": (12, 24, 48)},
    full={"ratio": 1e-2, "edge_counts": (12, 24, 48, 96)},
)
def sinking_ring(ratio: float, edge_counts: tuple[int, ...]) -> Evidence:
    """Speed of a horizontal ring that sinks under its weight less its buoyancy, in a simulation."""
    ring_radius, density, viscosity, gravity = 0.01, 2000.0, 2.0, 9.81
    radius = ratio * ring_radius
    weight = (density - 1000.0) * gravity * 2.0 * math.pi**2 * ring_radius * radius**2
    drag = 6.0 * math.pi * viscosity * (ring_radius + radius) * torus_reference(ratio)
    found, moved = [], []
    for count in edge_counts:
        shape = torus(ratio, count)
        rod = Rod(
            nodes=ring_radius * shape.nodes,
            edges=shape.edges,
            radius=radius,
            material=Material(youngs_modulus=1e8, density=density),
        )
        scene = Scene(
            rods=(rod,),
            fluid=Fluid(viscosity=viscosity, density=1000.0),
            gravity=np.array([0.0, 0.0, -gravity]),
        )
        simulation = Simulation(scene, dt=1e-3 * ring_radius * drag / weight, threads=1)
        start = simulation.nodes
        simulation.step(10)
        fallen = simulation.nodes - start
        found.append(-float(fallen[:, 2].mean()) / simulation.time * drag / weight)
        moved.append(float(np.abs(fallen[:, :2]).max() / np.abs(fallen[:, 2]).max()))
    values = np.array(found)
    sizes = 2.0 * np.pi / np.array(edge_counts, dtype=float)
    checks = (
        converging(
            f"speed over weight / drag, a/R = {ratio:g}",
            sizes,
            values,
            1.0,
            tolerance=_torus_tolerance(ratio),
            reason=_TORUS_REASON,
            order_tolerance=0.15,
            resolution=f"{', '.join(map(str, edge_counts))} edges",
        ),
        Check(
            "motion in the ring's plane over the way fallen",
            max(moved),
            0.0,
            1e-6,
            "none by symmetry; Newton's tolerance",
            absolute=True,
        ),
    )
    panel = errors_panel(
        "Error against the mesh",
        "edge length / R",
        "relative error of the speed",
        {"": (sizes, values - 1.0)},
    )
    return Evidence(checks, (panel,))
