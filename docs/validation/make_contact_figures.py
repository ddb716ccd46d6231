"""Makes every number and figure of contact.md's cases: friction, knot, plectoneme, heap, crossing rods.

Run with ``python docs/validation/make_contact_figures.py`` (three minutes on one core; needs matplotlib);
names of parts may follow. It uses the scenes of the tests, tests/python/contact_cases.py.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from flagrs import ConvergenceError, Simulation
from flagrs.plot.canvas import COLOURS, GREY, dress, legend, new_figure
from matplotlib.axes import Axes

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "python"))

from contact_cases import (  # noqa: E402
    Capstan,
    Knot,
    Plectoneme,
    Watch,
    contact_forces,
    crossing,
    drag,
    heap,
    incline_velocity,
    linking_numbers,
    ring_pairs,
    settled_heap,
    weight,
)

Array = npt.NDArray[np.float64]
FIGURES = Path(__file__).with_name("figures")
ROWS: list[tuple[str, str, str, str]] = []


def row(what: str, theory: str, found: str, error: str) -> None:
    """Print a line of the table, and keep it for the end."""
    ROWS.append((what, theory, found, error))
    print(f"| {what} | {theory} | {found} | {error} |", flush=True)


def friction() -> None:
    """Stick and slip on an incline, and the capstan."""
    figure = new_figure(8.0, 3.4)
    left, right = figure.subplots(1, 2)
    slip = 1e-6
    steepness = np.concatenate([np.linspace(0.1, 0.95, 7), [0.99, 1.01], np.linspace(1.05, 2.0, 7)])
    for colour, mu in zip(COLOURS, (0.1, 0.3, 0.6), strict=False):
        found = np.array([incline_velocity(np.arctan(mu * s), mu, slip) for s in steepness])
        left.semilogy(steepness, found[:, 0] / slip, "o", color=colour, ms=4, label=f"$\\mu$ = {mu}")
        fine = np.linspace(0.05, 2.0, 80)
        exact = np.array([incline_velocity(np.arctan(mu * s), mu, slip)[1] for s in fine])
        left.semilogy(fine, exact / slip, "-", color=colour, linewidth=1.0)
        stuck = steepness < 1.0
        row(
            f"incline, mu = {mu}: creep below, sliding above",
            "v of the balance",
            f"{(found[stuck, 0] / slip).max():.3f} and {(found[~stuck, 0] / slip).min():.1f} slip velocities",
            f"{np.abs(found[:, 0] / found[:, 1] - 1.0).max():.0e}",
        )
    left.axhline(1.0, color=GREY, linewidth=0.8, linestyle=":")
    left.axvline(1.0, color=GREY, linewidth=0.8, linestyle=":")
    dress(left, "tan(angle) / $\\mu$", "velocity / slip velocity", "Rod on an incline (lines: theory)")
    legend(left)
    for colour, wrap in zip(COLOURS, (0.5 * np.pi, np.pi, 2.0 * np.pi), strict=False):
        turns = f"{wrap / np.pi:g}$\\pi$"
        curve = np.linspace(0.0, 0.52, 30)
        right.semilogy(curve, np.exp(curve * wrap), "-", color=colour, linewidth=1.0)
        marks = (0.0, 0.1, 0.2, 0.3, 0.5)
        for mu in marks:
            capstan = Capstan(wrap, mu)
            ratio, theory = capstan.ratio(), capstan.theory()
            label = f"wrapped by {turns}" if mu == 0.0 else None
            right.semilogy(mu, ratio, "o", color=colour, ms=5, label=label)
            row(
                f"capstan, {wrap / np.pi:g} pi, mu = {mu}",
                f"{np.exp(mu * wrap):.4f}; {theory:.4f} with bending",
                f"{ratio:.4f}",
                f"{100.0 * (ratio / theory - 1.0):+.2f} %",
            )
    dress(right, "$\\mu$", "pull / load", "Rope around a drum (lines: $e^{\\mu\\varphi}$)")
    legend(right)
    figure.savefig(FIGURES / "contact_friction.png", dpi=160)
    shorter = Capstan(np.pi, 0.5)
    row(
        "capstan, pi, mu = 0.5, 80 steps instead of 20",
        f"{shorter.theory():.4f}",
        f"{shorter.ratio(80):.4f}",
        "",
    )


def knot() -> None:
    """A trefoil knot pulled tight, with and without friction."""
    figure = new_figure(8.0, 3.4)
    left, right = figure.subplots(1, 2)
    for colour, mu in zip(COLOURS, (0.0, 0.05, 0.1), strict=False):
        case = Knot(loop=0.05, edge_count=200, friction=mu, speed=5e-3)
        rows = []
        start = time.perf_counter()
        while case.curvature().max() * case.RADIUS < 0.25 and time.perf_counter() - start < 60.0:
            try:
                case.simulation.step(20)
            except ConvergenceError as error:
                print(f"knot, mu = {mu}: {error}")
                break
            _, _, sizes = contact_forces(case.simulation)
            rows.append(
                [case.loop_radius(), case.force(), case.watch.closest(), sizes.sum(), case.shortening()]
            )
        radius, force, _, total, end = np.array(rows[3:]).T
        thin = case.RADIUS / radius
        reduced = force * radius**2 / case.bending
        loose = thin < 0.06  # beyond, the loop is no longer opposite to the braid
        left.plot(np.sqrt(thin[loose]), reduced[loose], "-", color=colour, label=f"$\\mu$ = {mu}")
        right.loglog(
            end / case.RADIUS, force * case.RADIUS**2 / case.bending, color=colour, label=f"$\\mu$ = {mu}"
        )
        if mu == 0.0:
            slope, limit = np.polyfit(np.sqrt(thin[loose]), reduced[loose], 1)
            line = np.array([0.0, 0.25])
            left.plot(line, limit + slope * line, ":", color=colour, linewidth=1.0)
            plain = (thin, reduced)
            row(
                "loose knot, F R^2/EI as R grows (linear in sqrt(h/R))",
                "0.5",
                f"{limit:.3f}",
                f"slope {slope:.2f}",
            )
        else:
            there = np.interp(thin, *plain)
            more = (reduced - there) / (mu * total * radius**2 / case.bending)
            row(
                f"knot, mu = {mu}: pull beyond the frictionless one over mu x sum of contact forces",
                "1",
                f"{more[loose].mean():.2f} (from {more[loose].min():.2f} to {more[loose].max():.2f})",
                "",
            )
            sigma = (reduced - there) / (mu * np.sqrt(1.0 / thin))
            row(
                f"knot, mu = {mu}: sigma in F R^2/EI = 1/2 + mu sigma (R/h)^(1/2)",
                "the same for every mu",
                f"{sigma[loose].mean():.2f}",
                f"h/R from {thin.min():.3f} to 0.06",
            )
        statistics, tight = case.simulation.statistics, 1.0 / case.curvature().max() / case.RADIUS
        row(
            f"knot, mu = {mu}: least distance / 2r, bent to {tight:.1f} radii",
            "> 0.95",
            f"{case.watch.least:.4f}",
            f"{statistics['newton_iterations'] / statistics['steps']:.1f} iterations a step, "
            f"{statistics['rejected_steps']} of {statistics['steps']} rejected",
        )
    left.axhline(0.5, color=GREY, linewidth=0.8, linestyle=":")
    left.set_xlim(0.0, None)
    left.set_ylim(0.0, None)
    dress(left, "$(h/R)^{1/2}$", "$F R^2/EI$", "Loose trefoil knot (grey: $R\\to\\infty$, 1/2)")
    legend(left)
    dress(right, "end shortening / h", "$F h^2/EI$", "Pull on the ends, to the tight knot")
    right.set_xticks([40, 60, 100, 200], ["40", "60", "100", "200"])
    right.minorticks_off()
    legend(right)
    figure.savefig(FIGURES / "contact_knot.png", dpi=160)


def plectoneme() -> None:
    """Ply angle, tension and pressure of a plectoneme against theory, for several twists and meshes."""
    figure = new_figure(8.0, 3.4)
    left, right = figure.subplots(1, 2)
    found = []
    for count, turns in ((160, 16), (250, 14), (250, 16), (250, 18), (400, 16)):
        case = Plectoneme(count, turns)
        case.wind()
        values = case.measured()
        theory = case.theory(values["torque"], values["radius"])
        for name in theory:
            row(
                f"plectoneme, {turns} turns, {count} edges: {name}",
                f"{theory[name]:.5g}",
                f"{values[name]:.5g}",
                f"{100.0 * (values[name] / theory[name] - 1.0):+.1f} %",
            )
        row(
            "the same: least distance / 2r, spread of angle",
            "> 0.95",
            f"{case.watch.least:.4f}",
            f"{values['spread']:.0e} rad",
        )
        if count == 250:
            found.append((values, theory, case))
    values, theory, case = found[-1]
    radius, bending = values["radius"], float(case.rod.EI_array()[0, 0, 0])
    angles = np.linspace(0.15, 0.4, 60)
    torque = 2.0 * np.sin(angles) ** 3 * np.cos(angles) / np.cos(2.0 * angles)
    curves = {"tension": np.sin(angles) ** 4 * (0.5 + 1.0 / np.cos(2.0 * angles))}
    curves["pressure"] = np.sin(angles) ** 4 / np.cos(2.0 * angles)
    left.plot(torque, angles, "-", color=COLOURS[0], linewidth=1.0, label="theory")
    for name, colour in (("tension", COLOURS[1]), ("pressure", COLOURS[2])):
        right.plot(torque, curves[name], "-", color=colour, linewidth=1.0)
    for k, (values, _, _) in enumerate(found):
        at = values["torque"] * values["radius"] / bending
        label = "simulation" if k == 0 else None
        left.plot(at, values["angle"], "o", color=COLOURS[1], ms=5, label=label)
        units = {"tension": radius**2 / bending, "pressure": radius**3 / bending}
        for name, colour, unit in (("tension", COLOURS[1], "r^2"), ("pressure", COLOURS[2], "r^3")):
            text = f"{name} $\\cdot\\,{unit}/EI$" if k == 0 else None
            right.plot(at, values[name] * units[name], "o", color=colour, ms=5, label=text)
    low, high = (f([v["torque"] * v["radius"] / bending for v, _, _ in found]) for f in (min, max))
    for axes in (left, right):
        axes.set_xlim(low - 0.3 * (high - low), high + 0.3 * (high - low))
    inside = (torque > low - 0.3 * (high - low)) & (torque < high + 0.3 * (high - low))
    left.set_ylim(angles[inside].min() - 0.01, angles[inside].max() + 0.01)
    right.set_ylim(0.0, 1.2 * curves["tension"][inside].max())
    dress(left, "torque $\\cdot\\, r/EI$", "ply angle / rad", "Plectoneme: ply angle")
    dress(right, "torque $\\cdot\\, r/EI$", "force", "Tension and pressure (lines: theory)")
    legend(left)
    legend(right)
    figure.savefig(FIGURES / "contact_plectoneme.png", dpi=160)


def draw(axes: Axes, simulation: Simulation, across: Array, up: Array, half: float) -> None:
    """Draw edges at their thickness, the nearest last, in a window of +- half [mm] around the middle."""
    x, edges, rods = simulation.nodes, simulation.edges, simulation.scene.rods
    up = up - (up @ across) * across
    up /= np.linalg.norm(up)
    rod_of_edge = np.repeat(np.arange(len(rods)), [len(rod.edge_array()) for rod in rods])
    held = {clamp.rod for clamp in simulation.scene.clamps if len(clamp.nodes) == len(rods[clamp.rod].nodes)}
    free = np.isin(rod_of_edge, list(held), invert=True)
    moving = np.unique(edges[free])
    middle = 0.5 * (x[moving].max(axis=0) + x[moving].min(axis=0))
    if len(rods) == 1 and half < 20.0:
        bent = np.linalg.norm(np.diff(x, 2, axis=0), axis=1)
        middle = x[1:-1][bent > 0.3 * bent.max()].mean(axis=0)
    flat = 1e3 * np.stack([(x - middle) @ across, (x - middle) @ up], axis=1)
    depth = (x[edges].mean(axis=1) - middle) @ np.cross(across, up)
    width = 2.0 * 2.2 * 72.0 / (2.0 * half)
    for k in np.argsort(depth):
        colour = COLOURS[rod_of_edge[k] % 6] if free[k] else GREY
        ends = flat[edges[k]].T
        axes.plot(*ends, "-", color="white", linewidth=1.25 * width, solid_capstyle="butt")
        axes.plot(*ends, "-", color=colour, linewidth=width, solid_capstyle="round")
    axes.set_aspect("equal")
    axes.set_xlim(-half, half)
    axes.set_ylim(-half, half)


def shapes() -> None:
    """Pictures of the knot, the plectoneme and the heap."""
    figure = new_figure(8.4, 3.0)
    panels = figure.subplots(1, 3)
    tight = Knot()
    while tight.curvature().max() * tight.RADIUS < 0.25:
        tight.simulation.step(10)
    ply = Plectoneme()
    ply.wind()
    scene = heap()
    pile = Simulation(scene, dt=2e-3, threads=1)
    while pile.time < 3.0:
        pile.step()
    up = ply.simulation.nodes[len(ply.simulation.nodes) // 2] - ply.simulation.nodes[[0, -1]].mean(axis=0)
    flattest = np.linalg.svd(tight.simulation.nodes[40:81] - tight.simulation.nodes[40:81].mean(axis=0))[2]
    along = tight.along
    views = (
        (tight.simulation, along, flattest[1], 12.0, "Tight trefoil knot"),
        (ply.simulation, np.array([1.0, 0.0, 0.0]), up, 80.0, "Plectoneme"),
        (pile, np.array([0.0, 1.0, 0.0]), np.array([-1.0, 0.0, 0.0]), 30.0, "Ten rods after 3 s, from above"),
    )
    for axes, (simulation, across, upwards, half, title) in zip(panels, views, strict=True):
        draw(axes, simulation, across, upwards, half)
        dress(axes, "mm", "mm", title)
    figure.savefig(FIGURES / "contact_shapes.png", dpi=160)


def piles() -> None:
    """A heap of ten rods: weight borne, least distance."""
    scene = heap()
    simulation, watch = settled_heap(scene)
    total = sum(weight(rod) for rod in scene.rods[:10])
    pairs, forces, _ = contact_forces(simulation)
    borne = forces[(pairs[:, 0] < 60) & (pairs[:, 1] >= 60)].sum(axis=0)
    creep = float(np.abs(drag(simulation)[:70].sum(axis=0)).max())
    statistics = simulation.statistics
    row(
        "heap: force on the rails / weight",
        "1",
        f"{borne[2] / total:.5f}",
        f"drag of creep / weight {creep / total:.0e}",
    )
    row(
        "heap: least distance / 2r",
        "> 0.95",
        f"{watch.least:.4f}",
        f"{statistics['newton_iterations'] / statistics['steps']:.1f} iterations a step, "
        f"{statistics['rejected_steps']} of {statistics['steps']} rejected",
    )


def crossings() -> None:
    """Rods driven through each other, rings pulled through each other."""
    choices: tuple[dict[str, Any], ...] = ({}, {"rtol": 1e-3})
    for options in choices:
        for dt in (1e-3, 1e-2, 0.1, 1.0):
            least, failed, count = np.inf, 0, 0
            for speed in (0.1, 1.0, 100.0):
                for angle in (0.3, 1.0, 1.57):
                    simulation = Simulation(crossing(speed, angle), dt=dt, threads=1, **options)
                    watch = Watch(simulation)
                    count += 1
                    try:
                        while speed * simulation.time < 0.03:
                            simulation.step()
                            watch.closest()
                    except ConvergenceError:
                        failed += 1
                    watch.closest()
                    assert simulation.nodes[8:10, 2].min() > simulation.nodes[2:4, 2].max()
                    least = min(least, watch.least)
            row(
                f"rods driven through each other, dt = {dt:g} s, {'rtol 1e-3' if options else 'fixed steps'}",
                "none crosses",
                f"0 of {count} cross, least distance / 2r {least:.4f}",
                f"{failed} ConvergenceErrors",
            )
    pulls: tuple[tuple[float, float, dict[str, Any]], ...] = (
        (1e-4, 1e-3, {}),
        (1e-4, 0.1, {}),
        (1e-2, 1e-3, {}),
        (1e-2, 0.1, {}),
        (1e-2, 0.1, {"rtol": 1e-3}),
        (1.0, 1.0, {"rtol": 1e-2}),
    )
    for load, dt, options in pulls:
        changed, least, contacts = 0, np.inf, 0
        for seed in (1, 2):
            simulation = Simulation(ring_pairs(30, seed, load), dt=dt, threads=1, **options)
            before = linking_numbers(simulation.nodes)
            simulation.step(6)
            changed += int((np.abs(linking_numbers(simulation.nodes) - before) > 0.5).sum())
            least = min(least, 1.0 + simulation.frame()["minimum_gap"] / 2e-3)
            contacts += simulation.frame()["contacts"]
        row(
            f"60 pairs of rings, {load:g} N a node, dt = {dt:g} s, {'rtol' if options else 'fixed'}",
            "linking numbers stay",
            f"{changed} changed, least distance / 2r {least:.4f}",
            f"{contacts} contacts",
        )


def main() -> None:
    """Run everything, or the parts named on the command line."""
    FIGURES.mkdir(exist_ok=True)
    parts = {part.__name__: part for part in (friction, knot, plectoneme, piles, crossings, shapes)}
    for name in sys.argv[1:] or parts:
        start = time.perf_counter()
        print(f"--- {name}")
        parts[name]()
        print(f"({time.perf_counter() - start:.0f} s)", flush=True)
    print("\n| case | theory | found | error, cost |\n|---|---|---|---|")
    for line in ROWS:
        print("| " + " | ".join(line) + " |")


if __name__ == "__main__":
    main()
