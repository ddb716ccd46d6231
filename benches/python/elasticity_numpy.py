"""Gradient and Hessian of a chain's elastic energy in NumPy, all hinges at once.

The formulas are those of docs/theory ("Strains"), with curvature in the frame halfway through the twist.
Frames are transported in time from the reference; the Hessian is exact where the chain stands at its
reference frames.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from elasticity import Chain, FloatArray

Derivatives = Callable[[], tuple[FloatArray, FloatArray]]


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    # Three products of columns: numpy.cross takes several times as long.
    return np.stack(
        [
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        ],
        axis=1,
    )


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    result: FloatArray = np.einsum("hi,hi->h", a, b)
    return result


def _outer(a: FloatArray, b: FloatArray) -> FloatArray:
    return a[:, :, None] * b[:, None, :]


def _symmetric(a: FloatArray, b: FloatArray) -> FloatArray:
    outer = _outer(a, b)
    return outer + outer.transpose(0, 2, 1)


def _skew(v: FloatArray) -> FloatArray:
    result = np.zeros((len(v), 3, 3))
    result[:, 0, 1], result[:, 0, 2], result[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    result[:, 1, 0], result[:, 2, 0], result[:, 2, 1] = v[:, 2], -v[:, 1], v[:, 0]
    return result


def _transport(v: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    axis, cosine = _cross(start, end), _dot(start, end)[:, None]
    return v * cosine + _cross(axis, v) + axis * (_dot(axis, v)[:, None] / (1.0 + cosine))


def _spreading() -> FloatArray:
    """Return the matrix (11, 8) that takes a gradient in ``(e, theta_e, f, theta_f)`` to nodes and angles."""
    matrix = np.zeros((11, 8))
    matrix[0:3, 0:3], matrix[4:7, 0:3] = -np.eye(3), np.eye(3)
    matrix[4:7, 4:7], matrix[8:11, 4:7] = -np.eye(3), np.eye(3)
    matrix[3, 3] = matrix[7, 7] = 1.0
    return matrix


def derivatives(chain: Chain) -> Derivatives:
    """Return the function of no arguments that computes gradient (ndof,) and Hessian, a band (21, ndof)."""
    size, hinges = len(chain.q), len(chain.twists)
    spread = _spreading()
    hinge_dofs = 4 * np.arange(hinges)[:, None] + np.arange(11)
    edge_dofs = 4 * np.arange(hinges + 1)[:, None] + np.array([0, 1, 2, 4, 5, 6])

    def slots(dofs: FloatArray) -> FloatArray:
        rows, columns = dofs[:, :, None], dofs[:, None, :]
        return ((10 + rows - columns) * size + columns).ravel()

    dofs = np.concatenate([hinge_dofs.ravel(), edge_dofs.ravel()])
    entries = np.concatenate([slots(hinge_dofs), slots(edge_dofs)])

    def evaluate() -> tuple[FloatArray, FloatArray]:
        hinge_gradient, hinge_hessian, edge_gradient, edge_hessian = _elements(chain)
        gradient_8 = np.concatenate([(hinge_gradient @ spread.T).ravel(), edge_gradient.ravel()])
        hessian_8 = np.concatenate([(spread @ hinge_hessian @ spread.T).ravel(), edge_hessian.ravel()])
        gradient = np.bincount(dofs, gradient_8, size)
        return gradient, np.bincount(entries, hessian_8, 21 * size).reshape(21, size)

    return evaluate


def _elements(chain: Chain) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    count = len(chain.lengths) + 1
    nodes = np.append(chain.q, 0.0).reshape(count, 4)
    edges = np.diff(nodes[:, :3], axis=0)
    theta = nodes[:-1, 3]
    length = np.sqrt(_dot(edges, edges))
    t = edges / length[:, None]
    d1 = _transport(chain.directors, chain.tangents, t)
    d1 = d1 - t * _dot(d1, t)[:, None]
    d1 = d1 / np.sqrt(_dot(d1, d1))[:, None]
    d2 = _cross(t, d1)
    cosine, sine = np.cos(theta)[:, None], np.sin(theta)[:, None]
    m1, m2 = cosine * d1 + sine * d2, cosine * d2 - sine * d1

    along = _transport(d1[:-1], t[:-1], t[1:])
    angle = np.arctan2(_dot(t[1:], _cross(along, d1[1:])), _dot(along, d1[1:]))
    angle += 2.0 * np.pi * np.round((chain.twists - angle) / (2.0 * np.pi))
    tau = np.diff(theta) + angle
    stretch = _stretching(chain, t, length)
    return *_bending_and_twisting(chain, t, m1, m2, length, tau), *stretch


def _stretching(chain: Chain, t: FloatArray, length: FloatArray) -> tuple[FloatArray, FloatArray]:
    tension = chain.stretching * (length / chain.lengths - 1.0)
    pull = tension[:, None] * t
    along = _outer(t, t)
    stiff, loose = (chain.stretching / chain.lengths)[:, None, None], (tension / length)[:, None, None]
    block = stiff * along + loose * (np.eye(3) - along)
    hessian = np.empty((len(t), 6, 6))
    hessian[:, :3, :3] = hessian[:, 3:, 3:] = block
    hessian[:, :3, 3:] = hessian[:, 3:, :3] = -block
    return np.concatenate([-pull, pull], axis=1), hessian


def _bending_and_twisting(
    chain: Chain, t: FloatArray, m1: FloatArray, m2: FloatArray, length: FloatArray, tau: FloatArray
) -> tuple[FloatArray, FloatArray]:
    te, tf, length_e, length_f = t[:-1], t[1:], length[:-1, None], length[1:, None]
    # The frame halfway through the twist, as either edge has it.
    cosine, sine = np.cos(0.5 * tau)[:, None], np.sin(0.5 * tau)[:, None]
    m1_e, m2_e = cosine * m1[:-1] + sine * m2[:-1], cosine * m2[:-1] - sine * m1[:-1]
    m1_f, m2_f = cosine * m1[1:] - sine * m2[1:], cosine * m2[1:] + sine * m1[1:]
    chi = 0.5 * _dot(te + tf, te + tf)[:, None]
    kb = 2.0 * _cross(te, tf) / chi
    mean_t, mean_m1, mean_m2 = (te + tf) / chi, (m1_e + m1_f) / chi, (m2_e + m2_f) / chi
    kappa_1, kappa_2 = 0.5 * _dot(kb, m2_e + m2_f), -0.5 * _dot(kb, m1_e + m1_f)

    slopes = np.zeros((3, len(kb), 8))
    for slope, kappa, mean, sign in ((slopes[0], kappa_1, mean_m2, 1.0), (slopes[1], kappa_2, mean_m1, -1.0)):
        slope[:, 0:3] = (sign * _cross(tf, mean) - kappa[:, None] * mean_t) / length_e
        slope[:, 4:7] = (-sign * _cross(te, mean) - kappa[:, None] * mean_t) / length_f
    slopes[0, :, 3] = slopes[0, :, 7] = 0.5 * kappa_2
    slopes[1, :, 3] = slopes[1, :, 7] = -0.5 * kappa_1
    slopes[2, :, 0:3], slopes[2, :, 4:7] = kb / (2.0 * length_e), kb / (2.0 * length_f)
    slopes[2, :, 3], slopes[2, :, 7] = -1.0, 1.0

    bending, twisting = chain.bending / chain.voronoi, chain.twisting / chain.voronoi
    stiffness = np.stack([bending, bending, twisting])
    strains = np.stack(
        [kappa_1 - chain.curvatures[:, 0], kappa_2 - chain.curvatures[:, 1], tau - chain.natural_twists]
    )
    moments = stiffness * strains
    gradient: FloatArray = np.einsum("kh,khi->hi", moments, slopes)
    # As matrix products of the weighted slopes: three times as fast as one einsum.
    hessian = (stiffness[:, :, None] * slopes).transpose(1, 2, 0) @ slopes.transpose(1, 0, 2)

    w1, w2, w3 = (moment[:, None] for moment in moments)
    weighted = (w1[:, 0] * kappa_1 + w2[:, 0] * kappa_2)[:, None, None]
    mean = mean_m2 * w1 - mean_m1 * w2
    across_e, across_f = _cross(te, mean), _cross(tf, mean)
    chi_3, identity = chi[:, :, None], np.eye(3)
    wide = 2.0 * weighted * _outer(mean_t, mean_t)
    with_twist = kb * (weighted[:, 0] / 32.0)
    for at, own, tangent, across, sign, edge in (
        (0, m2_e * w1 - m1_e * w2, te, across_f, -1.0, length_e),
        (4, m2_f * w1 - m1_f * w2, tf, across_e, 1.0, length_f),
    ):
        block = wide + sign * _symmetric(across, mean_t) + _symmetric(kb, 0.25 * own + with_twist)
        block -= (identity - _outer(tangent, tangent)) * (weighted / chi_3)
        block -= 0.25 * w3[:, :, None] * _symmetric(kb, tangent + mean_t)
        hessian[:, at : at + 3, at : at + 3] += block / (edge * edge)[:, :, None]
    column = 0.5 * (w1 * slopes[1] - w2 * slopes[0])
    for angle in (3, 7):
        for start in (0, 4):
            hessian[:, start : start + 3, angle] += column[:, start : start + 3]
            hessian[:, angle, start : start + 3] += column[:, start : start + 3]
        hessian[:, angle, 3] += column[:, 3]
        hessian[:, angle, 7] += column[:, 7]
    block = (
        wide
        - _outer(across_f, mean_t)
        + _outer(mean_t, across_e)
        - _skew(mean)
        + 2.0 * _outer(kb, with_twist)
    )
    block -= (identity + _outer(te, tf)) * (weighted / chi_3)
    block += 0.5 * w3[:, :, None] * (_skew(te) * (2.0 / chi_3) - _outer(kb, mean_t))
    block /= (length_e * length_f)[:, :, None]
    hessian[:, 0:3, 4:7] += block
    hessian[:, 4:7, 0:3] += block.transpose(0, 2, 1)
    return gradient, hessian
