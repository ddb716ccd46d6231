"""The clamped bundling benchmark: turning helices, clamped side by side, that wrap around each other."""

from __future__ import annotations

import math

import numpy as np

from flagrs.scenarios.overrides import ContactOverride, FluidOverride, contact_from, fluid_from
from flagrs.scenarios.registry import scenario
from flagrs.scene import Clamp, Fluid, Material, Rod, Scene
from flagrs.scene.shapes import Helix, edge_count, helix_nodes, number, whole
from flagrs.scene.values import Bounds, FloatArray

# The benchmark's published values; lengths in metres.
RUBBER = Material(youngs_modulus=3e6, poisson_ratio=0.5, density=1000.0)
ROD_RADIUS = 1e-3
EPSILON = 1.02e-3
SIDE = 30e-3
HELIX = Helix(radius=10e-3, pitch=50e-3, axial_length=200e-3)


@scenario
def clamped_flagella(
    count: int = 2,
    angular_velocity: float = 15.0,
    edge_length: float = 5e-3,
    contact: ContactOverride = True,
    fluid: FluidOverride = None,
    twist_drag: bool = True,
    scale: float = 1.0,
) -> Scene:
    """Return right-handed helices, clamped on a regular polygon and turned against their handedness.

    Each flagellum is a rod of its own along +x: a clamped edge, a lead-in at 45 degrees and a helix of four
    turns. Both nodes of the clamped edge are fixed, and it turns at ``-angular_velocity`` about +x.

    Parameters
    ----------
    count
        Number of flagella, on the corners of a polygon with sides of 30 mm; a single one is at the origin.
    angular_velocity
        Speed of the clamped edges, turning about -x where positive [rad/s].
    edge_length
        Least arc length of an edge of the helix [m].
    contact
        Whether the flagella keep apart, or how: a `Contact` or a mapping of its options.
    fluid
        Another fluid, or a mapping of options to change; the default is 0.1 Pa s with an epsilon of 1.02 mm.
    twist_drag
        False switches the flagella's resistance to spinning off, as in the published runs.
    scale
        Factor on all lengths, `edge_length` among them [1].

    Returns
    -------
    Scene
        68 nodes for each flagellum at 5 mm edges.

    Examples
    --------
    >>> clamped_flagella(count=3).node_count
    204
    """
    whole("count", count)
    number("scale", scale, Bounds("1", above=0.0))
    number("angular_velocity", angular_velocity, Bounds("rad/s"))
    flagellum = _nodes(edge_length)
    rods = [
        Rod(
            nodes=scale * (flagellum + corner),
            material=RUBBER,
            radius=scale * ROD_RADIUS,
            name=f"flagellum {number + 1}",
        )
        for number, corner in enumerate(_corners(count))
    ]
    return Scene(
        rods=tuple(rods),
        fluid=fluid_from(fluid, Fluid(viscosity=0.1, epsilon=scale * EPSILON), twist_drag),
        clamps=tuple(
            Clamp(rod=rod, nodes=(0, 1), edges=(0,), angular_velocity=-angular_velocity)
            for rod in range(count)
        ),
        contact=contact_from(contact),
        name="clamped_flagella",
    )


def _nodes(edge_length: float) -> FloatArray:
    """Return the nodes of one flagellum about the x axis [m]."""
    radius, contour = HELIX.radius, HELIX.contour
    edges = edge_count(contour, edge_length)
    edge = contour / edges
    lead_in = max(1, int(math.sqrt(2.0) * radius / edge))  # one node at least, the end of the clamped edge
    along = radius * np.arange(lead_in) / lead_in
    start = np.stack([along - radius, along, np.zeros(lead_in)], axis=1)
    return np.concatenate([[[-edge - radius, 0.0, 0.0]], start, helix_nodes(HELIX, edges, "right")])


def _corners(count: int) -> FloatArray:
    """Return the corners (count, 3) of the polygon in the plane x = 0 [m]."""
    if count == 1:
        return np.zeros((1, 3))
    angle = 2.0 * math.pi * np.arange(count) / count
    circumradius = SIDE / (2.0 * math.sin(math.pi / count))
    return circumradius * np.stack([np.zeros(count), np.cos(angle), np.sin(angle)], axis=1)
