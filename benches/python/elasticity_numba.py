"""Gradient and Hessian of a chain's elastic energy in Numba: the formulas of `elasticity_numpy`, in loops."""

from __future__ import annotations

import math

import numba
import numpy as np
from elasticity import Chain, FloatArray
from elasticity_numpy import Derivatives


@numba.njit(inline="always")
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@numba.njit(inline="always")
def _cross(a, b):  # type: ignore[no-untyped-def]
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@numba.njit(inline="always")
def _sum(a, x, b, y):  # type: ignore[no-untyped-def]
    """Return ``x a + y b``."""
    return (x * a[0] + y * b[0], x * a[1] + y * b[1], x * a[2] + y * b[2])


@numba.njit(inline="always")
def _row(array, k):  # type: ignore[no-untyped-def]
    return (array[k, 0], array[k, 1], array[k, 2])


@numba.njit(inline="always")
def _transport(v, start, end):  # type: ignore[no-untyped-def]
    axis = _cross(start, end)
    cosine = _dot(start, end)
    turned = _sum(v, cosine, _cross(axis, v), 1.0)
    return _sum(turned, 1.0, axis, _dot(axis, v) / (1.0 + cosine))


@numba.njit(inline="always")
def _set(slope, start, vector, factor):  # type: ignore[no-untyped-def]
    for i in range(3):
        slope[start + i] = factor * vector[i]


