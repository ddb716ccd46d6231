"""Many states side by side: what a case costs beyond its steps, and how far two threads carry."""

from __future__ import annotations

import os

import flagrs
from clock import Samples, hold_to_one_thread, race, wall
from document import document_option, machine, publish, table

#: Cases of a rollout, steps of each, and repeats of everything.
CASES, STEPS, REPEATS = 64, 20, 9


def scenes() -> dict[str, flagrs.Scene]:
    """Return what is rolled out: little and much work in a step."""
    soft = flagrs.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
    rod = flagrs.Rod.straight(length=0.05, edge_count=8, radius=1e-3, material=soft)
    pulled = flagrs.Scene(
        rods=rod,
        fluid=flagrs.Fluid(viscosity=1.0, model="RFT"),
        clamps=flagrs.Clamp(nodes=(0, 1), edges=(0,)),
        loads=flagrs.PointLoad(node=8, force=(0.0, 1e-5, 0.0)),
    )
    return {"a rod of 8 edges, local drag": pulled, "the robot, 59 nodes": flagrs.scenarios.robot()}


def row(name: str, scene: flagrs.Scene) -> list[str]:
    """Return one line of the table."""
    simulation = flagrs.Simulation(scene, rtol=None, threads=1)
    start = simulation.state()
    states = [start] * CASES

    def one_by_one() -> None:
        for state in states:
            simulation.load_state(state)
            simulation.step(STEPS)

    def rollout(threads: int, steps: int) -> None:
        flagrs.rollout(simulation, states, steps=steps, threads=threads).check()

    found: dict[str, Samples] = race(
        {
            "one by one": wall(one_by_one),
            "one thread": wall(lambda: rollout(1, STEPS)),
            "two threads": wall(lambda: rollout(2, STEPS)),
            "one step": wall(lambda: rollout(1, 1)),
        },
        REPEATS,
    )
    least = {what: samples.least for what, samples in found.items()}
    # A step's own cost from the difference of 20 and 1; what is left of one is the case's.
    step = (least["one thread"] - least["one step"]) / (CASES * (STEPS - 1))
    overhead = least["one step"] / CASES - step
    return [
        name,
        *(f"{1e3 * least[what]:.1f}" for what in ("one by one", "one thread", "two threads")),
        f"{least['one thread'] / least['two threads']:.2f}",
        f"{1e6 * step:.0f}",
        f"{1e6 * overhead:.0f}",
    ]


def main() -> None:
    """Measure everything and publish the table."""
    hold_to_one_thread()
    path = document_option("Many states side by side.")
    head = [
        f"{CASES} cases of {STEPS} steps",
        "one by one [ms]",
        "rollout, one thread [ms]",
        "two threads [ms]",
        "speed-up",
        "a step [us]",
        "a case besides [us]",
    ]
    rows = [row(name, scene) for name, scene in scenes().items()]
    publish("rollouts", f"{machine('numpy')} Processors: {os.cpu_count()}.\n\n{table(head, rows)}", path)


if __name__ == "__main__":
    main()
