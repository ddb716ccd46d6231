"""A scene's scales in numbers, and what they say of units that may have been mistaken."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from flagrs.scene.scene import Scene

#: Extent [m] beyond which lengths look like millimetres: the largest soft robots are a metre long.
LARGE = 2.0
#: Viscosity [Pa s] beyond which it looks like mPa s: honey has 10, the silicone oils of robots up to 60.
THICK = 100.0
#: Gravity [m/s^2] beyond which it looks like mm/s^2, and contour over radius below which a rod is no rod.
HEAVY, STOUT = 100.0, 10.0


@dataclass(frozen=True)
class Scales:
    """A scene's scales.

    Attributes
    ----------
    extent : float
        Largest extent of the scene along an axis [m].
    slenderness : float
        Contour length over radius of the stoutest rod.
    reynolds : float
        Fluid density times rate times squared size across the axis, over viscosity, for the fastest motor or
        clamp; 0 if none is prescribed, or without a fluid.
    sperm_number : float
        Contour length times (drag across times rate over bending stiffness)^(1/4) of the softest rod at that
        rate: filaments are stiff far below 1, floppy far above; 0 as `reynolds`.
    """

    extent: float
    slenderness: float
    reynolds: float
    sperm_number: float

    def __str__(self) -> str:
        """Return the scales on one line."""
        text = f"extent {self.extent:.3g} m, slenderness {self.slenderness:.3g}"
        if self.reynolds > 0.0:
            text += f", Reynolds number {self.reynolds:.2g}, sperm number {self.sperm_number:.2g}"
        return text


def scales_of(scene: Scene) -> Scales:
    """Return the scales of a scene."""
    from flagrs.time_step import fastest_rate, size  # time_step reads scenes, so it is above this module

    lengths = [float(rod.rest_lengths().sum()) for rod in scene.rods]
    radii = [float(rod.radius_array().max()) for rod in scene.rods]
    fluid, rate = scene.fluid, fastest_rate(scene)
    reynolds = sperm = 0.0
    if fluid is not None and fluid.model != "none" and rate > 0.0:
        reynolds = fluid.density_for_inertia * rate * size(scene) ** 2 / fluid.viscosity
        for rod, length, radius in zip(scene.rods, lengths, radii, strict=True):
            if len(rod.hinge_array()):
                drag = 4.0 * np.pi * fluid.viscosity / (np.log(2.0 * max(length / radius, 1.0)) + 0.5)
                stiffness = float(np.linalg.eigvalsh(rod.EI_array()).min())
                sperm = max(sperm, length * float(drag * rate / stiffness) ** 0.25)
    return Scales(
        extent=float(np.ptp(scene.node_array(), axis=0).max()),
        slenderness=min(length / radius for length, radius in zip(lengths, radii, strict=True)),
        reynolds=reynolds,
        sperm_number=sperm,
    )


def implausible(scene: Scene, scales: Scales) -> list[str]:
    """Return what looks like a mistaken unit; a run itself warns of its Reynolds number."""
    found = []
    if scales.extent > LARGE:
        found.append(f"the scene is {scales.extent:.3g} m across: were lengths given in millimetres?")
    fluid, gravity = scene.fluid, float(np.linalg.norm(scene.gravity))
    if fluid is not None and fluid.viscosity > THICK:
        found.append(f"a viscosity of {fluid.viscosity:g} Pa s is that of tar: was it given in mPa s?")
    if gravity > HEAVY:
        found.append(f"gravity is {gravity:g} m/s^2: was it given in mm/s^2?")
    if scales.slenderness < STOUT:
        text = f"a rod is only {scales.slenderness:.2g} radii long: rods and slender-body drag want tens"
        found.append(f"{text}; was the radius given in another unit?")
    return found
