"""Checks of what a simulation is given besides its scene: arrays of shapes and states, and the scheme."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from flagrs.errors import SceneError, not_allowed
from flagrs.scene import Scene
from flagrs.scene.values import FloatArray

#: Schemes in time; see docs/theory/time.md.
SCHEMES = ("overdamped", "implicit", "explicit")


def state_part(name: str, value: Any, like: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return an array of a state as the core takes it."""
    array = np.asarray(value)
    if array.dtype != like.dtype or array.ndim != like.ndim:
        found = f"{array.ndim}-dimensional {array.dtype}"
        raise not_allowed(f"state.{name}", found, f"{like.ndim}-dimensional {like.dtype}")
    return array


def real_array(field: str, value: Any, dimensions: int) -> FloatArray:
    """Return numbers with so many dimensions, or refuse the field."""
    try:
        array = np.ascontiguousarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise not_allowed(field, value, f"numbers in {dimensions} dimensions") from None
    if np.iscomplexobj(value):
        raise not_allowed(field, value, "real numbers")
    if array.ndim != dimensions:
        raise SceneError(
            f"{field}: shape {np.shape(value)} is not allowed; must have {dimensions} dimensions",
            field=field,
            value=value,
            allowed=f"{dimensions} dimensions",
        )
    return array


def check_scheme(scene: Scene, scheme: str) -> None:
    """Refuse a scheme that is unknown, or one without inertia for a scene without drag."""
    if scheme not in SCHEMES:
        raise not_allowed("scheme", scheme, f"one of {', '.join(SCHEMES)}")
    if scheme != "overdamped":
        return
    wet = scene.fluid is not None and scene.fluid.model != "none"
    if not wet or not any(rod.immersed_array().any() for rod in scene.rods):
        raise SceneError(
            "scheme: overdamped is not allowed without a fluid; must be implicit, or the scene needs a "
            "fluid with a model that resists motion",
            field="scheme",
            value=scheme,
            allowed="implicit or explicit for a scene without drag",
        )
