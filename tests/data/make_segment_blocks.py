"""Writes segment_blocks.csv: reference values of the regularized Stokeslet segment blocks M1, M2.

Run with ``python make_segment_blocks.py`` (needs mpmath; about ten seconds). Each row holds a segment, a target and a
regularization as exact doubles, and the six independent entries (xx, xy, xz, yy, yz, zz) of each symmetric 3x3 block

    M1 = |s| int_0^1 (1-a) [(1/R + eps^2/R^3) I + d d^T/R^3] da,    M2 the same with weight a,
    d = x - x_start - a (x_end - x_start),  R^2 = |d|^2 + eps^2,

to 25 digits. The doubles are taken as exact numbers and the integrals are computed with 70 digits by composite
Gauss-Legendre quadrature in v, where the distance along the axis from the target's foot is zeta = h sinh(v). Every row is
compared with the closed form (indefinite integrals at 120 digits); a disagreement above 1e-30 stops the program.
"""

import csv
import itertools
import math
import random
from pathlib import Path

from mpmath import asinh, cos, exp, fabs, mp, mpf, nstr, pi, sqrt, workdps

mp.dps = 70
POINTS = 44  # per panel of length <= 1 in v: the poles at v = +-i pi/2 leave an error near 1e-70
ENTRIES = ("xx", "xy", "xz", "yy", "yz", "zz")
PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def legendre_rule(n):
    """Nodes and weights of n-point Gauss-Legendre quadrature on [-1, 1], by Newton's method."""
    rule = []
    for k in range(1, n + 1):
        x = cos(pi * (k - mpf(1) / 4) / (n + mpf(1) / 2))
        for _ in range(9):
            p0, p1 = mpf(1), x
            for j in range(2, n + 1):
                p0, p1 = p1, ((2 * j - 1) * x * p1 - (j - 1) * p0) / j
            slope = n * (x * p1 - p0) / (x * x - 1)
            x -= p1 / slope
        rule.append((x, 2 / ((1 - x * x) * slope**2)))
    return rule


RULE = legendre_rule(POINTS)


def frame(target, start, end, epsilon):
    """Exact geometry: perpendicular offset, unit tangent, length, h^2 and the ends' coordinates from the foot."""
    x, p, q = ([mpf(c) for c in v] for v in (target, start, end))
    s = [b - a for a, b in zip(p, q)]
    length = sqrt(sum(c * c for c in s))
    u = [c / length for c in s]
    r = [a - b for a, b in zip(x, p)]
    along = sum(a * b for a, b in zip(r, u))
    perp = [a - along * b for a, b in zip(r, u)]
    h2 = sum(c * c for c in perp) + mpf(epsilon) ** 2
    return perp, u, length, h2, -along, length - along


def assemble(perp, u, epsilon, isotropic, k0, k1, k2):
    """Six entries of (isotropic + eps^2 k0) I + k0 p p^T - k1 (p u^T + u p^T) + k2 u u^T."""
    diagonal = isotropic + mpf(epsilon) ** 2 * k0
    return [
        (diagonal if i == j else 0)
        + k0 * perp[i] * perp[j]
        - k1 * (perp[i] * u[j] + u[i] * perp[j])
        + k2 * u[i] * u[j]
        for i, j in PAIRS
    ]


def by_quadrature(target, start, end, epsilon):
    perp, u, length, h2, z0, z1 = frame(target, start, end, epsilon)
    h = sqrt(h2)
    v0, v1 = asinh(z0 / h), asinh(z1 / h)
    panels = max(1, math.ceil(v1 - v0))
    half = (v1 - v0) / (2 * panels)
    sums = [[mpf(0)] * 4, [mpf(0)] * 4]
    for panel in range(panels):
        middle = v0 + (2 * panel + 1) * half
        for node, weight in RULE:
            e = exp(middle + half * node)
            zeta, r2 = h * (e - 1 / e) / 2, h2 * ((e + 1 / e) / 2) ** 2
            w = weight * half
            for phi, block in zip(((z1 - zeta) / length, (zeta - z0) / length), sums):
                block[0] += w * phi
                block[1] += w * phi / r2
                block[2] += w * phi * zeta / r2
                block[3] += w * phi * zeta * zeta / r2
    return [assemble(perp, u, epsilon, *block) for block in sums]


def by_closed_form(target, start, end, epsilon):
    with workdps(120):
        perp, u, length, h2, z0, z1 = frame(target, start, end, epsilon)
        r0, r1 = sqrt(h2 + z0**2), sqrt(h2 + z1**2)
        i0 = asinh(z1 / sqrt(h2)) - asinh(z0 / sqrt(h2))
        i1 = r1 - r0
        c0, c1 = (z1 / r1 - z0 / r0) / h2, 1 / r0 - 1 / r1
        c2, c3 = i0 - h2 * c0, i1 - h2 * c1
        first = [(z1 * a - b) / length for a, b in ((i0, i1), (c0, c1), (c1, c2), (c2, c3))]
        second = [(b - z0 * a) / length for a, b in ((i0, i1), (c0, c1), (c1, c2), (c2, c3))]
        return [assemble(perp, u, epsilon, *block) for block in (first, second)]


def unit(random_source):
    while True:
        v = [random_source.gauss(0, 1) for _ in range(3)]
        n = math.sqrt(sum(c * c for c in v))
        if n > 1e-3:
            return [c / n for c in v]


