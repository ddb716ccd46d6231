"""PyElastica's localized buckling by flagrs and by PyElastica: error of the bulge against wall time.

Run ``python benches/python/pyelastica_localized.py [--document docs/performance.md]``; an hour or less. It
needs PyElastica, ``pip install 'flagrs[pyelastica]'``, and makes docs/images/pyelastica_localized.png.

A straight rod of length 100 whose ends are turned against each other by 27 turns and moved together by 3, in
500 s, comes to rest with its slack in one helical bulge. Settings are those of PyElastica's example
(examples/HelicalBucklingCase) but for the number of elements; both codes begin with a push of 1e-6 and are
held against the homoclinic solution of an infinitely long rod, moment 98.541 and tension 2900.99.
"""

from __future__ import annotations

import time
from pathlib import Path

from clock import hold_to_one_thread

hold_to_one_thread()

import elastica as ea  # noqa: E402
import numpy as np  # noqa: E402
from document import document_option, machine, publish, table  # noqa: E402
from flagrs import Clamp, Fluid, Material, Rod, Rotation, Scene, Simulation, Table  # noqa: E402
from flagrs.plot.canvas import COLOURS, dress, legend, new_figure  # noqa: E402
from flagrs.validation.equilibria import settle  # noqa: E402
from flagrs.validation.problems.localized import bulge, moment_and_tension  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

IMAGE = Path(__file__).parents[2] / "docs" / "images" / "pyelastica_localized.png"
LENGTH, RADIUS, SLACK, TURNS = 100.0, 0.35, 3.0, 27.0
BENDING, TWISTING, YOUNGS_MODULUS, SHEAR = 1.345, 0.789, 1e6, 1e5
AREA = np.pi * RADIUS**2
#: Damping of all velocities [1/s], time of the drive and time to rest [s].
DAMPING, DRIVEN, DURATION = 0.01, 500.0, 10_500.0
COUNTS = {"flagrs": (50, 100, 200, 400), "PyElastica": (50, 100)}
Array = NDArray[np.float64]


class Collection(ea.BaseSystemCollection, ea.Constraints, ea.Damping):
    """PyElastica's simulator, with what this case needs."""


def error(nodes: Array) -> float:
    """Return the error of the inclination (K,) of the edges to the axis over its largest, root mean square."""
    edges = np.diff(nodes, axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    axis = (nodes[-1] - nodes[0]) / np.linalg.norm(nodes[-1] - nodes[0])
    found = np.arccos(np.clip(edges @ axis / lengths, -1.0, 1.0))
    along = (np.cumsum(lengths) - 0.5 * lengths) / lengths.sum() - 0.5
    fine = np.linspace(-0.5, 0.5, 4001)
    exact = bulge(fine, *moment_and_tension(ratio=TWISTING / BENDING))[0]
    away = found - np.interp(along, fine, exact)
    return float(np.sqrt((away**2).mean()) / exact.max())


def with_flagrs(count: int) -> tuple[float, float]:
    """Return the error at rest, and the time it took [s]."""
    start = time.perf_counter()
    # The clamped edges reach half an edge beyond either end.
    edge = LENGTH / (count - 1)
    nodes = np.zeros((count + 1, 3))
    nodes[:, 2] = edge * np.arange(count + 1)
    nodes[count // 2, 1] += 1e-6
    rod = Rod(
        nodes=nodes,
        rest_nodes=nodes * [0.0, 0.0, 1.0],
        radius=RADIUS,
        material=Material(youngs_modulus=YOUNGS_MODULUS, density=1.0 / AREA),
        EA=YOUNGS_MODULUS * AREA,
        EI=BENDING,
        GJ=TWISTING,
    )

    def end(first: int, sign: float) -> Clamp:
        times = (0.0, DRIVEN)
        drive = Table(times=times, values=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, sign * 0.5 * SLACK]]))
        turn = Table(times=times, values=(0.0, sign * np.pi * TURNS))
        rotation = Rotation(axis=(0.0, 0.0, 1.0), angle=turn)
        return Clamp(
            nodes=(first, first + 1),
            edges=(0 if first == 0 else count - 1,),
            displacement=drive,
            rotation=rotation,
        )

    fluid = Fluid(viscosity=DAMPING / (4.0 * np.pi), model="RFT", density=0.0)
    scene = Scene(rods=rod, fluid=fluid, clamps=(end(0, 1.0), end(count - 1, -1.0)))
    simulation = Simulation(scene, rtol=1e-2, threads=1)
    simulation.run(until=DRIVEN, save_every=DRIVEN, path=False)
    rested = scene.replace(clamps=tuple(clamp.replace(displacement=(0.0, 0.0, 0.0), rotation=None) for clamp in scene.clamps))
    held = Simulation(rested, rtol=1e-2, threads=1)
    held.load_state(simulation.state())
    held.run(until=DURATION, save_every=DURATION - DRIVEN, path=False)
    return error(held.nodes[:]), time.perf_counter() - start


