"""What all parts of a scene share: frozen, validated, comparable, with errors that name the field."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from flagrs.errors import SceneError, combined, not_allowed, unknown_option


class Part(BaseModel):
    """Base class of the parts of a scene.

    Parts are built from keyword arguments and cannot be changed afterwards; `replace` makes a changed copy.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

    def __init__(self, **data: Any) -> None:
        """Validate the fields; raise `SceneError` listing everything that is wrong."""
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise _scene_error(error, list(type(self).model_fields)) from None

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed, validated like a new part."""
        fields = {name: getattr(self, name) for name in type(self).model_fields}
        return type(self)(**{**fields, **changes})

    def __setstate__(self, state: dict[Any, Any]) -> None:
        """Take over what was pickled, with arrays as read-only as they were."""
        super().__setstate__(state)
        self._lock()

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        """Return the part itself, as it cannot change."""
        return self

    def _lock(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

    def __eq__(self, other: object) -> bool:
        """Compare field by field; arrays are equal when every bit is."""
        return isinstance(other, Part) and _key(self) == _key(other)

    def __hash__(self) -> int:
        """Hash of everything `__eq__` compares."""
        return hash(_key(self))

    def __repr_args__(self) -> Any:
        """Show arrays by their shape, so that a rod fits on one line."""
        for name, value in super().__repr_args__():
            yield name, _Summary(f"array{value.shape}") if isinstance(value, np.ndarray) else value


class _Summary(str):
    """Text that stands for a value in a repr, without quotation marks."""

    __slots__ = ()
    __repr__ = str.__str__


def _key(value: Any) -> Any:
    """Return a hashable stand-in for a field's value."""
    if isinstance(value, Part):
        return type(value), tuple(_key(getattr(value, name)) for name in type(value).model_fields)
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    if isinstance(value, tuple):
        return tuple(_key(item) for item in value)
    return value


def different(a: Any, b: Any) -> bool:
    """Return whether two values of fields differ in any bit."""
    return bool(_key(a) != _key(b))


def _scene_error(error: ValidationError, known: list[str]) -> SceneError:
    """Return pydantic's findings as one SceneError with full field paths."""
    return combined(_single_error(details, known) for details in error.errors(include_url=False))


def field_errors(kind: type[Part], data: dict[str, Any]) -> list[SceneError]:
    """Return what is wrong with the fields of a part, each by itself, without what holds between them."""
    try:
        # Past the constructor, whose error no longer tells fields from what holds between them.
        kind.__pydantic_validator__.validate_python(data, self_instance=kind.__new__(kind))
    except ValidationError as error:
        known = list(kind.model_fields)
        return [_single_error(found, known) for found in error.errors(include_url=False) if found["loc"]]
    return []


def _single_error(details: Any, known: list[str]) -> SceneError:
    path = "".join(f"[{item}]" if isinstance(item, int) else f".{item}" for item in details["loc"])
    field = path.removeprefix(".")
    cause = details.get("ctx", {}).get("error")
    if isinstance(cause, SceneError):
        return cause.within(field) if field else cause
    if details["type"] == "missing":
        return SceneError(f"{field}: missing; it has no default", field=field, allowed="a value")
    if details["type"] == "extra_forbidden":
        return unknown_option(field, known, details["input"])
    if details["type"] == "literal_error":
        return not_allowed(field, details["input"], details["ctx"]["expected"])
    words = details["msg"].removeprefix("Input should be ")
    return not_allowed(field, details["input"], words)
