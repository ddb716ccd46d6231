"""The kernels of a step in flagrs, NumPy and Numba, on one thread, in one run: first checked, then timed.

Run ``python benches/python/kernels.py [--document docs/performance.md]``.
"""

from __future__ import annotations

import elasticity_numba
import elasticity_numpy
import flagrs
import numpy as np
import scipy.linalg
from clock import SAMPLE, Clock, Samples, hold_to_one_thread, race, wall
from document import document_option, machine, publish, table
from elasticity import FloatArray, chain_of, dense
from helix import EPSILON, helix_nodes, helix_scene
from stokeslets import mobility_numba, mobility_numpy

#: Largest difference of two versions over the largest entry. The published closed forms lose digits far away
#: and along a segment's axis: 7e-13 at 600 nodes, measured.
FLUID_TOLERANCE = 1e-11
#: As above, for gradient and Hessian: round-off of a few operations.
ELASTIC_TOLERANCE = 1e-13
#: Displacement of a node over an edge in the elastic state: far above what a time step moves it.
DISTURBANCE = 0.05


def check(name: str, value: FloatArray, reference: FloatArray, tolerance: float) -> None:
    """Stop the program if two versions do not agree."""
    difference = float(np.abs(value - reference).max() / np.abs(reference).max())
    if not difference < tolerance:
        raise SystemExit(f"{name} differs from flagrs by {difference:.1e} of its largest entry")


def mobility(count: int) -> dict[str, Samples]:
    """Race the assembly of the mobility matrix of a helix."""
    nodes = helix_nodes(count)
    edges = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    reference = flagrs.fluid.mobility(nodes, edges, EPSILON, threads=1)
    check("NumPy mobility", mobility_numpy(nodes, EPSILON), reference, FLUID_TOLERANCE)
    check("Numba mobility", mobility_numba(nodes, EPSILON), reference, FLUID_TOLERANCE)
    return race(
        {
            "flagrs": wall(lambda: flagrs.fluid.mobility(nodes, edges, EPSILON, threads=1)),
            "NumPy": wall(lambda: mobility_numpy(nodes, EPSILON)),
            "Numba": wall(lambda: mobility_numba(nodes, EPSILON)),
        }
    )


def fluid_clock(count: int) -> Clock:
    """Return the clock of assembly and LU inside a step, by the simulation's own statistics."""
    simulation = flagrs.Simulation(helix_scene(count, 0.0), scheme="explicit", dt=1e-6, threads=1)

    def spend(steps: int) -> float:
        before = simulation.statistics["seconds_fluid"]
        simulation.step(steps)
        return (simulation.statistics["seconds_fluid"] - before) / steps

    spend(1)
    steps = max(1, round(SAMPLE / spend(1)))

    def read() -> float:
        return spend(steps)

    return read


def factored_mobility(count: int) -> dict[str, Samples]:
    """Race assembly and LU together: what a step does for its fluid."""
    nodes = helix_nodes(count)
    return race(
        {
            "flagrs": fluid_clock(count),
            "NumPy": wall(lambda: scipy.linalg.lu_factor(mobility_numpy(nodes, EPSILON))),
            "Numba": wall(lambda: scipy.linalg.lu_factor(mobility_numba(nodes, EPSILON))),
        }
    )


def resistance(count: int) -> dict[str, Samples]:
    """Race the resistance matrix: assembly, a dense solve with 3N right-hand sides, hat weights."""
    nodes = helix_nodes(count)
    edges = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    basis = np.eye(count)
    by_node = [flagrs.fluid.hat_weights(nodes, edges, np.outer(row, [1.0, 0.0, 0.0]))[:, 0] for row in basis]
    weights = 8.0 * np.pi * np.kron(np.array(by_node), np.eye(3))
    identity = np.eye(3 * count)
    simulation = flagrs.Simulation(helix_scene(count, 0.0), threads=1)
    reference = simulation.resistance()
    calls = {
        "flagrs": simulation.resistance,
        "NumPy": lambda: weights @ np.linalg.solve(mobility_numpy(nodes, EPSILON), identity),
        "Numba": lambda: weights @ np.linalg.solve(mobility_numba(nodes, EPSILON), identity),
    }
    for name in ("NumPy", "Numba"):
        check(f"{name} resistance", calls[name](), reference, FLUID_TOLERANCE)
    return race({name: wall(call) for name, call in calls.items()})


def elasticity(count: int) -> dict[str, Samples]:
    """Race gradient and Hessian of a disturbed helix at its reference frames."""
    scene = helix_scene(count, DISTURBANCE)
    simulation = flagrs.Simulation(scene, threads=1)
    chain = chain_of(scene)
    calls = {
        "NumPy": elasticity_numpy.derivatives(chain),
        "Numba": elasticity_numba.derivatives(chain),
    }
    for name, call in calls.items():
        gradient, band = call()
        check(f"{name} gradient", gradient, simulation.gradient(), ELASTIC_TOLERANCE)
        check(f"{name} Hessian", dense(band), simulation.hessian().toarray(), ELASTIC_TOLERANCE)
    # One call makes gradient and Hessian.
    clocks = {"flagrs": wall(simulation.gradient)}
    return race(clocks | {name: wall(call) for name, call in calls.items()})


def row(name: str, size: str, samples: dict[str, Samples], count: float, scale: float = 1e9) -> list[str]:
    """Return a line of the table: each version per element, and its ratio to flagrs."""
    cells = [name, size]
    for version in ("flagrs", "NumPy", "Numba"):
        own = samples[version]
        median, least = (scale * seconds / count for seconds in (own.median, own.least))
        cells.append(f"{median:.3g} ({least:.3g}, {100.0 * own.spread:.0f} %)")
    for version in ("NumPy", "Numba"):
        median = samples[version].median / samples["flagrs"].median
        least = samples[version].least / samples["flagrs"].least
        cells.append(f"{median:.3g} ({least:.3g})")
    return cells


def main() -> None:
    """Run everything and publish the table."""
    hold_to_one_thread()
    path = document_option("Kernels in flagrs, NumPy and Numba.")
    rows = []
    for count in (59, 136, 600):
        pairs = count * (count - 1)
        rows.append(row("RSS assembly, ns per pair", f"{count} nodes", mobility(count), pairs))
    for count in (59, 136, 600):
        size = f"{3 * count} rows"
        rows.append(row("RSS assembly and LU, ms", size, factored_mobility(count), 1, 1e3))
    for count in (59, 136):
        size = f"{3 * count} rows"
        rows.append(row("resistance matrix, ms", size, resistance(count), 1, 1e3))
    for count in (59, 136, 1000):
        rows.append(
            row("elastic gradient and Hessian, ns per node", f"{count} nodes", elasticity(count), count)
        )
    head = ("kernel", "size", "flagrs", "NumPy", "Numba", "NumPy / flagrs", "Numba / flagrs")
    text = "\n\n".join(
        [
            machine("numpy", "scipy", "numba"),
            "Medians of 15 runs taken in turn, on one thread; in brackets the shortest run and the distance "
            "of the quartiles over the median. Ratios of medians; in brackets of the shortest runs.",
            table(head, rows),
        ]
    )
    publish("kernels", text, path)


if __name__ == "__main__":
    main()
