"""The rod most problems use: soft, straight, clamped at the origin, with loads given without dimensions."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flagrs.scene import Clamp, Fluid, Material, PointLoad, Rod, Scene
from flagrs.scene.values import FloatArray

LENGTH = 0.1
RADIUS = 1e-3
MATERIAL = Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
#: Stiffnesses of a solid circular section: bending, twisting [N m^2] and stretching [N].
EI = 1e6 * math.pi * RADIUS**4 / 4.0
GJ = EI / 1.5
EA = 1e6 * math.pi * RADIUS**2
#: Weight per length at 1 m/s^2 [N/m].
LINE_DENSITY = 1200.0 * math.pi * RADIUS**2
#: EI / (EA L^2).
COMPLIANCE = EI / (EA * LENGTH**2)
#: Factor on EA where theory has an inextensible rod: what is left of stretching is 1e-4 of 2.5e-5.
STIFFENING = 1e4

#: Drag per length across a rod by Gray and Hancock, of wavelength L, and drag on its spin, at 1 Pa s.
DRAG = 4.0 * math.pi / (math.log(2.0 * LENGTH / RADIUS) + 0.5)
SPIN_DRAG = 4.0 * math.pi * RADIUS**2

_VISCOUS = Fluid(viscosity=1.0, model="RFT", wavelength=LENGTH, density=0.0)


@dataclass(frozen=True)
class ClampedRod:
    """A rod along x from the wall at x = 0, of `edge_count` edges beyond the clamped one.

    The clamped edge reaches half an edge to either side of the wall: an edge's direction belongs to its
    middle.

    Attributes
    ----------
    edge_count
        Edges beyond the clamped one.
    tip_force
        Force (3,) on the tip, in units of EI / L^2.
    weight
        Weight per length (3,), in units of EI / L^3.
    EI_matrix
        Bending stiffness towards z and towards y over EI, for sections that are not round.
    stretching
        Factor on EA.
    """

    edge_count: int
    tip_force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    weight: tuple[float, float, float] = (0.0, 0.0, 0.0)
    EI_matrix: tuple[float, float] = (1.0, 1.0)
    stretching: float = 1.0

    @property
    def edge(self) -> float:
        """Length of an edge [m]."""
        return LENGTH / (self.edge_count + 0.5)

    def nodes(self) -> FloatArray:
        """Return the nodes (edge_count + 2, 3) at rest [m]."""
        along = self.edge * (np.arange(self.edge_count + 2) - 0.5)
        return np.stack([along, np.zeros_like(along), np.zeros_like(along)], axis=1)

    def scene(self) -> Scene:
        """Return the scene, in a fluid of 1 Pa s with resistive forces."""
        rod = Rod(
            nodes=self.nodes(),
            radius=RADIUS,
            material=MATERIAL,
            EI=EI * np.diag(self.EI_matrix),
            GJ=GJ,
            EA=EA * self.stretching,
            director=np.array([0.0, 0.0, 1.0]),
        )
        force = np.array(self.tip_force) * EI / LENGTH**2
        return Scene(
            rods=(rod,),
            fluid=_VISCOUS,
            clamps=(Clamp(nodes=(0, 1), edges=(0,)),),
            loads=(PointLoad(node=self.edge_count + 1, force=force),) if force.any() else (),
            gravity=np.array(self.weight) * EI / LENGTH**3 / LINE_DENSITY,
            name="clamped rod",
        )


def edge_lengths(edge_counts: tuple[int, ...]) -> FloatArray:
    """Return the edge lengths (K,) of these meshes over L."""
    return 1.0 / (np.array(edge_counts, dtype=float) + 0.5)
