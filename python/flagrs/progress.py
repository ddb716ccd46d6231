"""A progress bar for a run, in simulated seconds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Self

from tqdm.auto import tqdm

from flagrs.errors import not_allowed


@contextmanager
def bar_for(
    progress: Callable[[float], None] | bool | None, until: float, title: str
) -> Iterator[Callable[[float], None] | None]:
    """Give what reports progress: a function as it is, a bar for True, nothing for False and None."""
    if progress is True:
        with ProgressBar(until, title) as bar:
            yield bar
    elif progress is None or progress is False:
        yield None
    elif callable(progress):
        yield progress
    else:
        raise not_allowed("progress", progress, "True, False, None or a function of the simulated time")


class ProgressBar:
    """A progress bar to be called with the simulated time.

    Parameters
    ----------
    until
        Simulated time at which the run ends [s].
    title
        What stands before the bar.
    hidden
        Whether to show nothing.

    Examples
    --------
    >>> with ProgressBar(until=10.0, title="robot", hidden=True) as progress:
    ...     progress(2.5)
    """

    def __init__(self, until: float, title: str = "", hidden: bool = False) -> None:
        layout = "{l_bar}{bar}| {n:.1f}/{total:.1f} s simulated [{elapsed}<{remaining}]"
        self._bar = tqdm(total=until, desc=title or None, disable=hidden, bar_format=layout)

    def __call__(self, time: float) -> None:
        """Show the simulated time [s]."""
        self._bar.update(time - self._bar.n)

    def __enter__(self) -> Self:
        """Return the bar itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the bar as it stands."""
        self._bar.close()
