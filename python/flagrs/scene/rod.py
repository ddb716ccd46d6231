"""Rods: networks of nodes, edges and hinges with a section, a material and a rest shape."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
import numpy.typing as npt
from pydantic import PlainValidator, model_validator

from flagrs.errors import SceneError, combined
from flagrs.scene import rod_checks, rod_topology, shapes
from flagrs.scene.material import Material
from flagrs.scene.part import Part
from flagrs.scene.values import (
    Array,
    BoolArray,
    Bounds,
    FloatArray,
    IntArray,
    optional_array,
    optional_index_pairs,
    switches,
)

_POSITIVE_STIFFNESS = Bounds("N m^2", above=0.0)
_NODES = (("N", 3),)
_PER_EDGE: tuple[tuple[int | str, ...], ...] = ((), ("E",))
_PER_HINGE: tuple[tuple[int | str, ...], ...] = ((), ("H",))
_MATRICES: tuple[tuple[int | str, ...], ...] = ((), ("H",), (2, 2), ("H", 2, 2))


def _bending_stiffness(value: Any) -> Any:
    # Off-diagonal entries of a matrix may have any sign, so only plain stiffnesses are bounded here.
    bounds = _POSITIVE_STIFFNESS if np.ndim(value) < 2 else Bounds("N m^2")
    return None if value is None else Array(_MATRICES, bounds)(value)


class Rod(Part):
    """A rod, or a network of them, of N nodes, E edges and H hinges.

    Whatever is left out is derived: the edges of a chain, a hinge for every pair of edges that meet, and the
    stiffnesses of a solid circular section. Where a field takes a number or an array, the number stands for
    all.

    Attributes
    ----------
    nodes : ndarray
        Initial positions (N, 3) [m].
    material : Material
        Material of all edges.
    radius : float or ndarray
        Radius of the section, one or (E,) [m].
    rest_nodes : ndarray or None
        Positions (N, 3) [m] of the shape without stress; None: the initial shape.
    edges : ndarray or None
        Start and end node (E, 2) of each edge; None: a chain.
    hinges : ndarray or None
        Pairs (H, 2) of edges that bend and twist against each other; None: every pair that meets at a node.
    EA : float, ndarray or None
        Stretching stiffness, one or (E,) [N]; None: E pi r^2.
    EI : float, ndarray or None
        Bending stiffness, one, (H,), (2, 2) or (H, 2, 2) [N m^2]; None: E pi r^4 / 4.
    GJ : float, ndarray or None
        Twisting stiffness, one or (H,) [N m^2]; None: G pi r^4 / 2.
    natural_curvature : ndarray or None
        Integrated natural curvature (2,) or (H, 2) at the hinges, in the material frame halfway between the
        two edges [1]; None: that of the rest shape.
    natural_twist : float, ndarray or None
        Natural twist at the hinges, one or (H,) [rad]; None: that of the rest shape.
    theta : ndarray or None
        Initial angle (E,) of each edge's material frame [rad]; None: zero.
    director : ndarray or None
        Direction (3,) of the material director m1 on the first edge; None: any.
    magnetization : ndarray or None
        Magnetization (3,) or (E, 3) along the material directors ``m1, m2`` and the tangent [A/m]; None: not
        magnetic.
    immersed : bool or ndarray
        Edges, all or (E,), on which the fluid acts.
    colliding : bool or ndarray
        Edges, all or (E,), that take part in contact.
    name : str or None
        Name for figures and messages.

    Examples
    --------
    >>> silicone = Material(youngs_modulus=1e6, density=1200.0)
    >>> rod = Rod.straight(length=0.1, edge_count=10, radius=1e-3, material=silicone)
    >>> rod.hinge_array().shape
    (9, 2)
    """

    if TYPE_CHECKING:
        # What the constructor takes, which is more than the fields hold.
        def __init__(
            self,
            *,
            nodes: npt.ArrayLike,
            material: Material,
            radius: npt.ArrayLike,
            rest_nodes: npt.ArrayLike | None = None,
            edges: npt.ArrayLike | None = None,
            hinges: npt.ArrayLike | None = None,
            EA: npt.ArrayLike | None = None,
            EI: npt.ArrayLike | None = None,
            GJ: npt.ArrayLike | None = None,
            natural_curvature: npt.ArrayLike | None = None,
            natural_twist: npt.ArrayLike | None = None,
            theta: npt.ArrayLike | None = None,
            director: npt.ArrayLike | None = None,
            magnetization: npt.ArrayLike | None = None,
            immersed: npt.ArrayLike = True,
            colliding: npt.ArrayLike = True,
            name: str | None = None,
        ) -> None: ...

    nodes: Annotated[FloatArray, PlainValidator(Array(_NODES, Bounds("m")))]
    material: Material
    radius: Annotated[float | FloatArray, PlainValidator(Array(_PER_EDGE, Bounds("m", above=0.0)))]
    rest_nodes: Annotated[FloatArray | None, optional_array(_NODES, Bounds("m"))] = None
    edges: Annotated[IntArray | None, optional_index_pairs()] = None
    hinges: Annotated[IntArray | None, optional_index_pairs()] = None
    EA: Annotated[float | FloatArray | None, optional_array(_PER_EDGE, Bounds("N", above=0.0))] = None
    EI: Annotated[float | FloatArray | None, PlainValidator(_bending_stiffness)] = None
    GJ: Annotated[float | FloatArray | None, optional_array(_PER_HINGE, _POSITIVE_STIFFNESS)] = None
    natural_curvature: Annotated[FloatArray | None, optional_array(((2,), ("H", 2)), Bounds("1"))] = None
    natural_twist: Annotated[float | FloatArray | None, optional_array(_PER_HINGE, Bounds("rad"))] = None
    theta: Annotated[FloatArray | None, optional_array((("E",),), Bounds("rad"))] = None
    director: Annotated[FloatArray | None, optional_array(((3,),), Bounds("1"))] = None
    magnetization: Annotated[FloatArray | None, optional_array(((3,), ("E", 3)), Bounds("A/m"))] = None
    immersed: Annotated[bool | BoolArray, PlainValidator(switches)] = True
    colliding: Annotated[bool | BoolArray, PlainValidator(switches)] = True
    name: str | None = None

    @model_validator(mode="after")
    def _check(self) -> Rod:
        found = rod_checks.problems(self)
        if found:
            raise combined(found)
        return self

    @classmethod
    def from_nodes(
        cls,
        nodes: Any,
        radius: Any,
        material: Material,
        rest_nodes: Any = None,
        **options: Any,
    ) -> Self:
        """Return the rod through given nodes (N, 3) [m]; `options` are further fields of `Rod`."""
        return cls(nodes=nodes, radius=radius, material=material, rest_nodes=rest_nodes, **options)

    @classmethod
    def straight(
        cls,
        *,
        length: float,
        radius: Any,
        material: Material,
        edge_length: float | None = None,
        edge_count: int | None = None,
        start: shapes.Vector = (0.0, 0.0, 0.0),
        direction: shapes.Vector = (1.0, 0.0, 0.0),
        **options: Any,
    ) -> Self:
        """Return a straight rod of equal edges.

        Parameters
        ----------
        length
            Length of the rod [m].
        radius, material
            As in `Rod`.
        edge_length, edge_count
            Exactly one of them: the least length of an edge [m], or how many edges there are.
        start, direction
            Position (3,) of the first node [m], and which way the rod goes.
        **options
            Further fields of `Rod`.
        """
        total = shapes.length("length", length)
        count = _count(total, edge_length, edge_count)
        nodes = shapes.straight_nodes(total, count, start, direction)
        return cls(nodes=nodes, radius=radius, material=material, **options)

    @classmethod
    def helix(
        cls,
        *,
        helix_radius: float,
        pitch: float,
        axial_length: float,
        radius: Any,
        material: Material,
        edge_length: float | None = None,
        edge_count: int | None = None,
        handedness: shapes.Handedness = "right",
        point: shapes.Vector = (0.0, 0.0, 0.0),
        direction: shapes.Vector = (1.0, 0.0, 0.0),
        phase: float = 0.0,
        **options: Any,
    ) -> Self:
        """Return a helical rod of equal edges.

        Parameters
        ----------
        helix_radius, pitch, axial_length
            Radius of the centreline, advance per turn and total advance [m].
        radius, material
            As in `Rod`; `radius` is that of the section.
        edge_length, edge_count
            Exactly one of them: the least arc length of an edge [m], or how many edges there are.
        handedness
            ``right`` or ``left``.
        point, direction
            Where the axis starts (3,) [m], and which way it goes.
        phase
            Angle of the first node about the axis [rad].
        **options
            Further fields of `Rod`.
        """
        helix = shapes.Helix(
            shapes.length("helix_radius", helix_radius),
            shapes.length("pitch", pitch),
            shapes.length("axial_length", axial_length),
        )
        nodes = shapes.helix_nodes(
            helix,
            _count(helix.contour, edge_length, edge_count),
            handedness,
            point=point,
            direction=direction,
            phase=phase,
        )
        return cls(nodes=nodes, radius=radius, material=material, **options)

    def edge_array(self) -> IntArray:
        """Return start and end node (E, 2) of each edge."""
        return rod_topology.chain(len(self.nodes)) if self.edges is None else self.edges

    def hinge_array(self) -> IntArray:
        """Return the two edges (H, 2) of each hinge."""
        if self.hinges is None and self.edges is None:
            return rod_topology.chain(
                len(self.nodes) - 1
            )  # the same at once, for the many rods that are chains
        if self.hinges is None:
            return rod_topology.all_hinges(self.edge_array(), len(self.nodes))
        return self.hinges

    def hinge_nodes(self) -> IntArray:
        """Return the node (H,) at which each hinge sits."""
        edges = self.edge_array()
        nodes = [rod_topology.shared_node(edges, *pair) for pair in self.hinge_array().tolist()]
        return np.array(nodes, dtype=np.int64)

    def rest_array(self) -> FloatArray:
        """Return the positions (N, 3) of the rest shape [m]."""
        return self.nodes if self.rest_nodes is None else self.rest_nodes

    def rest_lengths(self) -> FloatArray:
        """Return the rest length (E,) of each edge [m]."""
        edges, nodes = self.edge_array(), self.rest_array()
        lengths: FloatArray = np.linalg.norm(nodes[edges[:, 1]] - nodes[edges[:, 0]], axis=1)
        return lengths

    def radius_array(self) -> FloatArray:
        """Return the radius (E,) of each edge [m]."""
        return np.broadcast_to(self.radius, len(self.edge_array())).astype(np.float64)

    def density_array(self) -> FloatArray:
        """Return the mass density (E,) of each edge [kg/m^3]."""
        return np.full(len(self.edge_array()), self.material.density)

    def EA_array(self) -> FloatArray:
        """Return the stretching stiffness (E,) of each edge [N]."""
        if self.EA is None:
            return self.material.youngs_modulus * np.pi * self.radius_array() ** 2
        return np.broadcast_to(self.EA, len(self.edge_array())).astype(np.float64)

    def EI_array(self) -> FloatArray:
        """Return the bending stiffness (H, 2, 2) of each hinge [N m^2], by default the mean of its edges."""
        count = len(self.hinge_array())
        if self.EI is None:
            plain = self._mean_over_hinges(
                self.material.youngs_modulus * np.pi / 4.0 * self.radius_array() ** 4
            )
        elif np.ndim(self.EI) < 2:
            plain = np.broadcast_to(self.EI, count)
        else:
            given = np.broadcast_to(self.EI, (count, 2, 2)).astype(np.float64)
            return 0.5 * (given + given.transpose(0, 2, 1))  # a turned tensor is symmetric but for round-off
        return plain[:, None, None] * np.eye(2)

    def GJ_array(self) -> FloatArray:
        """Return the twisting stiffness (H,) of each hinge [N m^2], by default the mean of its edges."""
        if self.GJ is None:
            return self._mean_over_hinges(
                self.material.shear_modulus * np.pi / 2.0 * self.radius_array() ** 4
            )
        return np.broadcast_to(self.GJ, len(self.hinge_array())).astype(np.float64)

    def immersed_array(self) -> BoolArray:
        """Return for each edge (E,) whether the fluid acts on it."""
        return np.broadcast_to(self.immersed, len(self.edge_array())).astype(np.bool_)

    def colliding_array(self) -> BoolArray:
        """Return for each edge (E,) whether it takes part in contact."""
        return np.broadcast_to(self.colliding, len(self.edge_array())).astype(np.bool_)

    def _mean_over_hinges(self, per_edge: FloatArray) -> FloatArray:
        mean: FloatArray = per_edge[self.hinge_array()].mean(axis=1)
        return mean


def _count(contour: float, edge_length: float | None, edge_count: int | None) -> int:
    """Return the number of edges from whichever of the two was given."""
    if (edge_length is None) == (edge_count is None):
        raise SceneError(
            "edge_length: exactly one of edge_length and edge_count must be given",
            field="edge_length",
            value=edge_length,
            allowed="exactly one of edge_length [m] and edge_count",
        )
    return (
        shapes.checked_count(edge_count) if edge_length is None else shapes.edge_count(contour, edge_length)
    )