def with_pyelastica(count: int, duration: float = DURATION) -> tuple[float, float]:
    """Return the error at the end, and the time its steps took [s]."""
    # The example's step at its 100 elements; longer ones are unstable on coarser meshes too, by shear.
    dt = min(1e-3, 1e-3 * LENGTH / count)
    collection = Collection()
    rod = ea.CosseratRod.straight_rod(
        count,
        np.zeros(3),
        np.array([0.0, 0.0, 1.0]),
        np.array([0.0, 1.0, 0.0]),
        LENGTH,
        RADIUS,
        1.0 / AREA,
        youngs_modulus=YOUNGS_MODULUS,
        shear_modulus=YOUNGS_MODULUS / 100.0,
    )
    rod.shear_matrix[:] = SHEAR * np.identity(3)[:, :, None]
    rod.bend_matrix[:] = np.diag([BENDING, BENDING, TWISTING])[:, :, None]
    collection.append(rod)
    collection.constrain(rod).using(
        ea.HelicalBucklingBC,
        constrained_position_idx=(0, -1),
        constrained_director_idx=(0, -1),
        twisting_time=DRIVEN,
        slack=SLACK,
        number_of_rotations=TURNS,
    )
    collection.dampen(rod).using(ea.AnalyticalLinearDamper, uniform_damping_constant=DAMPING, time_step=dt)
    collection.finalize()
    rod.velocity_collection[1, count // 2] += 1e-6
    start = time.perf_counter()
    ea.integrate(ea.PositionVerlet(), collection, duration, round(duration / dt), progress_bar=False)
    seconds = time.perf_counter() - start
    return error(rod.position_collection.T), seconds


def main() -> None:
    """Run both, write the table and the figure."""
    document = document_option("Localized buckling by flagrs and PyElastica.")
    with_pyelastica(20, 1.0)  # compiles
    rows, series = [], {}
    for name, solve in (("flagrs", with_flagrs), ("PyElastica", with_pyelastica)):
        for count in COUNTS[name]:
            away, seconds = solve(count)
            print(name, count, away, seconds, flush=True)
            rows.append([name, str(count), f"{away:.1e}", f"{seconds:.3g}"])
            series.setdefault(name, []).append((seconds, away))
    figure = new_figure(5.2, 3.6)
    axes = figure.subplots()
    for (name, points), colour in zip(series.items(), COLOURS, strict=False):
        axes.loglog(*np.array(points).T, "o-", color=colour, markersize=4, label=name)
    dress(axes, "wall time / s", "error of the bulge", "Localized buckling, 50 to 400 edges")
    legend(axes)
    figure.savefig(IMAGE, dpi=150)
    head = ["code", "edges", "error of the bulge", "seconds"]
    publish("pyelastica-localized", f"{machine('pyelastica')}\n\n{table(head, rows)}", document)


if __name__ == "__main__":
    main()
