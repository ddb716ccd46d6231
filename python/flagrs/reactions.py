"""What clamps exert on the filaments they hold."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flagrs.errors import FlagrsError, not_allowed
from flagrs.scene.values import FloatArray


class Reaction(NamedTuple):
    """What a clamp exerts on its filament, at an instant or at T of them.

    Attributes
    ----------
    force : ndarray
        Force (3,) or (T, 3) [N].
    torque : ndarray
        Torque (3,) or (T, 3) about the clamp's first node, wherever that is at the time [N m].
    power : ndarray
        Power () or (T,) that the clamp spends [W].
    """

    force: FloatArray
    torque: FloatArray
    power: FloatArray


def reaction_of(clamp: int, force: FloatArray, torque: FloatArray, power: FloatArray) -> Reaction:
    """Return the reaction of one clamp.

    Parameters
    ----------
    clamp
        Its index in the scene.
    force, torque, power
        Of all C clamps: (..., C, 3) [N], (..., C, 3) [N m] and (..., C) [W].

    Raises
    ------
    SceneError
        If there is no such clamp.
    FlagrsError
        If they were not recorded.
    """
    count = power.shape[-1]
    whole = isinstance(clamp, int | np.integer) and not isinstance(clamp, bool)
    if not whole or not 0 <= clamp < count:
        allowed = f"a whole number from 0 to {count - 1}" if count else "left alone: the scene has no clamps"
        raise not_allowed("clamp", clamp, allowed)
    if np.isnan(power[..., clamp]).any():
        raise FlagrsError("no reactions: the file was written by an older flagrs, which did not record them")
    return Reaction(force[..., clamp, :], torque[..., clamp, :], power[..., clamp])
