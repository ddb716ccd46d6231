"""Write the canonical scenes as the core takes them, for the Rust tests and benches.

Run ``python tests/scenes/make_scenes.py``. A file holds what `flagrs.assemble.native_scene` returns, and
``dt``, the step when none is asked for [s]. Arrays whose entries are all the same hold one of them; the rest
shape is null where it is the initial shape; null stands for NaN and for infinity. `tests/common/scenes.rs`
reads it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from flagrs import (
    Clamp,
    Contact,
    Fluid,
    LinearFlow,
    LineLoad,
    MagneticField,
    Material,
    Motor,
    PointLoad,
    Rod,
    Scene,
    Table,
    scenarios,
)
from flagrs.assemble import native_scene
from flagrs.default_step import default_step
from flagrs.scenarios.robot import AXIAL_LENGTH, EPSILON, HELIX_RADIUS, ROD_RADIUS
from flagrs.scenarios.robot import SILICONE as ROBOT_SILICONE
from flagrs.scene.shapes import Helix, edge_count, helix_nodes

FOLDER = Path(__file__).parent
SILICONE = Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
#: Nodes of the longest helix that a bench asks for.
HELIX_NODES = 1000

#: Arrays with an entry for every edge, hinge, node or body.
UNIFORM = {
    "theta",
    "radius",
    "density",
    "stretching",
    "bending",
    "twisting",
    "natural_curvature",
    "natural_twist",
    "reynolds",
    "immersed",
    "epsilon",
    "coefficients",
    "driven",
    "bent",
    "slip_velocities",
    "colliding",
}


def free_helix() -> Scene:
    """Return a flagellum of the robot continued to many turns, free, without contact."""
    flagellum = Helix(HELIX_RADIUS, 7.0 * HELIX_RADIUS, AXIAL_LENGTH)
    longer = (HELIX_NODES - 1) / edge_count(flagellum.contour, 5e-3)
    helix = Helix(flagellum.radius, flagellum.pitch, longer * flagellum.axial_length)
    nodes = helix_nodes(helix, HELIX_NODES - 1, "left")
    fluid = Fluid(viscosity=1.0, epsilon=EPSILON, far_field_nodes=2 * HELIX_NODES)
    rod = Rod(nodes=nodes, material=ROBOT_SILICONE, radius=ROD_RADIUS)
    return Scene(rods=(rod,), fluid=fluid, name="free helix")


def free_fibre() -> Scene:
    """Return a bent fibre in a shear flow, by resistive force theory, that nothing holds."""
    along = np.linspace(-0.05, 0.05, 13)
    nodes = np.stack([along, 0.2 * along**2 / 0.05, 1e-3 * np.sin(60.0 * along)], axis=1)
    rod = Rod(nodes=nodes, radius=1e-3, material=SILICONE)
    shear = LinearFlow(gradient=((0.0, 3.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    return Scene(rods=(rod,), fluid=Fluid(viscosity=0.5, model="RFT", background=(shear,)), name="free fibre")


def branched_network() -> Scene:
    """Return three arms that meet at a node, one of them held and turned, under gravity and buoyancy."""
    arm = np.array([[k * 8e-3, 0.0, 0.0] for k in range(5)])
    up, down = np.array([6e-3, 5e-3, 1e-3]), np.array([5e-3, -6e-3, 2e-3])
    further = [arm[-1] + k * step for step in (up, down) for k in (1, 2, 3)]
    nodes = np.concatenate([arm, further])
    chain = [[k, k + 1] for k in range(4)]
    rod = Rod(
        nodes=nodes,
        edges=[*chain, [4, 5], [5, 6], [6, 7], [4, 8], [8, 9], [9, 10]],
        radius=[1e-3] * 4 + [8e-4] * 6,
        material=SILICONE,
    )
    return Scene(
        rods=(rod,),
        fluid=Fluid(viscosity=1.0, density=1000.0),
        clamps=(
            Clamp(nodes=(0, 1), edges=(0,), angular_velocity=Table(times=[0.0, 1.0], values=[0.0, 3.0])),
        ),
        gravity=(0.0, 0.0, -9.81),
        name="branched network",
    )


def torque_motor() -> Scene:
    """Return a helix on a held shaft, driven by a torque that is switched on slowly and then reversed."""
    turn = np.linspace(0.0, 3.0 * np.pi, 19)
    helix = np.stack([3e-3 * turn, 6e-3 * np.cos(turn), 6e-3 * np.sin(turn)], axis=1)
    nodes = np.concatenate([[[-15e-3, 6e-3, 0.0], [-10e-3, 6e-3, 0.0], [-5e-3, 6e-3, 0.0]], helix])
    torque = Table(times=[0.0, 0.5, 1.0, 1.1], values=[0.0, 2e-5, 2e-5, -1e-5])
    return Scene(
        rods=(Rod(nodes=nodes, radius=1e-3, material=SILICONE),),
        fluid=Fluid(viscosity=1.0, epsilon="lim-et-al"),
        motors=(Motor(node=2, shaft=2, torque=torque),),
        clamps=(Clamp(nodes=(0, 1), edges=(0,)),),
        name="torque motor",
    )


def loads() -> Scene:
    """Return a magnetised cantilever of unequal bending stiffnesses with every kind of load on it."""
    along = np.linspace(0.0, 0.05, 11)
    rod = Rod(
        nodes=np.stack([along, 0.0 * along, 2.0 * along**2], axis=1),
        radius=1e-3,
        material=SILICONE,
        EI=[[8e-7, 1e-7], [1e-7, 5e-7]],
        director=(0.0, 1.0, 0.0),
        natural_twist=0.05,
        magnetization=(0.0, 2e3, 8e3),
    )
    swing = Table(times=[0.0, 0.2, 0.4], values=[[0.0, 0.0, 0.0], [1e-4, -2e-4, 0.0], [0.0, 1e-4, 1e-4]])
    return Scene(
        rods=(rod,),
        fluid=Fluid(viscosity=1.0, model="RFT", coefficients="lighthill"),
        clamps=(Clamp(nodes=(0, 1), edges=(0,)),),
        loads=(
            PointLoad(node=10, force=swing),
            PointLoad(node=6, force=(0.0, 1e-4, -2e-4), edge=5, frame="material"),
            PointLoad(edge=8, torque=(0.0, 0.0, 2e-6)),
            PointLoad(edge=4, torque=(1e-6, 0.0, 2e-6), frame="material"),
            LineLoad(force=(0.0, 2e-3, 0.0), edges=(2, 3, 4)),
            LineLoad(torque=(0.0, 0.0, 1e-5), frame="material"),
        ),
        magnetic_field=MagneticField(
            field=(2e-3, 0.0, 5e-3), gradient=((0.05, 0.0, 0.0), (0.0, 0.05, 0.0), (0.0, 0.0, -0.1))
        ),
        name="loads",
    )


def crossed(contact: Contact) -> Scene:
    """Return a rod that slides, under its weight and a pull, across two rails that are held."""
    rail = {
        "length": 0.04,
        "edge_count": 4,
        "radius": 1.5e-3,
        "material": SILICONE,
        "direction": (0.0, 1.0, 0.0),
    }
    rails = [Rod.straight(start=(x, -0.02, 0.0), **rail) for x in (-0.015, 0.016)]
    above = Rod.straight(
        length=0.06, edge_count=9, radius=1e-3, material=SILICONE, start=(-0.03, 1e-3, 2.56e-3)
    )
    return Scene(
        rods=(above, *rails),
        fluid=Fluid(viscosity=0.5, model="RFT", density=0.0),
        clamps=tuple(Clamp(rod=k, nodes=tuple(range(5)), edges=tuple(range(4))) for k in (1, 2)),
        loads=(LineLoad(force=(3e-2, 1e-2, 0.0), edges=tuple(range(9))),),
        gravity=(0.0, 0.0, -9.81),
        contact=contact,
        name="friction rail",
    )


#: Every scene, by the name of its file.
SCENES: dict[str, Callable[[], Scene]] = {
    "robot": scenarios.robot,
    "robot_of_pitch_5": lambda: scenarios.robot(normalized_pitch=5.0),
    "robot_of_pitch_9": lambda: scenarios.robot(normalized_pitch=9.0),
    "one_clamped_flagellum": lambda: scenarios.clamped_flagella(count=1),
    "two_clamped_flagella": scenarios.clamped_flagella,
    "five_clamped_flagella": lambda: scenarios.clamped_flagella(count=5),
    "free_helix": free_helix,
    "free_fibre": free_fibre,
    "branched_network": branched_network,
    "torque_motor": torque_motor,
    "loads": loads,
    "friction_rail": lambda: crossed(Contact(friction=0.3)),
    "rail_by_passes": lambda: crossed(Contact(method="spillmann-teschner")),
}


def plain(value: Any) -> Any:
    """Return a value as JSON has it: lists for arrays, null for what is not finite."""
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, dict):
        return {key: shortened(key, plain(entry)) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def shortened(key: str, value: Any) -> Any:
    """Return one entry of an array whose entries are all the same."""
    if key in UNIFORM and isinstance(value, list) and all(entry == value[0] for entry in value):
        return value[:1]
    return value


def content(name: str) -> dict[str, Any]:
    """Return what the file of a scene holds."""
    scene = SCENES[name]()
    found: dict[str, Any] = plain(native_scene(scene))
    if found["rest_nodes"] == found["nodes"]:
        found["rest_nodes"] = None
    return found | {"dt": default_step(scene)}


def path_of(name: str) -> Path:
    """Return the file of a scene."""
    return FOLDER / f"{name}.json"


def main() -> None:
    """Write all files."""
    for name in SCENES:
        lines = (f'"{key}": {json.dumps(value)}' for key, value in content(name).items())
        path_of(name).write_text("{\n" + ",\n".join(lines) + "\n}\n")
        print(f"{name}: {path_of(name).stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
