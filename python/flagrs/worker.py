"""A worker process of a sweep: it stops when told to, and does not outlive the process that started it."""

from __future__ import annotations

import _thread
import os
import signal
import threading
import time
from multiprocessing.connection import Connection

from flagrs.errors import FlagrsError

#: How long a worker that is to stop may take to save and close its file [s].
GRACE = 1.0

_stopping = threading.Event()


def start(line: Connection) -> None:
    """Prepare this process as a worker.

    Parameters
    ----------
    line
        The reading end of a pipe whose other end only the parent has: it closes when the parent says stop,
        and when it dies.
    """
    # Ctrl-C goes to the whole group of processes; the parent alone decides what follows from it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _interrupt)
    threading.Thread(target=_watch, args=(line,), daemon=True).start()


def check_not_stopping() -> None:
    """Raise FlagrsError if this process is to stop: no new case begins then."""
    if _stopping.is_set():
        raise FlagrsError("the sweep was stopped")


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt


def _watch(line: Connection) -> None:
    try:
        line.recv_bytes()
    except (EOFError, OSError):
        pass
    _stopping.set()
    _thread.interrupt_main(signal.SIGTERM)
    time.sleep(GRACE)
    os._exit(1)
