"""Makes every number and figure of fluid.md: regularized Stokeslet segments against references of their own.

Run with ``python docs/validation/make_fluid_figures.py`` (about two minutes on one core; needs matplotlib).
The tests in tests/python/test_fluid_validation.py use the same geometries and references. The viscosity is
1 Pa s throughout, so that forces at 1 m/s, in N, are resistances in N s/m.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import scipy.linalg
from flagrs import Fluid, Material, Rod, Scene, Simulation, fluid
from flagrs.plot.canvas import COLOURS, dress, legend, new_figure

if TYPE_CHECKING:
    from matplotlib.axis import Axis

Array = npt.NDArray[np.float64]

FIGURES = Path(__file__).with_name("figures")
SLENDER = math.exp(0.5)
#: Regularization over radius in the supplementary text.
SEED = 1.65 / 1.6
X = np.array([1.0, 0.0, 0.0])


# ---------------------------------------------------------------------------------------------------
# Filaments: polygons of regularized Stokeslet segments
# ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Filament:
    """Nodes (N, 3) [m], edges (E, 2) and regularization of every edge (E,) [m]."""

    nodes: Array
    edges: npt.NDArray[np.int64]
    epsilon: Array

    def density(self, velocity: Array) -> Array:
        """Force per length on the fluid (N, 3) [N/m] at nodal velocities (N, 3) [m/s]."""
        matrix = fluid.mobility(self.nodes, self.edges, self.epsilon, threads=1)
        return np.linalg.solve(matrix, 8.0 * math.pi * velocity.ravel()).reshape(-1, 3)

    def forces(self, velocity: Array) -> Array:
        """Nodal forces on the fluid (N, 3) [N]."""
        return fluid.hat_weights(self.nodes, self.edges, self.density(velocity))

    def drag(self, axis: int) -> float:
        """Drag along a coordinate axis at 1 m/s [N]."""
        return float(self.forces(np.tile(np.eye(3)[axis], (len(self.nodes), 1))).sum(axis=0)[axis])


def chain(nodes: Array, epsilon: float | Array) -> Filament:
    """An open filament."""
    count = len(nodes) - 1
    edges = np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)
    return Filament(nodes, edges, np.broadcast_to(np.asarray(epsilon, dtype=float), count).copy())


def straight(length: float, count: int, epsilon: float) -> Filament:
    """A straight filament of equal edges along x."""
    return chain(np.linspace(0.0, length, count + 1)[:, None] * X, epsilon)


def graded_rod(length: float, epsilon: float, growth: float = 1.15) -> Filament:
    """A straight filament whose edges are as long as epsilon at the ends and grow towards the middle."""
    half = [0.0]
    edge = epsilon
    while half[-1] < length / 2.0:
        half.append(half[-1] + edge)
        edge *= growth
    along = np.array(half) * (length / 2.0 / half[-1])
    return chain(np.concatenate([along, length - along[-2::-1]])[:, None] * X, epsilon)


def torus(ratio: float, count: int) -> Filament:
    """A ring of unit radius about z: the polygon whose perimeter is the circle's."""
    angle = 2.0 * math.pi * np.arange(count) / count
    radius = math.pi / count / math.sin(math.pi / count)
    nodes = radius * np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    edges = np.stack([np.arange(count), (np.arange(count) + 1) % count], axis=1)
    return Filament(nodes, edges, np.full(count, SLENDER * ratio))


def torus_drag(ratio: float, count: int) -> float:
    """Axial drag of a torus over that of a sphere around it, F / (6 pi mu U (R + a))."""
    return torus(ratio, count).drag(2) / (6.0 * math.pi * (1.0 + ratio))


def spheroid(aspect: float, count: int) -> Filament:
    """A prolate spheroid of unit equatorial radius: segments between its foci, as thick as it is there."""
    focus = math.sqrt(aspect**2 - 1.0)
    along = -focus * np.cos(np.linspace(0.0, math.pi, count + 1))
    middle = (along[1:] + along[:-1]) / 2.0
    return chain(along[:, None] * X, SLENDER * np.sqrt(1.0 - (middle / focus) ** 2))


