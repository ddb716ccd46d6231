"""Makes every number and figure of fluid.md: regularized Stokeslet segments against references of their own.

Run with ``python docs/validation/make_fluid_figures.py`` (about two minutes on one core; needs matplotlib).
The tests in tests/python/test_fluid_validation.py use the same geometries and references. The viscosity is
1 Pa s throughout, so that forces at 1 m/s, in N, are resistances in N s/m.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from flagrs import fluid
from flagrs.plot.canvas import COLOURS, dress, legend, new_figure
from flagrs.validation.drag_references import (
    TORUS_EXACT,
    cylinder_series,
    spheroid_drag,
    torus_reference,
)
from flagrs.validation.filaments import SLENDER, Filament, graded_rod, spheroid, straight, torus_drag
from flagrs.validation.rigid_helix import Helix, Propulsion, of_filament, of_model, propulsion
from flagrs.validation.surface_solution import helix_tube, straight_tube, surface_solution

if TYPE_CHECKING:
    from matplotlib.axis import Axis

Array = npt.NDArray[np.float64]

FIGURES = Path(__file__).with_name("figures")
#: Regularization over radius in Lim et al.
LIM_ET_AL = 1.65 / 1.6


# ---------------------------------------------------------------------------------------------------
# Properties of the matrix
# ---------------------------------------------------------------------------------------------------


def asymmetry(filament: Filament) -> tuple[float, float]:
    """Largest asymmetry |A_ij/w_j - A_ji^T/w_i| of pairs of inner nodes, and of pairs with an end, relative.

    `w` is the integral of a node's hat function: without it half a hat at an end would count as asymmetry.
    """
    count = len(filament.nodes)
    weight = fluid.hat_weights(filament.nodes, filament.edges, np.ones((count, 3)))[:, 0]
    matrix = fluid.mobility(filament.nodes, filament.edges, filament.epsilon, threads=1)
    blocks = matrix.reshape(count, 3, count, 3).transpose(0, 2, 1, 3) / weight[None, :, None, None]
    difference = np.linalg.norm(blocks - blocks.transpose(1, 0, 3, 2), axis=(2, 3))
    relative = difference / np.linalg.norm(blocks, axis=(2, 3))
    return float(relative[1:-1, 1:-1].max()), float(relative[[0, -1]].max())


def condition(filament: Filament) -> float:
    """Condition number of the mobility matrix in the 2-norm."""
    return float(np.linalg.cond(fluid.mobility(filament.nodes, filament.edges, filament.epsilon, threads=1)))


def zigzag_gain(filament: Filament) -> float:
    """Largest force density of a zigzag of the nodes over that of a uniform motion as fast, both across x."""
    count = len(filament.nodes)
    across = np.tile([0.0, 1.0, 0.0], (count, 1))
    zigzag = across * (-1.0) ** np.arange(count)[:, None]
    inner = slice(count // 4, -(count // 4))
    return float(
        np.abs(filament.density(zigzag)[inner]).max() / np.abs(filament.density(across)[inner]).max()
    )


# ---------------------------------------------------------------------------------------------------
# The studies of fluid.md
# ---------------------------------------------------------------------------------------------------


def table(title: str, heads: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    """Print a Markdown table."""
    heads = list(heads)
    print(f"\n### {title}\n\n| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")


def plain_ticks(axis: Axis, values: Iterable[float]) -> None:
    """Label a logarithmic axis at a few values, in plain numbers."""
    values = list(values)
    axis.set_ticks(values, labels=[f"{value:g}" for value in values])
    axis.set_ticks([], minor=True)


def percent(value: float, digits: int = 2) -> str:
    """A relative difference in per cent."""
    return f"{100.0 * value:+.{digits}f} %"


def study_torus() -> None:
    """Mesh and slenderness of the torus."""
    counts = [12, 24, 48, 96, 192]
    errors = {
        ratio: [torus_drag(ratio, n) / exact - 1.0 for n in counts] for ratio, exact in TORUS_EXACT.items()
    }
    table(
        "torus, mesh",
        ["edges", *(f"a/R = {ratio:g}: |e|/eps, F*, error" for ratio in errors)],
        [
            [
                n,
                *(
                    f"{2 * math.pi / n / (SLENDER * r):.1f}, {torus_drag(r, n):.9f}, {percent(e[k], 4)}"
                    for r, e in errors.items()
                ),
            ]
            for k, n in enumerate(counts)
        ],
    )
    ratios = [0.25, 0.1, 0.03, 0.01, 0.003, 0.001]
    rows, slender = [], []
    for ratio in ratios:
        exact = torus_reference(ratio)
        # Fine enough for the polygon, and not finer than the regularization.
        value = torus_drag(ratio, min(600, int(2.0 * math.pi / (SLENDER * ratio))))
        slender.append(value / exact - 1.0)
        rows.append([ratio, f"{exact:.9f}", f"{value:.9f}", percent(slender[-1], 4)])
    table("torus, slenderness", ["a/R", "exact (own solution)", "segments", "error"], rows)

    figure = new_figure(9.0, 3.6)
    left, right = figure.subplots(1, 2)
    for colour, (ratio, error) in zip(COLOURS, errors.items(), strict=False):
        left.loglog(counts, np.abs(error), "o-", color=colour, label=f"a/R = {ratio:g}")
    left.loglog(counts, 0.09 / np.array(counts, dtype=float) ** 2, "--", color="grey", label="second order")
    plain_ticks(left.xaxis, counts)
    dress(left, "edges of the ring", "relative error of the drag", "refining the mesh")
    legend(left)
    right.loglog(ratios, np.abs(slender), "o-", color=COLOURS[0], label=r"$\epsilon = \sqrt{e}\,a$")
    squares = np.array(ratios)
    right.loglog(
        squares,
        0.17 * squares**2 * np.log(8.0 / squares),
        "--",
        color="grey",
        label=r"$\propto (a/R)^2\ln(8R/a)$",
    )
    dress(right, "a/R", "relative error of the drag", "finest mesh")
    legend(right)
    figure.savefig(FIGURES / "fluid_torus.png", dpi=130)


def study_straight() -> None:
    """Straight rods: spheroids, cylinders and capsules."""
    rows = []
    for aspect in (5, 10, 20, 50, 100, 1000):
        errors = [spheroid(aspect, 160).drag(axis) / spheroid_drag(aspect, axis) - 1.0 for axis in (0, 1)]
        rows.append([aspect, *(percent(e, 4) for e in errors)])
    table("prolate spheroid, 160 edges", ["aspect", "along", "across"], rows)

    meshes = [10, 20, 40, 80, 160]
    converging = [[spheroid(1000, n).drag(k) / spheroid_drag(1000, k) - 1.0 for k in (0, 1)] for n in meshes]
    table(
        "spheroid of aspect 1000, mesh",
        ["edges", "along", "across"],
        [[n, *(percent(e, 4) for e in row)] for n, row in zip(meshes, converging, strict=True)],
    )

    slenderness = [2e1, 6e1, 2e2, 2e3, 2e4, 2e5, 2e6]
    rows, differences = [], {}
    for ratio in slenderness:
        rod = graded_rod(ratio, SLENDER)
        cells = []
        for axis in (0, 1):
            drag = rod.drag(axis)
            found = [drag / cylinder_series(ratio, axis, terms) - 1.0 for terms in (2, 3, 4)]
            differences[ratio, axis] = found
            cells.append(f"{drag / ratio:.5f}: " + ", ".join(percent(d, 3) for d in found))
        rows.append([f"{ratio:g}", len(rod.edges), *cells])
    table("cylinder: F/(mu U L), against 2, 3, 4 terms", ["L/a", "edges", "along", "across"], rows)

    rows = []
    for length in (8.0, 18.0, 38.0):
        cells = []
        for axis in (0, 1):
            reference = surface_solution(straight_tube(length, axis), 0.8, 12).drag
            drag = straight(length, int(length / SLENDER), SLENDER).drag(axis)
            longer = straight(length + 2.0, int((length + 2.0) / SLENDER), SLENDER).drag(axis)
            cells.append(
                f"{reference:.3f}, {percent(drag / reference - 1.0)}, {percent(longer / reference - 1.0)}"
            )
        rows.append([length + 2.0, *cells])
    table(
        "capsule: F/(mu U a), segments from cap centre to cap centre, from tip to tip",
        ["length / a", "along", "across"],
        rows,
    )

    rows = []
    for length, count in ((80.0, 25), (100.0, 50), (200.0, 50), (200.0, 100), (400.0, 100), (400.0, 200)):
        rod = straight(length, count, LIM_ET_AL)
        cells = []
        for axis in (0, 1):
            lumped = rod.density(np.tile(np.eye(3)[axis], (count + 1, 1)))[:, axis].sum() * length / count
            cells.append(percent(lumped / rod.drag(axis) - 1.0, 1))
        rows.append([f"{length:g}", count, f"{length / count / LIM_ET_AL:.2f}", *cells])
    table(
        "straight rod, nodal force |e| f in place of W f",
        ["L/a", "edges", "|e|/eps", "along", "across"],
        rows,
    )

    figure = new_figure(9.0, 3.6)
    left, right = figure.subplots(1, 2)
    for axis, name in ((0, "along"), (1, "across")):
        left.loglog(meshes, [abs(row[axis]) for row in converging], "o-", color=COLOURS[axis], label=name)
    left.loglog(meshes, 1.0 / np.array(meshes, dtype=float) ** 2, "--", color="grey", label="second order")
    dress(left, "edges", "relative error of the drag", "prolate spheroid 1000 : 1, against the exact drag")
    legend(left)
    small = np.array([1.0 / math.log(ratio) for ratio in slenderness])
    for axis, name in ((0, "along"), (1, "across")):
        for k, style in ((0, "s:"), (1, "^--"), (2, "o-")):
            values = [abs(differences[ratio, axis][k]) for ratio in slenderness]
            right.loglog(
                small, values, style, color=COLOURS[axis], label=f"{name}, {k + 2} terms", markersize=4
            )
    plain_ticks(right.xaxis, [0.07, 0.1, 0.2, 0.3])
    dress(right, "1 / ln(L/a)", "relative difference", "cylinder, against slender-body series")
    legend(right)
    figure.savefig(FIGURES / "fluid_straight.png", dpi=130)


def study_helix() -> None:
    """Thrust, drag and torque of rigid helices."""
    flagellum = Helix()
    sphere = surface_solution(straight_tube(0.0, 0), 0.8, 12).drag / (6.0 * math.pi) - 1.0
    print(f"\nsurface solution of a sphere, error of the drag: {percent(sphere, 3)}")
    fits = ((1.0, 6), (0.8, 8), (0.8, 12))
    references = [surface_solution(helix_tube(flagellum), step, around) for step, around in fits]
    exact = references[-1]
    spin = flagellum.twist_torque
    columns = ["", "drag [N s/m]", "thrust [mN s]", "torque [uN m s]", "thrust from translation [mN s]"]

    def row(name: str, p: Propulsion, compare: bool = True) -> list[str]:
        numbers = [f"{p.drag:.5f}", f"{1e3 * p.thrust:.4f}", f"{1e6 * p.torque:.3f}"]
        if compare:
            numbers = [f"{n} ({percent(d, 1)})" for n, d in zip(numbers, p.over(exact), strict=True)]
        return [name, *numbers, f"{1e3 * p.coupled_torque:.4f}"]

    rows = [
        row(f"surface, {step} a, {k} around", p, False) for (step, k), p in zip(fits, references, strict=True)
    ]
    for name, ratio in (("slender", SLENDER), ("lim-et-al", LIM_ET_AL)):
        for count in (25, 48):
            filament = flagellum.filament(count, ratio)
            rows.append(row(f"segments, eps {name}, {count} edges, twist drag", of_filament(filament, spin)))
            rows.append(row(f"segments, eps {name}, {count} edges", of_filament(filament)))
    arc = flagellum.pitch / flagellum.advance
    for coefficients, wavelength in (("gray-hancock", flagellum.pitch), ("lighthill", arc)):
        rows.append(
            row(
                f"{coefficients}, 200 edges",
                of_model(flagellum, 200, model="RFT", coefficients=coefficients, wavelength=wavelength),
            )
        )
    table("Lim et al.'s helix, pitch/R = 7", columns, rows)
    twist = []
    for pitch in (5.0, 7.0, 9.0):
        helix = Helix(pitch=pitch * Helix.radius)
        counts = (int(helix.contour / 5e-3), int(helix.contour / (SLENDER * helix.thickness)))
        shares = [
            helix.twist_torque / of_filament(helix.filament(n, r)).torque
            for r in (LIM_ET_AL, SLENDER)
            for n in counts
        ]
        twist.append([f"{pitch:g}", f"{counts[0]}, {counts[1]}", *(percent(share, 1) for share in shares)])
    heads = ["pitch/R", "edges", "eps of Lim et al., 5 mm", "fine", "eps slender, 5 mm", "fine"]
    table("twist drag over the Stokeslets' torque", heads, twist)

    rows = []
    for count in (12, 25, 48):
        filament = flagellum.filament(count, LIM_ET_AL)
        edge = float(np.linalg.norm(filament.nodes[1] - filament.nodes[0]))
        lumped = propulsion(filament.nodes, lambda velocity, one=filament, e=edge: e * one.density(velocity))
        rows.append([count, *(percent(d, 1) for d in lumped.over(of_filament(filament)))])
    table(
        "Lim et al.'s helix, nodal force |e| f in place of W f", ["edges", "drag", "thrust", "torque"], rows
    )

    # The finest fits that a gigabyte and half a minute allow.
    fitted = {1.6e-3: (0.8, 12), 0.8e-3: (0.8, 8), 0.4e-3: (1.0, 8)}
    differences, rows = [], []
    for radius, fit in fitted.items():
        helix = Helix(axial_length=Helix.pitch, thickness=radius)
        reference = surface_solution(helix_tube(helix), *fit)
        filament = helix.filament(int(helix.contour / (SLENDER * radius)))
        differences.append(of_filament(filament, helix.twist_torque).over(reference))
        bare = of_filament(filament).over(reference)[2]
        rows.append([f"{radius / helix.radius:.4f}", *(percent(d) for d in differences[-1]), percent(bare)])
    table(
        "one turn, against the surface solution",
        ["a/R", "drag", "thrust", "torque", "torque without twist drag"],
        rows,
    )

    thin = Helix(thickness=0.02e-3)
    counts = [20, 40, 80, 160, 320]
    finest = {
        name: of_filament(make(640)) for name, make in (("blunt", thin.filament), ("tapered", thin.tapered))
    }
    errors = {
        name: [of_filament(make(n)).over(finest[name]) for n in counts]
        for name, make in (("blunt", thin.filament), ("tapered", thin.tapered))
    }
    for name, found in errors.items():
        table(
            f"mesh, {name} ends, a = 0.02 mm, against 640 edges",
            ["edges", "drag", "thrust", "torque"],
            [[n, *(percent(d, 3) for d in e)] for n, e in zip(counts, found, strict=True)],
        )

    figure = new_figure(9.0, 3.6)
    left, right = figure.subplots(1, 2)
    for k, name in ((0, "drag"), (2, "torque")):
        left.loglog(
            [r / flagellum.radius for r in fitted],
            [abs(d[k]) for d in differences],
            "o-",
            color=COLOURS[k],
            label=name,
        )
    plain_ticks(left.xaxis, [round(r / flagellum.radius, 3) for r in fitted])
    left.set_ylim(1e-3, 1e-1)
    dress(left, "a/R", "relative difference", "one turn, against the surface solution")
    legend(left)
    for name, style in (("blunt", "s:"), ("tapered", "o-")):
        for k, quantity in ((0, "drag"), (2, "torque")):
            right.loglog(
                counts,
                [abs(e[k]) for e in errors[name]],
                style,
                color=COLOURS[k],
                label=f"{quantity}, {name} ends",
            )
    right.loglog(counts, 60.0 / np.array(counts, dtype=float) ** 2, "--", color="grey", label="second order")
    plain_ticks(right.xaxis, counts)
    dress(right, "edges", "relative difference from 640 edges", "refining a thin helix")
    legend(right)
    figure.savefig(FIGURES / "fluid_helix.png", dpi=130)


def study_matrix() -> None:
    """Condition, oscillation and asymmetry against the ratio of edge length to regularization."""
    ratios = [8.0, 4.0, 2.0, 1.5, 1.0, 0.8, 0.6, 0.5, 0.4, 0.3, 0.25, 0.2]
    flagellum = Helix()
    rows, found = [], []
    for ratio in ratios:
        rod = straight(60.0, round(60.0 / ratio), 1.0)
        helix = flagellum.filament(max(8, round(flagellum.contour / (ratio * SLENDER * flagellum.thickness))))
        density = rod.density(np.tile([0.0, 1.0, 0.0], (len(rod.nodes), 1)))[:, 1]
        values = (
            condition(rod),
            condition(helix),
            zigzag_gain(rod),
            density.max() / np.median(density),
            density.min() / np.median(density),
        )
        found.append(values[:3])
        rows.append(
            [
                ratio,
                len(rod.edges),
                *(f"{v:.3g}" for v in values),
                *(f"{100 * v:.2g} %" for v in asymmetry(helix)),
            ]
        )
    table(
        "matrix",
        [
            "|e|/eps",
            "edges of the rod",
            "cond, rod",
            "cond, Lim et al.'s helix",
            "zigzag gain",
            "highest density",
            "lowest density",
            "asymmetry inside",
            "with an end",
        ],
        rows,
    )
    figure = new_figure(9.0, 3.6)
    left, right = figure.subplots(1, 2)
    columns = np.array(found)
    left.loglog(ratios, columns[:, 0], "o-", color=COLOURS[0], label="straight rod, L = 60 eps")
    left.loglog(ratios, columns[:, 1], "s-", color=COLOURS[1], label="Lim et al.'s helix")
    short = np.array(ratios)[np.array(ratios) <= 1.0]
    left.loglog(
        short, 6.0 * np.exp(math.pi / short), "--", color="grey", label=r"$\propto e^{\pi\epsilon/|e|}$"
    )
    left.axvline(1.0, color="grey", linewidth=0.8)
    plain_ticks(left.xaxis, [0.2, 0.5, 1.0, 2.0, 5.0])
    dress(left, "|e| / eps", "condition number of A", "conditioning")
    legend(left)
    for k, ratio in enumerate((2.0, 1.0, 0.5, 0.25)):
        rod = straight(60.0, round(60.0 / ratio), 1.0)
        density = rod.density(np.tile([0.0, 1.0, 0.0], (len(rod.nodes), 1)))[:, 1]
        near = rod.nodes[:, 0] <= 8.0
        right.plot(
            rod.nodes[near, 0],
            density[near] / np.median(density),
            ".-",
            color=COLOURS[k],
            label=f"|e| = {ratio:g} eps",
        )
    right.set_yscale("symlog", linthresh=10.0)
    dress(
        right,
        "distance from the end / eps",
        "force density / median",
        "density near a blunt end, motion across",
    )
    legend(right)
    figure.savefig(FIGURES / "fluid_conditioning.png", dpi=130)


def main() -> None:
    """Print every number and draw every figure."""
    FIGURES.mkdir(exist_ok=True)
    for study in (study_torus, study_straight, study_helix, study_matrix):
        start = time.perf_counter()
        study()
        print(f"\n({study.__name__}: {time.perf_counter() - start:.1f} s)")


if __name__ == "__main__":
    main()
