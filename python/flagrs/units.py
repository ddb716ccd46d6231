"""Conversions into SI units, for the few quantities people quote in others."""

from __future__ import annotations

from typing import overload

import numpy as np
import numpy.typing as npt


@overload
def rpm(value: float) -> float: ...
@overload
def rpm(value: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]: ...
def rpm(value: float | npt.NDArray[np.float64]) -> float | npt.NDArray[np.float64]:
    """Return revolutions per minute as an angular velocity.

    Parameters
    ----------
    value
        Rotation speed [1/min], a number or an array of any shape.

    Returns
    -------
    float or ndarray
        Angular velocity [rad/s], of the same shape.

    Examples
    --------
    >>> round(rpm(60.0), 6)
    6.283185
    """
    return value * (2.0 * np.pi / 60.0)
