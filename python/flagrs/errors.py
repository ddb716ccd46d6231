"""Errors users can catch: what is wrong with a scene, and how far a run came before it failed."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np


class FlagrsError(Exception):
    """Base class of every error flagrs raises on purpose."""


class SceneError(FlagrsError, ValueError):
    """A scene, or a part of one, that cannot be simulated.

    Parameters
    ----------
    message
        What is wrong, in one sentence, beginning with the field.
    field
        Path of the field, such as ``rods[0].radius``; None where no single field is to blame.
    value
        The value that was given.
    allowed
        What would have been allowed, in words.
    errors
        The single problems, when this error stands for several of them.
    """

    def __init__(
        self,
        message: str = "",
        *,
        field: str | None = None,
        value: Any = None,
        allowed: str | None = None,
        errors: Sequence[SceneError] = (),
    ) -> None:
        super().__init__(message)
        self.field = field
        self.value = value
        self.allowed = allowed
        self._parts = tuple(errors)

    @property
    def errors(self) -> list[SceneError]:
        """The single problems this error stands for: itself alone, unless several were found at once."""
        return list(self._parts) or [self]

    def within(self, prefix: str) -> SceneError:
        """Return the same error seen from outside: its field paths begin with `prefix`."""
        if self._parts:
            return combined(part.within(prefix) for part in self._parts)
        inner = self.field or ""
        field = prefix + (inner if inner.startswith("[") or not inner else f".{inner}")
        problem = str(self).removeprefix(f"{inner}: ")
        return SceneError(f"{field}: {problem}", field=field, value=self.value, allowed=self.allowed)


def not_allowed(field: str, value: Any, allowed: str, hint: str = "") -> SceneError:
    """Return the error ``field: value is not allowed; must be ...``; `within` fills in an empty field."""
    problem = f"{shown(value)} is not allowed; must be {allowed}" + (f" ({hint})" if hint else "")
    return SceneError(f"{field}: {problem}" if field else problem, field=field, value=value, allowed=allowed)


def faulty(field: str, finding: str, allowed: str, hint: str = "") -> SceneError:
    """Return the error ``field: finding; must be ...``, for what no single value shows."""
    message = f"{field}: {finding}; must be {allowed}" + (f" ({hint})" if hint else "")
    return SceneError(message, field=field, value=finding, allowed=allowed)


def unknown_option(name: str, known: Iterable[str], value: Any = None) -> SceneError:
    """Return the error for an option nobody reads, naming the closest one that exists."""
    names = sorted(known)
    closest = difflib.get_close_matches(name, names, n=1)
    advice = f"did you mean '{closest[0]}'?" if closest else f"known: {', '.join(names)}"
    return SceneError(
        f"{name}: unknown option; {advice}", field=name, value=value, allowed="one of " + ", ".join(names)
    )


def combined(errors: Iterable[SceneError]) -> SceneError:
    """Return one error for several: the only one as it is, more of them as a list."""
    parts = [part for error in errors for part in error.errors]
    if len(parts) == 1:
        return parts[0]
    message = "\n".join([f"{len(parts)} problems in the scene:", *(f"  {part}" for part in parts)])
    return SceneError(message, errors=parts)


def shown(value: Any) -> str:
    """Return a value as an error message prints it: short, whatever its size."""
    if isinstance(value, np.ndarray) and value.ndim > 0:
        return f"an array of shape {value.shape}"
    text = str(value) if isinstance(value, np.generic | np.ndarray) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


class FileError(FlagrsError, OSError):
    """A file that cannot be read or written.

    Parameters
    ----------
    path
        The file.
    problem
        What is wrong with it, in words.
    errno
        The system's number of the error, if it has one.
    """

    def __init__(self, path: str | os.PathLike[str], problem: str, errno: int | None = None) -> None:
        super().__init__(errno, problem)
        self.filename = os.fspath(path)
        self.problem = problem

    def __str__(self) -> str:
        """Return path and problem."""
        return f"{printable(self.filename)}: {self.problem}"

    def __reduce__(self) -> tuple[Any, ...]:
        """Let it travel between processes."""
        return type(self), (self.filename, self.problem, self.errno)


class FileMissingError(FileError, FileNotFoundError):
    """A file that is not there."""


class FileTakenError(FileError, FileExistsError):
    """A file that is there already, or in use by another run, and is not replaced unasked."""


def file_error(path: str | os.PathLike[str], error: OSError | ValueError, doing: str) -> FileError:
    """Return an error of the system's as one of ours: which file, and what was being done."""
    number = error.errno if isinstance(error, OSError) else None
    kind = FileMissingError if isinstance(error, FileNotFoundError) else FileError
    return kind(path, f"{doing}: {os.strerror(number) if number else error}", number)


def printable(path: str) -> str:
    """Return a path as it can be printed anywhere, shortened in its middle."""
    text = path.encode("utf-8", "replace").decode("utf-8") if path.isprintable() else repr(path)[1:-1]
    return text if len(text) <= 300 else f"{text[:150]}...{text[-140:]}"


class ConvergenceError(FlagrsError, ArithmeticError):
    """A step that could not be solved, even after retries; the simulation stays at its last good state.

    Parameters
    ----------
    message
        What happened, in one sentence.
    time
        Simulated time of the last good state [s].
    step
        Index of the step that failed.
    residual
        Largest residual force left [N].
    iterations
        Newton iterations made in the last attempt.
    smallest_gap
        Smallest surface-to-surface distance between colliding edges [m].
    worst_node
        Node, in the scene's numbering, with the largest residual.
    """

    def __init__(
        self,
        message: str = "",
        *,
        time: float | None = None,
        step: int | None = None,
        residual: float | None = None,
        iterations: int | None = None,
        smallest_gap: float | None = None,
        worst_node: int | None = None,
    ) -> None:
        super().__init__(message)
        self.time = time
        self.step = step
        self.residual = residual
        self.iterations = iterations
        self.smallest_gap = smallest_gap
        self.worst_node = worst_node
