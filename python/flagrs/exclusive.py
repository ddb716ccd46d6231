"""One thread at a time: a native object whose use by a second thread is refused in words."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from flagrs.errors import FlagrsError


class Exclusive:
    """Passes everything on to an object, unless it is at work already.

    Refusing rather than waiting cannot end in a deadlock, neither between threads nor in a child of a fork.

    Parameters
    ----------
    inner
        The object.
    name
        What errors call it.
    """

    __slots__ = ("_busy", "_inner", "_lock", "_name")

    def __init__(self, inner: Any, name: str) -> None:
        set_here = object.__setattr__
        set_here(self, "_inner", inner)
        set_here(self, "_name", name)
        set_here(self, "_lock", threading.RLock())
        set_here(self, "_busy", False)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep other threads out for as long as the context lasts.

        Raises
        ------
        FlagrsError
            If another thread is at it.
        """
        if not self._lock.acquire(blocking=False):
            raise FlagrsError(
                f"{self._name} is at work in another thread; give each thread one of its own, or a lock"
            )
        try:
            yield
        finally:
            self._lock.release()

    @contextmanager
    def _alone(self) -> Iterator[None]:
        with self.held():
            if self._busy:
                raise FlagrsError(
                    f"{self._name} is in the middle of a step; functions of time and callbacks cannot use it"
                )
            object.__setattr__(self, "_busy", True)
            try:
                yield
            finally:
                object.__setattr__(self, "_busy", False)

    def __getattr__(self, name: str) -> Any:
        """Return a value, or a method that holds the object while it runs."""
        with self._alone():
            found = getattr(self._inner, name)
        return self._wrapped(found) if callable(found) else found

    def _wrapped(self, method: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            with self._alone():
                return method(*arguments)

        return call

    def __setattr__(self, name: str, value: Any) -> None:
        """Set a value of the object."""
        with self._alone():
            setattr(self._inner, name, value)

    def __repr__(self) -> str:
        """Describe the object."""
        with self._alone():
            return repr(self._inner)
