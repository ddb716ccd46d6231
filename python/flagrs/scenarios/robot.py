"""The robot of Lim et al.: two soft helical flagella, two motors, one head."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flagrs.errors import not_allowed
from flagrs.scenarios.overrides import ContactOverride, FluidOverride, contact_from, fluid_from
from flagrs.scenarios.registry import scenario
from flagrs.scene import Fluid, Head, Material, Motor, Rod, Scene
from flagrs.scene.shapes import Helix, edge_count, helix_nodes, number
from flagrs.scene.values import Bounds, FloatArray
from flagrs.units import rpm as revolutions_per_minute

# Table 1 of Lim et al., as resolved in docs/theory; lengths in metres.
SILICONE = Material(youngs_modulus=1.255e6, poisson_ratio=0.5, density=1260.0)
ROD_RADIUS = 1.6e-3
EPSILON = 1.65e-3
HELIX_RADIUS = 6.36e-3
AXIAL_LENGTH = 95.4e-3
HALF_DISTANCE = 14e-3
HEAD_RADIUS = 31e-3
#: Length of the two edges between corner, motor and axis point, whatever the mesh of the flagella.
SHAFT = 5e-3


@scenario
def robot(
    normalized_pitch: float = 7.0,
    rpm: float | Sequence[float] = 20.0,
    edge_length: float = 5e-3,
    flagella: int = 2,
    contact: ContactOverride = True,
    fluid: FluidOverride = None,
    twist_drag: bool = True,
    C_t: float = 4.1,
    C_r: float = 0.9,
    scale: float = 1.0,
) -> Scene:
    """Return the swimming robot of Lim et al.: two flagella, two motors, one head.

    One chain runs from the tip of flagellum 1 through its axis point, motor 1, a corner, the head, a corner,
    motor 2 and an axis point to the tip of flagellum 2. Both left-handed helices lie along +x; the robot
    swims towards -x. Each flagellum has int(contour / edge_length) equal edges, so that its axial length is
    95.4 mm on every mesh.

    Parameters
    ----------
    normalized_pitch
        Pitch of the flagella over their helix radius of 6.36 mm [1].
    rpm
        Speed of the shafts relative to the head [1/min], one or one per motor.
    edge_length
        Least arc length of an edge of the flagella [m]; the edges in the head are always 5 mm.
    flagella
        Number of flagella; 2.
    contact
        Whether the flagella keep apart, or how: a `Contact` or a mapping of its options.
    fluid
        Another fluid, or a mapping of options to change; the default is 1 Pa s with Lim et al.'s epsilon,
        1.65 mm.
    twist_drag
        False switches the flagella's resistance to spinning off, as in the text.
    C_t, C_r
        Prefactors of the head's drag, translational and rotational [1].
    scale
        Factor on all lengths of the robot, `edge_length` among them [1].

    Returns
    -------
    Scene
        69, 59 and 55 nodes for pitches of 5, 7 and 9 at 5 mm edges.

    Examples
    --------
    >>> robot().node_count
    59
    """
    if flagella != 2:
        raise not_allowed("flagella", flagella, "2")
    number("normalized_pitch", normalized_pitch, Bounds("1", above=0.0))
    number("scale", scale, Bounds("1", above=0.0))
    nodes, last = _nodes(normalized_pitch * HELIX_RADIUS, edge_length)
    in_head = range(last + 1, last + 7)
    immersed = np.array([edge not in in_head for edge in range(len(nodes) - 1)])
    rod = Rod(
        nodes=scale * nodes,
        material=SILICONE,
        radius=scale * ROD_RADIUS,
        immersed=immersed,
        colliding=immersed,
        name="robot",
    )
    speeds = _speeds(rpm)
    pitch = scale * normalized_pitch * HELIX_RADIUS
    default = Fluid(viscosity=1.0, epsilon=scale * EPSILON, wavelength=pitch)
    return Scene(
        rods=(rod,),
        fluid=fluid_from(fluid, default, twist_drag),
        head=Head(node=last + 4, radius=scale * HEAD_RADIUS, C_t=C_t, C_r=C_r),
        motors=(
            Motor(node=last + 2, shaft=last + 1, speed=speeds[0]),
            Motor(node=last + 6, shaft=last + 6, speed=speeds[1]),
        ),
        contact=contact_from(contact),
        name="robot",
    )


def _nodes(pitch: float, edge_length: float) -> tuple[FloatArray, int]:
    """Return all nodes [m], and the number of the last node of flagellum 1, its base."""
    helix = Helix(HELIX_RADIUS, pitch, AXIAL_LENGTH)
    start = (2.0 * SHAFT, 0.0, 0.0)
    flagellum = helix_nodes(helix, edge_count(helix.contour, edge_length), "left", point=start)
    to_1, to_2 = np.array([0.0, -HALF_DISTANCE, 0.0]), np.array([0.0, HALF_DISTANCE, 0.0])
    motor, axis_point = np.array([SHAFT, 0.0, 0.0]), np.array([2.0 * SHAFT, 0.0, 0.0])
    head = [axis_point + to_1, motor + to_1, to_1, np.zeros(3), to_2, motor + to_2, axis_point + to_2]
    nodes = np.concatenate([flagellum[::-1] + to_1, head, flagellum + to_2])
    return nodes, len(flagellum) - 1


def _speeds(rpm: float | Sequence[float]) -> tuple[float, float]:
    """Return the speeds of the two motors [rad/s]."""
    both = [rpm, rpm] if isinstance(rpm, int | float | str) else list(rpm)
    if len(both) != 2:
        raise not_allowed("rpm", rpm, "one number, or one for each of the 2 motors")
    first, second = (number("rpm", value, Bounds("1/min")) for value in both)
    return revolutions_per_minute(first), revolutions_per_minute(second)
