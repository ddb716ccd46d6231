"""A robot's head: drag on one node, and a couple against its turning about any axis."""

from __future__ import annotations

from typing import Annotated

from flagrs.scene.part import Part
from flagrs.scene.values import Bounds, Index, number


class Head(Part):
    """A spherical head at a node with exactly two neighbours (docs/theory/fluid.md, section 9).

    It is fixed to both edges that meet there, but not to the shaft of a motor that sits at its own node, and
    resists turning about any axis: rigid turns across the edges as in Lim et al. (equations 16
    to 18), turns about the edges by their material frames.

    Attributes
    ----------
    node : int
        Node of the rod that carries the head.
    radius : float
        Radius r_h of the head [m].
    rod : int
        Index of the rod in the scene.
    C_t, C_r : float
        Prefactors of the translational drag 6 pi mu r_h and the rotational drag 8 pi mu r_h^3; 1 is a sphere.
    mass : float
        Mass of the head [kg], for the schemes with inertia.
    """

    node: Index
    radius: Annotated[float, number(Bounds("m", above=0.0))]
    rod: Index = 0
    C_t: Annotated[float, number(Bounds("1", at_least=0.0))] = 1.0
    C_r: Annotated[float, number(Bounds("1", at_least=0.0))] = 1.0
    mass: Annotated[float, number(Bounds("kg", at_least=0.0))] = 0.0
