"""Writes wall_blocks.csv: reference values of the images of regularized Stokeslet segments behind a plane.

Run with ``python make_wall_blocks.py`` (needs mpmath; about a minute). Each row holds a plane, a segment, a target and a
regularization as exact doubles, and for both kinds of boundary the nine entries (row by row) of each of the two blocks

    M1 = |s| int_0^1 (1-a) G(x, y(a)) da,    M2 the same with weight a,    y(a) = start + a (end - start),

to 20 digits. G is taken in the form of Ainley et al. (2008) as corrected by Smith (2009), as a sum of a regularized Stokeslet,
derivatives of it and companion blobs, not in the collected form of the program; the derivatives are those of the
formula, written out. The doubles are taken as exact numbers; integrals by composite Gauss-Legendre quadrature of 40 points with
50 digits, on pieces halved until none is longer than the distance to the image.
"""

import csv
import math
import random
from pathlib import Path

from mpmath import cos, matrix, mp, mpf, nstr, pi, sqrt

mp.dps = 50


def legendre_rule(n):
    """Nodes and weights of n-point Gauss-Legendre quadrature on [0, 1], by Newton's method."""
    rule = []
    for k in range(1, n + 1):
        x = cos(pi * (k - mpf(1) / 4) / (n + mpf(1) / 2))
        for _ in range(9):
            p0, p1 = mpf(1), x
            for j in range(2, n + 1):
                p0, p1 = p1, ((2 * j - 1) * x * p1 - (j - 1) * p0) / j
            slope = n * (x * p1 - p0) / (x * x - 1)
            x -= p1 / slope
        rule.append(((1 + x) / 2, 1 / ((1 - x * x) * slope**2)))
    return rule


RULE = legendre_rule(40)
KINDS = ("no-slip", "free-surface")


def image(kind, x, y, eps):
    """G (3, 3) for a wall at z = 0, the fluid above it."""
    h, s = y[2], (1, 1, -1)
    R = [x[0] - y[0], x[1] - y[1], x[2] + h]
    square = sum(c * c for c in R)
    root = sqrt(square + eps**2)

    def delta(i, j):
        return mpf(i == j)

    def stokeslet(i, j):
        return (delta(i, j) * (square + 2 * eps**2) + R[i] * R[j]) / root**3

    if kind == "free-surface":
        return [[stokeslet(i, j) * s[j] for j in range(3)] for i in range(3)]

    def doublet(i, j):
        """d/dR_j of R_i / root^3."""
        return delta(i, j) / root**3 - 3 * R[i] * R[j] / root**5

    def stokeslet_doublet(i, j):
        """d/dR_j of the Stokeslet of a force along z."""
        isotropic = 2 * R[j] / root**3 - 3 * (square + 2 * eps**2) * R[j] / root**5
        return (
            delta(i, 2) * isotropic
            + (delta(i, j) * R[2] + R[i] * delta(2, j)) / root**3
            - 3 * R[i] * R[2] * R[j] / root**5
        )

    blob = 3 * eps**2 / root**5  # 4 pi times the companion blob
    return [
        [
            -stokeslet(i, j)
            + 2 * h * s[j] * (h * doublet(i, j) - stokeslet_doublet(i, j) - h * delta(i, j) * blob)
            - 6 * h * eps**2 / root**5 * (delta(i, 2) * R[j] - delta(i, j) * R[2])
            for j in range(3)
        ]
        for i in range(3)
    ]


