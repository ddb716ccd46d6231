"""Parts of small scenes that the tests of scenes are made of, and the error a scene is refused with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from flagrs import (
    Clamp,
    Contact,
    Fluid,
    Head,
    Material,
    Motor,
    PointLoad,
    Rod,
    Scene,
    SceneError,
    Table,
)

SOFT = Material(youngs_modulus=1e6, density=1200.0)
LINE = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [0.3, 0.0, 0.0]]
#: A Y: three arms of one edge each that meet at node 1.
FORK = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.1, 0.0], [0.2, -0.1, 0.0]]


def rod(**changes: Any) -> Rod:
    return Rod(**{"nodes": LINE, "radius": 1e-3, "material": SOFT, **changes})


def fork(**changes: Any) -> Rod:
    return rod(nodes=FORK, edges=[[0, 1], [1, 2], [1, 3]], **changes)


def error_of(build: Callable[[], Any]) -> SceneError:
    with pytest.raises(SceneError) as caught:
        build()
    return caught.value


def full_scene() -> Scene:
    """Return a scene with every part and numbers that no short decimal represents."""
    third = 1.0 / 3.0
    return Scene(
        rods=[
            rod(
                nodes=third * np.array(LINE),
                EI=[[2e-6, third * 1e-6], [third * 1e-6, 1e-6]],
                immersed=[True, False, True],
            ),
            fork(
                rest_nodes=1.1 * np.array(FORK),
                radius=[1e-3, 2e-3, third * 1e-3],
                natural_twist=third,
                name="Y",
            ),
        ],
        fluid=Fluid(viscosity=third, model="RFT", epsilon="lim-et-al", density=1000.0),
        head=Head(node=1, radius=third * 1e-2),
        motors=[Motor(node=2, shaft=2, torque=Table(times=[0.0, third], values=[third, 2.0]))],
        clamps=[Clamp(rod=1, nodes=(0,), edges=(0,), angular_velocity=third)],
        loads=[PointLoad(rod=1, node=2, force=(third, 0.0, -1.0))],
        contact=Contact(exclusion_factor=1.0 + third),
        gravity=(0.0, 0.0, -9.81),
        name="everything",
    )