@dataclass(frozen=True)
class Helix:
    """A left-handed helix about x: radius, pitch, axial length and radius of its cross-section [m]."""

    radius: float = 6.36e-3
    pitch: float = 7.0 * 6.36e-3
    axial_length: float = 95.4e-3
    thickness: float = 1.6e-3

    @property
    def advance(self) -> float:
        """Axial component of the tangent."""
        return self.pitch / math.hypot(self.pitch, 2.0 * math.pi * self.radius)

    @property
    def contour(self) -> float:
        """Arc length [m]."""
        return self.axial_length / self.advance

    @property
    def twist_torque(self) -> float:
        """Torque of twist drag about the axis at 1 rad/s [N m]; spin and torque are along the tangent."""
        return 4.0 * math.pi * self.thickness**2 * self.contour * self.advance**2

    def centre(self, arc: Array) -> Array:
        """Points of the centreline."""
        axial = np.asarray(arc) * self.advance
        angle = 2.0 * math.pi * axial / self.pitch
        return np.stack([axial, self.radius * np.cos(angle), -self.radius * np.sin(angle)], axis=-1)

    def tangent(self, arc: Array) -> Array:
        """Unit tangents."""
        angle = 2.0 * math.pi * np.asarray(arc) * self.advance / self.pitch
        around = math.sqrt(1.0 - self.advance**2)
        along = np.full(angle.shape, self.advance)
        return np.stack([along, -around * np.sin(angle), -around * np.cos(angle)], axis=-1)

    def filament(self, count: int, ratio: float = SLENDER) -> Filament:
        """A polygon of equal arcs."""
        return chain(self.centre(np.linspace(0.0, self.contour, count + 1)), ratio * self.thickness)

    def tapered(self, count: int) -> Filament:
        """A polygon with ends as round as a spheroid's, finer towards them."""
        place = (1.0 - np.cos(np.linspace(0.0, math.pi, count + 1))) / 2.0
        middle = place[1:] + place[:-1] - 1.0
        epsilon = SLENDER * self.thickness * np.sqrt(1.0 - middle**2)
        return chain(self.centre(self.contour * place), epsilon)


@dataclass(frozen=True)
class Propulsion:
    """Drag [N s/m], thrust of rotation, torque of translation [N s] and of rotation [N m s], along x."""

    drag: float
    thrust: float
    coupled_torque: float
    torque: float

    def over(self, other: Propulsion) -> tuple[float, float, float]:
        """Relative differences of drag, thrust and torque."""
        return (
            self.drag / other.drag - 1.0,
            self.thrust / other.thrust - 1.0,
            self.torque / other.torque - 1.0,
        )


def propulsion(nodes: Array, resist: Callable[[Array], Array], spin_torque: float = 0.0) -> Propulsion:
    """Resistances of a rigid body along x, given the nodal forces (N, 3) at nodal velocities (N, 3)."""
    moved = resist(np.tile(X, (len(nodes), 1)))
    turned = resist(np.cross(X, nodes))
    return Propulsion(
        drag=float(moved.sum(axis=0)[0]),
        thrust=float(turned.sum(axis=0)[0]),
        coupled_torque=float(np.cross(nodes, moved).sum(axis=0)[0]),
        torque=float(np.cross(nodes, turned).sum(axis=0)[0]) + spin_torque,
    )


def of_filament(filament: Filament, spin_torque: float = 0.0) -> Propulsion:
    """Resistances of a filament."""
    return propulsion(filament.nodes, filament.forces, spin_torque)


def of_model(helix: Helix, count: int, **options: object) -> Propulsion:
    """Resistances of a helix by one of the fluid models of a simulation."""
    nodes = helix.filament(count).nodes
    rod = Rod(
        nodes=nodes,
        radius=helix.thickness,
        material=Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1e3),
    )
    matrix = Simulation(Scene(rods=(rod,), fluid=Fluid(viscosity=1.0, **options)), threads=1).resistance()  # type: ignore[arg-type]
    return propulsion(nodes, lambda velocity: (matrix @ velocity.ravel()).reshape(-1, 3))


# ---------------------------------------------------------------------------------------------------
# References
# ---------------------------------------------------------------------------------------------------

#: Axial drag of a torus over that of a sphere around it, by a/R: Majumdar and O'Neill, ZAMP 28 (1977) 541.
TORUS_EXACT = {0.01: 0.577311201, 0.001: 0.441079950}