@numba.njit(fastmath=False)
def _evaluate(
    q,
    tangents,
    directors,
    twists,
    rest_lengths,
    voronoi,
    curvatures,
    natural_twists,
    stretching,
    bending,
    twisting,
):  # type: ignore[no-untyped-def]
    edges = rest_lengths.shape[0]
    size = q.shape[0]
    gradient = np.zeros(size)
    band = np.zeros((21, size))
    length = np.empty(edges)
    t = np.empty((edges, 3))
    d1 = np.empty((edges, 3))
    m1 = np.empty((edges, 3))
    m2 = np.empty((edges, 3))
    for k in range(edges):
        at = 4 * k
        e = (q[at + 4] - q[at], q[at + 5] - q[at + 1], q[at + 6] - q[at + 2])
        length[k] = math.sqrt(_dot(e, e))
        tk = _sum(e, 1.0 / length[k], e, 0.0)
        d = _transport(_row(directors, k), _row(tangents, k), tk)
        d = _sum(d, 1.0, tk, -_dot(d, tk))
        d = _sum(d, 1.0 / math.sqrt(_dot(d, d)), d, 0.0)
        second = _cross(tk, d)
        cosine, sine = math.cos(q[at + 3]), math.sin(q[at + 3])
        tension = stretching[k] * (length[k] / rest_lengths[k] - 1.0)
        stiff, loose = stretching[k] / rest_lengths[k], tension / length[k]
        for i in range(3):
            t[k, i] = tk[i]
            d1[k, i] = d[i]
            m1[k, i] = cosine * d[i] + sine * second[i]
            m2[k, i] = cosine * second[i] - sine * d[i]
            gradient[at + i] -= tension * tk[i]
            gradient[at + 4 + i] += tension * tk[i]
            for j in range(3):
                value = (stiff - loose) * tk[i] * tk[j] + (loose if i == j else 0.0)
                band[10 + i - j, at + j] += value
                band[10 + i - j, at + 4 + j] += value
                band[14 + i - j, at + j] -= value
                band[6 + i - j, at + 4 + j] -= value

    slopes = np.zeros((3, 8))
    local = np.empty((8, 8))
    half = np.zeros((8, 11))
    stiffness = np.empty(3)
    moments = np.empty(3)
    for k in range(edges - 1):
        te, tf = _row(t, k), _row(t, k + 1)
        m1e, m1f, m2e, m2f = _row(m1, k), _row(m1, k + 1), _row(m2, k), _row(m2, k + 1)
        le, lf = length[k], length[k + 1]
        along = _transport(_row(d1, k), te, tf)
        df = _row(d1, k + 1)
        angle = math.atan2(_dot(tf, _cross(along, df)), _dot(along, df))
        angle += 2.0 * math.pi * np.round((twists[k] - angle) / (2.0 * math.pi))
        tau = q[4 * k + 7] - q[4 * k + 3] + angle
        # The frame halfway through the twist, as either edge has it.
        cosine, sine = math.cos(0.5 * tau), math.sin(0.5 * tau)
        m1e, m2e = _sum(m1e, cosine, m2e, sine), _sum(m2e, cosine, m1e, -sine)
        m1f, m2f = _sum(m1f, cosine, m2f, -sine), _sum(m2f, cosine, m1f, sine)
        mid = _sum(te, 1.0, tf, 1.0)
        chi = 0.5 * _dot(mid, mid)
        bare = _cross(te, tf)
        kb = _sum(bare, 2.0 / chi, bare, 0.0)
        mean_t = _sum(te, 1.0 / chi, tf, 1.0 / chi)
        mean_m1 = _sum(m1e, 1.0 / chi, m1f, 1.0 / chi)
        mean_m2 = _sum(m2e, 1.0 / chi, m2f, 1.0 / chi)
        kappa_1 = 0.5 * chi * _dot(kb, mean_m2)
        kappa_2 = -0.5 * chi * _dot(kb, mean_m1)

        _set(slopes[0], 0, _sum(mean_t, -kappa_1, _cross(tf, mean_m2), 1.0), 1.0 / le)
        _set(slopes[0], 4, _sum(mean_t, -kappa_1, _cross(te, mean_m2), -1.0), 1.0 / lf)
        _set(slopes[1], 0, _sum(mean_t, -kappa_2, _cross(tf, mean_m1), -1.0), 1.0 / le)
        _set(slopes[1], 4, _sum(mean_t, -kappa_2, _cross(te, mean_m1), 1.0), 1.0 / lf)
        _set(slopes[2], 0, kb, 0.5 / le)
        _set(slopes[2], 4, kb, 0.5 / lf)
        slopes[0, 3] = slopes[0, 7] = 0.5 * kappa_2
        slopes[1, 3] = slopes[1, 7] = -0.5 * kappa_1
        slopes[2, 3] = -1.0
        slopes[2, 7] = 1.0

        stiffness[0] = stiffness[1] = bending[k] / voronoi[k]
        stiffness[2] = twisting[k] / voronoi[k]
        moments[0] = stiffness[0] * (kappa_1 - curvatures[k, 0])
        moments[1] = stiffness[1] * (kappa_2 - curvatures[k, 1])
        moments[2] = stiffness[2] * (tau - natural_twists[k])
        for i in range(8):
            for j in range(8):
                local[i, j] = (
                    stiffness[0] * slopes[0, i] * slopes[0, j]
                    + stiffness[1] * slopes[1, i] * slopes[1, j]
                    + stiffness[2] * slopes[2, i] * slopes[2, j]
                )

        w1, w2, w3 = moments[0], moments[1], moments[2]
        weighted = w1 * kappa_1 + w2 * kappa_2
        mean = _sum(mean_m2, w1, mean_m1, -w2)
        own_e, own_f = _sum(m2e, 0.25 * w1, m1e, -0.25 * w2), _sum(m2f, 0.25 * w1, m1f, -0.25 * w2)
        own_e, own_f = _sum(own_e, 1.0, kb, weighted / 32.0), _sum(own_f, 1.0, kb, weighted / 32.0)
        across_e, across_f = _cross(te, mean), _cross(tf, mean)
        # The antisymmetric part of the mixed block: -skew(mean) + w3 / chi skew(te).
        spin = _sum(mean, -1.0, te, w3 / chi)
        skew = ((0.0, -spin[2], spin[1]), (spin[2], 0.0, -spin[0]), (-spin[1], spin[0], 0.0))
        for i in range(3):
            for j in range(3):
                same = 1.0 if i == j else 0.0
                wide = 2.0 * weighted * mean_t[i] * mean_t[j]
                ee = wide - across_f[i] * mean_t[j] - mean_t[i] * across_f[j]
                ee += kb[i] * own_e[j] + own_e[i] * kb[j] - (same - te[i] * te[j]) * (weighted / chi)
                ee -= 0.25 * w3 * (kb[i] * (te[j] + mean_t[j]) + (te[i] + mean_t[i]) * kb[j])
                ff = wide + across_e[i] * mean_t[j] + mean_t[i] * across_e[j]
                ff += kb[i] * own_f[j] + own_f[i] * kb[j] - (same - tf[i] * tf[j]) * (weighted / chi)
                ff -= 0.25 * w3 * (kb[i] * (tf[j] + mean_t[j]) + (tf[i] + mean_t[i]) * kb[j])
                ef = wide - across_f[i] * mean_t[j] + mean_t[i] * across_e[j] + skew[i][j]
                ef += 0.0625 * weighted * kb[i] * kb[j]
                ef -= (same + te[i] * tf[j]) * (weighted / chi) + 0.5 * w3 * kb[i] * mean_t[j]
                local[i, j] += ee / (le * le)
                local[4 + i, 4 + j] += ff / (lf * lf)
                local[i, 4 + j] += ef / (le * lf)
                local[4 + j, i] += ef / (le * lf)
        for angle in (3, 7):
            for i in (0, 1, 2, 4, 5, 6):
                mixed = 0.5 * (w1 * slopes[1, i] - w2 * slopes[0, i])
                local[i, angle] += mixed
                local[angle, i] += mixed
            local[angle, 3] -= 0.25 * weighted
            local[angle, 7] -= 0.25 * weighted

        at = 4 * k
        for i in range(3):
            e_part = w1 * slopes[0, i] + w2 * slopes[1, i] + w3 * slopes[2, i]
            f_part = w1 * slopes[0, 4 + i] + w2 * slopes[1, 4 + i] + w3 * slopes[2, 4 + i]
            gradient[at + i] -= e_part
            gradient[at + 4 + i] += e_part - f_part
            gradient[at + 8 + i] += f_part
        gradient[at + 3] += w1 * slopes[0, 3] + w2 * slopes[1, 3] + w3 * slopes[2, 3]
        gradient[at + 7] += w1 * slopes[0, 7] + w2 * slopes[1, 7] + w3 * slopes[2, 7]
        for row in range(8):
            for i in range(3):
                half[row, i] = -local[row, i]
                half[row, 4 + i] = local[row, i] - local[row, 4 + i]
                half[row, 8 + i] = local[row, 4 + i]
            half[row, 3] = local[row, 3]
            half[row, 7] = local[row, 7]
        for column in range(11):
            for i in range(3):
                band[10 + i - column, at + column] -= half[i, column]
                band[14 + i - column, at + column] += half[i, column] - half[4 + i, column]
                band[18 + i - column, at + column] += half[4 + i, column]
            band[13 - column, at + column] += half[3, column]
            band[17 - column, at + column] += half[7, column]
    return gradient, band


def derivatives(chain: Chain) -> Derivatives:
    """Return the function of no arguments that computes gradient (ndof,) and Hessian, a band (21, ndof)."""

    def evaluate() -> tuple[FloatArray, FloatArray]:
        gradient, band = _evaluate(
            chain.q,
            chain.tangents,
            chain.directors,
            chain.twists,
            chain.lengths,
            chain.voronoi,
            chain.curvatures,
            chain.natural_twists,
            chain.stretching,
            chain.bending,
            chain.twisting,
        )
        return gradient, band

    return evaluate
