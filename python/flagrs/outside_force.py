"""Forces from a Python function, asked at the beginning of every step."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from flagrs.errors import SceneError, not_allowed
from flagrs.scene.values import FloatArray

#: What a force function may give besides forces.
PARTS = ("forces", "torques", "stiffness")

ForceFunction = Callable[[float, FloatArray, FloatArray, FloatArray], Any]


class OutsideForce:
    """A force function whose answers are checked before the core takes them.

    Parameters
    ----------
    function
        Called with the time [s], nodes (N, 3) [m], velocities (N, 3) [m/s] and directors (E, 3, 3), rows
        ``m1, m2, t``; returns forces (N, 3) [N], or a mapping with ``forces`` and, where there are any,
        ``torques`` (E, 3) on edges [N m] and ``stiffness`` (N, 3, 3) [N/m].
    node_count, edge_count
        Numbers of nodes and edges of the scene.
    """

    def __init__(self, function: ForceFunction, node_count: int, edge_count: int) -> None:
        if not callable(function):
            raise not_allowed("force", function, "a function of time, nodes, velocities and directors")
        self._function = function
        self._shapes = {
            "forces": (node_count, 3),
            "torques": (edge_count, 3),
            "stiffness": (node_count, 3, 3),
        }

    def __call__(
        self, time: float, nodes: FloatArray, velocities: FloatArray, directors: FloatArray
    ) -> tuple[FloatArray, FloatArray | None, FloatArray | None]:
        """Return forces, torques and stiffness; raise SceneError if the function gave anything else."""
        try:
            answer = self._function(time, nodes, velocities, directors)
        except Exception as error:
            error.add_note(f"raised by the force function {self._function!r} at t = {time:g} s")
            raise
        parts = answer if isinstance(answer, Mapping) else {"forces": answer}
        unknown = parts.keys() - set(PARTS)
        if unknown or "forces" not in parts:
            raise self._fault(time, sorted(map(str, parts)), f"forces, and perhaps {' and '.join(PARTS[1:])}")
        forces = self._array("forces", parts["forces"], time)
        torques, stiffness = (
            None if parts.get(name) is None else self._array(name, parts[name], time) for name in PARTS[1:]
        )
        return forces, torques, stiffness

    def _array(self, name: str, value: Any, time: float) -> FloatArray:
        shape = self._shapes[name]
        try:
            array = np.ascontiguousarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise self._fault(time, value, f"{name} of shape {shape}") from None
        if array.shape != shape:
            raise self._fault(time, f"{name} of shape {array.shape}", f"{name} of shape {shape}")
        if not np.isfinite(array).all():
            worst = int(np.argmin(np.isfinite(array).reshape(shape[0], -1).all(axis=1)))
            raise self._fault(time, f"{name}[{worst}] = {array[worst].tolist()}", "finite numbers")
        return array

    def _fault(self, time: float, value: Any, allowed: str) -> SceneError:
        return SceneError(
            f"force: {self._function!r} gave {value!r} at t = {time:g} s; must be {allowed}",
            field="force",
            value=value,
            allowed=allowed,
        )
