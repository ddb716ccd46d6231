"""A rod that spins in a viscous fluid: it twirls straight when slow, and whirls bent when fast."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre, leggauss
from scipy.linalg import eig
from scipy.optimize import brentq

from flagrs import Simulation
from flagrs.scene.values import FloatArray
from flagrs.validation.clamped_rod import DRAG, EI, GJ, LENGTH, SPIN_DRAG, ClampedRod, edge_lengths
from flagrs.validation.problem import Curve, Evidence, Panel, converging, problem


def linear_growth(spin: float, terms: int = 16) -> complex:
    """Return growth rate and frequency, in EI / (zeta L^4), of a straight rod that spins.

    With the deflection r = y + i z and the twisting moment -spin (1 - s), in EI / L,
    ``r_t = -r'''' - i spin ((1 - s) r'')'``, clamped at 0 and free at 1, by Galerkin's method on s^2 times
    Legendre polynomials.

    Parameters
    ----------
    spin
        zeta_r Omega L^2 / EI, with the drag zeta_r on the rod's spin Omega per length.
    terms
        Number of polynomials; 12 give ten digits.
    """
    abscissa, weight = leggauss(2 * terms + 8)
    s, weight = 0.5 * (abscissa + 1.0), 0.5 * weight
    square = Polynomial([0.0, 0.0, 1.0])
    basis = [square * Legendre.basis(k, domain=[0.0, 1.0]).convert(kind=Polynomial) for k in range(terms)]
    values, slopes, bends = (np.array([f.deriv(n)(s) if n else f(s) for f in basis]) for n in (0, 1, 2))
    mass = (values * weight) @ values.T
    # By parts; the boundary terms vanish, -i spin (1 - s) r'' at the tip and the test function at the wall.
    operator = -(bends * weight) @ bends.T + 1j * spin * (slopes * weight * (1.0 - s)) @ bends.T
    rates = eig(operator, mass, right=False)
    return complex(rates[np.argmax(rates.real)])


def critical_spin() -> float:
    """Return zeta_r Omega L^2 / EI at which whirling sets in, 8.86514."""
    return float(brentq(lambda spin: linear_growth(spin).real, 5.0, 15.0, xtol=1e-12))


def _growth(count: int, spin: float, rtol: float) -> complex:
    """Return growth rate and frequency, in EI / (zeta L^4), of a small deflection of a simulated rod."""
    unit = DRAG * LENGTH**4 / EI
    speed = spin * EI / (SPIN_DRAG * LENGTH**2)
    rod = ClampedRod(count)
    scene = rod.scene()
    scene = scene.replace(clamps=(scene.clamps[0].replace(angular_velocity=speed),))
    simulation = Simulation(scene, rtol=rtol, threads=1)
    nodes = rod.nodes()
    along = np.maximum(nodes[:, 0] / LENGTH, 0.0)
    nodes[:, 1] = 1e-2 * LENGTH * along**2 * (6.0 - 4.0 * along + along**2) / 3.0
    # Twisted already as it will be when the twist has spread along the rod.
    middles = np.arange(count + 1) / (count + 0.5)
    twist = -speed * SPIN_DRAG * LENGTH**2 / GJ * (middles - 0.5 * middles**2)
    simulation.set_state(nodes, twist)
    seen = []
    for time in (0.15, 0.45):
        while simulation.time < time * unit:
            simulation.step()
        tip = simulation.nodes[-1]
        seen.append((simulation.time / unit, complex(tip[1], tip[2])))
    (start, first), (end, last) = seen
    change = np.log(last / first)
    turns = np.round((linear_growth(spin).imag * (end - start) - change.imag) / (2.0 * np.pi))
    return complex(change.real, change.imag + 2.0 * np.pi * turns) / (end - start)


def _threshold(count: int, rtol: float) -> tuple[float, float]:
    """Return the spin at which growth is zero, and the frequency there, by parabolas through three spins."""
    spins = np.array([0.95, 1.0, 1.05]) * critical_spin()
    rates = np.array([_growth(count, spin, rtol) for spin in spins])
    spin, frequency = (np.polyfit(rates.real, values, 2)[-1] for values in (spins, rates.imag))
    return float(spin), float(frequency)


@problem(
    source="C. W. Wolgemuth, T. R. Powers and R. E. Goldstein, Phys. Rev. Lett. 84 (2000) 1623; "
    "solved here by Galerkin's method",
    quick={"edge_counts": (10, 20, 40), "rtol": 1e-5},
    full={"edge_counts": (10, 20, 40, 80), "rtol": 1e-6},
)
def whirling(edge_counts: tuple[int, ...], rtol: float) -> Evidence:
    """Spin at which a rod driven at its end begins to whirl, and how fast it then goes around."""
    exact = critical_spin()
    turning = abs(linear_growth(exact).imag)
    found = np.array([_threshold(count, rtol) for count in edge_counts])
    sizes = edge_lengths(edge_counts)
    mesh = f"{', '.join(map(str, edge_counts))} edges, rtol {rtol:g}"
    reason = "left of the transient, the amplitude squared, and interpolation of the growth rate"
    checks = tuple(
        converging(
            quantity,
            sizes,
            values,
            expected,
            tolerance=1e-3,
            reason=reason,
            order_tolerance=0.3,
            resolution=mesh,
        )
        for quantity, values, expected in (
            ("critical $\\zeta_r\\Omega L^2/EI$", found[:, 0], exact),
            ("frequency $\\omega\\zeta L^4/EI$ there", np.abs(found[:, 1]), turning),
        )
    )
    spins = np.linspace(0.8, 1.2, 9) * exact
    marks = np.array([0.9, 1.0, 1.1]) * exact
    growth = np.array([_growth(edge_counts[-1], spin, rtol).real for spin in marks])
    theory: FloatArray = np.array([linear_growth(spin).real for spin in spins])
    panel = Panel(
        "Growth of a small deflection",
        "$\\zeta_r\\Omega L^2/EI$",
        "growth rate $\\cdot\\,\\zeta L^4/EI$",
        (Curve(spins, theory, "linear theory", "-"), Curve(marks, growth, f"{edge_counts[-1]} edges", "o")),
    )
    return Evidence(checks, (panel,))
