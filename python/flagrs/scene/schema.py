"""The JSON Schema of scene files, with which editors complete and check them."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np

from flagrs.scene.part import Part
from flagrs.scene.rod import Rod
from flagrs.scene.scene import Scene

Schema = dict[str, Any]


def scene_schema() -> Schema:
    """Return the JSON Schema (draft 2020-12) of a scene as TOML or JSON files hold it.

    It knows names, kinds and meanings of fields; their ranges, and what must hold between them, are checked
    when a file is read.
    """
    parts: dict[str, Schema] = {}
    written = _part(Scene, parts)
    parts["Rod"] = {"anyOf": [parts["Rod"], *(_shape(name) for name in ("helix", "straight"))]}
    by_name = {
        "type": "object",
        "description": "A scenario of `flagrs scenarios` with its parameters.",
        "properties": {"scenario": {"type": "string"}, "parameters": {"type": "object"}},
        "required": ["scenario"],
        "additionalProperties": False,
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "flagrs scene",
        "anyOf": [written, by_name],
        "$defs": parts,
    }


def _part(kind: type[Part], parts: dict[str, Schema]) -> Schema:
    """Return the schema of a part; those of parts within go to `parts`."""
    meanings = meanings_of(kind)
    properties = {}
    for name, field in kind.model_fields.items():
        properties[name] = {**_value(field.annotation, parts), **_described(meanings.get(name))}
    for name in _LISTED.get(kind.__name__, ()):
        # A single part may stand for a list of one.
        properties[name] = {
            "anyOf": [properties[name], properties[name]["items"]],
            **_described(meanings.get(name)),
        }
    return {
        "type": "object",
        "description": _summary(kind),
        "properties": properties,
        "required": [name for name, field in kind.model_fields.items() if field.is_required()],
        "additionalProperties": False,
    }


_LISTED = {"Scene": ("rods", "motors", "clamps", "loads"), "Fluid": ("background",)}


def _shape(name: str) -> Schema:
    """Return the schema of a rod that is given by a shape."""
    make: Callable[..., Rod] = getattr(Rod, name)
    arguments = inspect.signature(make).parameters
    fields = _part(Rod, {})["properties"]
    meanings = meanings_of(make, "Parameters")
    properties: dict[str, Schema] = {"shape": {"const": name}}
    for argument in arguments:
        if argument != "options":
            properties[argument] = _described(meanings.get(argument)) or fields.get(argument, {})
    properties |= {key: value for key, value in fields.items() if key != "nodes" and key not in properties}
    needed = [key for key, one in arguments.items() if one.default is one.empty and key != "options"]
    return {
        "type": "object",
        "description": _summary(make),
        "properties": properties,
        "required": ["shape", *needed],
        "additionalProperties": False,
    }


def _value(kind: Any, parts: dict[str, Schema]) -> Schema:
    """Return the schema of a value of a type, as far as a file can hold it."""
    if get_origin(kind) is Annotated:
        kind = get_args(kind)[0]
    origin = get_origin(kind)
    if origin in (Union, UnionType):
        choices: list[Schema] = []
        for choice in get_args(kind):
            found = _value(choice, parts)
            if choice is not NoneType and found and found not in choices:
                choices.append(found)
        return {"anyOf": choices} if len(choices) > 1 else (choices or [{}])[0]
    if origin is Literal:
        return {"enum": list(get_args(kind))}
    if origin is tuple:
        inner = get_args(kind)[0]
        return {"type": "array", "items": _value(inner, parts)}
    if origin is np.ndarray or kind is np.ndarray:
        return {"type": "array"}
    if isinstance(kind, type) and issubclass(kind, Part):
        if kind.__name__ not in parts:
            parts[kind.__name__] = {}
            parts[kind.__name__] = _part(kind, parts)
        return {"$ref": f"#/$defs/{kind.__name__}"}
    plain = {float: "number", int: "integer", bool: "boolean", str: "string"}
    return {"type": plain[kind]} if kind in plain else {}  # functions of time have no place in a file


def meanings_of(thing: Any, section: str = "Attributes") -> dict[str, str]:
    """Return what a docstring in NumPy's style says of each attribute or parameter, on one line each."""
    text = inspect.getdoc(thing) or ""
    _, found, rest = text.partition(f"{section}\n{'-' * len(section)}\n")
    meanings: dict[str, str] = {}
    names: list[str] = []
    for line in rest.split("\n") if found else ():
        if re.fullmatch(r"-{3,}", line):
            break  # the next section
        if line and not line.startswith(" "):
            names = [name.strip(" *") for name in line.partition(":")[0].split(",")]
        elif line.strip():
            for name in names:
                meanings[name] = f"{meanings.get(name, '')} {line.strip()}".strip()
    return meanings


def _described(meaning: str | None) -> Schema:
    return {"description": meaning} if meaning else {}


def _summary(thing: Any) -> str:
    return (inspect.getdoc(thing) or "").partition("\n\n")[0].replace("\n", " ")
