"""Sweeps whose processes are killed at random moments: repeated, they end with the same table and frames."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from flagrs.trajectory import Trajectory
from programs import left_of, linux, started, wait_for

#: Writes its table once all cases are done, without what time tells of.
SWEEP = """
    import csv, sys
    from pathlib import Path
    from flagrs import scenarios, sweep
    from flagrs.runs import RunSettings

    if __name__ == "__main__":
        folder, until = Path(sys.argv[1]), float(sys.argv[2])
        settings = RunSettings(until=until, save_every=0.02, rtol=1e-2)
        cases = [
            sweep.Case("robot", scenarios.robot(rpm=float(rpm), edge_length=9e-3), settings, {"rpm": rpm})
            for rpm in (5, 20, 35, 50)
        ]
        found = {}
        for result in sweep.run(cases, folder, processes=2, progress=False):
            found[result.case.parameters["rpm"]] = [result.path.name, result.error, *result.measured.values()]
        with open(sys.argv[3], "w", newline="") as file:
            csv.writer(file).writerows([rpm, *map(repr, row)] for rpm, row in sorted(found.items()))
    """

FIELDS = ("time", "nodes", "theta", "velocities", "force_density", "motor_torque", "energy", "account")


def completed(folder: Path, name: str, until: float) -> tuple[bytes, dict[str, Trajectory]]:
    """Return the table and the trajectories of a sweep that nobody stops."""
    run = started(SWEEP, folder, folder / name, until, folder / f"{name}.csv")
    output, _ = run.communicate(timeout=300)
    assert run.returncode == 0, output.decode()
    files = sorted((folder / name).iterdir())
    return (folder / f"{name}.csv").read_bytes(), {file.name: Trajectory.load(file) for file in files}


def children(pid: int) -> list[int]:
    """Return the processes that one has started."""
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def kill(sweep: subprocess.Popen[bytes], what: str, chance: random.Random) -> None:
    """Kill the sweep, all of its processes at once, or one of those it has started."""
    if what == "all":
        os.killpg(sweep.pid, signal.SIGKILL)
    elif what == "parent":
        sweep.kill()
    else:
        there = children(sweep.pid)
        if there:
            os.kill(chance.choice(there), signal.SIGKILL)
        # The pool is broken: the sweep reports what failed, and ends by itself.
    sweep.communicate(timeout=60)


def killed_once(tmp_path: Path, until: float, chance: random.Random) -> bool:
    """Kill a sweep at a random moment, see that nothing of it goes on, and return whether it was at work."""
    folder = tmp_path / "killed"
    sweep = started(SWEEP, tmp_path, folder, until, tmp_path / "killed.csv")
    # From before the workers have started to well within the runs.
    if chance.random() < 0.8:
        wait_for(lambda: any(folder.glob("*.h5")) or sweep.poll() is not None, 30.0)
    time.sleep(chance.uniform(0.0, 1.5))
    met = sweep.poll() is None
    kill(sweep, chance.choice(["all", "parent", "worker"]), chance)
    assert wait_for(lambda: not left_of(sweep.pid), 5.0), left_of(sweep.pid)
    return met


def killed_and_repeated(tmp_path: Path, seed: int, kills: int, until: float) -> int:
    """Hold a sweep that is killed and repeated against one that is not; return how many kills met it."""
    table, whole = completed(tmp_path, "whole", until)
    assert len(whole) == 4 and all(trajectory.finished for trajectory in whole.values())
    chance, met, folder = random.Random(seed), 0, tmp_path / "killed"
    for _ in range(kills):
        met += killed_once(tmp_path, until, chance)
        for file in folder.glob("*.h5"):
            there = Trajectory.load(file)
            assert np.array_equal(there.nodes, whole[file.name].nodes[: len(there)])
    repeated, found = completed(tmp_path, "killed", until)
    assert repeated == table and found.keys() == whole.keys()
    for name, trajectory in found.items():
        assert trajectory.finished
        for field in FIELDS:
            assert np.array_equal(getattr(trajectory, field), getattr(whole[name], field)), (name, field)
    return met


@linux
def test_a_sweep_killed_at_random_moments_ends_with_the_same_bits(tmp_path: Path) -> None:
    assert killed_and_repeated(tmp_path, seed=1, kills=3, until=8.0) > 0


@linux
@pytest.mark.slow
def test_a_sweep_killed_two_hundred_times_ends_with_the_same_bits(tmp_path: Path) -> None:
    met = 0
    for seed in range(20):
        (tmp_path / str(seed)).mkdir()
        met += killed_and_repeated(tmp_path / str(seed), seed=100 + seed, kills=10, until=60.0)
    assert met > 150
