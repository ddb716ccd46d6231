"""The fields of a scene that may change between steps: signals of motors, clamps, loads, fields and flows."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from functools import reduce
from typing import Any

import numpy as np
import numpy.typing as npt

from flagrs.errors import FlagrsError, SceneError, faulty, not_allowed, unknown_option
from flagrs.scene import (
    Clamp,
    FlowFunction,
    LinearFlow,
    LineLoad,
    MagneticField,
    Motor,
    PointLoad,
    PoiseuilleFlow,
    Rotation,
    Scene,
    codec,
)
from flagrs.scene.part import Part, different
from flagrs.scene.values import FloatArray

#: What may change, of every kind of part.
CHANGEABLE: dict[type[Part], tuple[str, ...]] = {
    Motor: ("speed", "torque"),
    Clamp: ("velocity", "displacement", "angular_velocity"),
    Rotation: ("rate", "angle"),
    PointLoad: ("force", "torque"),
    LineLoad: ("force", "torque"),
    MagneticField: ("field",),
    LinearFlow: ("velocity", "strength"),
    PoiseuilleFlow: ("speed",),
    FlowFunction: ("function",),
}

#: Part of a record for a clamp's center, which follows from what it was before a change and cannot be set.
CENTER = "center"

#: Address in the repr of a Python function, which another process has elsewhere.
_ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")


def parts_of(scene: Scene) -> dict[str, Part]:
    """Return the parts with fields that may change, by path: ``motors[0]``, ``clamps[1].rotation``."""
    flows = () if scene.fluid is None else scene.fluid.background
    listed = {"motors": scene.motors, "clamps": scene.clamps, "loads": scene.loads, "fluid.background": flows}
    found: dict[str, Part] = {
        f"{name}[{k}]": part for name, parts in listed.items() for k, part in enumerate(parts)
    }
    turning = {
        f"clamps[{k}].rotation": clamp.rotation for k, clamp in enumerate(scene.clamps) if clamp.rotation
    }
    if scene.magnetic_field is not None:
        found["magnetic_field"] = scene.magnetic_field
    return found | turning


def changed(scene: Scene, path: str, value: Any, given: Scene) -> Scene:
    """Return a scene with another value at a path such as ``motors[0].speed``; itself if it is no other.

    Parameters
    ----------
    scene
        The scene of the moment.
    path, value
        What changes.
    given
        The scene that the equations were made from: they hold the forces and torques of its loads.

    Raises
    ------
    SceneError
        If nothing that may change is there, or the value is not allowed.
    """
    place, _, name = path.rpartition(".")
    parts = parts_of(scene)
    if place not in parts:
        raise unknown_option(
            path, [f"{at}.{name}" for at, part in parts.items() for name in _fields(part)], value
        )
    part = parts[place]
    if name not in _fields(part):
        raise unknown_option(path, [f"{place}.{field}" for field in _fields(part)], value)
    try:
        new = part.replace(**{name: value})
    except SceneError as error:
        raise error.within(place) from None
    if not different(getattr(part, name), getattr(new, name)):
        return scene
    _refuse_new_load(parts_of(given)[place], path, name)
    return _with_part(scene, place, new)


def _fields(part: Part) -> tuple[str, ...]:
    names = CHANGEABLE[type(part)]
    return (part.drive,) if isinstance(part, Motor) else names


def _refuse_new_load(part: Part, path: str, name: str) -> None:
    """Refuse a force or torque of a load that the equations of the simulation do not hold."""
    if isinstance(part, PointLoad | LineLoad) and name not in part.acting:
        other = "a force" if name == "torque" else "a torque"
        raise faulty(
            path,
            f"the load was made as {other} alone",
            "given in the scene already, if only as a Table of zeros",
        )


def _with_part(scene: Scene, place: str, new: Part) -> Scene:
    """Return a scene with another part, validated by itself: nothing between parts depends on signals."""
    first, *rest = re.findall(r"(\w+)(?:\[(\d+)\])?", place)
    whole: Scene = _put(scene, [first, *rest], new)
    return whole


def _put(part: Any, steps: list[tuple[str, str]], new: Part) -> Any:
    if not steps:
        return new
    (name, index), *rest = steps
    value = getattr(part, name)
    if index:
        k = int(index)
        value = (*value[:k], _put(value[k], rest, new), *value[k + 1 :])
    else:
        value = _put(value, rest, new)
    return part.model_copy(update={name: value})


def recorded(scene: Scene) -> npt.NDArray[np.uint8]:
    """Return all that may change as bytes of JSON text, with names in place of Python functions."""
    values = {
        f"{place}.{name}": codec.plain(getattr(part, name), codec.named_function, f"{place}.{name}")
        for place, part in parts_of(scene).items()
        for name in (*_fields(part), *([CENTER] if isinstance(part, Rotation) else []))
    }
    return np.frombuffer(json.dumps(values, allow_nan=False).encode(), dtype=np.uint8).copy()


def values_in(record: npt.NDArray[Any]) -> dict[str, Any]:
    """Return what `recorded` wrote, by path; nothing for an empty record.

    Raises
    ------
    SceneError
        If it is no such record.
    """
    if not record.size:
        return {}
    try:
        values = json.loads(record.astype(np.uint8).tobytes().decode())
    except ValueError:
        values = None
    if not isinstance(values, dict):
        raise not_allowed("state.inputs", "no record of inputs", "what state() returned")
    return values


def applied(scene: Scene, values: Mapping[str, Any], given: Scene) -> Scene:
    """Return a scene with recorded values; functions are those the scene has at their places.

    Raises
    ------
    FlagrsError
        If a function was recorded that the scene does not have there.
    """
    functions = codec.functions_of(scene)
    for path, value in values.items():
        for at, function in _functions_in(value, path):
            found = repr(functions[at]) if at in functions else "none"
            if _ADDRESS.sub("", found) != _ADDRESS.sub("", function):
                raise FlagrsError(
                    f"{at} was the Python function {function}, which no state can hold; the scene has "
                    f"{found}: give the scene as it was then"
                )
        filled = codec.filled(value, functions, path)
        place, _, name = path.rpartition(".")
        if name == CENTER:
            part = parts_of(scene)[place]
            scene = _with_part(scene, place, part.replace(center=filled))
        else:
            scene = changed(scene, path, _of_kind(filled), given)
    return scene


def resumed(record: npt.NDArray[Any], present: Scene, given: Scene) -> Scene:
    """Return the scene with the inputs of a record: an empty one stands for those of the given scene.

    Functions are those of the present scene, or else of the given one.
    """
    values = values_in(record)
    if not values:
        return given
    try:
        return applied(present, values, given)
    except FlagrsError:
        return applied(given, values, given)


def turning_clamp_that_moves(path: str, scene: Scene) -> int | None:
    """Return the clamp that a change at a path shifts if it has a rotation, whose axis moves along."""
    found = re.fullmatch(r"clamps\[(\d+)\]\.(velocity|displacement)", path)
    if found is None or scene.clamps[int(found[1])].rotation is None:
        return None
    return int(found[1])


def with_center_shifted(scene: Scene, clamp: int, shift: FloatArray) -> Scene:
    """Return a scene in which the axis of a clamp's rotation lies elsewhere by a vector (3,) [m]."""
    place = f"clamps[{clamp}].rotation"
    rotation = scene.clamps[clamp].rotation
    if rotation is None:
        return scene
    return _with_part(scene, place, rotation.replace(center=rotation.center + shift))


def _of_kind(value: Any) -> Any:
    """Return a list of three signals as the tuple it was; everything else validates by itself."""
    return tuple(value) if isinstance(value, list) and any(callable(item) for item in value) else value


def _functions_in(value: Any, path: str) -> list[tuple[str, str]]:
    """Return path and name of every function in a recorded value."""
    if isinstance(value, dict) and value.keys() == {"function"}:
        return [(path, value["function"])]
    if isinstance(value, dict):
        return [found for name, item in value.items() for found in _functions_in(item, f"{path}.{name}")]
    if isinstance(value, list):
        return [found for k, item in enumerate(value) for found in _functions_in(item, f"{path}[{k}]")]
    return []


def put_into(data: Any, values: Mapping[str, Any]) -> Any:
    """Return a scene's plain mapping, as `codec.plain` gives it, with recorded values in it."""
    data = json.loads(json.dumps(data))
    for path, value in values.items():
        place, _, name = path.rpartition(".")
        steps = re.findall(r"(\w+)(?:\[(\d+)\])?", place)
        keys = [key for step, index in steps for key in ([step, int(index)] if index else [step])]
        reduce(lambda part, key: part[key], keys, data)[name] = value
    return data
