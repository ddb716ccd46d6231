"""A clamped rod under a load that follows its tangent: at rest below a threshold, fluttering above."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre, leggauss
from scipy.linalg import eig
from scipy.optimize import brentq

from flagrs import LineLoad, PointLoad, Simulation
from flagrs.scene.load import Load
from flagrs.scene.values import FloatArray
from flagrs.validation.clamped_rod import DRAG, EI, LENGTH, STIFFENING, ClampedRod, edge_lengths
from flagrs.validation.problem import Check, Curve, Evidence, Panel, converging, problem

#: Deflection of the tip over the length at the start: linear theory errs by its square.
AMPLITUDE = 1e-3
#: Periods that are looked at, and instants in each.
PERIODS, INSTANTS = 3, 16
#: Loads next to the threshold at which the sign of the growth rate is looked at.
SIDES = (0.98, 1.02)

#: Compression over the load, of a load on the tip and of one along the whole rod.
COMPRESSION: dict[str, Callable[[FloatArray], FloatArray]] = {
    "tip": lambda s: np.ones_like(s),
    "distributed": lambda s: 1.0 - s,
}


def linear_mode(
    load: float, kind: str, terms: int = 16
) -> tuple[complex, Callable[[FloatArray], FloatArray]]:
    """Return the fastest growth with its frequency, in EI / (zeta L^4), and its shape at one instant.

    ``y_t = -y'''' - P(s) y''`` with the compression ``P``, clamped at 0 and free at 1, by Galerkin's method
    on s^2 times Legendre polynomials: a load along the tangent leaves no force across at the tip.

    Parameters
    ----------
    load
        P L^2 / EI of a force on the tip, f L^3 / EI of a force per length.
    kind
        ``tip`` or ``distributed``.
    terms
        Number of polynomials.
    """
    abscissa, weight = leggauss(2 * terms + 8)
    s, weight = 0.5 * (abscissa + 1.0), 0.5 * weight
    square = Polynomial([0.0, 0.0, 1.0])
    basis = [square * Legendre.basis(k, domain=[0.0, 1.0]).convert(kind=Polynomial) for k in range(terms)]
    values, bends = np.array([f(s) for f in basis]), np.array([f.deriv(2)(s) for f in basis])
    mass = (values * weight) @ values.T
    operator = -(bends * weight) @ bends.T - load * (values * weight * COMPRESSION[kind](s)) @ bends.T
    rates, vectors = eig(operator, mass)
    # Of a pair, the one that goes around with a positive frequency.
    first = int(np.argmax(rates.real + 1e-9 * np.sign(rates.imag)))
    weights = vectors[:, first] / sum(vectors[k, first] * f(1.0) for k, f in enumerate(basis))
    shape = sum((float(c.real) * f for c, f in zip(weights, basis, strict=True)), Polynomial([0.0]))
    return complex(rates[first]), shape


def threshold(kind: str) -> float:
    """Return the load at which flutter sets in, in units of `linear_mode`: 37.695 and 76.10."""
    low, high = {"tip": (30.0, 45.0), "distributed": (60.0, 90.0)}[kind]
    return float(brentq(lambda load: linear_mode(load, kind)[0].real, low, high, xtol=1e-10))


def _growth(count: int, load: float, kind: str, rtol: float) -> complex:
    """Return growth rate and frequency, in EI / (zeta L^4), of a small deflection of a simulated rod."""
    rod = ClampedRod(count, stretching=STIFFENING)
    loads: Load
    if kind == "tip":
        loads = PointLoad(node=count + 1, force=(0.0, 0.0, -load * EI / LENGTH**2), frame="material")
    else:
        loads = LineLoad(force=(0.0, 0.0, -load * EI / LENGTH**3), frame="material")
    simulation = Simulation(rod.scene().replace(loads=(loads,)), rtol=rtol, threads=1)
    rate, shape = linear_mode(load, kind)
    nodes = rod.nodes()
    nodes[2:, 1] = AMPLITUDE * LENGTH * shape(nodes[2:, 0] / LENGTH)
    simulation.set_state(nodes)
    period = 2.0 * np.pi / rate.imag * DRAG * LENGTH**4 / EI
    # The first period is that in which the mesh's own mode takes the place of theory's.
    end, every = (1 + PERIODS) * period, period / INSTANTS
    tip = simulation.run(until=end, save_every=every, path=False).nodes[INSTANTS:, -1, 1]
    # y(t + 2h) = 2 Re(z) y(t + h) - |z|^2 y(t) for z = exp(lambda h), by least squares.
    parts = np.stack([tip[1:-1], -tip[:-2]], axis=1)
    twice, squared = np.linalg.lstsq(parts, tip[2:], rcond=None)[0]
    z = 0.5 * twice + 1j * np.sqrt(max(squared - 0.25 * twice**2, 0.0))
    return complex(np.log(z) / (every * EI / (DRAG * LENGTH**4)))


def _found(count: int, kind: str, rtol: float) -> tuple[float, float]:
    """Return the load at which growth is zero, and the frequency there, by parabolas through three loads."""
    loads = np.array([0.98, 1.0, 1.02]) * threshold(kind)
    rates = np.array([_growth(count, load, kind, rtol) for load in loads])
    load, frequency = (np.polyfit(rates.real, values, 2)[-1] for values in (loads, rates.imag))
    return float(load), float(frequency)


@problem(
    source="G. De Canio, E. Lauga and R. E. Goldstein, J. R. Soc. Interface 14 (2017) 20170491; P. V. Bayly "
    "and S. K. Dutcher, J. R. Soc. Interface 13 (2016) 20160523; solved here by Galerkin's method",
    quick={"kinds": ("tip",), "edge_counts": (10, 20, 40), "rtol": 1e-5},
    full={"kinds": ("tip", "distributed"), "edge_counts": (10, 20, 40, 80), "rtol": 1e-6},
)
def flutter(kinds: tuple[str, ...], edge_counts: tuple[int, ...], rtol: float) -> Evidence:
    """Load along the tangent, at the tip or everywhere, at which a clamped rod begins to flutter."""
    sizes = edge_lengths(edge_counts)
    mesh = f"{', '.join(map(str, edge_counts))} edges, rtol {rtol:g}"
    checks: list[Check] = []
    panels = []
    for kind in kinds:
        exact = threshold(kind)
        turning = linear_mode(exact, kind)[0].imag
        unit = "$PL^2/EI$ at the tip" if kind == "tip" else "$fL^3/EI$ along the rod"
        found = np.array([_found(count, kind, rtol) for count in edge_counts])
        for quantity, values, expected in (
            (f"critical {unit}", found[:, 0], exact),
            (f"frequency $\\omega\\zeta L^4/EI$ there, {kind}", found[:, 1], turning),
        ):
            checks.append(
                converging(
                    quantity,
                    sizes,
                    values,
                    expected,
                    tolerance=1e-3,
                    reason="fourth order of the mesh error, and interpolation of the growth rate",
                    order_tolerance=0.3,
                    resolution=mesh,
                )
            )
        marks = np.array(SIDES) * exact
        growth = np.array([_growth(edge_counts[-1], load, kind, rtol).real for load in marks])
        for share, load, rate in zip(SIDES, marks, growth, strict=True):
            checks.append(
                Check(
                    f"growth rate at {share:g} of it, $\\cdot\\,\\zeta L^4/EI$",
                    float(rate),
                    linear_mode(float(load), kind)[0].real,
                    0.25,
                    "the threshold's own mesh error, 4e-3 of it on 40 edges, over 0.02: the sign is right",
                    resolution=f"{edge_counts[-1]} edges, rtol {rtol:g}",
                )
            )
        loads = np.linspace(0.9, 1.1, 11) * exact
        theory = np.array([linear_mode(float(load), kind)[0].real for load in loads])
        panels.append(
            Panel(
                f"Growth of a small deflection, load {unit.split('$')[-1].strip()}",
                f"load over threshold ({unit.split('$')[1]})",
                "growth rate $\\cdot\\,\\zeta L^4/EI$",
                (
                    Curve(loads / exact, theory, "linear theory", "-"),
                    Curve(np.array(SIDES), growth, f"{edge_counts[-1]} edges", "o"),
                ),
            )
        )
    return Evidence(tuple(checks), tuple(panels))
