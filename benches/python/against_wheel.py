"""Runs of this version against those of another wheel, in turn on one machine: processor seconds and steps.

Run ``python benches/python/against_wheel.py WHEEL``, with the wheel of the other version, as ``make wheel``
of its checkout leaves it in dist/. It prints the table of docs/performance.md.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
import warnings
import zipfile
from pathlib import Path

#: Turns of both versions, and runs in each turn, of which the least counts.
TURNS, RUNS = 3, 3
#: Frames of a run.
FRAMES = 10
HERE = str(Path(__file__).parent)


def measured() -> dict[str, tuple[float, float]]:
    """Return the least processor seconds [s] and the steps of every run, with the flagrs that is imported."""
    import flagrs

    robot, pair = flagrs.scenarios.robot(), flagrs.scenarios.clamped_flagella(count=2)
    cases = {
        "robot, 20 s, `dt=0.0239`": (robot, 20.0, {"dt": 0.0239}),
        "robot, 60 s, `rtol=1e-2`": (robot, 60.0, {"rtol": 1e-2}),
        "robot, 60 s, `rtol=1e-3`": (robot, 60.0, {"rtol": 1e-3}),
        "two clamped flagella, 2 s, `rtol=1e-2`": (pair, 2.0, {"rtol": 1e-2}),
        "two clamped flagella in contact, 9 s, `rtol=1e-3`": (pair, 9.0, {"rtol": 1e-3}),
        "robot, 20 s, `rtol=1e-3`, 200 frames": (robot, 20.0, {"rtol": 1e-3}),
    }
    found = {}
    for name, (scene, until, options) in cases.items():
        frames = 200 if "frames" in name else FRAMES
        seconds = []
        for _ in range(RUNS):
            simulation = flagrs.Simulation(scene, threads=1, **options)  # type: ignore[arg-type]
            start = time.process_time()
            simulation.run(until=until, save_every=until / frames, path=False)
            seconds.append(time.process_time() - start)
        found[name] = min(seconds), float(simulation.statistics["steps"])
    return found


def in_turn(wheel: Path) -> list[dict[str, tuple[float, float]]]:
    """Return what both versions take, the other's first: the least of all turns."""
    best: list[dict[str, tuple[float, float]]] = [{}, {}]
    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(wheel).extractall(folder)
        for _ in range(TURNS):
            for found, place in zip(best, (folder, None), strict=True):
                # The folder of the other version goes before everything that is installed.
                first = [place] if place else []
                program = (
                    f"import sys, json; sys.path[:0] = {first!r}; sys.path.append({HERE!r}); "
                    "import against_wheel; print(json.dumps(against_wheel.measured()))"
                )
                command = [sys.executable, "-W", "ignore", "-c", program]
                environment = os.environ | {"OMP_NUM_THREADS": "1"}
                output = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
                for name, (seconds, steps) in json.loads(output.stdout.splitlines()[-1]).items():
                    found[name] = min((seconds, steps), found.get(name, (seconds, steps)))
    return best


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore")
    before, now = in_turn(Path(sys.argv[1]))
    print("| run | before | now | ratio | steps before, now |\n|---|---|---|---|---|")
    for name, (seconds, steps) in before.items():
        later, steps_later = now[name]
        counts = f"{steps:.0f}, {steps_later:.0f}"
        print(f"| {name} | {seconds:.3f} | {later:.3f} | {later / seconds:.2f} | {counts} |")


if __name__ == "__main__":
    main()
