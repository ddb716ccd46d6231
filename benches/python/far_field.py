"""The product of the mobility with a force density without its matrix: its time and error, and whole steps.

Run ``python benches/python/far_field.py [--document docs/performance.md]``. The scenes are 5 to 1470 helical
flagella of 68 nodes, scattered at one density whatever their number. Errors are the largest at any of 2000
nodes, over the largest component of the product, for a random and a uniform force density; times are the
shortest of several, of one thread. The direct sum is timed on at most 2000 targets beyond 10,000 nodes, and
scaled.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

import flagrs
import numpy as np
import numpy.typing as npt
from clock import hold_to_one_thread
from document import document_option, machine, publish, table
from flagrs.plot.canvas import dress, new_figure

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

FIGURE = Path(__file__).parents[2] / "docs" / "images" / "far_field.png"
COUNTS = (5, 15, 45, 150, 450, 1470)
ERRORS = (1e-4, 1e-6, 1e-8)
#: Nodes of a flagellum; its length and radius, and the side of the cube there is for each [m].
NODES, LENGTH, RADIUS, SPACING = 68, 0.2, 0.01, 0.15
EPSILON = 1.65e-3
SAMPLE = 2000
#: Nodes up to which the matrix is stored (0.7 GB) and the direct sum is timed in full.
MOST_STORED, MOST_DIRECT = 3100, 10_500
#: Flagella of the scenes that take a step, and the most that take it with the matrix.
STEPPED, MOST_DENSE = (2, 6, 15, 30, 300), 30


@dataclass
class Result:
    """Times [s] and errors at one size."""

    nodes: int
    direct: float = 0.0
    stored: float | None = None
    product: dict[float, float] = field(default_factory=dict)
    all_threads: dict[float, float] = field(default_factory=dict)
    setup: dict[float, float] = field(default_factory=dict)
    error: dict[float, float] = field(default_factory=dict)
    megabytes: dict[float, float] = field(default_factory=dict)


def flagella(count: int) -> list[FloatArray]:
    """Return the nodes of helices anywhere in a cube and pointing anywhere [m]."""
    random = np.random.default_rng(1)
    along = np.linspace(0.0, LENGTH, NODES)
    phase = 2.0 * np.pi * along / 0.05
    found = []
    for _ in range(count):
        frame, _ = np.linalg.qr(random.normal(size=(3, 3)))
        local = np.stack([RADIUS * np.cos(phase), RADIUS * np.sin(phase), along], axis=1)
        found.append(local @ frame.T + SPACING * count ** (1 / 3) * random.uniform(-0.5, 0.5, 3))
    return found


def network(rods: list[FloatArray]) -> tuple[FloatArray, IntArray]:
    first = np.arange(NODES * len(rods)).reshape(-1, NODES)[:, :-1].ravel()
    return np.concatenate(rods), np.stack([first, first + 1], axis=1)


def shortest(call: Callable[[], object], budget: float = 1.0) -> float:
    """Return the shortest time of calls that take so long together, but of two at least [s]."""
    times: list[float] = []
    while len(times) < 2 or (sum(times) < budget and len(times) < 50):
        begun = perf_counter()
        call()
        times.append(perf_counter() - begun)
    return min(times)


def study(count: int) -> Result:
    nodes, edges = network(flagella(count))
    total = len(nodes)
    result = Result(total)
    random = np.random.default_rng(2)
    densities = (np.tile([1.0, 0.5, -0.3], (total, 1)), random.normal(size=(total, 3)))
    sample = np.unique(np.linspace(0, total - 1, SAMPLE).astype(int))
    targets = nodes if total <= MOST_DIRECT else nodes[sample]
    viscosity = 1.0 / (8.0 * np.pi)

    def direct(at: FloatArray, density: FloatArray) -> FloatArray:
        return flagrs.fluid.velocity(at, nodes, edges, density, viscosity, EPSILON, threads=1)

    exact = [direct(nodes[sample], density) for density in densities]
    result.direct = shortest(lambda: direct(targets, densities[1])) * total / len(targets)
    if total <= MOST_STORED:
        matrix = flagrs.fluid.mobility(nodes, edges, EPSILON)
        flat = densities[1].ravel()
        result.stored = shortest(lambda: matrix @ flat)
    for error in ERRORS:

        def build(threads: int | None = 1, error: float = error) -> flagrs.fluid.FastMobility:
            return flagrs.fluid.FastMobility(nodes, edges, EPSILON, error=error, threads=threads)

        product = build()
        result.setup[error] = shortest(lambda product=product: product.update(nodes), 0.5)
        result.product[error] = shortest(lambda product=product: product.apply(densities[1]))
        result.megabytes[error] = product.bytes / 1e6
        found = [product.apply(density) for density in densities]
        result.error[error] = max(
            float(np.abs(flow[sample] - true).max() / np.abs(flow).max())
            for flow, true in zip(found, exact, strict=True)
        )
        shared = build(None)
        result.all_threads[error] = shortest(lambda shared=shared: shared.apply(densities[1]))
    return result


def products(results: list[Result]) -> str:
    rows = []
    for result in results:
        stored = "-" if result.stored is None else f"{1e3 * result.stored:.2f}"
        for error in ERRORS:
            rows.append(
                [
                    f"{result.nodes:,}",
                    f"{error:.0e}",
                    f"{result.error[error]:.0e}",
                    f"{1e3 * result.product[error]:.2f}",
                    f"{1e6 * result.product[error] / result.nodes:.2f}",
                    f"{1e3 * result.all_threads[error]:.2f}",
                    f"{1e3 * result.setup[error]:.1f}",
                    f"{result.megabytes[error]:.0f}",
                    f"{1e3 * result.direct:.1f}",
                    stored,
                ]
            )
    head = (
        "nodes",
        "error asked for",
        "error found",
        "product [ms]",
        "per node [us]",
        "all threads [ms]",
        "setup [ms]",
        "memory [MB]",
        "direct sum [ms]",
        "stored matrix [ms]",
    )
    few, many = results[1], results[-1]
    growth = ", ".join(
        f"{many.product[error] / many.nodes / (few.product[error] / few.nodes):.1f} at {error:.0e}"
        for error in ERRORS
    )
    note = f"From {few.nodes:,} to {many.nodes:,} nodes the cost per node grows by {growth}."
    return f"{table(head, rows)}\n\n{note}"


def step(count: int, options: Mapping[str, float]) -> tuple[FloatArray, float]:
    """Return the displacements of a step of flagella that sink [m], and how long it took [s]."""
    material = flagrs.scenarios.clamped_flagella(count=1).rods[0].material
    rods = [flagrs.Rod.from_nodes(nodes, radius=1e-3, material=material) for nodes in flagella(count)]
    fluid = flagrs.Fluid(viscosity=0.1, epsilon=EPSILON, density=0.0, **options)
    scene = flagrs.Scene(rods=rods, fluid=fluid, gravity=(0.0, 0.0, -9.81))
    simulation = flagrs.Simulation(scene, dt=1e-3, threads=1)
    before = simulation.nodes.copy()
    begun = perf_counter()
    simulation.step()
    return simulation.nodes - before, perf_counter() - begun


def steps() -> str:
    rows = []
    for count in STEPPED:
        exact, dense = step(count, {"far_field_nodes": 10**9}) if count <= MOST_DENSE else (None, None)
        for error in ERRORS[:2]:
            moved, seconds = step(count, {"far_field_nodes": 0, "far_field_error": error})
            apart = "-" if exact is None else f"{np.abs(moved - exact).max() / np.abs(exact).max():.0e}"
            took = "-" if dense is None else f"{1e3 * dense:.0f}"
            rows.append([f"{count * NODES:,}", f"{error:.0e}", f"{1e3 * seconds:.0f}", took, apart])
    head = (
        "nodes",
        "error asked for",
        "step [ms]",
        "step with the matrix [ms]",
        "difference / largest displacement",
    )
    return table(head, rows)


def draw(results: list[Result]) -> None:
    figure = new_figure(10.0, 4.6)
    times, errors = figure.subplots(1, 2)
    nodes = [result.nodes for result in results]
    times.loglog(nodes, [result.direct for result in results], "k--", label="direct sum")
    stored = [result for result in results if result.stored is not None]
    times.loglog(
        [result.nodes for result in stored],
        [result.stored for result in stored],
        "ks-",
        label="stored matrix",
    )
    for marker, error in zip("o^v", ERRORS, strict=True):
        (line,) = times.loglog(
            nodes,
            [result.product[error] for result in results],
            marker + "-",
            label=f"multipoles, error {error:.0e}",
        )
        errors.loglog(
            nodes, [result.error[error] for result in results], marker + "-", color=line.get_color()
        )
        errors.axhline(error, color=line.get_color(), linestyle=":")
        errors.annotate(
            f"{error:.0e} asked for", (nodes[0], error), xytext=(0, 3), textcoords="offset points"
        )
    dress(times, "nodes", "time of a product on one thread [s]", "Time")
    dress(errors, "nodes", "largest error / largest component", "Error found")
    times.legend()
    FIGURE.parent.mkdir(exist_ok=True)
    figure.savefig(FIGURE, dpi=130)


def main() -> None:
    hold_to_one_thread()
    document = document_option(__doc__ or "")
    results = [study(count) for count in COUNTS]
    draw(results)
    publish("far-field", f"{machine('numpy')}\n\n{products(results)}\n\n{steps()}", document)


if __name__ == "__main__":
    main()
