"""Contact geometry on plain arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from flagrs import _flagrs
from flagrs.errors import SceneError
from flagrs.scene.values import FloatArray

__all__ = ["segment_distance"]


def segment_distance(a0: Any, a1: Any, b0: Any, b1: Any) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return distances and closest points of segments, one pair or many.

    Parameters
    ----------
    a0, a1, b0, b1
        Ends of the segments, (3,) or (K, 3), broadcast against each other [m]; any length from 1e-9 m up.

    Returns
    -------
    distance, s, t : ndarray
        Distance [m] and the places in [0, 1] of the closest points ``a0 + s (a1 - a0)`` and ``b0 + t (b1 -
        b0)``; of shape () or (K,).

    Raises
    ------
    SceneError
        For arrays that are not (3,) or (K, 3), or not finite.

    Examples
    --------
    >>> distance, s, t = segment_distance([0, 0, 0], [2, 0, 0], [1, 1, -1], [1, 1, 1])
    >>> float(distance), float(s), float(t)
    (1.0, 0.5, 0.5)
    """
    try:
        ends = np.broadcast_arrays(*(np.asarray(end, dtype=np.float64) for end in (a0, a1, b0, b1)))
    except ValueError as error:
        raise SceneError(
            f"a0, a1, b0, b1: {error}", field="a0", value=a0, allowed="of shape (3,) or (K, 3)"
        ) from error
    shape = ends[0].shape
    if shape[-1:] != (3,) or len(shape) > 2:
        raise SceneError(
            f"a0: shape {shape} is not allowed; must be (3,) or (K, 3)",
            field="a0",
            value=shape,
            allowed="of shape (3,) or (K, 3)",
        )
    rows = [np.ascontiguousarray(end.reshape(-1, 3)) for end in ends]
    distance, s, t = _flagrs.segment_distance(*rows)
    return distance.reshape(shape[:-1]), s.reshape(shape[:-1]), t.reshape(shape[:-1])
