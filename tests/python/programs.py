"""Programs that tests start, wait for, and look for what is left of."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from typing import Any

import pytest

linux = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")


def started(code: str, folder: Path, *arguments: object) -> subprocess.Popen[bytes]:
    """Return a program at work, the leader of a group of processes that Ctrl-C reaches as on a terminal."""
    program = folder / "program.py"
    program.write_text(textwrap.dedent(code))
    # Whoever runs the tests in the background may have let them ignore Ctrl-C.
    return subprocess.Popen(
        [sys.executable, str(program), *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "FLAGRS_THREADS": "1"},
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )


def wait_for(condition: Any, seconds: float) -> bool:
    end = time.monotonic() + seconds
    while not (found := condition()) and time.monotonic() < end:
        time.sleep(0.05)
    return bool(found)


def left_of(group: int) -> list[str]:
    """Return the processes of a session that are still at work."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split() if entry.name.isdigit() else []
        except OSError:
            continue
        if fields and int(fields[3]) == group and fields[0] != "Z":
            found.append((entry / "cmdline").read_text().replace("\0", " ")[:200])
    return found
