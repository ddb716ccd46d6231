"""Two flagella in contact by two methods and several tolerances: speed against error, forces, iterations.

Run ``python benches/python/contact_methods.py [--document docs/performance.md]``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import flagrs
import numpy as np
from clock import hold_to_one_thread
from document import document_option, machine, publish, table
from flagrs.contact_scales import contact_scales, pair_stiffness
from numpy.typing import NDArray

#: Radius of the filaments [m]; helix radius, the size that errors refer to [m].
RADIUS, HELIX_RADIUS = 1e-3, 10e-3
#: Simulated time [s]: the flagella meet at about 2.6 s and are wrapped from 8 s on.
COMPARED_TIME = 9.0


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
    scene = flagrs.scenarios.clamped_flagella(count=2)
    if "stiffness" in contact:
        thickness = 2.0 * float(scene.rods[0].radius_array()[0])
        usual = pair_stiffness(
            contact_scales(scene), (0, 1), thickness, flagrs.Contact().tolerance_or_default()
        )
        contact = {**contact, "stiffness": contact["stiffness"] * usual}
    scene = scene.replace(contact=flagrs.Contact(**contact))
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


#: Options of contact, with the stiffness over the one taken from the scene, and of the simulation.
METHODS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "barrier, rtol 1e-1": ({}, {"rtol": 1e-1}),
    "barrier, rtol 1e-2": ({}, {"rtol": 1e-2}),
    "barrier, rtol 1e-3": ({}, {"rtol": 1e-3}),
    "barrier, rtol 1e-4": ({}, {"rtol": 1e-4}),
    "barrier, tolerance 0.1, rtol 1e-3": ({"tolerance": 0.1}, {"rtol": 1e-3}),
    "barrier, tolerance 0.02, rtol 1e-3": ({"tolerance": 0.02}, {"rtol": 1e-3}),
    "barrier, a tenth of the stiffness, rtol 1e-2": ({"stiffness": 0.1}, {"rtol": 1e-2}),
    "barrier, ten times the stiffness, rtol 1e-2": ({"stiffness": 10.0}, {"rtol": 1e-2}),
    "barrier, a hundred times, rtol 1e-2": ({"stiffness": 100.0}, {"rtol": 1e-2}),
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


def main() -> None:
    hold_to_one_thread()
    document = document_option(__doc__ or "")
    publish("contact-methods", f"{machine('numpy')}\n\n{comparison()}", document)


if __name__ == "__main__":
    main()
