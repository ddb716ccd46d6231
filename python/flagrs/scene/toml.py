"""Scenes as TOML files, written in full or as a scenario with parameters."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import tomli_w

from flagrs.errors import SceneError, faulty, not_allowed, unknown_option
from flagrs.scene.codec import plain
from flagrs.scene.material import Material
from flagrs.scene.rod import Rod
from flagrs.scene.scene import Scene

_SHAPES: dict[str, Callable[..., Rod]] = {"helix": Rod.helix, "straight": Rod.straight}


def write(scene: Scene, path: Path) -> None:
    """Write a scene to a TOML file."""
    path.write_text(tomli_w.dumps(plain(scene)), encoding="utf-8")


def read(path: Path, changes: Mapping[str, Any] | None = None) -> Scene:
    """Return the scene in a TOML file.

    Parameters
    ----------
    path
        The file.
    changes
        Values that replace fields of the file, or parameters of its scenario, by dotted path with list
        positions as numbers: ``fluid.viscosity``, ``motors.0.speed``.

    Raises
    ------
    SceneError
        If the file is not TOML, or does not describe a scene.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SceneError(f"{path}: not a TOML file: {error}") from None
    if "scenario" in data:
        return _from_scenario(data, changes or {})
    return from_mapping(changed(data, changes or {}))


def from_mapping(data: Mapping[str, Any]) -> Scene:
    """Return the scene a mapping describes, with rods given by their fields or by a shape's arguments."""
    rods = data.get("rods")
    if isinstance(rods, list):
        data = {**data, "rods": [_rod(entry, f"rods[{number}]") for number, entry in enumerate(rods)]}
    return Scene(**data)


def _from_scenario(data: dict[str, Any], changes: Mapping[str, Any]) -> Scene:
    from flagrs import scenarios  # the scenarios are built from scenes

    for key in data.keys() - {"scenario", "parameters"}:
        raise unknown_option(key, ["scenario", "parameters"], data[key])
    return scenarios.build(data["scenario"], changed(data.get("parameters", {}), changes))


def _rod(entry: Any, path: str) -> Any:
    """Return the rod of an entry with a shape; other entries are left to the scene."""
    if not isinstance(entry, dict) or "shape" not in entry:
        return entry
    options = {name: value for name, value in entry.items() if name != "shape"}
    make = _SHAPES.get(entry["shape"])
    if make is None:
        raise not_allowed(f"{path}.shape", entry["shape"], " or ".join(repr(shape) for shape in _SHAPES))
    try:
        if isinstance(options.get("material"), dict):
            options["material"] = _material(options["material"])
        return make(**options)
    except SceneError as error:
        raise error.within(path) from None
    except TypeError as error:
        # Python's own words for a missing argument name it: "... required keyword-only argument: 'pitch'".
        raise faulty(path, str(error).partition("() ")[2], f"the arguments of Rod.{entry['shape']}") from None


def _material(fields: dict[str, Any]) -> Material:
    try:
        return Material(**fields)
    except SceneError as error:
        raise error.within("material") from None


def changed(data: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of a mapping with values changed by dotted path, such as ``fluid.viscosity``."""
    copy = deepcopy(dict(data))
    for dotted, value in changes.items():
        _change(copy, dotted, value)
    return copy


def _change(data: dict[str, Any], dotted: str, value: Any) -> None:
    """Set the value at a dotted path, which must lead through what is there already."""
    *way, last = dotted.split(".")
    place: Any = data
    for step in way:
        place = _enter(place, step, dotted)
    if isinstance(place, list):
        _enter(place, last, dotted)
        place[int(last)] = value
    elif isinstance(place, dict):
        place[last] = value
    else:
        raise faulty(dotted, f"{last!r} is inside a plain value", "a path into the scene")


def _enter(place: Any, step: str, dotted: str) -> Any:
    if isinstance(place, dict):
        return place.setdefault(step, {})
    if isinstance(place, list) and step.isdigit() and int(step) < len(place):
        return place[int(step)]
    raise faulty(dotted, f"no {step!r} there", "a path into the scene")
