"""Drag and thrust of a scene's immersed part with stiff filaments: what mesh and fluid model are worth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from flagrs.assemble import edges_of, radii_of, resistive_coefficients
from flagrs.fluid import hat_weights, mobility
from flagrs.scene import Fluid, Scene
from flagrs.scene.values import FloatArray, IntArray

#: Edges that meet at a sharper turn than this are no part of one smooth curve [cosine].
SMOOTH_TURN = 0.5
#: Thrust below this part of what drag and torque allow is none.
LEAST_THRUST = 0.02


@dataclass(frozen=True)
class Body:
    """Immersed edges at rest, and the filaments they make up.

    Attributes
    ----------
    nodes : ndarray
        Positions (N, 3) [m].
    edges : ndarray
        Start and end node (E, 2).
    radius : ndarray
        Radius (E,) [m].
    parent : ndarray
        The scene's immersed edge (E,) that each edge is a part of.
    filament : ndarray
        The filament (N,) to which each node belongs.
    centres, axes : ndarray
        Mean node (F, 3) of each filament [m], and its principal direction (F, 3).
    """

    nodes: FloatArray
    edges: IntArray
    radius: FloatArray
    parent: IntArray
    filament: IntArray
    centres: FloatArray
    axes: FloatArray

    def halved(self) -> Body:
        """Return the body with every edge halved at a point of the curve through its neighbours."""
        middles = np.array([self._middle(int(start), int(end)) for start, end in self.edges])
        new = len(self.nodes) + np.arange(len(self.edges))
        first = np.stack([self.edges[:, 0], new], axis=1)
        second = np.stack([new, self.edges[:, 1]], axis=1)
        edges = np.stack([first, second], axis=1).reshape(-1, 2)
        return replace(
            self,
            nodes=np.concatenate([self.nodes, middles]),
            edges=edges,
            radius=np.repeat(self.radius, 2),
            parent=np.repeat(self.parent, 2),
            filament=np.concatenate([self.filament, self.filament[self.edges[:, 0]]]),
        )

    def _middle(self, start: int, end: int) -> FloatArray:
        # Cubic through four nodes, or parabola through three, or the middle of the edge.
        a, b = self.nodes[start], self.nodes[end]
        before, after = self._beyond(start, end), self._beyond(end, start)
        middle: FloatArray = 0.5 * (a + b)
        if before is not None and after is not None:
            middle = (9.0 * (a + b) - before - after) / 16.0
        elif after is not None:
            middle = 0.375 * a + 0.75 * b - 0.125 * after
        elif before is not None:
            middle = 0.375 * b + 0.75 * a - 0.125 * before
        return middle

    def _beyond(self, node: int, other: int) -> FloatArray | None:
        """Return the node beyond `node` as seen from `other`, if the curve goes on there."""
        at = self.edges[(self.edges == node).any(axis=1)]
        beyond = [int(pair[0] + pair[1] - node) for pair in at]
        beyond = [index for index in beyond if index != other]
        if len(beyond) != 1:
            return None
        u, v = self.nodes[node] - self.nodes[other], self.nodes[beyond[0]] - self.nodes[node]
        smooth = u @ v > SMOOTH_TURN * np.linalg.norm(u) * np.linalg.norm(v)
        found: FloatArray = self.nodes[beyond[0]]
        return found if smooth else None


def immersed_body(scene: Scene) -> Body:
    """Return the immersed edges of a scene at rest."""
    immersed = np.concatenate([rod.immersed_array() for rod in scene.rods])
    radius = radii_of(scene)[immersed]
    nodes = np.concatenate([rod.rest_array() for rod in scene.rods])
    used, edges = np.unique(edges_of(scene)[immersed], return_inverse=True)
    edges = edges.reshape(-1, 2).astype(np.int64)
    points = nodes[used]
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(used), len(used)))
    count, filament = connected_components(graph, directed=False)
    centres = np.array([points[filament == k].mean(axis=0) for k in range(count)])
    axes = np.array(
        [np.linalg.svd(points[filament == k] - centres[k], full_matrices=False)[2][0] for k in range(count)]
    )
    return Body(points, edges, radius, np.arange(len(edges)), filament.astype(np.int64), centres, axes)


def motions(body: Body) -> FloatArray:
    """Return velocities (N, 3, 4) of the nodes: along x, y and z, and of each filament about its axis."""
    arms = body.nodes - body.centres[body.filament]
    turning = np.cross(body.axes[body.filament], arms)
    shifting = np.tile(np.eye(3), (len(arms), 1, 1))
    return np.concatenate([shifting, turning[:, :, None]], axis=2)


@dataclass(frozen=True)
class Response:
    """What the fluid answers to the motions of a body.

    Attributes
    ----------
    drag : ndarray
        Force (3, 3) on the fluid per velocity [N s/m].
    torque, thrust : ndarray
        Torque about [N m s] and force along [N s] its own axis, of every filament (F,), as all turn about
        theirs.
    speed : ndarray
        Thrust over the drag of the whole body along the filament's axis (F,) [m].
    """

    drag: FloatArray
    torque: FloatArray
    thrust: FloatArray

    speed: FloatArray

    def difference(self, other: Response) -> float:
        """Return by how much it differs from another one: the largest of all answers, relative.

        Filaments that do not turn a motion about their axis into one along it have no thrust and no speed to
        differ in, straight ones no torque either.
        """

        def apart(mine: FloatArray, theirs: FloatArray) -> float:
            return float(np.linalg.norm(mine - theirs) / np.linalg.norm(theirs))

        drag, torque = float(np.linalg.norm(other.drag)), float(np.linalg.norm(other.torque))
        found = [apart(self.drag, other.drag)]
        if np.linalg.norm(other.thrust) > LEAST_THRUST * np.sqrt(drag * torque):
            pairs = ((self.torque, other.torque), (self.thrust, other.thrust), (self.speed, other.speed))
            found += [apart(*pair) for pair in pairs]
        return max(found)


def _per_filament(filament: IntArray, values: FloatArray) -> FloatArray:
    sums = np.zeros(int(filament.max()) + 1)
    np.add.at(sums, filament, values)
    return sums


def _response(body: Body, points: FloatArray, filament: IntArray, forces: FloatArray) -> Response:
    """Return the response from forces (K, 3, 4) on the fluid at points (K, 3)."""
    axes = body.axes[filament]
    arms = points - body.centres[filament]
    moments = (np.cross(arms, forces[:, :, 3]) * axes).sum(axis=1)
    thrusts = (forces[:, :, 3] * axes).sum(axis=1)
    drag: FloatArray = forces[:, :, :3].sum(axis=0)
    torque, thrust = (_per_filament(filament, values) for values in (moments, thrusts))
    along = np.einsum("fa,ab,fb->f", body.axes, drag, body.axes)
    return Response(drag=drag, torque=torque, thrust=thrust, speed=thrust / along)


def rss_response(body: Body, fluid: Fluid) -> Response:
    """Return the response by regularized Stokeslet segments."""
    matrix = mobility(body.nodes, body.edges, fluid.epsilon_array(body.radius))
    velocity = 8.0 * np.pi * fluid.viscosity * motions(body)
    density = np.linalg.solve(matrix, velocity.reshape(-1, 4)).reshape(velocity.shape)
    columns = [np.ascontiguousarray(density[:, :, k]) for k in range(4)]
    forces = np.stack([hat_weights(body.nodes, body.edges, column) for column in columns], axis=2)
    return _response(body, body.nodes, body.filament, forces)


def rft_response(scene: Scene, body: Body, fluid: Fluid) -> Response:
    """Return the response by resistive force theory."""
    immersed = np.concatenate([rod.immersed_array() for rod in scene.rods])
    along, across = resistive_coefficients(scene, fluid)[immersed][body.parent].T
    ends = body.nodes[body.edges]
    vector = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(vector, axis=1)
    t = vector / length[:, None]
    tt = t[:, :, None] * t[:, None, :]
    blocks = across[:, None, None] * np.eye(3) + (along - across)[:, None, None] * tt
    velocity = motions(body)[body.edges].mean(axis=1)
    forces = length[:, None, None] * (blocks @ velocity)
    return _response(body, ends.mean(axis=1), body.filament[body.edges[:, 0]], forces)