def axes_of(normal):
    """Rotation whose third row is the unit normal."""
    n = [mpf(c) for c in normal]
    size = sqrt(sum(c * c for c in n))
    n = [c / size for c in n]
    other = [mpf(0)] * 3
    other[min(range(3), key=lambda k: abs(n[k]))] = mpf(1)
    u = cross(other, n)
    size = sqrt(sum(c * c for c in u))
    u = [c / size for c in u]
    return matrix([u, cross(n, u), n])


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def blocks(kind, plane, target, start, end, epsilon):
    """M1 and M2 in laboratory axes."""
    point, normal = plane
    Q = axes_of(normal)

    def local(v):
        return Q * matrix([mpf(c) - mpf(p) for c, p in zip(v, point)])

    x, p, q, eps = local(target), local(start), local(end), mpf(epsilon)
    along = q - p
    length = sqrt(sum(c * c for c in along))
    out = [matrix(3, 3), matrix(3, 3)]
    pieces = [(mpf(0), mpf(1))]
    while pieces:
        a, b = pieces.pop()
        middle = p + along * (a + b) / 2
        apart = [x[0] - middle[0], x[1] - middle[1], x[2] + middle[2]]
        if (b - a) * length > sqrt(sum(c * c for c in apart) + eps**2):
            pieces += [(a, (a + b) / 2), ((a + b) / 2, b)]
            continue
        for node, weight in RULE:
            place = a + (b - a) * node
            G = matrix(image(kind, x, p + along * place, eps)) * (weight * (b - a) * length)
            out[0] += G * (1 - place)
            out[1] += G * place
    return [Q.T * block * Q for block in out]


def placed(draw, plane, above, spread):
    """Return a random point at a height above a plane."""
    point, n = plane
    v = [spread * draw.gauss(0, 1) for _ in range(3)]
    shift = above - sum(a * b for a, b in zip(n, v))
    return [p + b + shift * a for p, a, b in zip(point, n, v)]


def cases():
    """Label, plane, target, start, end and regularization; everything is on the fluid's side."""
    draw = random.Random(7)
    for number in range(60):
        scale = 10.0 ** draw.uniform(-6, 2)
        point = [scale * draw.gauss(0, 1) for _ in range(3)]
        normal = [draw.gauss(0, 1) for _ in range(3)]
        size = math.sqrt(sum(c * c for c in normal))
        plane = point, [c / size for c in normal]
        low = scale * 10.0 ** draw.uniform(-2.5, 1)
        # A third of them along the plane.
        other = low if number % 3 == 0 else scale * 10.0 ** draw.uniform(-2.5, 1)
        start, end = placed(draw, plane, low, scale), placed(draw, plane, other, scale)
        far = scale * 10.0 ** draw.uniform(-3, 1.5), scale * 10.0 ** draw.uniform(-1, 2)
        target = [start, placed(draw, plane, low, 0.3 * scale), placed(draw, plane, *far)][number % 5 % 3]
        epsilon = math.dist(start, end) * 10.0 ** draw.uniform(-3, 0)
        yield f"random {number}", (point, normal), target, start, end, epsilon
    for depth in range(4):  # slender edges that all but lie on the plane z = 0, with the target on them
        low = 10.0**-depth
        yield (
            f"near {depth}",
            ([0.0] * 3, [0.0, 0.0, 1.0]),
            [0.3, 0.0, low],
            [0.0, 0.0, low],
            [1.0, 0.0, low],
            low,
        )
        yield (
            f"steep {depth}",
            ([0.0] * 3, [0.0, 0.0, 1.0]),
            [0.0, 0.0, low],
            [0.0, 0.0, low],
            [0.0, 0.1, 1.0],
            low,
        )


with (Path(__file__).parent / "wall_blocks.csv").open("w", newline="") as file:
    writer = csv.writer(file, lineterminator="\n")
    entries = [f"{block}_{i}{j}" for block in ("m1", "m2") for i in "xyz" for j in "xyz"]
    vectors = [f"{name}_{c}" for name in ("point", "normal", "target", "start", "end") for c in "xyz"]
    writer.writerow(["kind", "label", *vectors, "epsilon", *entries])
    for label, plane, target, start, end, epsilon in cases():
        for kind in KINDS:
            values = [entry for block in blocks(kind, plane, target, start, end, epsilon) for entry in block]
            numbers = [*plane[0], *plane[1], *target, *start, *end, epsilon]
            writer.writerow([kind, label, *map(repr, numbers), *(nstr(v, 20) for v in values)])
