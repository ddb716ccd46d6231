"""Localized buckling: a long rod, twisted and slack, gathers its slack into one helical bulge."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.optimize import brentq

from flagrs import Simulation
from flagrs.scene import Clamp, Fluid, Rod, Scene
from flagrs.scene.values import FloatArray
from flagrs.validation.clamped_rod import EI, LENGTH, MATERIAL
from flagrs.validation.equilibria import settle
from flagrs.validation.problem import Curve, Evidence, Panel, converging, errors_panel, problem

#: End shortening over L and rotation of the ends [rad], as in PyElastica's case; GJ / EI.
SLACK, ROTATION, RATIO = 0.03, 27.0 * 2.0 * math.pi, 0.6
#: Section of the rod [m]; its stiffnesses are given.
RADIUS = 1e-3 * LENGTH


def moment_and_tension(
    slack: float = SLACK, rotation: float = ROTATION, ratio: float = RATIO
) -> tuple[float, float]:
    """Return twisting moment M L / EI and tension T L^2 / EI of an infinitely long rod with one bulge.

    Its end shortening is ``4 (1 / T - M^2 / 4 T^2)^(1/2)`` and its end rotation
    ``M / ratio + 4 arccos(M / 2 T^(1/2))``.
    """

    def tension(moment: float) -> float:
        # Of the two tensions with this shortening, the one whose bulge is not yet half a turn.
        return moment**2 / (2.0 + 2.0 * math.sqrt(max(0.0, 1.0 - (moment * slack) ** 2 / 16.0)))

    def excess(moment: float) -> float:
        return (
            moment / ratio + 4.0 * math.acos(min(1.0, 0.5 * moment / math.sqrt(tension(moment)))) - rotation
        )

    moment = float(brentq(excess, 0.5 * ratio * rotation, ratio * rotation, xtol=1e-12))
    return moment, tension(moment)


def bulge(along: FloatArray, moment: float, tension: float) -> tuple[FloatArray, FloatArray]:
    """Return angle from the axis and azimuth (K,) [rad] of the tangent at points s / L from the middle."""
    depth = 1.0 - 0.25 * moment**2 / tension
    sech = 1.0 / np.cosh(math.sqrt(depth * tension) * along)
    inclination = 2.0 * np.arcsin(math.sqrt(depth) * sech)
    azimuth = cumulative_simpson(moment / (1.0 + np.cos(inclination)), x=along, initial=0.0)
    return inclination, azimuth


def _started(count: int, moment: float, tension: float) -> Scene:
    """Return the rod placed on the theory's curve, and twisted as theory has it."""
    fine = np.linspace(-0.5, 0.5, 200 * count + 1)
    inclination, azimuth = bulge(fine, moment, tension)
    across = np.sin(inclination)
    tangent = np.stack([np.cos(inclination), across * np.cos(azimuth), across * np.sin(azimuth)], axis=1)
    curve = cumulative_simpson(tangent, x=fine, axis=0, initial=0.0) * LENGTH
    nodes = curve[::200]
    straight = np.stack(
        [LENGTH * np.arange(count + 1) / count, np.zeros(count + 1), np.zeros(count + 1)], axis=1
    )
    middles = (np.arange(count) + 0.5) / count
    rod = Rod(
        nodes=nodes,
        rest_nodes=straight,
        radius=RADIUS,
        material=MATERIAL,
        EI=EI,
        GJ=RATIO * EI,
        EA=1e9 * EI / LENGTH**2,
        theta=moment / RATIO * (middles - middles[0]),
    )
    ends = (Clamp(nodes=(0, 1), edges=(0,)), Clamp(nodes=(count - 1, count), edges=(count - 1,)))
    fluid = Fluid(viscosity=1.0, model="RFT", density=0.0)
    return Scene(rods=(rod,), fluid=fluid, clamps=ends)


def _rested(count: int, moment: float, tension: float) -> tuple[float, float, float, Simulation]:
    """Return moment M L / EI, tension T L^2 / EI and largest inclination [rad] at rest, and the rod."""
    simulation = settle(_started(count, moment, tension))
    twisting = simulation.energy()["twisting"]
    length = LENGTH * (1.0 - 1.0 / count)
    found = math.sqrt(2.0 * RATIO * twisting * length / EI) * LENGTH / length
    at = simulation.dof_of_node[[0, 1]]
    pull = -float(simulation.gradient()[at].sum())
    edges = np.diff(simulation.nodes, axis=0)
    inclination = np.arccos(edges[:, 0] / np.linalg.norm(edges, axis=1))
    return found, pull * LENGTH**2 / EI, float(inclination.max()), simulation


@problem(
    source="J. Coyne, IEEE J. Ocean. Eng. 15 (1990) 72; G. H. M. van der Heijden and J. M. T. Thompson, "
    "Nonlinear Dyn. 21 (2000) 71; the slack and turns of PyElastica's case",
    quick={"edge_counts": (200, 400, 800)},
    full={"edge_counts": (400, 800, 1600)},
)
def localized_buckling(edge_counts: tuple[int, ...]) -> Evidence:
    """Tension, moment and bulge of a long rod, wound by 27 turns with 3 % slack, at rest after motion."""
    moment, tension = moment_and_tension()
    steepest = float(bulge(np.array([-1e-9, 0.0]), moment, tension)[0][-1])
    rests = [_rested(count, moment, tension) for count in edge_counts]
    found = np.array([rest[:3] for rest in rests])
    sizes = 1.0 / np.array(edge_counts, dtype=float)
    exact = {"$TL^2/EI$": tension, "$ML/EI$": moment, "largest inclination": steepest}
    columns = {"$TL^2/EI$": found[:, 1], "$ML/EI$": found[:, 0], "largest inclination": found[:, 2]}
    checks = tuple(
        converging(
            name,
            sizes,
            columns[name],
            expected,
            tolerance=tolerance,
            reason="fourth order of the mesh error of edges a hundredth and a fiftieth of the bulge's length",
            order_tolerance=0.3,
            resolution=f"{', '.join(map(str, edge_counts))} edges",
        )
        for (name, expected), tolerance in zip(exact.items(), (5e-4, 2e-5, 5e-4), strict=True)
    )
    along = np.linspace(-0.5, 0.5, 2001)
    edges = np.diff(rests[-1][3].nodes, axis=0)
    marks = np.arccos(edges[:, 0] / np.linalg.norm(edges, axis=1))[:: max(1, edge_counts[-1] // 200)]
    middles = ((np.arange(edge_counts[-1]) + 0.5) / edge_counts[-1] - 0.5)[:: max(1, edge_counts[-1] // 200)]
    panels = (
        Panel(
            "Inclination of the tangent to the axis",
            "s / L",
            "inclination / rad",
            (
                Curve(along, bulge(along, moment, tension)[0], "theory", "-"),
                Curve(middles, marks, f"{edge_counts[-1]} edges", "."),
            ),
        ),
        errors_panel(
            "Error against the mesh",
            "1 / edges",
            "relative error",
            {name: (sizes, columns[name] / exact[name] - 1.0) for name in exact},
        ),
    )
    return Evidence(checks, panels)
