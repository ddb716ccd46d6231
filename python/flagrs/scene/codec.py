"""Scenes as plain mappings and JSON text, and back to the last bit."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flagrs.errors import FlagrsError, SceneError, faulty
from flagrs.scene.flow import CheckedFlow
from flagrs.scene.part import Part
from flagrs.scene.signal import signal_value
from flagrs.scene.values import FloatArray
from flagrs.scene.vector_signal import VectorFunction, vector_at


def refuse(path: str, function: Callable[[float], float]) -> Any:
    """Raise the error for a function of time in a scene that is to be written."""
    raise faulty(path, f"{function!r} cannot be written to a file", "a number or a flagrs.Table")


def plain(value: Any, on_function: Callable[[str, Any], Any] = refuse, path: str = "") -> Any:
    """Return a part, or a field's value, as mappings, lists and numbers; fields that are None are left out.

    Parameters
    ----------
    value
        What to convert.
    on_function
        What stands for a Python function, given the path of its field and the function.
    path
        Path of the value, for `on_function`.
    """
    if isinstance(value, Part):
        fields = {name: getattr(value, name) for name in type(value).model_fields}
        dot = "." if path else ""
        return {
            name: plain(field, on_function, f"{path}{dot}{name}")
            for name, field in fields.items()
            if field is not None
        }
    if isinstance(value, tuple):
        return [plain(item, on_function, f"{path}[{position}]") for position, item in enumerate(value)]
    if isinstance(value, np.ndarray):
        return value.tolist()
    return on_function(path, value) if callable(value) else value


def to_json(scene: Part, on_function: Callable[[str, Any], Any] = refuse) -> str:
    """Return a scene as JSON text."""
    return json.dumps(plain(scene, on_function), allow_nan=False)


def named_function(path: str, function: Any) -> Any:
    """Return what stands for a function of time where a scene is only recorded: its name."""
    return {"function": repr(function)}


def filled(data: Any, functions: Mapping[str, Any], path: str = "") -> Any:
    """Return what `plain` gave with `named_function`, with functions put in by path where they are known."""
    if isinstance(data, dict) and data.keys() == {"function"}:
        return functions[path] if path in functions else Unrecorded(data["function"])
    if isinstance(data, dict):
        dot = "." if path else ""
        return {name: filled(field, functions, f"{path}{dot}{name}") for name, field in data.items()}
    if isinstance(data, list):
        return [filled(item, functions, f"{path}[{position}]") for position, item in enumerate(data)]
    return data


def functions_of(scene: Part) -> dict[str, Callable[[float], float]]:
    """Return the Python functions of time in a scene, by the path of their field."""
    found: dict[str, Callable[[float], float]] = {}
    plain(scene, found.setdefault)
    return found


def sampled_functions_of(scene: Part) -> dict[str, Callable[[float], Any]]:
    """Return those of `functions_of` that depend on time alone, so that a record can hold samples of them."""
    return {path: value for path, value in functions_of(scene).items() if not isinstance(value, CheckedFlow)}


def sample_at(scene: Part, path: str, time: float, shape: tuple[int, ...]) -> FloatArray:
    """Return the value of the signal at a path of a scene at an instant, a number or a vector (3,)."""
    value: Any = scene
    for name, index in re.findall(r"(\w+)|\[(\d+)\]", path):
        if name:
            value = getattr(value, name)
        elif isinstance(value, tuple):
            value = value[int(index)]
        else:
            # One of three signals was a function, and all of them are something else now.
            return np.asarray(vector_at(value, time)[int(index)])
    return vector_at(value, time) if shape else np.asarray(signal_value(value, time))


def empty_samples(function: Callable[[float], Any]) -> FloatArray:
    """Return no samples of a function, of the shape that some have."""
    return np.zeros((0, 3) if isinstance(function, VectorFunction) else 0)


@dataclass(frozen=True)
class Unrecorded:
    """What stands for a background flow of which a record holds the name alone."""

    name: str

    def __call__(self, points: FloatArray, time: float) -> FloatArray:
        """Raise the error that says so."""
        raise FlagrsError(f"the background flow was {self.name}, a Python function, which no file can hold")


def from_json(text: str) -> dict[str, Any]:
    """Return the mapping in a JSON text."""
    try:
        data = json.loads(text)
    except ValueError as error:
        raise SceneError(f"not JSON: {error}") from None
    if not isinstance(data, dict):
        raise SceneError("not a scene: the JSON text holds no object")
    return data
