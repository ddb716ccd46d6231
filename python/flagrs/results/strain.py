"""Tension, curvature and twist along the rods, of any shape of a scene."""

from __future__ import annotations

from typing import Any

import numpy as np

from flagrs.assemble import edges_of, rest_lengths_of
from flagrs.results.material_frames import angles_about, transported
from flagrs.scene import Scene
from flagrs.scene.values import FloatArray, IntArray


def tensions(scene: Scene, nodes: Any) -> FloatArray:
    """Return the tension (..., E) of every edge, EA times its strain, positive where stretched [N].

    Parameters
    ----------
    scene
        The scene.
    nodes
        Positions (..., N, 3) [m].
    """
    edges = edges_of(scene)
    rest = rest_lengths_of(scene)
    stiffness = np.concatenate([rod.EA_array() for rod in scene.rods])
    lengths = np.linalg.norm(nodes[..., edges[:, 1], :] - nodes[..., edges[:, 0], :], axis=-1)
    force: FloatArray = stiffness * (lengths / rest - 1.0)
    return force


def hinges_of(scene: Scene) -> IntArray:
    """Return the two edges (H, 2) of every hinge of the scene."""
    pairs = [rod.hinge_array() + scene.edge_offset(k) for k, rod in enumerate(scene.rods)]
    joined: IntArray = np.concatenate(pairs).reshape(-1, 2)
    return joined


def curvatures(scene: Scene, nodes: Any) -> FloatArray:
    """Return the curvature (..., H) at every hinge [1/m].

    It is 2 tan(phi/2) over the mean rest length of the two edges, with phi the angle between them: the size
    of the discrete curvature vector of docs/theory/rods.md per length.

    Parameters
    ----------
    scene
        The scene.
    nodes
        Positions (..., N, 3) [m].
    """
    tangents, flips = _tangents_through(scene, nodes)
    first, second = tangents[..., 0, :], tangents[..., 1, :] * flips
    cosine = np.einsum("...i,...i->...", first, second)
    sine = np.linalg.norm(np.cross(first, second), axis=-1)
    rest = rest_lengths_of(scene)[hinges_of(scene)].mean(axis=1)
    size: FloatArray = 2.0 * sine / np.maximum(1.0 + cosine, 1e-12) / rest
    return size


def twists(scene: Scene, nodes: FloatArray, directors: FloatArray) -> FloatArray:
    """Return the twist (H,) at every hinge beyond none at all, in (-pi, pi] [rad].

    It is the angle from the material director of the first edge, carried over to the second, to the second's
    own.

    Parameters
    ----------
    scene
        The scene.
    nodes, directors
        Positions (N, 3) [m] and material directors m1 (E, 3).
    """
    tangents, flips = _tangents_through(scene, nodes)
    hinges = hinges_of(scene)
    first, second = tangents[:, 0], tangents[:, 1] * flips
    carried = transported(directors[hinges[:, 0]], first, second)
    own = directors[hinges[:, 1]]
    angle = angles_about(second, carried, own)
    # Where the first edge points away from the second, both tangents do, and the way leads against them.
    edges = edges_of(scene)
    end, other = edges[hinges[:, 0], 1], edges[hinges[:, 1]]
    ahead = (end == other[:, 0]) | (end == other[:, 1])
    twist: FloatArray = np.where(ahead, angle, -angle)
    return twist


def _tangents_through(scene: Scene, nodes: Any) -> tuple[FloatArray, FloatArray]:
    """Return unit tangents (..., H, 2, 3) at hinges, and signs (H, 1) that make the second go on."""
    edges, hinges = edges_of(scene), hinges_of(scene)
    arms = nodes[..., edges[:, 1], :] - nodes[..., edges[:, 0], :]
    unit = arms / np.linalg.norm(arms, axis=-1, keepdims=True)
    a, b = edges[hinges[:, 0]], edges[hinges[:, 1]]
    # Edges that meet head to head, or tail to tail, run against each other.
    same = (a[:, 1] == b[:, 1]) | (a[:, 0] == b[:, 0])
    return unit[..., hinges, :], np.where(same, -1.0, 1.0)[:, None]
