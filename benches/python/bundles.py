"""Bundles of clamped flagella in contact: time of long runs, two methods side by side, speed against error.

Run ``python benches/python/bundles.py [--document docs/performance.md]``; about ten minutes.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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
#: Radius of the filaments [m]; helix radius, the size that errors refer to [m].
RADIUS, HELIX_RADIUS = 1e-3, 10e-3
#: Simulated time of the robots [s].
ROBOT_TIME = 100.0
#: Error asked for in the long runs.
RTOL = 1e-2
#: Time between rows of the figure [s].
EVERY = 0.5
#: Simulated time of the comparisons [s]: the flagella meet at about 2.6 s and are wrapped from 8 s on.
COMPARED_TIME = 9.0


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


@dataclass(frozen=True)
class Measures:
    """Two flagella in contact: nodes, distance of the tips [m] and sum of contact forces [N] over time."""

    nodes: NDArray[np.float64]
    tips: NDArray[np.float64]
    force: NDArray[np.float64]
    gap: float
    seconds: float
    counts: dict[str, float]


def bundle(contact: dict[str, Any], **options: Any) -> Measures:
    scene = flagrs.scenarios.clamped_flagella(count=2, contact=contact)
    simulation = flagrs.Simulation(scene, threads=1, **options)
    nodes, force, gap = [], [], np.inf
    # Rejected guesses aside, every accepted step is seen: the gap is that of all of them.
    for frame in np.arange(1, round(COMPARED_TIME / 0.1) + 1):
        simulation.run(0.1 * frame, 0.1, path=False)
        gap = min(gap, simulation.minimum_gap)
        nodes.append(simulation.nodes)
        force.append(float(simulation.contact_forces()[1].sum()))
    found = np.array(nodes)
    tips = np.linalg.norm(found[:, 67] - found[:, 135], axis=1)
    counts = simulation.statistics
    return Measures(found, tips, np.array(force), gap / (2.0 * RADIUS), counts["seconds_total"], counts)


def mean_force(measures: Measures) -> float:
    """Return the mean over the second half of the frames [N]."""
    return float(measures.force[len(measures.force) // 2 :].mean())


METHODS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "barrier, rtol 1e-1": ({}, {"rtol": 1e-1}),
    "barrier, rtol 1e-2": ({}, {"rtol": 1e-2}),
    "barrier, rtol 1e-3": ({}, {"rtol": 1e-3}),
    "barrier, rtol 1e-4": ({}, {"rtol": 1e-4}),
    "barrier, tolerance 0.1, rtol 1e-3": ({"tolerance": 0.1}, {"rtol": 1e-3}),
    "barrier, tolerance 0.02, rtol 1e-3": ({"tolerance": 0.02}, {"rtol": 1e-3}),
    "barrier, dt 3.3 ms": ({}, {}),
    "Spillmann-Teschner, rtol 1e-2": ({"method": "spillmann-teschner"}, {"rtol": 1e-2}),
    "Spillmann-Teschner, rtol 1e-3": ({"method": "spillmann-teschner"}, {"rtol": 1e-3}),
    "Spillmann-Teschner, dt 3.3 ms": ({"method": "spillmann-teschner"}, {}),
    "Spillmann-Teschner, explicit, dt 1 ms": (
        {"method": "spillmann-teschner"},
        {"scheme": "explicit", "dt": 1e-3},
    ),
}


def comparison() -> str:
    reference, check = bundle({}, rtol=1e-5), bundle({}, rtol=1e-4)
    rows = []
    for name, (contact, options) in METHODS.items():
        found = bundle(contact, **options)
        apart = np.linalg.norm(found.nodes - reference.nodes, axis=2).max() / HELIX_RADIUS
        tips = np.abs(found.tips - reference.tips).max() / HELIX_RADIUS
        rows.append(
            [
                name,
                f"{apart:.1e}",
                f"{tips:.1e}",
                f"{1e3 * mean_force(found):.2f}",
                f"{found.gap:+.4f}",
                f"{1e3 * found.seconds / COMPARED_TIME:.0f}",
                f"{found.counts['steps']:.0f}",
                f"{found.counts['newton_iterations']:.0f}",
                f"{found.counts['contact_iterations']:.0f}",
                f"{found.counts['rejected_steps']:.0f}",
            ]
        )
    head = (
        f"two flagella, {COMPARED_TIME:g} s",
        "error of nodes",
        "of tip distance",
        "mean force [mN]",
        "smallest gap / 2r",
        "ms per simulated s",
        "steps",
        "Newton",
        "passes",
        "rejected",
    )
    own = np.linalg.norm(reference.nodes - check.nodes, axis=2).max() / HELIX_RADIUS
    return (
        f"{table(head, rows)}\n\nErrors are the largest at any of the frames, 0.1 s apart, over the helix "
        f"radius, against the barrier (tolerance 0.05) at rtol 1e-5, which moves by {own:.0e} from rtol "
        f"1e-4; its mean force is {1e3 * mean_force(reference):.2f} mN. Gaps are those of the frames."
    )


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
    compared = comparison()
    print(compared, flush=True)
    runs = {}
    for count in PUBLISHED:
        runs[count] = long_run(count, PUBLISHED_TIME if count < 10 else 40.0)
        print(count, runs[count].seconds, flush=True)
    draw(runs)
    publish("bundles", f"{machine('numpy')}\n\n{long_runs(runs)}\n\n{robots()}\n\n{compared}", document)


if __name__ == "__main__":
    main()
