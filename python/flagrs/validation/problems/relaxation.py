"""Small motions of straight rods: decay, vibration and untwisting."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq

from flagrs import Simulation
from flagrs.scene import Clamp, Fluid, Rod, Scene
from flagrs.scene.values import FloatArray, IntArray
from flagrs.validation.clamped_rod import (
    DRAG,
    EI,
    GJ,
    LENGTH,
    LINE_DENSITY,
    MATERIAL,
    RADIUS,
    SPIN_DRAG,
    ClampedRod,
    edge_lengths,
)
from flagrs.validation.problem import Check, Curve, Evidence, Panel, converging, errors_panel, problem

_REASON = "fourth order of the mesh error, 0.15 (k^2 |e| |e'|)^2 of the finest edges; round-off, 1e-16 |e|^-4"


def wave_numbers(ends: str, count: int) -> FloatArray:
    """Return the lowest wave numbers (count,) times L of a beam, by its characteristic equation."""

    def characteristic(x: float) -> float:
        if ends == "clamped, free":
            return float(np.cos(x) + 1.0 / np.cosh(x))
        if ends == "free, free":
            return float(np.cos(x) - 1.0 / np.cosh(x))
        return float(np.sin(x) - np.cos(x) * np.tanh(x))  # hinged, free

    first = {"clamped, free": 0.5, "free, free": 1.5, "hinged, free": 1.25}[ends]
    roots = [first + k for k in range(count)]
    return np.array([brentq(characteristic, (x - 0.4) * np.pi, (x + 0.4) * np.pi, xtol=1e-14) for x in roots])


def _beam(ends: str, count: int) -> tuple[Scene, IntArray]:
    """Return a straight rod with such ends, and which of its nodes are free."""
    if ends == "clamped, free":
        return ClampedRod(count).scene(), np.arange(2, count + 2)
    rod = Rod.straight(length=LENGTH, edge_count=count, radius=RADIUS, material=MATERIAL, EI=EI, GJ=GJ)
    fluid = Fluid(viscosity=1.0, model="RFT", wavelength=LENGTH, density=0.0)
    clamps = (Clamp(nodes=(0,)),) if ends == "hinged, free" else ()
    return Scene(rods=(rod,), fluid=fluid, clamps=clamps), np.arange(len(clamps), count + 1)


def _eigenvalues(ends: str, count: int, modes: int, inertia: bool) -> FloatArray:
    """Return rates [1/s] of decay, or frequencies [rad/s], of the lowest modes across the rod."""
    scene, free = _beam(ends, count)
    simulation = Simulation(scene, threads=1)
    across = simulation.dof_of_node[free] + 1
    stiffness = simulation.hessian()[across][:, across].toarray()
    if inertia:
        other = np.diag(simulation.mass[across])
    else:
        sideways = 3 * free + 1
        other = simulation.resistance()[np.ix_(sideways, sideways)]
    values = eigh(stiffness, other, eigvals_only=True)
    rigid = {"clamped, free": 0, "free, free": 2, "hinged, free": 1}[ends]
    kept: FloatArray = values[rigid : rigid + modes]
    return np.sqrt(kept) if inertia else kept


def _modes(
    what: str, edge_counts: tuple[int, ...], modes: int, ends: tuple[str, ...], inertia: bool
) -> Evidence:
    checks: list[Check] = []
    errors = {}
    for end in ends:
        numbers = wave_numbers(end, modes)
        unit = np.sqrt(EI / LINE_DENSITY) / LENGTH**2 if inertia else EI / (DRAG * LENGTH**4)
        exact = numbers ** (2 if inertia else 4)
        found = np.array([_eigenvalues(end, n, modes, inertia) for n in edge_counts]) / unit
        sizes = edge_lengths(edge_counts) if end == "clamped, free" else 1.0 / np.array(edge_counts, float)
        for k in range(modes):
            label = f"{end}, mode {k + 1}"
            errors[label] = (sizes, found[:, k] / exact[k] - 1.0)
            checks.append(
                converging(
                    f"{what}, {label}",
                    sizes,
                    found[:, k],
                    float(exact[k]),
                    tolerance=0.15 * float(numbers[k] ** 2 * sizes[-1] * sizes[-2]) ** 2
                    + 1e-16 / float(sizes[-1]) ** 4,
                    reason=_REASON,
                    resolution=f"{', '.join(map(str, edge_counts))} edges",
                )
            )
    return Evidence(
        tuple(checks),
        (errors_panel("Error against the mesh", "edge length / L", f"relative error of {what}", errors),),
    )


@problem(
    source="equations of beams; k^4 EI / (zeta L^4), zeta by J. Gray and G. J. Hancock (1955)",
    quick={"edge_counts": (20, 40, 80), "modes": 2},
    full={"edge_counts": (20, 40, 80, 160), "modes": 3},
)
def relaxation_rates(edge_counts: tuple[int, ...], modes: int) -> Evidence:
    """Rates at which a bent rod straightens in a viscous fluid with local drag, for three kinds of ends."""
    ends = ("clamped, free", "free, free", "hinged, free")
    return _modes("rate $\\zeta L^4/EI$", edge_counts, modes, ends, inertia=False)


@problem(
    source="characteristic equations of beams; frequencies k^2 (EI / rho A L^4)^(1/2), Euler and Bernoulli",
    quick={"edge_counts": (20, 40, 80), "modes": 2},
    full={"edge_counts": (20, 40, 80, 160), "modes": 3},
)
def vibration_frequencies(edge_counts: tuple[int, ...], modes: int) -> Evidence:
    """Frequencies of a slender rod without a fluid, from stiffness and mass of the simulator."""
    ends = ("clamped, free", "free, free", "hinged, free")
    return _modes("$\\omega L^2\\sqrt{\\rho A/EI}$", edge_counts, modes, ends, inertia=True)


def _mode_shape(along: FloatArray) -> FloatArray:
    """Return the first mode of a clamped rod at points s / L, 1 at the tip; straight behind the wall."""
    k = wave_numbers("clamped, free", 1)[0]
    ratio = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))

    def shape(x: FloatArray) -> FloatArray:
        value: FloatArray = np.cosh(k * x) - np.cos(k * x) - ratio * (np.sinh(k * x) - np.sin(k * x))
        return value

    beyond: FloatArray = np.where(along > 0.0, shape(np.maximum(along, 0.0)), 0.0)
    return beyond / shape(np.ones(1))


@problem(
    source="the first rate of a clamped rod, 12.3624 EI / (zeta L^4)",
    quick={"edge_count": 40, "steps": (10, 20, 40)},
    full={"edge_count": 80, "steps": (10, 20, 40, 80, 160)},
)
def relaxation_in_time(edge_count: int, steps: tuple[int, ...]) -> Evidence:
    """Decay of the first mode of a clamped rod over its relaxation time, by fixed and by adaptive steps."""
    rod = ClampedRod(edge_count)
    rate = wave_numbers("clamped, free", 1)[0] ** 4 * EI / (DRAG * LENGTH**4)
    nodes = rod.nodes()
    amplitude = 1e-3 * LENGTH
    nodes[2:, 1] = amplitude * _mode_shape(nodes[2:, 0] / LENGTH)

    def started(dt: float, rtol: float | None = None) -> Simulation:
        simulation = Simulation(rod.scene(), dt=dt, rtol=rtol, threads=1)
        simulation.set_state(nodes)
        return simulation

    def found(simulation: Simulation) -> float:
        return -math.log(simulation.nodes[-1, 1] / amplitude) / float(simulation.time * rate)

    rates = []
    for count in steps:
        simulation = started(1.0 / (rate * count))
        simulation.step(count)
        rates.append(found(simulation))
    sizes, values = 1.0 / np.array(steps, dtype=float), np.array(rates)
    mesh = f"{edge_count} edges"
    fixed = converging(
        "rate over theory's, fixed steps",
        sizes,
        values,
        1.0,
        order=1.0,
        order_tolerance=0.1,
        tolerance=1e-3,
        reason="second order of the error in time, 1/3 of (rate dt)^2, and of the mesh, 0.32 |e|^2 / L^2",
        resolution=f"{mesh}; {', '.join(map(str, steps))} steps",
    )
    adaptive = started(0.01 / rate, 1e-6)
    while adaptive.time < 1.0 / rate:
        adaptive.step()
    check = Check(
        "rate over theory's, adaptive steps",
        found(adaptive),
        1.0,
        1e-3,
        "rtol 1e-6 of the rod's size is 1e-3 of the amplitude; the mesh's error is 2e-4",
        resolution=f"{mesh}; rtol 1e-6",
    )
    panel = errors_panel(
        "Fixed steps", "step x rate", "relative error of the rate", {mesh: (sizes, values - 1.0)}, 1.0
    )
    return Evidence((fixed, check), (panel,))


@problem(
    source="diffusion of twist, (pi / 2)^2 GJ / (4 pi mu a^2 L^2): C. W. Wolgemuth et al. (2000)",
    quick={"edge_counts": (10, 20, 40), "step_count": 400},
    full={"edge_counts": (10, 20, 40, 80), "step_count": 1600},
)
def untwisting(edge_counts: tuple[int, ...], step_count: int) -> Evidence:
    """Rate at which a straight rod, held at one end, untwists against the drag on its spin."""
    rate = 0.25 * np.pi**2 * GJ / (SPIN_DRAG * LENGTH**2)
    found, curves = [], []
    for count in edge_counts:
        rod = ClampedRod(count)
        middles = np.arange(count + 1) / (count + 0.5)
        start = 0.1 * np.sin(0.5 * np.pi * middles)
        pair = []
        for steps in (step_count, 2 * step_count):
            simulation = Simulation(rod.scene(), dt=1.0 / (rate * steps), threads=1)
            simulation.set_state(simulation.nodes, start)
            simulation.step(steps)
            pair.append(-float(np.log(simulation.theta[-1] / start[-1])) / (simulation.time * rate))
        found.append(2.0 * pair[1] - pair[0])
        curves.append(Curve(middles, simulation.theta / 0.1, f"{count} edges", "."))
    sizes, values = edge_lengths(edge_counts), np.array(found)
    check = converging(
        "rate over theory's",
        sizes,
        values,
        1.0,
        tolerance=1e-5,
        reason="fourth order of the mesh error, and 1/3 of (rate dt)^2 left by extrapolating the steps once",
        resolution=f"{', '.join(map(str, edge_counts))} edges; {step_count}, {2 * step_count} steps",
    )
    along = np.linspace(0.0, 1.0, 101)
    curves.append(Curve(along, np.exp(-1.0) * np.sin(0.5 * np.pi * along), "theory", "-"))
    panels = (
        Panel("Twist after 1 / rate", "s / L", "angle over that of the tip at first", tuple(curves)),
        errors_panel(
            "Error against the mesh",
            "edge length / L",
            "relative error of the rate",
            {"": (sizes, values - 1.0)},
        ),
    )
    return Evidence((check,), panels)
