"""The chain all kernels are timed on: a flagellum of the robot, continued to any number of nodes."""

from __future__ import annotations

import flagrs
import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

#: The robot's flagellum, pitch 7 helix radii, lengths in metres; 25 edges of 5.13 mm on its axial length.
RADIUS, PITCH, AXIAL_LENGTH, EDGES = 6.36e-3, 7.0 * 6.36e-3, 95.4e-3, 25
#: Regularization of its fluid [m].
EPSILON = 1.65e-3
#: Radius of its section [m].
ROD_RADIUS = 1.6e-3
SILICONE = flagrs.Material(youngs_modulus=1.255e6, poisson_ratio=0.5, density=1260.0)
#: Direction of the first material director, so that every version starts from the same frames.
DIRECTOR = np.array([0.0, 0.0, 1.0])


def helix_nodes(count: int) -> FloatArray:
    """Return the nodes (count, 3) of the left-handed helix [m]."""
    along = AXIAL_LENGTH / EDGES * np.arange(count)
    angle = 2.0 * np.pi / PITCH * along
    return np.stack([along, RADIUS * np.cos(angle), -RADIUS * np.sin(angle)], axis=1)


def helix_scene(count: int, disturbance: float = 0.0) -> flagrs.Scene:
    """Return the free helix in the robot's fluid, disturbed.

    Parameters
    ----------
    count
        Number of nodes.
    disturbance
        Largest displacement of a node over the length of an edge, and largest turn of an edge [rad].
    """
    rest = helix_nodes(count)
    random = np.random.default_rng(1)
    edge = float(np.linalg.norm(rest[1] - rest[0]))
    rod = flagrs.Rod(
        nodes=rest + disturbance * edge * random.uniform(-1.0, 1.0, rest.shape),
        rest_nodes=rest,
        theta=disturbance * random.uniform(-1.0, 1.0, count - 1),
        director=DIRECTOR,
        radius=ROD_RADIUS,
        material=SILICONE,
    )
    # The matrix at every size: it is what is raced.
    fluid = flagrs.Fluid(viscosity=1.0, epsilon=EPSILON, far_field_nodes=10**6)
    return flagrs.Scene(rods=(rod,), fluid=fluid, name="helix")
