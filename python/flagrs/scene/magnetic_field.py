"""Magnetic fields that turn and pull magnetised rods."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field, PlainValidator, model_validator

from flagrs.errors import not_allowed
from flagrs.scene.part import Part
from flagrs.scene.values import Array, Bounds, FloatArray, read_only
from flagrs.scene.vector_signal import CheckedVectorSignal, VectorInput

#: How far a gradient may be from that of a field without sources, relative to its largest entry.
SOURCE_FREE = 1e-6


class MagneticField(Part):
    """A magnetic field ``B(x, t) = B0(t) + G x``, felt by rods with a magnetization.

    An edge with moment ``m`` feels the torque ``m x B`` at its midpoint and the force ``G^T m``.

    Attributes
    ----------
    field : vector, Table of vectors, or function of time
        Field (3,) at the origin [T].
    gradient : ndarray
        Gradient (3, 3), ``dB_i/dx_j`` [T/m]; symmetric and without trace, as a field without sources has it.

    Examples
    --------
    >>> import math
    >>> rotating = MagneticField(field=lambda t: (1e-3 * math.cos(t), 1e-3 * math.sin(t), 0.0))
    """

    if TYPE_CHECKING:
        # What the constructor takes, which is more than the fields hold.
        def __init__(
            self,
            *,
            field: VectorInput,
            gradient: npt.ArrayLike = ...,
        ) -> None: ...

    field: CheckedVectorSignal
    gradient: Annotated[FloatArray, PlainValidator(Array(((3, 3),), Bounds("T/m")))] = Field(
        default_factory=lambda: read_only(np.zeros((3, 3)))
    )

    @model_validator(mode="after")
    def _check(self) -> MagneticField:
        gradient = self.gradient
        allowed = SOURCE_FREE * float(np.abs(gradient).max())
        if np.abs(gradient - gradient.T).max() > allowed:
            raise not_allowed("gradient", gradient.tolist(), "symmetric, as without currents")
        if abs(float(np.trace(gradient))) > 3.0 * allowed:
            raise not_allowed("gradient", gradient.tolist(), "without trace, as without sources")
        return self
