"""Result files damaged at random: read rightly or refused in words, in little memory."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

#: Damages a closed file and that of a killed run in many ways, and loads each.
PROGRAM = """
import resource, sys, time
from pathlib import Path
import numpy as np
from fake_simulation import rigid_frame
from flagrs import FlagrsError, scenarios
from flagrs.recorder import Recorder
from flagrs.trajectory import Trajectory

folder, trials, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
scene = scenarios.straight_rod()
frames = [rigid_frame(scene, float(number)) for number in range(40)]

def record(path, close):
    recorder = Recorder(path, scene, {"scheme": "overdamped"})
    for number, frame in enumerate(frames):
        recorder.append(frame)
        if number % 15 == 14:
            recorder.checkpoint({"number": np.array(number)})
    recorder.flush()
    content = path.read_bytes()
    recorder.close()
    return path.read_bytes() if close else content

whole = record(folder / "closed.h5", True), record(folder / "open.h5", False)
truth = np.stack([frame["nodes"] for frame in frames])
rng, path = np.random.default_rng(seed), folder / "bad.h5"
refused = good = 0
slowest = 0.0
for trial in range(trials):
    content = bytearray(whole[trial % 2])
    # Where HDF5 keeps what it knows of the file more often than among the data.
    reach = len(content) if rng.random() < 0.4 else 6000
    kind = rng.integers(4)
    if kind == 0:
        content[int(rng.integers(reach))] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        at = int(rng.integers(reach))
        content[at : at + 16] = rng.bytes(16)
    elif kind == 2:
        del content[int(rng.integers(len(content))) :]
    else:
        at, length = int(rng.integers(reach)), int(rng.integers(1, 4000))
        content[at : at + length] = bytes(length)
    path.write_bytes(content)
    start = time.perf_counter()
    try:
        trajectory = Trajectory.load(path)
        good += 1
        assert np.array_equal(trajectory.nodes, truth[: len(trajectory)]), trial
        assert trajectory.scene == scene and np.isfinite(trajectory.wall_seconds), trial
    except FlagrsError as error:
        refused += 1
        assert str(path) in str(error), (trial, error)
    slowest = max(slowest, time.perf_counter() - start)
print(refused, good, f"{slowest:.2f}")
"""


@pytest.mark.parametrize(("trials", "seed"), [(60, 1), pytest.param(10_000, 2, marks=pytest.mark.slow)])
def test_damaged_files_are_read_rightly_or_refused(tmp_path: Path, trials: int, seed: int) -> None:
    paths = [str(Path(__file__).parent), *filter(None, sys.path)]
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path), str(trials), str(seed)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
        check=False,
        timeout=60 + 4 * trials,
    )
    assert ended.returncode == 0, ended.stderr
    refused, good, _ = ended.stdout.split()
    assert int(refused) > trials // 2 and int(refused) + int(good) == trials