def ring_flow(rings: Array, at: Array, count: int) -> Array:
    """Flow (M, 2, S, 2), times 8 pi mu, at points (r, z) of radial and axial force rings (S, 2) at (r, z).

    A ring of strength 1 has the force 1 / (2 pi) per length, integrated at `count` points of half a circle.
    """
    angle = math.pi * (np.arange(count) + 0.5) / count
    cosine = np.cos(angle)
    out = np.empty((len(at), 2, len(rings), 2))
    for s, (ring, level) in enumerate(rings):
        for m, (r, z) in enumerate(at):
            dx, dz = r - ring * cosine, z - level
            d2 = dx**2 + (ring * np.sin(angle)) ** 2 + dz**2
            inverse = 1.0 / np.sqrt(d2)
            cube = inverse / d2
            radial = dx * cosine - ring * np.sin(angle) ** 2
            weight = ring / count
            out[m, 0, s, 0] = weight * (cosine * inverse + dx * radial * cube).sum()
            out[m, 0, s, 1] = weight * (dx * dz * cube).sum()
            out[m, 1, s, 0] = weight * (dz * radial * cube).sum()
            out[m, 1, s, 1] = weight * (inverse + dz * dz * cube).sum()
    return out


def torus_reference(ratio: float, sources: int = 12) -> float:
    """Axial drag of a torus, F / (6 pi mu U (R + a)), by force rings within its cross-section."""

    def circle(radius: float, count: int) -> Array:
        angle = 2.0 * math.pi * np.arange(count) / count
        return np.stack([1.0 + radius * np.cos(angle), radius * np.sin(angle)], axis=1)

    inner, surface = circle(ratio / 4.0, sources), circle(ratio, 2 * sources)
    # Analytic in a strip as wide as the gap between sources and surface, the integrals err by exp(-2 n gap).
    flow = ring_flow(inner, surface, math.ceil(30.0 / ratio)).reshape(4 * sources, 2 * sources)
    wanted = 8.0 * math.pi * np.tile([0.0, 1.0], len(surface))
    strength = np.linalg.lstsq(flow, wanted, rcond=None)[0].reshape(-1, 2)
    return float((strength[:, 1] * inner[:, 0]).sum() / (6.0 * math.pi * (1.0 + ratio)))


def spheroid_drag(aspect: float, axis: int) -> float:
    """Drag of a prolate spheroid of unit equatorial radius: Chwang and Wu, J. Fluid Mech. 67 (1975) 787."""
    e = math.sqrt(1.0 - 1.0 / aspect**2)
    log = math.log((1.0 + e) / (1.0 - e))
    if axis == 0:
        return 16.0 * math.pi * aspect * e**3 / ((1.0 + e**2) * log - 2.0 * e)
    return 32.0 * math.pi * aspect * e**3 / (2.0 * e + (3.0 * e**2 - 1.0) * log)


def cylinder_series(slenderness: float, axis: int, terms: int) -> float:
    """Drag of a cylinder of unit radius and length L at 1 m/s by slender-body theory, to powers of 1/ln(L/a).

    Batchelor, J. Fluid Mech. 44 (1970) 419, gives three terms. The equation behind them (Keller and Rubinow,
    J. Fluid Mech. 75 (1976) 705) is ``(2 ln(L/a) - h) f + K f = c pi mu U`` with ``h = +-1 - ln(1 - x^2)``
    and ``K f = integral of (f(y) - f(x)) / |y - x|``, whose eigenfunctions are the Legendre polynomials, with
    eigenvalues ``-2 H_n``; iterated once more it gives the fourth.
    """
    sign, factor = (1.0, 2.0) if axis == 0 else (-1.0, 4.0)
    abscissa, weight = np.polynomial.legendre.leggauss(400)
    # In x = tanh(9 t) nothing is singular.
    stretch = 9.0 * abscissa
    measure = weight * 4.5 / np.cosh(stretch) ** 2
    h = sign + 2.0 * np.log(np.cosh(stretch))
    even = np.arange(2, 4001, 2)
    harmonic = np.cumsum(1.0 / np.arange(1, 4001))[even - 1]
    hkh = -8.0 * float(((2 * even + 1) * harmonic / (even * (even + 1.0)) ** 2).sum())
    means = [float((measure * h**power).sum()) for power in range(4)]
    coefficients = [1.0, means[1] / 2.0, means[2] / 4.0, (means[3] - hkh) / 8.0]
    small = 1.0 / math.log(slenderness)
    return (
        factor * math.pi * slenderness * sum(c * small ** (k + 1) for k, c in enumerate(coefficients[:terms]))
    )


