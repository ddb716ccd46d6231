"""Which steps a simulation makes: adaptive ones that keep to a relative error, or fixed ones."""

from __future__ import annotations

from typing import Literal

from flagrs.errors import SceneError, not_allowed
from flagrs.scene.shapes import number
from flagrs.scene.values import Bounds

#: Relative error that steps keep to when neither it nor their length is asked for.
DEFAULT_RTOL = 1e-3

#: A relative error, None for fixed steps, or "auto" for the choice of `chosen_rtol`.
RelativeError = float | Literal["auto"] | None


def chosen_rtol(rtol: RelativeError, dt: float | None, scheme: str) -> float | None:
    """Return the relative error of adaptive steps; None for fixed steps.

    ``auto`` is `DEFAULT_RTOL`, unless `dt` asks for fixed steps or the scheme is the explicit one, which has
    no others.

    Raises
    ------
    SceneError
        If `rtol` is out of range, or asked of the explicit scheme.
    """
    if isinstance(rtol, str):
        if rtol != "auto":
            raise not_allowed("rtol", rtol, "a number from 1e-8 to 0.1, None or 'auto'")
        return DEFAULT_RTOL if dt is None and scheme != "explicit" else None
    if rtol is None:
        return None
    error = number("rtol", rtol, Bounds("1", at_least=1e-8, at_most=0.1))
    if scheme == "explicit":
        raise SceneError(
            f"rtol: {rtol} is not allowed with the explicit scheme; must be None",
            field="rtol",
            value=rtol,
            allowed="None with the explicit scheme",
        )
    return error


def steps_in_words(rtol: float | None, dt: float | None) -> str:
    """Return what steps are, for a person to read; without a length, the default one."""
    if rtol is not None:
        return f"adaptive steps, rtol = {rtol:g}"
    return "fixed steps of the default length" if dt is None else f"fixed steps of {dt:.3g} s"
