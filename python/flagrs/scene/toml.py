"""Scenes as TOML files, written in full or as a scenario with parameters."""

from __future__ import annotations

import errno
import inspect
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import tomli_w

from flagrs.errors import (
    FileMissingError,
    FlagrsError,
    SceneError,
    combined,
    faulty,
    file_error,
    not_allowed,
    unknown_option,
)
from flagrs.scene.codec import plain
from flagrs.scene.material import Material
from flagrs.scene.part import field_errors
from flagrs.scene.rod import Rod
from flagrs.scene.scene import Scene
from flagrs.scene.toml_lines import line_of, lines_of

#: Largest file [bytes], and deepest nesting of tables and lists in one: a scene has rods, nodes, coordinates.
LARGEST_FILE = 1 << 26
DEEPEST = 16

_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
_DEEP_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]{{0,8}}\.[ \t]{{0,8}}{_PART}){{{DEEPEST}}}")

#: Stands for a material that is wrong, so that what else is wrong can be found.
_ANY_MATERIAL = Material(youngs_modulus=1e6, density=1e3)

_SHAPES: dict[str, Callable[..., Rod]] = {"helix": Rod.helix, "straight": Rod.straight}


def write(scene: Scene, path: Path) -> None:
    """Write a scene to a TOML file."""
    text = tomli_w.dumps(plain(scene))
    try:
        path.write_text(text, encoding="utf-8")
    except (OSError, ValueError) as error:
        raise file_error(path, error, "cannot be written") from None


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
    FileError
        If it cannot be read; an `OSError`.
    """
    text, data = _parsed(path)
    try:
        if "scenario" in data:
            return _from_scenario(data, changes or {})
        return from_mapping(changed(data, changes or {}))
    except SceneError as error:
        raise _with_lines(error, path, lines_of(text), changes or {}) from None


def _with_lines(
    error: SceneError, path: Path, lines: dict[str, int], changes: Mapping[str, Any]
) -> SceneError:
    """Return an error whose problems say on which line of a file they are, in the order of the file."""
    by_line = []
    for part in error.errors:
        field = part.field or ""
        # A scenario's parameters stand in a table of their own.
        line = line_of(lines, field) or line_of(lines, f"parameters.{field}")
        line = None if _is_changed(field, changes) else line
        message = str(part) if line is None else f"line {line}: {part}"
        same = SceneError(message, field=part.field, value=part.value, allowed=part.allowed)
        by_line.append((line or 0, same))
    parts = [part for _, part in sorted(by_line, key=lambda pair: pair[0])]
    if len(parts) == 1:
        only = parts[0]
        where = f"{path}, {only}" if str(only).startswith("line ") else f"{path}: {only}"
        return SceneError(where, field=only.field, value=only.value, allowed=only.allowed)
    listed = "\n".join(f"  {part}" for part in parts)
    return SceneError(f"{path}: {len(parts)} problems:\n{listed}", errors=parts)


def _is_changed(field: str, changes: Mapping[str, Any]) -> bool:
    """Return whether a field was given from outside the file: ``clamps[0].nodes`` by ``clamps.0.nodes``."""
    dotted = _dotted(field)
    given = [_dotted(change) for change in changes]
    return any(dotted == change or dotted.startswith(f"{change}.") for change in given)


def _parsed(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the text and the tables of a TOML file, after checking their size, depth and numbers."""
    try:
        if not path.is_file():
            raise FileMissingError(path, "no such file" if not path.exists() else "not a file", errno.ENOENT)
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise SceneError(f"{path}: {size} bytes; must be at most {LARGEST_FILE}")
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise SceneError(f"{path}: not a TOML file: {error}") from None
    except (OSError, ValueError) as error:
        if isinstance(error, FlagrsError):
            raise
        raise file_error(path, error, "cannot be read") from None
    if _DEEP_KEY.search(text):  # parsing it would take minutes
        raise SceneError(f"{path}: a key of more than {DEEPEST} levels")
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{path}: not a TOML file: {error}") from None
    except RecursionError:
        raise SceneError(f"{path}: nested deeper than {DEEPEST} levels") from None
    except ValueError as error:  # numbers of thousands of digits, dates that do not exist
        raise SceneError(f"{path}: a value that cannot be: {error}") from None
    _check_values(data, "")
    return text, data


