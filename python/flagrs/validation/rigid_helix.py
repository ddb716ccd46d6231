"""Rigid helices, and what resists a rigid body that moves and turns about x, in a fluid of 1 Pa s."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from flagrs import Fluid, Material, Rod, Scene, Simulation
from flagrs.validation.filaments import SLENDER, Array, Filament, X, chain


@dataclass(frozen=True)
class Helix:
    """A left-handed helix about x: radius, pitch, axial length and radius of its cross-section [m]."""

    radius: float = 6.36e-3
    pitch: float = 7.0 * 6.36e-3
    axial_length: float = 95.4e-3
    thickness: float = 1.6e-3

    @property
    def advance(self) -> float:
        """Axial component of the tangent."""
        return self.pitch / math.hypot(self.pitch, 2.0 * math.pi * self.radius)

    @property
    def contour(self) -> float:
        """Arc length [m]."""
        return self.axial_length / self.advance

    @property
    def twist_torque(self) -> float:
        """Torque of twist drag about the axis at 1 rad/s [N m]; spin and torque are along the tangent."""
        return 4.0 * math.pi * self.thickness**2 * self.contour * self.advance**2

    def centre(self, arc: Array) -> Array:
        """Return points (..., 3) of the centreline at arc lengths."""
        axial = np.asarray(arc) * self.advance
        angle = 2.0 * math.pi * axial / self.pitch
        return np.stack([axial, self.radius * np.cos(angle), -self.radius * np.sin(angle)], axis=-1)

    def tangent(self, arc: Array) -> Array:
        """Return unit tangents (..., 3) at arc lengths [m]."""
        angle = 2.0 * math.pi * np.asarray(arc) * self.advance / self.pitch
        around = math.sqrt(1.0 - self.advance**2)
        along = np.full(angle.shape, self.advance)
        return np.stack([along, -around * np.sin(angle), -around * np.cos(angle)], axis=-1)

    def filament(self, count: int, ratio: float = SLENDER) -> Filament:
        """Return a polygon of equal arcs."""
        return chain(self.centre(np.linspace(0.0, self.contour, count + 1)), ratio * self.thickness)

    def tapered(self, count: int) -> Filament:
        """Return a polygon with ends as round as a spheroid's, finer towards them."""
        place = (1.0 - np.cos(np.linspace(0.0, math.pi, count + 1))) / 2.0
        middle = place[1:] + place[:-1] - 1.0
        epsilon = SLENDER * self.thickness * np.sqrt(1.0 - middle**2)
        return chain(self.centre(self.contour * place), epsilon)


@dataclass(frozen=True)
class Propulsion:
    """Drag [N s/m], thrust of rotation, torque of translation [N s] and of rotation [N m s], along x."""

    drag: float
    thrust: float
    coupled_torque: float
    torque: float

    def over(self, other: Propulsion) -> tuple[float, float, float]:
        """Relative differences of drag, thrust and torque."""
        return (
            self.drag / other.drag - 1.0,
            self.thrust / other.thrust - 1.0,
            self.torque / other.torque - 1.0,
        )


def propulsion(nodes: Array, resist: Callable[[Array], Array], spin_torque: float = 0.0) -> Propulsion:
    """Return the resistances of a rigid body along x, given forces (N, 3) at velocities (N, 3)."""
    moved = resist(np.tile(X, (len(nodes), 1)))
    turned = resist(np.cross(X, nodes))
    return Propulsion(
        drag=float(moved.sum(axis=0)[0]),
        thrust=float(turned.sum(axis=0)[0]),
        coupled_torque=float(np.cross(nodes, moved).sum(axis=0)[0]),
        torque=float(np.cross(nodes, turned).sum(axis=0)[0]) + spin_torque,
    )


def of_filament(filament: Filament, spin_torque: float = 0.0) -> Propulsion:
    """Return the resistances of a filament."""
    return propulsion(filament.nodes, filament.forces, spin_torque)


def of_model(helix: Helix, count: int, **options: Any) -> Propulsion:
    """Return the resistances of a helix by one of the fluid models of a simulation."""
    nodes = helix.filament(count).nodes
    rod = Rod(
        nodes=nodes,
        radius=helix.thickness,
        material=Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1e3),
    )
    matrix = Simulation(Scene(rods=(rod,), fluid=Fluid(viscosity=1.0, **options)), threads=1).resistance()
    return propulsion(nodes, lambda velocity: (matrix @ velocity.ravel()).reshape(-1, 3))
