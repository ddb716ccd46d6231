"""Conversions into SI units of quantities that people quote in others, and units that sizes read best in."""

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


#: Factors and the prefixes that stand for them.
_PREFIXES = ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"), (1e12, "p"), (1e15, "f"), (1e18, "a"))


def prefixed(size: float, unit: str) -> tuple[float, str]:
    """Return factor and name of the unit in which a size reads best: 1000 and mm for 2e-3 m.

    Parameters
    ----------
    size
        The largest size that is shown, in the plain unit; below a thousandth of an attounit it stays plain.
    unit
        The plain unit, such as ``N m``.
    """
    for factor, prefix in _PREFIXES:
        if size * factor >= 1.0:
            return factor, prefix + unit
    return 1.0, unit
