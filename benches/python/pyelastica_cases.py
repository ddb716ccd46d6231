"""Cantilevers brought to rest by flagrs and by PyElastica: error of the tip against wall time.

Run ``python benches/python/pyelastica_cases.py [--document docs/performance.md]``; some minutes. It needs
PyElastica, ``pip install 'flagrs[pyelastica]'``, and makes docs/images/pyelastica.png.

Both codes take the same rods on the same meshes, with the wall in the middle of the first element, and are
held against the elastica of their own rod: flagrs' does not shear, PyElastica's does.
"""

from __future__ import annotations

import time
from pathlib import Path

from clock import hold_to_one_thread

hold_to_one_thread()

import elastica as ea  # noqa: E402
import numpy as np  # noqa: E402
from document import document_option, machine, publish, table  # noqa: E402
from flagrs.plot.canvas import COLOURS, dress, legend, new_figure  # noqa: E402
from flagrs.validation.clamped_rod import (  # noqa: E402
    COMPLIANCE,
    EA,
    EI,
    LENGTH,
    MATERIAL,
    RADIUS,
    ClampedRod,
)
from flagrs.validation.elastica import tip_deflection  # noqa: E402
from flagrs.validation.equilibria import settle  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

IMAGE = Path(__file__).parents[2] / "docs" / "images" / "pyelastica.png"
COUNTS = (5, 10, 20, 40, 80)
LOADS = (1.0, 10.0)
#: PyElastica's shear correction of a circular section.
SHEAR_FACTOR = 27.0 / 28.0
#: Damping of all velocities [1/s], critical for the slowest vibration of 5 rad/s; time to rest [s].
DAMPING, DURATION = 10.0, 6.0


class Collection(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):
    """PyElastica's simulator, with what a damped cantilever needs."""


def with_flagrs(load: float, count: int) -> tuple[NDArray[np.float64], float]:
    """Return vertical and horizontal deflection of the tip over L, and the time it took [s]."""
    start = time.perf_counter()
    tip = settle(ClampedRod(count, tip_force=(0.0, 0.0, -load)).scene()).nodes[-1] / LENGTH
    return np.array([-tip[2], 1.0 - tip[0]]), time.perf_counter() - start


def with_pyelastica(load: float, count: int) -> tuple[NDArray[np.float64], float]:
    """Return vertical and horizontal deflection of the tip over L, and the time its steps took [s]."""
    edge = LENGTH / (count + 0.5)
    collection = Collection()
    rod = ea.CosseratRod.straight_rod(
        count + 1,
        np.array([-0.5 * edge, 0.0, 0.0]),
        np.array([1.0, 0.0, 0.0]),
        np.array([0.0, 0.0, 1.0]),
        (count + 1) * edge,
        RADIUS,
        MATERIAL.density,
        youngs_modulus=MATERIAL.youngs_modulus,
        shear_modulus=MATERIAL.shear_modulus,
    )
    # Half a wave of the fastest sound in an edge; below the limit of shear and bending waves here.
    dt = min(5e-5, 0.5 * edge / np.sqrt(MATERIAL.youngs_modulus / MATERIAL.density))
    collection.append(rod)
    collection.constrain(rod).using(
        ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
    )
    force = np.array([0.0, 0.0, -load * EI / LENGTH**2])
    collection.add_forcing_to(rod).using(ea.EndpointForces, np.zeros(3), force, ramp_up_time=0.1)
    collection.dampen(rod).using(ea.AnalyticalLinearDamper, uniform_damping_constant=DAMPING, time_step=dt)
    collection.finalize()
    start = time.perf_counter()
    ea.integrate(ea.PositionVerlet(), collection, DURATION, round(DURATION / dt), progress_bar=False)
    seconds = time.perf_counter() - start
    # What is left of the motion would move the tip by this much more.
    assert np.abs(rod.velocity_collection).max() / DAMPING < 1e-6 * LENGTH
    tip = rod.position_collection[:, -1] / LENGTH
    return np.array([-tip[2], 1.0 - tip[0]]), seconds


def main() -> None:
    document = document_option("Cantilevers by flagrs and PyElastica.")
    shear = EI / (SHEAR_FACTOR * MATERIAL.shear_modulus / MATERIAL.youngs_modulus * EA * LENGTH**2)
    with_pyelastica(1.0, 5)  # compiles
    with_flagrs(1.0, 5)
    rows, series = [], {}
    for load in LOADS:
        exact = {
            "flagrs": tip_deflection(load, COMPLIANCE),
            "PyElastica": tip_deflection(load, COMPLIANCE, shear=shear),
        }
        for name, solve in (("flagrs", with_flagrs), ("PyElastica", with_pyelastica)):
            for count in COUNTS:
                tip, seconds = solve(load, count)
                error = float(np.abs(tip - exact[name]).max())
                rows.append([name, f"{load:g}", str(count), f"{error:.1e}", f"{seconds:.3g}"])
                series.setdefault((name, load), []).append((seconds, error))
    figure = new_figure(5.2, 3.6)
    axes = figure.subplots()
    for (name, load), points in series.items():
        colour = COLOURS[0] if name == "flagrs" else COLOURS[1]
        style = "o-" if load == LOADS[0] else "s--"
        label = f"{name}, $PL^2/EI$ = {load:g}"
        axes.loglog(*np.array(points).T, style, color=colour, markersize=4, label=label)
    dress(axes, "wall time / s", "error of the tip / L", "A cantilever brought to rest, 5 to 80 edges")
    legend(axes)
    figure.savefig(IMAGE, dpi=150)
    head = ["code", "PL^2/EI", "edges", "error of the tip / L", "seconds"]
    publish("pyelastica", f"{machine('pyelastica')}\n\n{table(head, rows)}", document)


if __name__ == "__main__":
    main()
