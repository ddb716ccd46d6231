"""Disks that fail at any write, without notice: a clear error, and what was saved before stays readable."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from flagrs.recorder import load_checkpoint
from flagrs.trajectory import Trajectory

HERE = Path(__file__).parent

#: Writes into the folder $FAIL_IN fail with EIO, from number $FAIL_AT on: all, or that one if $FAIL_ONCE.
SHIM = r"""
    #define _GNU_SOURCE
    #include <dlfcn.h>
    #include <errno.h>
    #include <stdio.h>
    #include <stdlib.h>
    #include <string.h>
    #include <sys/types.h>
    #include <unistd.h>

    static long seen = 0;

    static int fails(int descriptor) {
        const char *folder = getenv("FAIL_IN");
        char link[64], name[4096];
        if (!folder) return 0;
        snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
        ssize_t length = readlink(link, name, sizeof name - 1);
        if (length < 0) return 0;
        name[length] = 0;
        if (strncmp(name, folder, strlen(folder)) != 0) return 0;
        long first = atol(getenv("FAIL_AT")), now = seen++;
        if (now == first || (now > first && !getenv("FAIL_ONCE"))) { errno = EIO; return 1; }
        return 0;
    }

    typedef ssize_t (*pwriter)(int, const void *, size_t, off_t);
    typedef ssize_t (*writer)(int, const void *, size_t);

    ssize_t pwrite(int d, const void *b, size_t n, off_t at) {
        return fails(d) ? -1 : ((pwriter)dlsym(RTLD_NEXT, "pwrite"))(d, b, n, at);
    }
    ssize_t pwrite64(int d, const void *b, size_t n, off_t at) {
        return fails(d) ? -1 : ((pwriter)dlsym(RTLD_NEXT, "pwrite64"))(d, b, n, at);
    }
    ssize_t write(int d, const void *b, size_t n) {
        return fails(d) ? -1 : ((writer)dlsym(RTLD_NEXT, "write"))(d, b, n);
    }
    """

PROGRAM = """
    import sys
    import numpy as np
    from fake_simulation import rigid_frame
    from flagrs import FileError, scenarios
    from flagrs.recorder import Recorder

    path, scene = sys.argv[1], scenarios.robot(edge_length=9e-3)
    try:
        with Recorder(path, scene, {}) as recorder:
            for number in range(60):
                recorder.append(rigid_frame(scene, float(number)))
                if number % 20 == 9:
                    recorder.flush()
                if number % 20 == 19:
                    recorder.checkpoint({"number": np.array(number)})
    except FileError as error:
        print("told", error.errno, error.filename == path, str(error).splitlines()[0])
    else:
        print("done")
    """

needs_shim = pytest.mark.skipif(
    sys.platform != "linux" or shutil.which("cc") is None, reason="needs Linux and a C compiler"
)


@pytest.fixture(scope="module")
def shim(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a library that lets writes fail."""
    folder = tmp_path_factory.mktemp("shim")
    (folder / "shim.c").write_text(textwrap.dedent(SHIM))
    built = folder / "shim.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-o", str(built), str(folder / "shim.c"), "-ldl"], check=True)
    return built


def recorded(path: Path, shim: Path, fail_at: int, once: bool) -> subprocess.CompletedProcess[str]:
    """Return how a recording ended whose disk fails at a write."""
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(HERE), *filter(None, sys.path)]),
        "LD_PRELOAD": str(shim),
        "FAIL_IN": str(path.parent),
        "FAIL_AT": str(fail_at),
    } | ({"FAIL_ONCE": "1"} if once else {})
    command = [sys.executable, "-c", textwrap.dedent(PROGRAM), str(path)]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=120)


def check(folder: Path, shim: Path, fail_at: int, once: bool) -> bool:
    """Hold a failing write to what is promised; return whether it failed at all."""
    folder.mkdir()
    path = folder / "run.h5"
    ended = recorded(path, shim, fail_at, once)
    assert ended.returncode == 0 and ended.stderr == "", (fail_at, once, ended)
    told = ended.stdout.startswith("told 5 True")
    assert told or ended.stdout == "done\n", (fail_at, once, ended.stdout)
    if path.exists():
        trajectory = Trajectory.load(path)
        count = len(trajectory)
        assert np.array_equal(trajectory.time, np.arange(count)), (fail_at, once)
        assert trajectory.finished == (not told) and count % 10 == 0, (fail_at, once)
        if trajectory.has_checkpoint:
            assert int(load_checkpoint(path).state["number"]) in {
                count - 1,
                count - 11,
                count - 21,
            }, (fail_at, once)
        assert told or count == 60
    assert {entry.name for entry in folder.iterdir()} <= {"run.h5"}, (fail_at, once)
    return told


@needs_shim
@pytest.mark.parametrize("once", [False, True])
def test_a_write_that_fails_is_told_and_keeps_what_was_saved(tmp_path: Path, shim: Path, once: bool) -> None:
    told = [check(tmp_path / str(at), shim, at, once) for at in (3, 30, 60, 120)]
    assert sum(told) >= 3


@needs_shim
@pytest.mark.slow
def test_every_write_that_fails_is_told_and_keeps_what_was_saved(tmp_path: Path, shim: Path) -> None:
    for once in (False, True):
        at = 0
        while check(tmp_path / f"{at}-{once}", shim, at, once):
            at += 4
        assert at > 50
