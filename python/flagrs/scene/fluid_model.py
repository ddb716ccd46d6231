"""The fluid around the rods, and which model of its drag is used."""

from __future__ import annotations

import math
import warnings
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import PlainValidator, field_validator

from flagrs.errors import not_allowed
from flagrs.scene.flow import Flow, flow_of
from flagrs.scene.part import Part
from flagrs.scene.values import Array, Bounds, Flag, FloatArray, index, number, optional_number

#: Regularization over rod radius, by name: matching slender-body theory, and Lim et al.'s choice.
EPSILON_RATIO = {"slender": math.sqrt(math.e), "lim-et-al": 1.031}

#: Names that regularizations had before.
FORMER_NAMES = {"seed": "lim-et-al"}

#: Immersed nodes from which on a step takes less time without the segments' matrix (docs/performance.md).
CROSSOVER = 500

#: Density of water, for the Reynolds number where no other is given [kg/m^3].
WATER = 1000.0

_length = Array(((),), Bounds("m", above=0.0))


def _epsilon(value: Any) -> Any:
    if isinstance(value, str):
        name = FORMER_NAMES.get(value, value)
        if name not in EPSILON_RATIO:
            raise not_allowed("", value, "'slender', 'lim-et-al' or a length > 0 m")
        if name != value:
            warnings.warn(
                f"epsilon={value!r} is now called {name!r}; the former name will go in version 1.0",
                DeprecationWarning,
                stacklevel=2,
            )
        return name
    return _length(value)


def _count(value: Any) -> int | None:
    return None if value is None else index(value)


class Fluid(Part):
    """A Newtonian fluid at zero Reynolds number.

    Attributes
    ----------
    viscosity : float
        Dynamic viscosity [Pa s], above 0 and up to 1e4.
    model : str
        ``RSS`` regularized Stokeslet segments (nonlocal), ``RFT`` resistive force theory (local), or
        ``none``.
    epsilon : str or float
        Regularization of the segments: ``slender`` is sqrt(e) times the rod's radius, which matches
        slender-body theory; ``lim-et-al`` is 1.031 times the radius, as in Lim et al.
        (docs/bibliography.md), and was called ``seed`` before; or a length [m].
    twist_drag : bool
        Whether a filament spinning about its own centreline is resisted, by 4 pi mu a^2 per unit length.
    coefficients : str
        Drag coefficients of resistive force theory: ``gray-hancock`` or ``lighthill``.
    wavelength : float or None
        Wavelength of the filaments for these coefficients [m]: the pitch of a helix for ``gray-hancock``, the
        arc length of a turn for ``lighthill``. None: the immersed length of each rod, for straight ones.
    far_field_error : float
        Largest error of the product of the mobility with a force density, relative to its largest component,
        where it is made by the fast multipole method: 1e-9 to 0.1.
    far_field_nodes : int or None
        Immersed nodes from which on the method is used and the dense matrix of the segments is never formed;
        0: always. None: 500, where a step takes the same time either way.
    density : float or None
        Density of the fluid [kg/m^3], for buoyancy under gravity (where it must be given; 0: no buoyancy) and
        for the Reynolds number that a run watches. None: 1000, that of water, for the latter.
    background : sequence of flows
        Flows there are without the filaments, which add up: `LinearFlow`, `PoiseuilleFlow`, `FlowFunction`. A
        single one may stand for a list of one. Drag acts on velocities relative to them.
    """

    viscosity: Annotated[float, number(Bounds("Pa s", above=0.0, at_most=1e4, if_large="given in mPa s?"))]
    model: Literal["RSS", "RFT", "none"] = "RSS"
    epsilon: Annotated[Literal["slender", "lim-et-al"] | float, PlainValidator(_epsilon)] = "slender"
    twist_drag: Flag = True
    coefficients: Literal["gray-hancock", "lighthill"] = "gray-hancock"
    wavelength: Annotated[float | None, optional_number(Bounds("m", above=0.0))] = None
    far_field_error: Annotated[float, number(Bounds("1", at_least=1e-9, at_most=0.1))] = 1e-6
    far_field_nodes: Annotated[int | None, PlainValidator(_count)] = None
    density: Annotated[float | None, optional_number(Bounds("kg/m^3", at_least=0.0, at_most=3e4))] = None

    @property
    def density_for_buoyancy(self) -> float:
        """Density that gravity acts on [kg/m^3]."""
        return 0.0 if self.density is None else self.density

    @property
    def density_for_inertia(self) -> float:
        """Density of the Reynolds number [kg/m^3]."""
        return WATER if self.density is None else self.density

    background: tuple[Flow, ...] = ()

    @field_validator("background", mode="before")
    @classmethod
    def _kinds_of_flow(cls, value: Any) -> Any:
        """Let a single flow stand for a list of one, and tell the kinds apart."""
        listed = (value,) if isinstance(value, Part | dict) else value
        return tuple(map(flow_of, listed)) if isinstance(listed, list | tuple) else listed

    @property
    def crossover(self) -> int:
        """Immersed nodes from which on the segments' matrix is never formed."""
        return CROSSOVER if self.far_field_nodes is None else self.far_field_nodes

    def epsilon_array(self, radius: FloatArray) -> FloatArray:
        """Return the regularization of each edge.

        Parameters
        ----------
        radius
            Radius (E,) of each edge [m].

        Returns
        -------
        ndarray
            Regularization (E,) [m].
        """
        if isinstance(self.epsilon, str):
            return EPSILON_RATIO[self.epsilon] * radius
        return np.full(radius.shape, self.epsilon)