def cases():
    """Yields (label, target, start, end, epsilon); all numbers are doubles and taken as exact."""
    rng = random.Random(20240607)
    epsilons = [1e-6, 1e-4, 1e-2, 0.3, 1.0, 10.0]
    distances = [
        1e-6,
        1e-3,
        0.1,
        0.5,
        0.9,
        1.0,
        1.3,
        1.6,
        2.2,
        3.5,
        5.0,
        9.0,
        22.0,
        50.0,
        1e2,
        1e3,
        1e4,
        1e5,
        1e6,
    ]

    def segment(scale=1.0, shift=10.0, axis=None):
        """A segment of length about `scale`, `shift` lengths from the origin; unless `axis` is set, askew."""
        u = unit(rng) if axis is None else axis
        away = unit(rng)
        start = [scale * shift * c for c in away]
        return start, [a + scale * b for a, b in zip(start, u)], u

    def across(u):
        v = unit(rng)
        dot = sum(a * b for a, b in zip(u, v))
        v = [a - dot * b for a, b in zip(v, u)]
        n = math.sqrt(sum(c * c for c in v))
        return [c / n for c in v]

    # At a distance from the start, by angle from the axis, from straight on to 1e-6 rad off, on both sides.
    angles = [0.0, 1e-6, 1e-3, 0.3, math.pi / 2, math.pi - 0.3, math.pi - 1e-3, math.pi - 1e-6, math.pi]
    for n, (distance, angle) in enumerate(itertools.product(distances, angles)):
        for epsilon in (epsilons[n % 6], epsilons[(n + 2 + n // 9) % 6]):
            start, end, u = segment()
            v = across(u)
            target = [
                a + distance * (math.cos(angle) * b + math.sin(angle) * c) for a, b, c in zip(start, u, v)
            ]
            yield "angle", target, start, end, epsilon

    # Exactly on the axis, in binary: every coordinate below is a short binary fraction.
    for t in (-64.0, -3.0, -1.5, -0.5, -(2.0**-20), 0.25, 0.5, 1.0 + 2.0**-20, 1.5, 2.0, 3.5, 12.0, 1e6):
        for epsilon in (1e-6, 1e-3, 0.125, 4.0):
            start, step = [8.0, -4.0, 2.5], [0.5, 0.75, -0.25]
            end = [a + b for a, b in zip(start, step)]
            yield "axis", [a + t * b for a, b in zip(start, step)], start, end, epsilon

    # On the nodes and inside the segment, to within rounding and off it by less and more than epsilon.
    for fraction in (0.0, 1e-6, 0.01, 0.37, 0.5, 0.99, 1.0 - 1e-6, 1.0):
        for epsilon in epsilons:
            for offset in (0.0, 1e-7, 1e-3):
                start, end, u = segment()
                v = across(u)
                along = [(1 - fraction) * a + fraction * b for a, b in zip(start, end)]
                yield "inside", [a + offset * c for a, c in zip(along, v)], start, end, epsilon

    # Just beyond an end, close to the axis.
    for gap in (1e-7, 1e-5, 1e-3, 0.1):
        for off in (0.0, 1e-6, 1e-4):
            for epsilon in (1e-6, 1e-5, 1e-3, 0.1):
                start, end, u = segment()
                v, near_end = across(u), rng.random() < 0.5
                base, sign = (end, 1.0) if near_end else (start, -1.0)
                yield (
                    "tip",
                    [a + sign * gap * b + off * c for a, b, c in zip(base, u, v)],
                    start,
                    end,
                    epsilon,
                )

    # Anywhere, in any size from micrometres to kilometres, at the origin or away from it.
    for _ in range(140):
        scale = 10.0 ** rng.uniform(-6, 3)
        start, end, u = segment(scale, rng.choice([0.0, 1.0, 10.0]))
        away, distance = unit(rng), scale * 10.0 ** rng.uniform(-3, 6)
        target = [a + distance * b for a, b in zip(start, away)]
        yield "random", target, start, end, scale * 10.0 ** rng.uniform(-6, 1)


def main():
    rows, worst = [], mpf(0)
    for label, target, start, end, epsilon in cases():
        blocks = by_quadrature(target, start, end, epsilon)
        for block, check in zip(blocks, by_closed_form(target, start, end, epsilon)):
            size = max(fabs(c) for c in check)
            worst = max(worst, max(fabs(a - b) for a, b in zip(block, check)) / size)
        if worst > mpf("1e-30"):
            raise SystemExit(
                f"quadrature and closed form differ by {nstr(worst, 3)} at {label} {target} {start} {end} {epsilon}"
            )
        inputs = [repr(c) for c in (*target, *start, *end, epsilon)]
        rows.append([label, *inputs, *(nstr(c, 25) for block in blocks for c in block)])
    header = ["case"] + [f"{v}_{c}" for v in ("target", "start", "end") for c in "xyz"] + ["epsilon"]
    header += [f"{m}_{e}" for m in ("m1", "m2") for e in ENTRIES]
    with open(Path(__file__).with_name("segment_blocks.csv"), "w", newline="") as out:
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
    print(f"{len(rows)} cases; quadrature and closed form agree to {nstr(worst, 3)}")


if __name__ == "__main__":
    main()
