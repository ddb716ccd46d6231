"""What a simulation tells of its present instant: shape, energies, forces, flow; nothing here changes it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import scipy.sparse

from flagrs import _flagrs
from flagrs.assemble import edges_of
from flagrs.flow import flow_of, immersed_edges
from flagrs.force_density import ForceDensity
from flagrs.memory import require_memory
from flagrs.reactions import Reaction, reaction_of
from flagrs.scene import Scene
from flagrs.scene.values import FloatArray, IntArray


class ReadOuts:
    """The read-outs of `flagrs.Simulation`, which sets the attributes."""

    _scene: Scene
    _native: _flagrs.Simulation
    _settings: dict[str, Any]

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self._scene

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._native.time

    @property
    def nodes(self) -> FloatArray:
        """Positions (N, 3) of the nodes [m]; a copy."""
        return self._native.nodes

    @property
    def edges(self) -> IntArray:
        """Start and end node (E, 2) of the edges."""
        return edges_of(self._scene)

    def reaction(self, clamp: int = 0) -> Reaction:
        """Return force (3,), torque (3,) and power of a clamp on its filament in the last step [N, N m, W].

        The torque is about the clamp's first node. Zero before the first step.

        Raises
        ------
        SceneError
            If there is no such clamp.
        """
        return reaction_of(clamp, *self._native.reactions())

    @property
    def immersed_edges(self) -> IntArray:
        """Start and end node (W, 2) of the edges in the fluid: those that go with a force density."""
        return immersed_edges(self._scene)[0]

    def flow(self, points: Any) -> FloatArray:
        """Return the velocity (M, 3) of the fluid at points (M, 3) [m], driven by the immersed edges [m/s].

        Raises
        ------
        FlagrsError
            If the fluid is not of regularized Stokeslet segments.
        SceneError
            For points of the wrong shape.
        """
        threads = self._settings["threads"]
        return flow_of(self._scene, self.nodes, self.frame()["force_density"], points, threads)

    @property
    def theta(self) -> FloatArray:
        """Angles (E,) of the material frames against the reference frames [rad]; a copy."""
        return self._native.theta

    @property
    def velocities(self) -> FloatArray:
        """Velocities (N, 3) of the nodes over the last step [m/s]; a copy."""
        return self._native.velocities

    @property
    def dof_of_node(self) -> IntArray:
        """First of the three degrees of freedom of each node (N,) in `gradient` and `hessian`."""
        return self._native.dof_of_node

    @property
    def dof_of_edge(self) -> IntArray:
        """Degree of freedom of each edge's angle (E,) in `gradient` and `hessian`."""
        return self._native.dof_of_edge

    @property
    def mass(self) -> FloatArray:
        """Mass (ndof,) of each degree of freedom [kg or kg m^2]."""
        return self._native.mass

    @property
    def terms(self) -> list[str]:
        """Names of the terms this scene carries."""
        return self._native.terms

    def energy(self) -> Mapping[str, float]:
        """Return the elastic energies [J] by name: stretching, bending, twisting and their total."""
        parts = self._native.energies()
        return parts | {"total": sum(parts.values())}

    def gradient(self) -> FloatArray:
        """Return the gradient (ndof,) of the elastic energy [N, N m].

        The numbering interleaves ``x0 y0 z0 theta0 x1 ...``; see `dof_of_node` and `dof_of_edge`. Angles
        of torque-driven motors come last.
        """
        return self._native.gradient()

    def hessian(self) -> scipy.sparse.csc_matrix:
        """Return the Hessian (ndof, ndof) of the elastic energy, numbered as `gradient` [N/m, N, N m]."""
        values, rows, starts = self._native.hessian()
        size = self._native.dof_count
        return scipy.sparse.csc_matrix((values, rows, starts), shape=(size, size))

    def resistance(self) -> FloatArray:
        """Return the resistance (3N, 3N) of the nodes to the fluid [N s/m], zero for dry nodes.

        ``resistance() @ velocities.ravel()`` is the force that drags the nodes at these velocities; twist
        drag and head are not in it.
        """
        require_memory(
            f"the resistance of {self._scene.node_count} nodes",
            3 * 72.0 * self._scene.node_count**2,
            "there is no smaller form of it; simulations of large scenes never form it",
        )
        return self._native.resistance()

    @property
    def minimum_gap(self) -> float:
        """Smallest distance of surfaces that may touch [m]: negative in an overlap, infinite without any."""
        return self._native.minimum_gap

    def contact_forces(self) -> tuple[IntArray, FloatArray]:
        """Return the pairs that push each other, and how hard.

        Returns
        -------
        pairs : ndarray
            Edges (K, 2) in the scene's global numbering; the head as a sphere comes after the
            last edge, and walls after that.
        forces : ndarray
            Normal force (K,) of each pair [N].
        """
        state = self._native.state()
        return state["contact_pairs"], state["contact_forces"]

    def frame(self) -> dict[str, Any]:
        """Return everything known of the present instant; see `flagrs.frame.FIELDS` for shapes and units."""
        frame = self._native.frame()
        return frame | {"force_density": ForceDensity(frame["force_density"], self.immersed_edges)}
