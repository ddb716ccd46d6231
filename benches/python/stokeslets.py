"""Regularized Stokeslet segments in NumPy and Numba: the published closed forms, written down as they stand.

Both return the matrix A (3N, 3N) of ``8 pi mu u = A f`` for a chain: Cortez (2018),
doi:10.1016/j.jcp.2018.08.055, or equations 12 to 14 of Lim et al., 14e mended. With
``r = x - x_k``, ``s = x_k - x_(k+1)``, ``p = (r + a s) . s`` and ``R^2 = |r + a s|^2 + eps^2`` everything
follows from ``log(|s| R + p)`` and ``1/(R (|s| R + p))`` at a = 0 and 1.
"""

from __future__ import annotations

import math

import numba
import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


def mobility_numpy(nodes: FloatArray, epsilon: float) -> FloatArray:
    """Return A of the chain of nodes (N, 3) [m] with one regularization [m], all pairs at once."""
    r = nodes[:, None] - nodes[None, :-1]
    s = nodes[:-1] - nodes[1:]
    squared = np.einsum("ej,ej->e", s, s)
    length = np.sqrt(squared)
    along = np.einsum("nej,ej->ne", r, s)
    r0 = np.sqrt(np.einsum("nej,nej->ne", r, r) + epsilon**2)
    r1 = np.sqrt(np.square(r + s).sum(axis=2) + epsilon**2)
    p0, p1 = along, along + squared

    t01 = (np.log(length * r1 + p1) - np.log(length * r0 + p0)) / length
    t03 = 1.0 / (r0 * (length * r0 + p0)) - 1.0 / (r1 * (length * r1 + p1))
    t11 = (r1 - r0) / squared - along / squared * t01
    t13 = (1.0 / r0 - 1.0 / r1) / squared - along / squared * t03
    t23 = -1.0 / (r1 * squared) + t01 / squared - along / squared * t13
    t33 = -1.0 / (r1 * squared) + 2.0 / squared * t11 - along / squared * t23

    rr = r[..., :, None] * r[..., None, :]
    rs = r[..., :, None] * s[:, None, :]
    rs = rs + np.swapaxes(rs, 2, 3)
    ss = s[:, :, None] * s[:, None, :]
    identity = np.eye(3)

    def block(t_1: FloatArray, t_3: FloatArray, t_next: FloatArray, t_last: FloatArray) -> FloatArray:
        wide = (t_1 + epsilon**2 * t_3)[..., None, None] * identity
        wide = wide + t_3[..., None, None] * rr + t_next[..., None, None] * rs + t_last[..., None, None] * ss
        result: FloatArray = length[:, None, None] * wide
        return result

    m2 = block(t11, t13, t23, t33)
    m1 = block(t01, t03, t13, t23) - m2
    count = len(nodes)
    a = np.zeros((count, 3, count, 3))
    a[:, :, :-1] += m1.transpose(0, 2, 1, 3)
    a[:, :, 1:] += m2.transpose(0, 2, 1, 3)
    return a.reshape(3 * count, 3 * count)


@numba.njit(cache=False, fastmath=False)
def mobility_numba(nodes: FloatArray, epsilon: float) -> FloatArray:
    """Return A of the chain of nodes (N, 3) [m] with one regularization [m], pair by pair."""
    count = nodes.shape[0]
    a = np.zeros((3 * count, 3 * count))
    eps2 = epsilon * epsilon
    m1 = np.empty((3, 3))
    m2 = np.empty((3, 3))
    r = np.empty(3)
    s = np.empty(3)
    for n in range(count):
        for e in range(count - 1):
            squared = 0.0
            along = 0.0
            r0 = eps2
            r1 = eps2
            for j in range(3):
                r[j] = nodes[n, j] - nodes[e, j]
                s[j] = nodes[e, j] - nodes[e + 1, j]
                squared += s[j] * s[j]
                along += r[j] * s[j]
                r0 += r[j] * r[j]
                r1 += (r[j] + s[j]) ** 2
            length = math.sqrt(squared)
            r0 = math.sqrt(r0)
            r1 = math.sqrt(r1)
            q0 = length * r0 + along
            q1 = length * r1 + along + squared
            over = 1.0 / squared
            shift = along * over
            t01 = math.log(q1 / q0) / length
            t03 = 1.0 / (r0 * q0) - 1.0 / (r1 * q1)
            t11 = (r1 - r0) * over - shift * t01
            t13 = (1.0 / r0 - 1.0 / r1) * over - shift * t03
            t23 = -over / r1 + t01 * over - shift * t13
            t33 = -over / r1 + 2.0 * over * t11 - shift * t23
            for i in range(3):
                for j in range(3):
                    rs = r[i] * s[j] + s[i] * r[j]
                    m2[i, j] = length * (t13 * r[i] * r[j] + t23 * rs + t33 * s[i] * s[j])
                    m1[i, j] = length * (t03 * r[i] * r[j] + t13 * rs + t23 * s[i] * s[j]) - m2[i, j]
                m2[i, i] += length * (t11 + eps2 * t13)
                m1[i, i] += length * (t01 + eps2 * t03 - t11 - eps2 * t13)
            for i in range(3):
                for j in range(3):
                    a[3 * n + i, 3 * e + j] += m1[i, j]
                    a[3 * n + i, 3 * e + 3 + j] += m2[i, j]
    return a
