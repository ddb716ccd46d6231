"""Cantilevers bent far by a force on the tip or by their own weight, against the elastica."""

from __future__ import annotations

import numpy as np

from flagrs.validation.clamped_rod import COMPLIANCE, LENGTH, ClampedRod, edge_lengths
from flagrs.validation.elastica import tip_deflection
from flagrs.validation.equilibria import settle
from flagrs.validation.problem import Check, Curve, Evidence, Panel, converging, errors_panel, problem

_SOURCE = "S. P. Timoshenko; K. E. Bisshopp and D. C. Drucker, Q. Appl. Math. 3 (1945) 272; integrated here"
_REASON = "fourth order of the mesh error, below 1e-5 on 20 and 40 edges"
_NAMES = ("down", "back")


def _deflection(rod: ClampedRod) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    tip = settle(rod.scene()).nodes[-1] / LENGTH
    return np.array([-tip[2], 1.0 - tip[0]])


def _compared(
    label: str, loads: tuple[float, ...], edge_counts: tuple[int, ...], by_weight: bool
) -> Evidence:
    sizes = edge_lengths(edge_counts)
    checks: list[Check] = []
    errors, marks = {}, []
    for load in loads:
        exact = tip_deflection(0.0 if by_weight else load, COMPLIANCE, load if by_weight else 0.0)
        down = (0.0, 0.0, -load)
        rods = [
            ClampedRod(count, weight=down) if by_weight else ClampedRod(count, tip_force=down)
            for count in edge_counts
        ]
        found = np.array([_deflection(rod) for rod in rods])
        marks.append(found[-1])
        for k, name in enumerate(_NAMES):
            errors[f"{label} = {load:g}, {name}"] = (sizes, found[:, k] - exact[k])
            checks.append(
                converging(
                    f"tip deflection / L, {name}, at {label} = {load:g}",
                    sizes,
                    found[:, k],
                    float(exact[k]),
                    tolerance=2e-5,
                    absolute=True,
                    reason=_REASON,
                    resolution=f"{', '.join(map(str, edge_counts))} edges",
                )
            )
    range_of_loads = np.linspace(1e-3, max(loads), 30)
    lines = np.array(
        [tip_deflection(0.0 if by_weight else x, COMPLIANCE, x if by_weight else 0.0) for x in range_of_loads]
    )
    curves = []
    for k, name in enumerate(_NAMES):
        curves.append(Curve(range_of_loads, lines[:, k], f"{name}, elastica", "-"))
        curves.append(
            Curve(
                np.array(loads), np.array(marks)[:, k], f"{name}, {edge_counts[-1]} edges", "o", paired=True
            )
        )
    return Evidence(
        tuple(checks),
        (
            Panel("Deflection of the tip", label, "deflection / L", tuple(curves)),
            errors_panel("Error against the mesh", "edge length / L", "error of deflection / L", errors),
        ),
    )


@problem(
    source=_SOURCE,
    quick={"loads": (1.0, 10.0), "edge_counts": (10, 20, 40)},
    full={"loads": (0.5, 1.0, 2.0, 5.0, 10.0), "edge_counts": (10, 20, 40, 80, 160)},
)
def cantilever(loads: tuple[float, ...], edge_counts: tuple[int, ...]) -> Evidence:
    """Tip deflection of a cantilever under a dead force, at rest after overdamped motion."""
    return _compared("$PL^2/EI$", loads, edge_counts, by_weight=False)


@problem(
    source=_SOURCE,
    quick={"loads": (1.0, 10.0), "edge_counts": (10, 20, 40)},
    full={"loads": (0.5, 1.0, 3.0, 10.0), "edge_counts": (10, 20, 40, 80, 160)},
)
def heavy_cantilever(loads: tuple[float, ...], edge_counts: tuple[int, ...]) -> Evidence:
    """Tip deflection of a horizontal cantilever under its own weight, at rest after overdamped motion."""
    return _compared("$wL^3/EI$", loads, edge_counts, by_weight=True)
