"""Whole steps of the robot and of two clamped flagella in every scheme, in one run, by part.

Run ``python benches/python/steps.py [--document docs/performance.md]``.
"""

from __future__ import annotations

import math
import statistics
import time
from dataclasses import dataclass, field

import flagrs
from clock import Samples, hold_to_one_thread
from document import document_option, machine, publish, table

#: Steps after a change of scheme that are not measured.
SETTLING = 50
#: Steps between returns to the start, so that every sample measures the same motion.
BLOCK = 60
#: Samples of each scheme.
REPEATS = 15
#: Simulated time of the start [s]: any, and long after the clamped flagella first touch, at about 4 s.
APART, BUNDLED = 0.5, 10.0
#: Schemes with their steps [s]; None for the default of the implicit schemes.
SCHEMES = (("overdamped", None), ("implicit", None), ("explicit", 1e-3), ("explicit", 1e-4))
#: Parts of a step in the statistics, and their headings.
PARTS = {
    "seconds_fluid": "fluid matrix",
    "seconds_assembly": "assembly",
    "seconds_linear": "linear",
    "seconds_contact": "contact",
}
COUNTS = {"newton_iterations": "Newton", "krylov_iterations": "Krylov", "contact_iterations": "passes"}


@dataclass
class Case:
    """A scene in one scheme, with what its blocks of steps have taken.

    Attributes
    ----------
    scene : str
        What is simulated.
    simulation : Simulation
        The simulation, settled.
    blocks : list of dict
        Seconds and counts per step, one mapping per block.
    """

    scene: str
    simulation: flagrs.Simulation
    blocks: list[dict[str, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Settle, and remember the start of every block."""
        self.simulation.step(SETTLING)
        self.start = self.simulation.state()

    def sample(self) -> None:
        """Make a block of steps from the start."""
        self.simulation.load_state(self.start)
        before = self.simulation.statistics
        begun = time.perf_counter()
        self.simulation.step(BLOCK)
        wall = time.perf_counter() - begun
        after = self.simulation.statistics
        block = {name: (after[name] - before[name]) / BLOCK for name in (*PARTS, *COUNTS)}
        self.blocks.append(block | {"wall": wall / BLOCK})

    def median(self, name: str) -> float:
        """Return the median over the blocks."""
        return statistics.median(block[name] for block in self.blocks)

    def row(self) -> list[str]:
        """Return the case's line of the table."""
        wall = Samples(tuple(block["wall"] for block in self.blocks))
        dt = self.simulation.dt
        rest = statistics.median(block["wall"] - sum(block[part] for part in PARTS) for block in self.blocks)
        return [
            self.scene,
            f"{self.simulation.scheme}, {1e3 * dt:.3g} ms",
            f"{1e3 * wall.median:.3f} ({1e3 * wall.least:.3f}, {100.0 * wall.spread:.0f} %)",
            *(f"{1e3 * self.median(part):.3f}" for part in PARTS),
            f"{1e3 * rest:.3f}",
            *(f"{self.median(count):.1f}" for count in COUNTS),
            f"{wall.median / dt:.3g}",
            f"{dt / wall.median:.3g}",
        ]


def cases(name: str, scene: flagrs.Scene, start: float) -> list[Case]:
    """Return the scene in every scheme, all from the state of the default scheme at the time `start` [s]."""
    first = flagrs.Simulation(scene, rtol=None, threads=1)
    first.step(math.floor(start / first.dt))
    state = first.state()
    result = []
    for scheme, dt in SCHEMES:
        simulation = flagrs.Simulation(scene, scheme=scheme, dt=first.dt if dt is None else dt, threads=1)
        simulation.load_state(state)
        result.append(Case(name, simulation))
    return result


def main() -> None:
    """Run everything and publish the table."""
    hold_to_one_thread()
    path = document_option("Whole steps by part.")
    robot, flagella = flagrs.scenarios.robot(rpm=20.0), flagrs.scenarios.clamped_flagella(count=2)
    everything = [
        *cases("robot", robot, APART),
        *cases("two clamped flagella, apart", flagella, APART),
        *cases("two clamped flagella, in contact", flagella, BUNDLED),
    ]
    for _ in range(REPEATS):
        for case in everything:
            case.sample()
    head = ["scene", "scheme, dt", "step", *PARTS.values(), "rest", *COUNTS.values(), "s per s", "real time"]
    text = "\n\n".join(
        [
            machine("numpy"),
            f"Milliseconds of a step on one thread: medians of {REPEATS} blocks of {BLOCK} steps, taken in "
            "turn; in brackets the fastest block and the distance of the quartiles over the median. "
            "Iterations per step. *s per s*: wall time per simulated second; *real time*: its inverse.",
            table(head, [case.row() for case in everything]),
        ]
    )
    publish("steps", text, path)


if __name__ == "__main__":
    main()
