"""From a scene to the plain arrays of the native core: one global numbering of nodes, edges and hinges."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flagrs.contact_scales import SLIP_SHARE, contact_scales
from flagrs.errors import SceneError, not_allowed
from flagrs.native_loads import native_flows, native_loads, native_magnetism, native_signal, native_vector
from flagrs.scene import Clamp, Contact, Fluid, Head, Motor, Rod, Rotation, Scene, rod_topology, scene_checks
from flagrs.scene.values import BoolArray, FloatArray, IntArray
from flagrs.time_step import rod_size

#: Excluded rest arc length over the sum of radii where a contact gives none; see docs/theory/contact.md.
EXCLUSION_FACTOR = math.pi / 2.0


def native_scene(scene: Scene) -> dict[str, Any]:
    """Return the mapping that ``_flagrs.Simulation`` takes.

    Parameters
    ----------
    scene
        The scene.

    Returns
    -------
    dict
        Arrays over all rods, in the scene's global numbering, SI units.
    """
    rods = scene.rods
    edges = [rod.edge_array() + scene.node_offset(k) for k, rod in enumerate(rods)]
    hinges = [rod.hinge_array() + scene.edge_offset(k) for k, rod in enumerate(rods)]
    return {
        "nodes": scene.node_array(),
        "rest_nodes": np.concatenate([rod.rest_array() for rod in rods]),
        "edges": np.concatenate(edges),
        "hinges": np.concatenate(hinges),
        "theta": np.concatenate([_theta(rod) for rod in rods]),
        "directors": _directors(scene),
        "radius": radii_of(scene),
        "density": np.concatenate([rod.density_array() for rod in rods]),
        "stretching": np.concatenate([rod.EA_array() for rod in rods]),
        "bending": np.concatenate([rod.EI_array() for rod in rods]),
        "twisting": np.concatenate([rod.GJ_array() for rod in rods]),
        "natural_curvature": np.concatenate([_natural_curvature(rod) for rod in rods]),
        "natural_twist": np.concatenate([_natural_twist(rod) for rod in rods]),
        "head": None if scene.head is None else _head(scene, scene.head),
        "walls": [wall.native() for wall in scene.walls],
        "gravity": scene.gravity.tolist(),
        "reynolds": reynolds_per_speed(scene),
        "fluid": None if scene.fluid is None else _fluid(scene, scene.fluid),
        "contact": None if scene.contact is None else _contact(scene, scene.contact),
        **native_inputs(scene, scene),
    }


def native_inputs(scene: Scene, given: Scene) -> dict[str, Any]:
    """Return what of `native_scene` may change between steps: motors, clamps, loads, magnetism and flows.

    Parameters
    ----------
    scene
        The scene of the moment.
    given
        The scene that the equations were made from, which differs in inputs alone.
    """
    return {
        "motors": [_motor(scene, k, motor) for k, motor in enumerate(scene.motors)],
        "clamps": [_clamp(scene, k, clamp) for k, clamp in enumerate(scene.clamps)],
        "loads": native_loads(scene, given),
        "magnetism": native_magnetism(scene),
        "flows": native_flows(scene),
    }


def reynolds_per_speed(scene: Scene) -> FloatArray:
    """Return each node's Reynolds number over its speed (N,) [s/m], 0 for dry ones.

    It is density times size over viscosity, with the size of the node's rod across its axis, the radius of a
    helix (`flagrs.time_step.size`), or the radius of the head on the head's node.
    """
    fluid = scene.fluid
    sizes = np.zeros(scene.node_count)
    if fluid is None:
        return sizes
    for number, rod in enumerate(scene.rods):
        wet = np.unique(rod.edge_array()[rod.immersed_array()])
        sizes[scene.node_offset(number) + wet] = rod_size(rod)
    if scene.head is not None:
        sizes[scene.node_offset(scene.head.rod) + scene.head.node] = scene.head.radius
    return sizes * (fluid.density_for_inertia / fluid.viscosity)


def _theta(rod: Rod) -> FloatArray:
    return np.zeros(len(rod.edge_array())) if rod.theta is None else rod.theta


def _natural_curvature(rod: Rod) -> FloatArray:
    shape = (len(rod.hinge_array()), 2)
    given = np.nan if rod.natural_curvature is None else rod.natural_curvature
    return np.broadcast_to(given, shape).astype(np.float64)


def _natural_twist(rod: Rod) -> FloatArray:
    given = np.nan if rod.natural_twist is None else rod.natural_twist
    return np.broadcast_to(given, len(rod.hinge_array())).astype(np.float64)


def _directors(scene: Scene) -> list[tuple[int, list[float]]]:
    given = [(k, rod.director) for k, rod in enumerate(scene.rods) if rod.director is not None]
    return [(scene.edge_offset(k), director.tolist()) for k, director in given]


def _motor(scene: Scene, position: int, motor: Motor) -> dict[str, Any]:
    rod = scene.rods[motor.rod]
    hinge, second = hinge_of_motor(rod, motor)
    offset = scene.hinge_offset(motor.rod)
    return {
        "hinge": offset + hinge,
        "shaft_second": second,
        "by_torque": motor.drive == "torque",
        "signal": native_signal(motor.signal, f"motors[{position}].{motor.drive}"),
    }


def hinge_of_motor(rod: Rod, motor: Motor) -> tuple[int, bool]:
    """Return the hinge at which a motor sits, and whether its shaft is the hinge's second edge.

    Raises
    ------
    SceneError
        If there is not exactly one hinge at the motor's node that bends its shaft.
    """
    edges, hinges = rod.edge_array(), rod.hinge_array()
    found = [
        (k, pair[1] == motor.shaft)
        for k, pair in enumerate(hinges.tolist())
        if motor.shaft in pair and rod_topology.shared_node(edges, *pair) == motor.node
    ]
    if len(found) != 1:
        raise SceneError(
            f"motors: node {motor.node} has {len(found)} hinges with shaft edge {motor.shaft}; must be one",
            field="motors",
            value=motor.node,
            allowed="a node with exactly one hinge that bends the shaft edge",
        )
    return found[0]


def _head(scene: Scene, head: Head) -> dict[str, Any]:
    viscosity = 0.0 if scene.fluid is None else scene.fluid.viscosity
    offset = scene.edge_offset(head.rod)
    return {
        "node": scene.node_offset(head.rod) + head.node,
        "edges": [offset + edge for edge in scene_checks.edges_of_head(scene, head)],
        "translation": head.C_t * 6.0 * math.pi * viscosity * head.radius,
        "rotation": head.C_r * 8.0 * math.pi * viscosity * head.radius**3,
        "mass": head.mass,
    }


def _clamp(scene: Scene, position: int, clamp: Clamp) -> dict[str, Any]:
    nodes, edges, field = scene.node_offset(clamp.rod), scene.edge_offset(clamp.rod), f"clamps[{position}]"
    return {
        "nodes": [nodes + node for node in clamp.nodes],
        "edges": [edges + edge for edge in clamp.edges],
        "angular_velocity": native_signal(clamp.angular_velocity, f"{field}.angular_velocity"),
        "axes": [axis in clamp.axes for axis in "xyz"],
        "velocity": native_vector(clamp.velocity, f"{field}.velocity"),
        "displacement": native_vector(clamp.displacement, f"{field}.displacement"),
        "turning": None if clamp.rotation is None else _turning(clamp.rotation, f"{field}.rotation"),
    }


def _turning(rotation: Rotation, field: str) -> dict[str, Any]:
    return {
        "axis": rotation.axis.tolist(),
        "center": rotation.center.tolist(),
        "rate": native_signal(rotation.rate, f"{field}.rate"),
        "angle": native_signal(rotation.angle, f"{field}.angle"),
    }


def _fluid(scene: Scene, fluid: Fluid) -> dict[str, Any]:
    radius = radii_of(scene)
    immersed: BoolArray = np.concatenate([rod.immersed_array() for rod in scene.rods])
    local = fluid.model == "RFT"
    return {
        "viscosity": fluid.viscosity,
        "immersed": (immersed & (fluid.model != "none")).tolist(),
        "twist_drag": fluid.twist_drag,
        "density": fluid.density_for_buoyancy,
        "far_field_error": fluid.far_field_error,
        "far_field_nodes": fluid.crossover,
        "epsilon": None if local else fluid.epsilon_array(radius),
        "coefficients": resistive_coefficients(scene, fluid) if local else None,
    }


def resistive_coefficients(scene: Scene, fluid: Fluid) -> FloatArray:
    """Return drag per length along and across every edge (E, 2) [N s/m^2].

    Gray and Hancock (1955): ``2 pi mu / (ln(2 lambda/a) - 1/2)`` and ``4 pi mu / (ln(2 lambda/a) + 1/2)``
    with the
    wavelength ``lambda``. Lighthill (1976): ``2 pi mu / ln(2 q/a)`` and ``4 pi mu / (ln(2 q/a) + 1/2)`` with
    ``q = 0.09`` times the arc length of a wavelength. Where the fluid gives no wavelength, the immersed
    length of the rod stands for it.
    """
    rows = []
    for rod in scene.rods:
        immersed = rod.immersed_array()
        if not immersed.any():
            rows.append(np.zeros((len(immersed), 2)))  # no drag, and no length to take it from
            continue
        contour = float(rod.rest_lengths()[immersed].sum())
        wavelength = contour if fluid.wavelength is None else fluid.wavelength
        radius = rod.radius_array()
        if fluid.coefficients == "gray-hancock":
            logarithm = np.log(2.0 * wavelength / radius)
            along = 2.0 * np.pi * fluid.viscosity / (logarithm - 0.5)
        else:
            logarithm = np.log(2.0 * 0.09 * wavelength / radius)
            along = 2.0 * np.pi * fluid.viscosity / logarithm
        across = 4.0 * np.pi * fluid.viscosity / (logarithm + 0.5)
        rows.append(np.stack([along, across], axis=1))
    coefficients: FloatArray = np.concatenate(rows)
    wet = np.concatenate([rod.immersed_array() for rod in scene.rods])
    if not (coefficients[wet] > 0.0).all():
        raise SceneError(
            "fluid.wavelength: too short for the radius; resistive force theory needs slender filaments",
            field="fluid.wavelength",
            value=fluid.wavelength,
            allowed="many radii [m]",
        )
    return coefficients


def _contact(scene: Scene, contact: Contact) -> dict[str, Any]:
    spheres: list[tuple[int, float]] = []
    if contact.head_radius is not None:
        if scene.head is None:
            raise not_allowed("contact.head_radius", contact.head_radius, "None in a scene without a head")
        spheres = [(scene.node_offset(scene.head.rod) + scene.head.node, contact.head_radius)]
    scales = contact_scales(scene)
    # One entry per body: edges in the scene's order, then spheres, then walls, which nothing drives or bends.
    owner = np.repeat(np.arange(len(scene.rods)), [len(rod.edge_array()) for rod in scene.rods])
    if spheres and scene.head is not None:
        owner = np.append(owner, scene.head.rod)
    at_rest = np.zeros(len(scene.walls))
    slip = np.append(scales.velocity[owner] * SLIP_SHARE, at_rest)
    return {
        "barrier": contact.method == "barrier",
        "tolerance": contact.tolerance_or_default(),
        "max_iterations": contact.max_iterations,
        "stiffness": contact.stiffness,
        "driven": [*scales.driven[owner].tolist(), *at_rest],
        "bent": [*scales.bent[owner].tolist(), *(at_rest + math.inf)],
        "friction": contact.friction,
        "slip_velocities": (
            slip if contact.slip_velocity is None else np.full_like(slip, contact.slip_velocity)
        ).tolist(),
        "spheres": spheres,
        "exclusion": EXCLUSION_FACTOR if contact.exclusion_factor is None else contact.exclusion_factor,
        "colliding": np.concatenate([rod.colliding_array() for rod in scene.rods]).tolist(),
    }


def rest_lengths_of(scene: Scene) -> FloatArray:
    """Return the rest length (E,) of every edge of the scene [m]."""
    return np.concatenate([rod.rest_lengths() for rod in scene.rods])


def radii_of(scene: Scene) -> FloatArray:
    """Return the radius (E,) of every edge of the scene [m]."""
    return np.concatenate([rod.radius_array() for rod in scene.rods])


def edges_of(scene: Scene) -> IntArray:
    """Return start and end node (E, 2) of every edge of the scene."""
    rods = enumerate(scene.rods)
    edges: IntArray = np.concatenate([rod.edge_array() + scene.node_offset(k) for k, rod in rods])
    return edges
