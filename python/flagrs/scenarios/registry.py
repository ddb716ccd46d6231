"""The list of scenarios, and building one by its name."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any, ParamSpec

from flagrs.errors import SceneError, faulty, shown, unknown_option
from flagrs.scene import Scene

P = ParamSpec("P")

_known: dict[str, Callable[..., Scene]] = {}


def scenario(function: Callable[P, Scene]) -> Callable[P, Scene]:
    """Register a function that returns a scene under its own name."""
    _known[function.__name__] = function
    return function


def summaries() -> dict[str, str]:
    """Return the names of all scenarios, each with one sentence about it."""
    return {name: _summary(make) for name, make in sorted(_known.items())}


def _summary(make: Callable[..., Scene]) -> str:
    """Return the first sentence of a function's docstring, without the verb."""
    sentence = (inspect.getdoc(make) or "").partition("\n")[0].removeprefix("Return ")
    return sentence[:1].upper() + sentence[1:]


def parameters(name: str) -> dict[str, Any]:
    """Return the parameters of a scenario with their default values."""
    return {key: value.default for key, value in inspect.signature(_find(name)).parameters.items()}


def build(name: str, options: Mapping[str, Any] | None = None) -> Scene:
    """Return a scenario by its name.

    Parameters
    ----------
    name
        One of `summaries`.
    options
        Values for some of its parameters.

    Raises
    ------
    SceneError
        If there is no such scenario or parameter, or a value is not allowed.
    """
    make, options = _find(name), options or {}
    known = inspect.signature(make).parameters
    for option, value in options.items():
        if option not in known:
            raise unknown_option(option, known, value)
    try:
        return make(**options)
    except (TypeError, OverflowError, ZeroDivisionError) as error:
        given = ", ".join(f"{option}={shown(value)}" for option, value in options.items())
        raise faulty(name, f"{given}: {error}", "given parameters of the right kind") from None


def _find(name: str) -> Callable[..., Scene]:
    if name not in _known:
        hint = unknown_option(str(name), _known)
        raise SceneError(
            str(hint).replace("unknown option", "unknown scenario"),
            field="scenario",
            value=name,
            allowed=hint.allowed,
        )
    return _known[name]
