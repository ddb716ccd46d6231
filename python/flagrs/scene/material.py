"""The material of a rod: linear, isotropic, homogeneous."""

from __future__ import annotations

from typing import Annotated

from flagrs.scene.part import Part
from flagrs.scene.values import Bounds, number

YOUNGS_MODULUS = Bounds(
    "Pa", at_least=100.0, at_most=1e13, if_small="given in MPa or GPa?", if_large="given in mPa?"
)
DENSITY = Bounds("kg/m^3", at_least=1.0, at_most=3e4, if_small="given in g/cm^3?", if_large="given in g/m^3?")


class Material(Part):
    """A linear elastic material.

    Attributes
    ----------
    youngs_modulus : float
        Young's modulus [Pa], 100 to 1e13.
    poisson_ratio : float
        Poisson's ratio, above -1 and up to 0.5 (incompressible, the default).
    density : float
        Mass density [kg/m^3], 1 to 3e4.

    Examples
    --------
    >>> Material(youngs_modulus=1.255e6, density=1260.0).shear_modulus
    418333.3333333333
    """

    youngs_modulus: Annotated[float, number(YOUNGS_MODULUS)]
    poisson_ratio: Annotated[float, number(Bounds("1", above=-1.0, at_most=0.5))] = 0.5
    density: Annotated[float, number(DENSITY)]

    @property
    def shear_modulus(self) -> float:
        """Shear modulus E / (2 (1 + nu)) [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))
