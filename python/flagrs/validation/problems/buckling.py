"""Loads under which a straight rod loses its stability: columns, and strips that buckle sideways."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import jv

from flagrs import Simulation
from flagrs.validation.clamped_rod import EI, GJ, LENGTH, STIFFENING, ClampedRod, edge_lengths
from flagrs.validation.equilibria import balance, lowest_stiffness
from flagrs.validation.problem import Curve, Evidence, Panel, converging, errors_panel, problem

#: Stiff over soft bending stiffness of the strips; theory takes it for infinite and errs by its inverse.
STRIP = 1e5
_REASON = (
    "fourth order of the mesh error, below 5e-7 on 20 and 40 edges; strips: theory's infinite stiffness, 1e-5"
)


def _stiffness(rod: ClampedRod, axes: tuple[int, ...]) -> float:
    """Return the lowest stiffness across the plane of loading, over EI / L^3, at the equilibrium in it."""
    scene = rod.scene()
    simulation = Simulation(scene, threads=1)
    balance(scene, simulation, axes)
    return lowest_stiffness(scene, simulation, LENGTH, (1,)) / (EI / LENGTH**3)


def _limits(
    title: str,
    unit: str,
    exact: float,
    make: Callable[[int, float], ClampedRod],
    axes: tuple[int, ...],
    edge_counts: tuple[int, ...],
) -> Evidence:
    """Return the evidence that rods of a load factor `make(edges, load)` lose stability at the exact one."""
    found = np.array(
        [
            brentq(lambda load, n=n: _stiffness(make(n, load), axes), 0.7 * exact, 1.3 * exact, rtol=1e-8)
            for n in edge_counts
        ]
    )
    sizes = edge_lengths(edge_counts)
    check = converging(
        f"critical {unit}",
        sizes,
        found,
        exact,
        tolerance=3e-5,
        reason=_REASON,
        resolution=f"{', '.join(map(str, edge_counts))} edges",
    )
    shares = np.linspace(0.0, 1.2, 13)
    lowest = np.array([_stiffness(make(edge_counts[-1], share * exact), axes) for share in shares])
    panels = (
        Panel(
            title,
            f"{unit} over theory's",
            "lowest eigenvalue $\\cdot\\,L^3/EI$",
            (
                Curve(shares, lowest, f"{edge_counts[-1]} edges"),
                Curve(np.ones(2), np.array([lowest.min(), lowest.max()]), "theory", "--"),
            ),
        ),
        errors_panel(
            "Error against the mesh", "edge length / L", f"error of {unit}", {title: (sizes, found - exact)}
        ),
    )
    return Evidence((check,), panels)


_MESHES: dict[str, dict[str, Any]] = {
    "quick": {"edge_counts": (10, 20, 40)},
    "full": {"edge_counts": (10, 20, 40, 80)},
}


@problem(source="L. Euler (1744): pi^2 / 4", **_MESHES)
def euler_column(edge_counts: tuple[int, ...]) -> Evidence:
    """Force on the tip under which a clamped column buckles."""

    def column(count: int, load: float) -> ClampedRod:
        return ClampedRod(count, tip_force=(-load, 0.0, 0.0), stretching=STIFFENING)

    return _limits("Euler's column", "$PL^2/EI$", 0.25 * np.pi**2, column, (0,), edge_counts)


@problem(
    source="A. G. Greenhill, Proc. Camb. Phil. Soc. 4 (1881) 65: a zero of J of order -1/3",
    **_MESHES,
)
def greenhill_column(edge_counts: tuple[int, ...]) -> Evidence:
    """Weight under which a clamped column buckles."""
    exact = float(brentq(lambda q: jv(-1.0 / 3.0, 2.0 / 3.0 * np.sqrt(q)), 5.0, 10.0, xtol=1e-13))

    def column(count: int, load: float) -> ClampedRod:
        return ClampedRod(count, weight=(-load, 0.0, 0.0), stretching=STIFFENING)

    return _limits("Greenhill's column", "$wL^3/EI$", exact, column, (0,), edge_counts)


def _strip_unit() -> float:
    return float(np.sqrt(EI * GJ) / EI)


@problem(
    source="A. G. M. Michell, Phil. Mag. 48 (1899) 298; L. Prandtl (1899): a zero of J of order -1/4",
    **_MESHES,
)
def loaded_strip(edge_counts: tuple[int, ...]) -> Evidence:
    """Force on the tip under which a strip on edge buckles sideways and twists."""
    exact = float(brentq(lambda p: jv(-0.25, 0.5 * p), 3.0, 5.0, xtol=1e-13))

    def strip(count: int, load: float) -> ClampedRod:
        return ClampedRod(count, tip_force=(0.0, 0.0, -load * _strip_unit()), EI_matrix=(STRIP, 1.0))

    return _limits("Strip with a load", "$PL^2/\\sqrt{EI\\,GJ}$", exact, strip, (0, 2), edge_counts)


@problem(
    source="L. Prandtl (1899): a zero of J of order -1/6",
    **_MESHES,
)
def heavy_strip(edge_counts: tuple[int, ...]) -> Evidence:
    """Weight under which a strip on edge buckles sideways and twists."""
    exact = float(brentq(lambda q: jv(-1.0 / 6.0, q / 6.0), 10.0, 15.0, xtol=1e-13))

    def strip(count: int, load: float) -> ClampedRod:
        return ClampedRod(count, weight=(0.0, 0.0, -load * _strip_unit()), EI_matrix=(STRIP, 1.0))

    return _limits("Strip under its weight", "$wL^3/\\sqrt{EI\\,GJ}$", exact, strip, (0, 2), edge_counts)