def _check_values(value: Any, path: str, depth: int = 0) -> None:
    """Raise SceneError for what TOML can say and no scene can: huge integers, dates, odd names."""
    if depth > DEEPEST:
        raise SceneError(f"{path[:80]}: nested deeper than {DEEPEST} levels")
    if isinstance(value, dict):
        for key, item in value.items():
            if not key.isidentifier() or key == "self":
                raise unknown_option(f"{path}{'.' if path else ''}{key!r}", ["the fields of a scene"], item)
            _check_values(item, f"{path}.{key}" if path else key, depth + 1)
    elif isinstance(value, list):
        for number, item in enumerate(value):
            _check_values(item, f"{path}[{number}]", depth + 1)
    elif isinstance(value, int) and abs(value) >= 2**63:
        raise not_allowed(path, value, "an integer of 64 bits")
    elif isinstance(value, str) and "\0" in value:
        raise not_allowed(path, value, "text without the character NUL")
    elif not isinstance(value, int | float | str):
        raise not_allowed(path, value, "a number, text, list or table")


def from_mapping(data: Mapping[str, Any]) -> Scene:
    """Return the scene a mapping describes, with rods given by their fields or by a shape's arguments.

    Raises
    ------
    SceneError
        Listing everything that is wrong, as far as one problem does not hide others.
    """
    rods = data.get("rods")
    if not isinstance(rods, list):
        return Scene(**data)
    made, found = [], []
    for number, entry in enumerate(rods):
        try:
            made.append(_rod(entry, f"rods[{number}]"))
        except SceneError as error:
            found.append(error)
    if not found:
        return Scene(**{**data, "rods": made})
    # The rest of the scene is looked at on its own: what holds between parts needs all of them.
    rest = {name: value for name, value in data.items() if name != "rods"}
    stand_in = Rod.straight(length=1.0, edge_count=1, radius=1e-3, material=_ANY_MATERIAL)
    raise combined([*found, *field_errors(Scene, {**rest, "rods": [*_shapeless(rods, stand_in)]})])


def _shapeless(rods: list[Any], stand_in: Rod) -> Iterator[Any]:
    """Yield the entries that are not given by a shape, which have been looked at, in their places."""
    for entry in rods:
        yield stand_in if isinstance(entry, dict) and "shape" in entry else entry


def _from_scenario(data: dict[str, Any], changes: Mapping[str, Any]) -> Scene:
    from flagrs import scenarios  # the scenarios are built from scenes

    for key in data.keys() - {"scenario", "parameters"}:
        raise unknown_option(key, ["scenario", "parameters"], data[key])
    name, parameters = data["scenario"], data.get("parameters", {})
    if not isinstance(name, str):
        raise not_allowed("scenario", name, "the name of a scenario")
    if not isinstance(parameters, dict):
        raise not_allowed("parameters", parameters, "a table of parameters")
    return scenarios.build(name, changed(parameters, changes))


def _rod(entry: Any, path: str) -> Any:
    """Return the rod of an entry with a shape; other entries are left to the scene."""
    if not isinstance(entry, dict) or "shape" not in entry:
        return entry
    options = {name: value for name, value in entry.items() if name != "shape"}
    shape = entry["shape"]
    make = _SHAPES.get(shape) if isinstance(shape, str) else None
    if make is None:
        raise not_allowed(f"{path}.shape", entry["shape"], " or ".join(repr(shape) for shape in _SHAPES))
    found = []
    if isinstance(options.get("material"), dict):
        try:
            options["material"] = Material(**options["material"])
        except SceneError as error:
            found.append(error.within(f"{path}.material"))
            options["material"] = _ANY_MATERIAL
    arguments = set(inspect.signature(make).parameters) - {"options"}
    known = arguments | set(Rod.model_fields) - {"nodes"}
    for name in [name for name in options if name not in known]:
        found.append(unknown_option(name, known, options.pop(name)).within(path))
    try:
        rod = make(**options)
    except SceneError as error:
        found.append(error.within(path))
    except TypeError as error:
        # Python's own words for a missing argument name it: "... required keyword-only argument: 'pitch'".
        found.append(faulty(path, str(error).partition("() ")[2], f"the arguments of Rod.{shape}"))
    if found:
        raise combined(found)
    return rod


def changed(data: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of a mapping with values changed by path, ``clamps.0.nodes`` or ``clamps[0].nodes``."""
    copy = deepcopy(dict(data))
    for path, value in changes.items():
        _change(copy, _dotted(path), value)
    return copy


def _dotted(path: str) -> str:
    """Return a path with list positions between dots: ``clamps.0.nodes`` for ``clamps[0].nodes``."""
    return re.sub(r"\[(\d+)\]", r".\1", path)


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
