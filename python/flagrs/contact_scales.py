"""Typical forces and velocities of every rod: stiffness and slip velocity of contact, pair by pair."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flagrs.native_loads import largest_load, largest_speed
from flagrs.scene import Rod, Scene
from flagrs.scene.values import FloatArray
from flagrs.time_step import largest

#: Magnitude of the barrier's derivative over its range at the middle of the range, where centrelines are the
#: sum of the radii apart: (2 ln 2 + 1) / 2.
MIDDLE_SLOPE = math.log(2.0) + 0.5
#: Slip velocity over the velocity that what drives a filament gives it.
SLIP_SHARE = 1e-3
#: First root of cos(k) cosh(k) = 1: the length of a straight rod over that on which it bends.
FREE_ROOT = 4.73
#: A contact gathers the load of stretches to both sides: forces per length of contact over the typical one.
GATHERED = 5.0
#: Strain of edges that have nothing else to bear.
STRETCHED = 1e-3
#: Part of the force that bends a rod as far as it is bent at rest which contact may have to bear.
BENT = 0.1


@dataclass(frozen=True)
class ContactScales:
    """What contact has to bear and how fast it slides, one entry per rod.

    Parameters
    ----------
    driven
        Force per length (R,) of what moves a rod: drag, weight, loads, torques [N/m].
    bent
        Force per length (R,) that bends it much [N/m]; infinite for what is held everywhere.
    velocity
        Velocity (R,) that what drives it gives it [m/s].
    """

    driven: FloatArray
    bent: FloatArray
    velocity: FloatArray


def contact_scales(scene: Scene) -> ContactScales:
    """Return the typical forces and velocities of all rods; the time grows linearly with their number."""
    rods = [_RodScales(scene, rod) for rod in scene.rods]
    _add_what_drives(scene, rods)
    driven = np.array([scales.driven() for scales in rods])
    bent = np.array([math.inf if scales.held else BENT * scales.bending for scales in rods])
    # Single edges do not bend: they bear what drives them, or as much as the softest rod where nothing does.
    rigid = bent == 0.0
    bent[rigid] = math.inf
    known = np.concatenate([driven[driven > 0.0], bent[np.isfinite(bent)]])
    stretched = [STRETCHED * float(rod.EA_array().max() / rod.rest_lengths().sum()) for rod in scene.rods]
    driven[rigid & (driven == 0.0)] = known.min() if len(known) else min(stretched)
    velocity = np.array([scales.velocity() for scales in rods])
    if not (velocity > 0.0).any():
        velocity = np.array([0.0 if scales.held else scales.recoil() for scales in rods])
    # Of a pair the faster rod counts: one that nothing drives must not be it.
    moving = velocity[velocity > 0.0]
    velocity[velocity == 0.0] = moving.min() if len(moving) else 1e-3
    return ContactScales(driven=driven, bent=bent, velocity=velocity)


def pair_stiffness(scales: ContactScales, pair: tuple[int, int], thickness: float, tolerance: float) -> float:
    """Return the stiffness [Pa] of contact of two rods whose radii sum to `thickness` [m].

    The same as ``src/contact/stiffness.rs`` takes for every pair of edges.
    """
    first, second = pair
    yielding = float(min(scales.bent[first], scales.bent[second]))
    moved = float(max(scales.driven[first], scales.driven[second]))
    force = max(moved, yielding) if math.isfinite(yielding) else moved
    return force / (MIDDLE_SLOPE * 2.0 * tolerance * thickness)


def suitable_stiffness(scene: Scene) -> tuple[float, float]:
    """Return the least and the largest stiffness [Pa] that any pair of rods in contact would be given."""
    contact = scene.contact
    assert contact is not None
    scales = contact_scales(scene)
    # A pair bears no less than the weaker of its rods bears against its like, and no more than the stronger.
    forces = np.where(np.isfinite(scales.bent), np.maximum(scales.driven, scales.bent), scales.driven)
    forces = forces[forces > 0.0]
    radii = [radius for rod in scene.rods for radius in (rod.radius_array().min(), rod.radius_array().max())]
    thick = max(float(max(radii)), contact.head_radius or 0.0)
    over = MIDDLE_SLOPE * 4.0 * contact.tolerance_or_default()
    if len(forces) == 0:
        return 0.0, math.inf
    return float(forces.min()) / (over * thick), float(forces.max()) / (over * float(min(radii)))


class _RodScales:
    """The sizes of one rod, and what drives it."""

    def __init__(self, scene: Scene, rod: Rod) -> None:
        nodes, lengths = rod.rest_array(), rod.rest_lengths()
        spread = np.linalg.svd(nodes - nodes.mean(axis=0), compute_uv=False)
        radius = rod.radius_array()
        across = float(np.sqrt((spread[1:] ** 2).sum() / len(nodes)))
        self.rod = rod
        self.length = float(lengths.sum())
        self.size = max(across, self.length / 20.0)
        wave = self.length / FREE_ROOT
        self.wave = min(wave, across) if across > float(radius.max()) else wave
        hinges = rod.hinge_array()
        self.rigidity = float(np.linalg.eigvalsh(rod.EI_array()).max()) if len(hinges) else 0.0
        # Of a rod bent as much as it is at rest, or on the wavelength of its slowest free vibration.
        self.bending = self.rigidity / self.wave**3
        wet = scene.fluid is not None and scene.fluid.model != "none" and bool(rod.immersed_array().any())
        logarithm = max(math.log(2.0 * self.length / float(radius.mean())) + 0.5, 1.0)
        viscosity = scene.fluid.viscosity if scene.fluid is not None and wet else 0.0
        self.resistance = 4.0 * math.pi * viscosity / logarithm
        area = np.pi * radius**2
        self.mass = float((rod.density_array() * area).mean())
        buoyancy = 0.0 if scene.fluid is None else scene.fluid.density_for_buoyancy
        weight = np.abs(rod.density_array() - buoyancy) * area
        self.load = float(weight.max()) * float(np.linalg.norm(scene.gravity))
        self.prescribed = 0.0
        self.held = False

    def driven(self) -> float:
        """Return the force per length of contact [N/m] that what drives the rod makes it bear."""
        load = 0.0 if self.held else self.load
        return GATHERED * max(load, self.resistance * self.prescribed)

    def velocity(self) -> float:
        """Return the velocity [m/s] that is prescribed or that load gives the rod."""
        return max(self.prescribed, 0.0 if self.held else self._under(self.load))

    def recoil(self) -> float:
        """Return the velocity [m/s] of the rod on its way back to rest, or of one bent as at rest."""
        away = _turned(self.rod)
        force = self.rigidity * away / self.wave**2 if away > 0.0 else BENT * self.bending
        return self._under(force)

    def _under(self, force: float) -> float:
        if self.resistance > 0.0:
            return force / self.resistance
        # Without drag: what the force makes of the rod's inertia over a distance of its size.
        return math.sqrt(force / self.mass * self.size) if self.mass > 0.0 else 0.0


def _add_what_drives(scene: Scene, rods: list[_RodScales]) -> None:
    held: dict[int, set[int]] = {}
    for clamp in scene.clamps:
        scales = rods[clamp.rod]
        held.setdefault(clamp.rod, set()).update(clamp.nodes)
        speed = largest_speed(clamp)
        turning = max((largest(signal) for signal in clamp.turning_signals()), default=0.0) * scales.size
        scales.prescribed = max(scales.prescribed, speed, turning)
    for index, nodes in held.items():
        rods[index].held = len(nodes) == len(rods[index].rod.nodes)
    for motor in scene.motors:
        scales = rods[motor.rod]
        if motor.speed is not None:
            scales.prescribed = max(scales.prescribed, largest(motor.speed) * scales.size)
        else:
            scales.load = max(scales.load, largest(motor.signal) / (scales.size * scales.length))
    for load in scene.loads:
        scales = rods[load.rod]
        scales.load = max(scales.load, largest_load(scene, load))


def _turned(rod: Rod) -> float:
    """Return the largest change of curvature from rest [1/m], by the angles between edges."""
    hinges, edges = rod.hinge_array(), rod.edge_array()
    if len(hinges) == 0:
        return 0.0

    def angles(nodes: FloatArray) -> FloatArray:
        vectors = nodes[edges[:, 1]] - nodes[edges[:, 0]]
        first, second = vectors[hinges[:, 0]], vectors[hinges[:, 1]]
        across = np.linalg.norm(np.cross(first, second), axis=1)
        turned: FloatArray = np.arctan2(across, (first * second).sum(axis=1))
        return turned

    lengths = rod.rest_lengths()[hinges].mean(axis=1)
    return float((np.abs(angles(np.asarray(rod.nodes)) - angles(rod.rest_array())) / lengths).max())
