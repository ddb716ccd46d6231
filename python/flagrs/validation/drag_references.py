"""Exact drag of tori and spheroids, and slender-body series of cylinders, that owe nothing to segments."""

from __future__ import annotations

import math

import numpy as np

from flagrs.validation.filaments import Array

#: Axial drag of a torus over that of a sphere around it, by a/R: Majumdar and O'Neill, ZAMP 28 (1977) 541.
TORUS_EXACT = {0.01: 0.577311201, 0.001: 0.441079950}


def ring_flow(rings: Array, at: Array, count: int) -> Array:
    """Flow (M, 2, S, 2), times 8 pi mu, at points (r, z) of radial and axial force rings (S, 2) at (r, z).

    A ring of strength 1 has the force 1 / (2 pi) per length, integrated at `count` points of half a circle.
    """
    angle = math.pi * (np.arange(count) + 0.5) / count
    cosine = np.cos(angle)
    out = np.empty((len(at), 2, len(rings), 2))
    for s, (ring, level) in enumerate(rings):
        for m, (r, z) in enumerate(at):
            dx, dz = r - ring * cosine, z - level
            d2 = dx**2 + (ring * np.sin(angle)) ** 2 + dz**2
            inverse = 1.0 / np.sqrt(d2)
            cube = inverse / d2
            radial = dx * cosine - ring * np.sin(angle) ** 2
            weight = ring / count
            out[m, 0, s, 0] = weight * (cosine * inverse + dx * radial * cube).sum()
            out[m, 0, s, 1] = weight * (dx * dz * cube).sum()
            out[m, 1, s, 0] = weight * (dz * radial * cube).sum()
            out[m, 1, s, 1] = weight * (inverse + dz * dz * cube).sum()
    return out


def torus_reference(ratio: float, sources: int = 12) -> float:
    """Axial drag of a torus, F / (6 pi mu U (R + a)), by force rings within its cross-section."""

    def circle(radius: float, count: int) -> Array:
        angle = 2.0 * math.pi * np.arange(count) / count
        return np.stack([1.0 + radius * np.cos(angle), radius * np.sin(angle)], axis=1)

    inner, surface = circle(ratio / 4.0, sources), circle(ratio, 2 * sources)
    # Analytic in a strip as wide as the gap between sources and surface, the integrals err by exp(-2 n gap).
    flow = ring_flow(inner, surface, math.ceil(30.0 / ratio)).reshape(4 * sources, 2 * sources)
    wanted = 8.0 * math.pi * np.tile([0.0, 1.0], len(surface))
    strength = np.linalg.lstsq(flow, wanted, rcond=None)[0].reshape(-1, 2)
    return float((strength[:, 1] * inner[:, 0]).sum() / (6.0 * math.pi * (1.0 + ratio)))


def spheroid_drag(aspect: float, axis: int) -> float:
    """Drag of a prolate spheroid of unit equatorial radius: Chwang and Wu, J. Fluid Mech. 67 (1975) 787."""
    e = math.sqrt(1.0 - 1.0 / aspect**2)
    log = math.log((1.0 + e) / (1.0 - e))
    if axis == 0:
        return 16.0 * math.pi * aspect * e**3 / ((1.0 + e**2) * log - 2.0 * e)
    return 32.0 * math.pi * aspect * e**3 / (2.0 * e + (3.0 * e**2 - 1.0) * log)


def cylinder_series(slenderness: float, axis: int, terms: int) -> float:
    """Drag of a cylinder of unit radius and length L at 1 m/s by slender-body theory, to powers of 1/ln(L/a).

    Batchelor, J. Fluid Mech. 44 (1970) 419, gives three terms. The equation behind them (Keller and Rubinow,
    J. Fluid Mech. 75 (1976) 705) is ``(2 ln(L/a) - h) f + K f = c pi mu U`` with ``h = +-1 - ln(1 - x^2)``
    and ``K f = integral of (f(y) - f(x)) / |y - x|``, whose eigenfunctions are the Legendre polynomials, with
    eigenvalues ``-2 H_n``; iterated once more it gives the fourth.
    """
    sign, factor = (1.0, 2.0) if axis == 0 else (-1.0, 4.0)
    abscissa, weight = np.polynomial.legendre.leggauss(400)
    # In x = tanh(9 t) nothing is singular.
    stretch = 9.0 * abscissa
    measure = weight * 4.5 / np.cosh(stretch) ** 2
    h = sign + 2.0 * np.log(np.cosh(stretch))
    even = np.arange(2, 4001, 2)
    harmonic = np.cumsum(1.0 / np.arange(1, 4001))[even - 1]
    hkh = -8.0 * float(((2 * even + 1) * harmonic / (even * (even + 1.0)) ** 2).sum())
    means = [float((measure * h**power).sum()) for power in range(4)]
    coefficients = [1.0, means[1] / 2.0, means[2] / 4.0, (means[3] - hkh) / 8.0]
    small = 1.0 / math.log(slenderness)
    return (
        factor * math.pi * slenderness * sum(c * small ** (k + 1) for k, c in enumerate(coefficients[:terms]))
    )
