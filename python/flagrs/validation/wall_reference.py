"""Filaments near a wall by a computation of its own: quadrature, and images in their published form.

Nothing of the native core is used. Every segment is cut into pieces with Gauss points on them; a point force
and its image behind the plane z = 0 are those of Ainley et al. (2008), as corrected by Smith (2009): a
Stokeslet, a Stokeslet doublet, a source doublet and companion blobs, summed term by term.
"""

from __future__ import annotations

import numpy as np

from flagrs.scene.values import FloatArray, IntArray

#: Pieces of a segment and Gauss points on each: the kernel is smooth over a few times epsilon.
PIECES, POINTS = 12, 12


def stokeslet(apart: FloatArray, epsilon: float) -> FloatArray:
    """Return the blocks (..., 3, 3) of regularized point forces at the distances (..., 3) [1/m]."""
    square = (apart**2).sum(axis=-1)[..., None, None]
    root = np.sqrt(square + epsilon**2)
    outer = apart[..., :, None] * apart[..., None, :]
    blocks: FloatArray = (np.eye(3) * (square + 2.0 * epsilon**2) + outer) / root**3
    return blocks


def image(targets: FloatArray, sources: FloatArray, epsilon: float) -> FloatArray:
    """Return the blocks (..., 3, 3) of the images of point forces behind the no-slip plane z = 0 [1/m]."""
    h = sources[..., 2][..., None, None]
    R = targets - sources * np.array([1.0, 1.0, -1.0])
    square = (R**2).sum(axis=-1)[..., None, None]
    root = np.sqrt(square + epsilon**2)
    unit, z = np.eye(3), np.array([0.0, 0.0, 1.0])
    third = R[..., 2][..., None, None]
    outer = R[..., :, None] * R[..., None, :]
    source_doublet = unit / root**3 - 3.0 * outer / root**5
    # d/dR_j of the Stokeslet of a force along z.
    isotropic = (2.0 / root**3 - 3.0 * (square + 2.0 * epsilon**2) / root**5) * R[..., None, :]
    doublet = z[:, None] * isotropic + (unit * third + R[..., :, None] * z) / root**3
    doublet = doublet - 3.0 * outer * third / root**5
    blob = 3.0 * epsilon**2 / root**5
    mirrored = np.array([1.0, 1.0, -1.0]) * (h * source_doublet - doublet - h * unit * blob)
    rotlet = z[:, None] * R[..., None, :] - unit * third
    blocks: FloatArray = -stokeslet(R, epsilon) + 2.0 * h * mirrored - 6.0 * h * epsilon**2 / root**5 * rotlet
    return blocks


def mobility(nodes: FloatArray, edges: IntArray, epsilon: float, wall: bool = True) -> FloatArray:
    """Return A (3N, 3N) with ``8 pi mu u = A f`` above the plane z = 0, or in unbounded fluid."""
    node, weight = np.polynomial.legendre.leggauss(POINTS)
    place = (np.arange(PIECES)[:, None] + 0.5 * (node + 1.0)).ravel() / PIECES
    weight = np.tile(0.5 * weight, PIECES) / PIECES
    matrix = np.zeros((len(nodes), 3, len(nodes), 3))
    for i, j in edges:
        along = nodes[j] - nodes[i]
        points = nodes[i] + place[:, None] * along
        blocks = stokeslet(nodes[:, None] - points, epsilon)
        if wall:
            blocks = blocks + image(
                nodes[:, None], np.broadcast_to(points, (len(nodes), *points.shape)), epsilon
            )
        length = float(np.linalg.norm(along))
        for end, share in ((i, 1.0 - place), (j, place)):
            matrix[:, :, end] += length * np.einsum("p,npab->nab", weight * share, blocks)
    return matrix.reshape(3 * len(nodes), -1)


def resistance(nodes: FloatArray, edges: IntArray, matrix: FloatArray, about: FloatArray) -> FloatArray:
    """Return force and torque on the fluid over ``8 pi mu`` for rigid motions about a point (6, 6)."""
    arms = nodes - about
    motions = np.concatenate(
        [
            np.broadcast_to(np.eye(3)[:, None, :], (3, len(nodes), 3)),
            np.cross(np.eye(3)[:, None, :], arms[None]),
        ]
    )
    density = np.linalg.solve(matrix, motions.reshape(6, -1).T).T.reshape(6, len(nodes), 3)
    total = np.zeros((6, 6))
    for i, j in edges:
        length = float(np.linalg.norm(nodes[j] - nodes[i]))
        for a, b in ((i, j), (j, i)):
            force = length / 6.0 * (2.0 * density[:, a] + density[:, b])
            total[:3] += force.T
            total[3:] += np.cross(arms[a], force).T
    return total
