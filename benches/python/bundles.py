"""Bundles of clamped flagella in contact, and robots: time of long runs, gaps, contacts, iterations.

Run ``python benches/python/bundles.py [--document docs/performance.md]``; about ten minutes.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import flagrs
import numpy as np
from clock import hold_to_one_thread
from document import document_option, machine, publish, table
from flagrs.plot.canvas import dress, new_figure
from numpy.typing import NDArray

FIGURE = Path(__file__).parents[2] / "docs" / "images" / "bundles.png"
#: Simulated time of the published runs [s], and their wall time by number of flagella [h].
PUBLISHED_TIME = 250.0
PUBLISHED = {2: 0.57, 3: 1.19, 5: 3.34, 10: 22.8}
#: Radius of the filaments [m].
RADIUS = 1e-3
#: Simulated time of the robots [s].
ROBOT_TIME = 100.0
#: Error asked for in the long runs.
RTOL = 1e-2
#: Time between rows of the figure [s].
EVERY = 0.5


@dataclass(frozen=True)
class History:
    """A run in intervals of `EVERY`.

    Attributes
    ----------
    gap : ndarray
        Smallest gap (K,) over all accepted steps of each interval, over the diameter.
    contacts, newton, rejected : ndarray
        Pairs that push (K,) at the end; Newton iterations per step; rejected steps.
    simulated, seconds : float
        Simulated and wall time [s].
    counts : dict
        Statistics of the simulation.
    """

    gap: NDArray[np.float64]
    contacts: NDArray[np.float64]
    newton: NDArray[np.float64]
    rejected: NDArray[np.float64]
    simulated: float
    seconds: float
    counts: dict[str, float]


def long_run(count: int, until: float) -> History:
    simulation = flagrs.Simulation(flagrs.scenarios.clamped_flagella(count=count), rtol=RTOL)
    rows: list[tuple[float, float, float, float]] = []
    begun = time.perf_counter()
    before = simulation.statistics
    while simulation.time < until:
        end, gap = simulation.time + EVERY, np.inf
        while simulation.time < end:
            simulation.step()
            gap = min(gap, simulation.minimum_gap)
        now = simulation.statistics
        made = {name: now[name] - before[name] for name in now}
        before = now
        contacts = len(simulation.contact_forces()[1])
        newton = made["newton_iterations"] / made["steps"]
        rows.append((gap / (2.0 * RADIUS), contacts, newton, made["rejected_steps"]))
    seconds = time.perf_counter() - begun
    columns = np.array(rows).T
    return History(*columns, simulated=simulation.time, seconds=seconds, counts=before)


def long_runs(runs: dict[int, History]) -> str:
    head = (
        "flagella",
        "nodes",
        "simulated s",
        "wall time",
        "ms per simulated s",
        "published, 250 s",
        "steps",
        "rejected",
        "Newton per step",
        "GMRES per step",
        "steps per search",
        "smallest gap / 2r",
        "most pairs",
    )
    rows = []
    for count, run in runs.items():
        simulated = run.simulated
        steps = run.counts["steps"]
        rows.append(
            [
                str(count),
                str(68 * count),
                f"{simulated:.0f}",
                f"{run.seconds:.0f} s",
                f"{1e3 * run.seconds / simulated:.0f}",
                f"{PUBLISHED[count]:g} h",
                f"{steps:.0f}",
                f"{run.counts['rejected_steps']:.0f}",
                f"{run.counts['newton_iterations'] / steps:.1f}",
                f"{run.counts['krylov_iterations'] / steps:.1f}",
                f"{steps / run.counts['contact_searches']:.1f}",
                f"{run.gap.min():.3f}",
                f"{run.contacts.max():.0f}",
            ]
        )
    return table(head, rows)


def robots() -> str:
    """Return what the robot's flagella do at 50 rpm, over all accepted steps."""
    rows = []
    for pitch in (5.0, 7.0, 9.0):
        scene = flagrs.scenarios.robot(normalized_pitch=pitch, rpm=50.0)
        simulation = flagrs.Simulation(scene, rtol=RTOL, threads=1)
        diameter = 2.0 * float(scene.rods[0].radius_array().min())
        gap, touching = np.inf, 0
        while simulation.time < ROBOT_TIME:
            simulation.step()
            gap = min(gap, simulation.minimum_gap / diameter)
            touching += len(simulation.contact_forces()[1]) > 0
        counts = simulation.statistics
        rows.append(
            [
                f"{pitch:g}",
                f"{ROBOT_TIME / counts['seconds_total']:.0f}",
                f"{counts['steps']:.0f}",
                f"{counts['rejected_steps']:.0f}",
                f"{counts['newton_iterations'] / counts['steps']:.2f}",
                f"{touching}",
                f"{gap:+.3f}",
            ]
        )
    head = (
        f"pitch / R, robot at 50 rpm, {ROBOT_TIME:g} s",
        "times real time",
        "steps",
        "rejected",
        "Newton per step",
        "steps in contact",
        "smallest gap / 2r",
    )
    return table(head, rows)


def draw(runs: dict[int, History]) -> None:
    figure = new_figure(9.0, 8.0)
    axes = figure.subplots(4, 1, sharex=True)
    labels = ("smallest gap / 2r", "pairs that push", "Newton iterations per step", "rejected steps")
    for count, run in runs.items():
        times = EVERY * np.arange(1, len(run.gap) + 1)
        rows = (run.gap, run.contacts, run.newton, run.rejected)
        for axis, row in zip(axes, rows):
            axis.plot(times, row, linewidth=0.8, label=f"{count} flagella")
    for axis, label in zip(axes, labels):
        dress(axis, "time [s]" if axis is axes[-1] else "", label, "")
    axes[0].set_ylim(-0.06, 0.3)
    axes[0].axhline(-0.05, color="0.4", linestyle=":")
    axes[0].text(1.0, -0.045, "never below", fontsize=8, color="0.4")
    axes[0].legend(ncols=4, loc="upper right")
    figure.savefig(FIGURE, dpi=130)


def main() -> None:
    hold_to_one_thread()
    document = document_option(__doc__ or "")
    runs = {}
    for count in PUBLISHED:
        runs[count] = long_run(count, PUBLISHED_TIME if count < 10 else 40.0)
        print(count, runs[count].seconds, flush=True)
    draw(runs)
    publish("bundles", f"{machine('numpy')}\n\n{long_runs(runs)}\n\n{robots()}", document)


if __name__ == "__main__":
    main()