@dataclass(frozen=True)
class Tube:
    """A tube of given radius about a centreline, closed by hemispheres beyond its ends."""

    centre: Callable[[Array], Array]
    tangent: Callable[[Array], Array]
    length: float
    radius: float

    def points(self, radius: float, step: float, around: int) -> Array:
        """Points on the surface a distance `radius` from the centreline, in rings `step` apart, staggered."""
        arcs = np.linspace(0.0, self.length, math.ceil(self.length / step) + 1)
        out = [self._ring(arc, 1.0, radius, 0.0, around, k) for k, arc in enumerate(arcs)]
        caps = max(2, round(around / 4))
        for arc, outward in ((0.0, -1.0), (self.length, 1.0)):
            for k in range(1, caps + 1):
                latitude = math.pi / 2.0 * k / caps
                count = max(1, round(around * math.cos(latitude))) if k < caps else 1
                out.append(self._ring(arc, outward, radius, latitude, count, k))
        return np.concatenate(out)

    def _ring(
        self, arc: float, outward: float, radius: float, latitude: float, count: int, stagger: int
    ) -> Array:
        centre, tangent = self.centre(np.array(arc)), outward * self.tangent(np.array(arc))
        first = np.cross(tangent, np.eye(3)[np.argmin(np.abs(tangent))])
        first /= np.linalg.norm(first)
        second = np.cross(tangent, first)
        angle = 2.0 * math.pi * (np.arange(count) + 0.5 * (stagger % 2)) / count
        ring = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
        return centre + radius * (math.sin(latitude) * tangent + math.cos(latitude) * ring)


def surface_solution(tube: Tube, step: float = 1.0, around: int = 6, depth: float = 0.5) -> Propulsion:
    """Resistances of a rigid tube along x by the method of fundamental solutions.

    Point forces on the tube of `depth` times the radius, in rings `step` radii apart with `around` points
    each, are fitted to the velocity at about twice as many points of the surface. No slenderness is assumed:
    what is left is the error of the fit, which a finer one tells.
    """
    a = tube.radius
    sources = tube.points(depth * a, step * a, around)
    surface = tube.points(a, step * a / 1.4, round(1.4 * around))
    offset = surface[:, None] - sources[None]
    inverse = 1.0 / np.linalg.norm(offset, axis=2)
    flow = (offset * inverse[:, :, None] ** 1.5)[:, :, :, None] * (offset * inverse[:, :, None] ** 1.5)[
        :, :, None, :
    ]
    for k in range(3):
        flow[:, :, k, k] += inverse
    matrix = flow.transpose(0, 2, 1, 3).reshape(3 * len(surface), 3 * len(sources))
    motions = np.stack([np.tile(X, (len(surface), 1)).ravel(), np.cross(X, surface).ravel()], axis=1)
    q, r = scipy.linalg.qr(matrix, mode="economic", overwrite_a=True, check_finite=False)
    fitted = scipy.linalg.solve_triangular(r, q.T @ (8.0 * math.pi * motions))
    moved, turned = fitted[:, 0].reshape(-1, 3), fitted[:, 1].reshape(-1, 3)
    return Propulsion(
        drag=float(moved[:, 0].sum()),
        thrust=float(turned[:, 0].sum()),
        coupled_torque=float(np.cross(sources, moved)[:, 0].sum()),
        torque=float(np.cross(sources, turned)[:, 0].sum()),
    )


def helix_tube(helix: Helix) -> Tube:
    """The tube about a helix."""
    return Tube(helix.centre, helix.tangent, helix.contour, helix.thickness)


