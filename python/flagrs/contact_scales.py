"""Typical forces and velocities of a scene, from which contact takes its stiffness and slip velocity."""

from __future__ import annotations

import math

import numpy as np

from flagrs.scene import Contact, PointLoad, Rod, Scene
from flagrs.time_step import fastest_rate, size

#: Magnitude of the barrier's derivative over its range at the middle of the range, where centrelines are the
#: sum of the radii apart: (2 ln 2 + 1) / 2.
MIDDLE_SLOPE = math.log(2.0) + 0.5
#: Slip velocity over the velocity that typical forces give a filament.
SLIP_SHARE = 1e-3
#: First root of cos(k) cosh(k) = 1: the length of a straight rod over that on which it bends.
FREE_ROOT = 4.73
#: A contact gathers the load of stretches to both sides: forces per length of contact over the typical one.
GATHERED = 5.0
#: Strain of edges that have nothing else to bear.
STRETCHED = 1e-3
#: Part of the force that bends a rod as far as it is bent at rest which contact may have to bear.
BENT = 0.1


def force_per_length(scene: Scene) -> float:
    """Return the force per length that contacts typically bear [N/m]: of drag, weight, loads or bending."""
    rods = _yielding(scene)
    loaded = max((_load(scene, load) for load in scene.loads), default=0.0)
    driven = max(loaded, *(max(_drag(scene, rod), _weight(scene, rod)) for rod in rods))
    borne = max(GATHERED * driven, *(BENT * _bending(rod) for rod in rods))
    # Single edges that nothing drives: what stretches them by a thousandth, over their length.
    return borne or max(STRETCHED * float(rod.EA_array().max() / rod.rest_lengths().sum()) for rod in rods)


def typical_velocity(scene: Scene) -> float:
    """Return the velocity of filaments under the typical force per length, or of what is prescribed [m/s]."""
    prescribed = max(fastest_rate(scene) * size(scene), _fastest_clamp(scene))
    resistance = max(_resistance(scene, rod) for rod in scene.rods)
    return max(prescribed, force_per_length(scene) / resistance if resistance > 0.0 else 1e-3)


def barrier_stiffness(scene: Scene, contact: Contact) -> float:
    """Return the stiffness of the barrier [Pa], given or from the typical force per length."""
    if contact.stiffness is not None:
        return contact.stiffness
    thickness = 2.0 * max(float(rod.radius_array().max()) for rod in scene.rods)
    span = 2.0 * contact.tolerance_or_default() * thickness
    return force_per_length(scene) / (MIDDLE_SLOPE * span)


def slip_velocity(scene: Scene, contact: Contact) -> float:
    """Return the velocity from which on contacts slide [m/s], given or from the typical one."""
    if contact.slip_velocity is not None:
        return contact.slip_velocity
    return SLIP_SHARE * typical_velocity(scene)


def _yielding(scene: Scene) -> list[Rod]:
    # A rod held at every node bears any force without bending: its stiffness says nothing of the forces.
    held: list[set[int]] = [set() for _ in scene.rods]
    for clamp in scene.clamps:
        held[clamp.rod].update(clamp.nodes)
    free = [rod for rod, nodes in zip(scene.rods, held, strict=True) if len(nodes) < len(rod.nodes)]
    return free or list(scene.rods)


def _bending(rod: Rod) -> float:
    # Of a rod bent as much as it is at rest, or on the wavelength of its slowest free vibration.
    if len(rod.hinge_array()) == 0:
        return 0.0
    nodes, lengths = rod.rest_array(), rod.rest_lengths()
    spread = np.linalg.svd(nodes - nodes.mean(axis=0), compute_uv=False)
    across = float(np.sqrt((spread[1:] ** 2).sum() / len(nodes)))
    wave = float(lengths.sum()) / FREE_ROOT
    scale = min(wave, across) if across > float(rod.radius_array().max()) else wave
    return float(rod.EI_array()[:, 0, 0].max()) / scale**3


def _resistance(scene: Scene, rod: Rod) -> float:
    if scene.fluid is None or scene.fluid.model == "none":
        return 0.0
    logarithm = math.log(2.0 * float(rod.rest_lengths().sum()) / float(rod.radius_array().mean())) + 0.5
    return 4.0 * math.pi * scene.fluid.viscosity / max(logarithm, 1.0)


def _fastest_clamp(scene: Scene) -> float:
    return max((float(np.linalg.norm(clamp.velocity)) for clamp in scene.clamps), default=0.0)


def _drag(scene: Scene, rod: Rod) -> float:
    return _resistance(scene, rod) * max(fastest_rate(scene) * size(scene), _fastest_clamp(scene))


def _weight(scene: Scene, rod: Rod) -> float:
    buoyancy = 0.0 if scene.fluid is None else scene.fluid.density_for_buoyancy
    area = math.pi * float(rod.radius_array().max()) ** 2
    return abs(rod.material.density - buoyancy) * area * float(np.linalg.norm(scene.gravity))


def _load(scene: Scene, load: PointLoad) -> float:
    return float(np.linalg.norm(load.force)) / float(scene.rods[load.rod].rest_lengths().sum())
