"""Single rods with a known answer, for tests, comparisons and first steps."""

from __future__ import annotations

import math

import numpy as np

from flagrs.scenarios.overrides import ContactOverride, FluidOverride, contact_from, fluid_from
from flagrs.scenarios.registry import scenario
from flagrs.scene import Clamp, Fluid, Material, PointLoad, Rod, Scene
from flagrs.scene.rod_topology import chain
from flagrs.scene.shapes import number, whole
from flagrs.scene.values import Bounds

#: A soft silicone rod, 100 mm long and 1 mm in radius.
SILICONE = Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
LENGTH = 0.1
RADIUS = 1e-3
BENDING_STIFFNESS = SILICONE.youngs_modulus * math.pi * RADIUS**4 / 4.0

_oil = Fluid(viscosity=1.0, model="RFT")


@scenario
def straight_rod(
    edge_count: int = 20, contact: ContactOverride = False, fluid: FluidOverride = None
) -> Scene:
    """Return a free straight rod at rest, which stays where it is.

    Parameters
    ----------
    edge_count
        Number of edges.
    contact, fluid
        Contact and fluid, or options to change; by default none, and oil of 1 Pa s with resistive forces.
    """
    rod = Rod.straight(length=LENGTH, edge_count=edge_count, radius=RADIUS, material=SILICONE)
    return _scene("straight_rod", rod, contact, fluid)


@scenario
def relaxing_rod(
    turn: float = math.pi / 2.0,
    edge_count: int = 20,
    contact: ContactOverride = False,
    fluid: FluidOverride = None,
) -> Scene:
    """Return a straight rod let go from an arc, to which it was bent without stretching.

    Parameters
    ----------
    turn
        Angle between the tangents at the two ends of the arc [rad], 0 to 2 pi.
    edge_count
        Number of edges.
    contact, fluid
        Contact and fluid, or options to change; by default none, and oil of 1 Pa s with resistive forces.
    """
    number("turn", turn, Bounds("rad", at_least=0.0, at_most=2.0 * math.pi))
    straight = Rod.straight(length=LENGTH, edge_count=edge_count, radius=RADIUS, material=SILICONE)
    angle = turn * (np.arange(edge_count) + 0.5) / edge_count
    edges = LENGTH / edge_count * np.stack([np.cos(angle), np.sin(angle), np.zeros(edge_count)], axis=1)
    nodes = np.concatenate([np.zeros((1, 3)), np.cumsum(edges, axis=0)])
    return _scene("relaxing_rod", straight.replace(nodes=nodes, rest_nodes=straight.nodes), contact, fluid)


@scenario
def cantilever(
    normalized_load: float = 1.0,
    edge_count: int = 20,
    contact: ContactOverride = False,
    fluid: FluidOverride = None,
) -> Scene:
    """Return a straight rod along +x, clamped at one end, with a force along -z on its tip.

    The clamped edge reaches half an edge to either side of the wall at x = 0: an edge's direction belongs to
    its middle, so the slope is held exactly at the wall, and the deflection converges with the square of the
    edge length.

    Parameters
    ----------
    normalized_load
        P L^2 / EI, with the force P, the length L from the wall to the tip and the bending stiffness EI [1].
    edge_count
        Number of edges beyond the clamped one.
    contact, fluid
        Contact and fluid, or options to change; by default none, and oil of 1 Pa s with resistive forces.
    """
    number("normalized_load", normalized_load, Bounds("1"))
    edge = LENGTH / (whole("edge_count", edge_count) + 0.5)
    rod = Rod.straight(
        length=(edge_count + 1) * edge,
        edge_count=edge_count + 1,
        start=(-edge / 2.0, 0.0, 0.0),
        radius=RADIUS,
        material=SILICONE,
    )
    force = normalized_load * BENDING_STIFFNESS / LENGTH**2
    return _scene("cantilever", rod, contact, fluid).replace(
        clamps=(Clamp(nodes=(0, 1), edges=(0,)),),
        loads=(PointLoad(node=edge_count + 1, force=np.array([0.0, 0.0, -force])),),
    )


@scenario
def twisted_ring(
    twist: float = 1.1 * 2.0 * math.pi * math.sqrt(3.0) * 1.5,
    edge_count: int = 60,
    perturbation: float = 1e-3,
    contact: ContactOverride = False,
    fluid: FluidOverride = None,
) -> Scene:
    """Return a rod twisted and closed to a ring, which buckles out of plane beyond Michell's twist.

    Michell's critical twist is 2 pi sqrt(3) EI / GJ, with EI / GJ = 1 + nu = 1.5 here; the default is 10 %
    above.

    Parameters
    ----------
    twist
        Total twist closed into the ring [rad].
    edge_count
        Number of edges, at least 3.
    perturbation
        Amplitude of the initial displacement out of plane, over the radius of the ring [1].
    contact, fluid
        Contact and fluid, or options to change; by default none, and oil of 1 Pa s with resistive forces.
    """
    whole("edge_count", edge_count, least=3)
    number("twist", twist, Bounds("rad"))
    number("perturbation", perturbation, Bounds("1", above=-1.0, below=1.0))
    angle = 2.0 * math.pi * np.arange(edge_count) / edge_count
    flat = LENGTH / (2.0 * math.pi) * np.stack([np.cos(angle), np.sin(angle), np.zeros(edge_count)], axis=1)
    # The mode that buckles first has two waves around the ring.
    out_of_plane = perturbation * LENGTH / (2.0 * math.pi) * np.cos(2.0 * angle)
    edges = np.concatenate([chain(edge_count), [[edge_count - 1, 0]]])
    rod = Rod(
        nodes=flat + out_of_plane[:, None] * [0.0, 0.0, 1.0],
        rest_nodes=flat,
        edges=edges,
        natural_curvature=np.zeros(2),
        # Frames closed without twist and an opposite natural twist: the stress of a twist closed in.
        natural_twist=-twist / edge_count,
        radius=RADIUS,
        material=SILICONE,
    )
    return _scene("twisted_ring", rod, contact, fluid)


def _scene(name: str, rod: Rod, contact: ContactOverride, fluid: FluidOverride) -> Scene:
    return Scene(rods=(rod,), fluid=fluid_from(fluid, _oil), contact=contact_from(contact), name=name)