def straight_tube(length: float, axis: int) -> Tube:
    """A capsule of unit radius whose centreline lies along or, for axis 1, across x."""
    direction = np.eye(3)[axis]
    return Tube(lambda arc: np.asarray(arc)[..., None] * direction, lambda arc: direction, length, 1.0)


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
        rod = straight(length, count, SEED)
        cells = []
        for axis in (0, 1):
            lumped = rod.density(np.tile(np.eye(3)[axis], (count + 1, 1)))[:, axis].sum() * length / count
            cells.append(percent(lumped / rod.drag(axis) - 1.0, 1))
        rows.append([f"{length:g}", count, f"{length / count / SEED:.2f}", *cells])
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
    seed = Helix()
    sphere = surface_solution(straight_tube(0.0, 0), 0.8, 12).drag / (6.0 * math.pi) - 1.0
    print(f"\nsurface solution of a sphere, error of the drag: {percent(sphere, 3)}")
    fits = ((1.0, 6), (0.8, 8), (0.8, 12))
    references = [surface_solution(helix_tube(seed), step, around) for step, around in fits]
    exact = references[-1]
    spin = seed.twist_torque
    columns = ["", "drag [N s/m]", "thrust [mN s]", "torque [uN m s]", "thrust from translation [mN s]"]

    def row(name: str, p: Propulsion, compare: bool = True) -> list[str]:
        numbers = [f"{p.drag:.5f}", f"{1e3 * p.thrust:.4f}", f"{1e6 * p.torque:.3f}"]
        if compare:
            numbers = [f"{n} ({percent(d, 1)})" for n, d in zip(numbers, p.over(exact), strict=True)]
        return [name, *numbers, f"{1e3 * p.coupled_torque:.4f}"]

    rows = [
        row(f"surface, {step} a, {k} around", p, False) for (step, k), p in zip(fits, references, strict=True)
    ]
    for name, ratio in (("slender", SLENDER), ("seed", SEED)):
        for count in (25, 48):
            filament = seed.filament(count, ratio)
            rows.append(row(f"segments, eps {name}, {count} edges, twist drag", of_filament(filament, spin)))
            rows.append(row(f"segments, eps {name}, {count} edges", of_filament(filament)))
    arc = seed.pitch / seed.advance
    for coefficients, wavelength in (("gray-hancock", seed.pitch), ("lighthill", arc)):
        rows.append(
            row(
                f"{coefficients}, 200 edges",
                of_model(seed, 200, model="RFT", coefficients=coefficients, wavelength=wavelength),
            )
        )
    table("the seed's helix, pitch/R = 7", columns, rows)
    twist = []
    for pitch in (5.0, 7.0, 9.0):
        helix = Helix(pitch=pitch * Helix.radius)
        counts = (int(helix.contour / 5e-3), int(helix.contour / (SLENDER * helix.thickness)))
        shares = [
            helix.twist_torque / of_filament(helix.filament(n, r)).torque
            for r in (SEED, SLENDER)
            for n in counts
        ]
        twist.append([f"{pitch:g}", f"{counts[0]}, {counts[1]}", *(percent(share, 1) for share in shares)])
    heads = ["pitch/R", "edges", "eps seed, 5 mm", "fine", "eps slender, 5 mm", "fine"]
    table("twist drag over the Stokeslets' torque", heads, twist)

    rows = []
    for count in (12, 25, 48):
        filament = seed.filament(count, SEED)
        edge = float(np.linalg.norm(filament.nodes[1] - filament.nodes[0]))
        lumped = propulsion(filament.nodes, lambda velocity, one=filament, e=edge: e * one.density(velocity))
        rows.append([count, *(percent(d, 1) for d in lumped.over(of_filament(filament)))])
    table("the seed's helix, nodal force |e| f in place of W f", ["edges", "drag", "thrust", "torque"], rows)

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
            [r / seed.radius for r in fitted],
            [abs(d[k]) for d in differences],
            "o-",
            color=COLOURS[k],
            label=name,
        )
    plain_ticks(left.xaxis, [round(r / seed.radius, 3) for r in fitted])
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
    seed = Helix()
    rows, found = [], []
    for ratio in ratios:
        rod = straight(60.0, round(60.0 / ratio), 1.0)
        helix = seed.filament(max(8, round(seed.contour / (ratio * SLENDER * seed.thickness))))
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
            "cond, seed's helix",
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
    left.loglog(ratios, columns[:, 1], "s-", color=COLOURS[1], label="seed's helix")
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
