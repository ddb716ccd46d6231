"""How slowly the filaments of a scene relax, from the stiffness and the drag of the network itself."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg
from scipy.sparse.csgraph import connected_components

from flagrs import _flagrs
from flagrs.assemble import native_scene
from flagrs.fluid import mobility as matrix_of
from flagrs.load_sizes import nodal_loads
from flagrs.scene import Fluid, Rod, Scene
from flagrs.scene.values import BoolArray, FloatArray, IntArray

#: Degrees of freedom up to which a filament's eigenvalues are found densely.
DENSE = 120
#: Slowest modes looked at, those without energy among them: doubled until one stores energy.
FEWEST_MODES, MOST_MODES = 12, 200
#: Drag of dry edges in wet filaments, over that of a wet one: too small to slow anything, not to divide by.
DRY_SHARE = 1e-2
#: First root of cos(k) cosh(k) = 1: wave number of the slowest mode of a free rod, times its length.
FREE_ROOT = 4.73
#: First root of cos(k) cosh(k) = -1, for a rod clamped at one end.
CLAMPED_ROOT = 1.875
#: Slowest rate that may be elastic, over the least that stiffness, length and drag allow.
ELASTIC_SHARE = 0.1
#: Nodes up to which a network's drag is that of all its nodes together.
NETWORK_NODES = 200
#: Filaments examined: where there are more, half of these that look slowest and half that look fastest.
MOST_FILAMENTS = 100


@dataclass(frozen=True)
class Relaxation:
    """The slowest elastic mode of a filament.

    Attributes
    ----------
    dofs : ndarray
        Its degrees of freedom (n,), ascending.
    eigenvalue : float
        Smallest rate of decay that is not zero [1/s]; in a vacuum, the smallest angular frequency squared.
    time : float
        Time of relaxation, one over the rate [s]; in a vacuum, the period.
    size : float
        A twentieth of the filament's extent [m].
    """

    dofs: IntArray
    eigenvalue: float
    time: float
    size: float


class Network:
    """Stiffness, resistance and filaments of a scene at rest.

    With the elastic Hessian K of the rest shape without stress, which is positive semidefinite, and the
    resistance R of every node by itself, the rates of a filament are the eigenvalues of K v = rate R v over
    its free degrees of freedom; in a vacuum masses M stand for R, and the eigenvalues are squares of angular
    frequencies (docs/theory/time.md, "The default step").

    Parameters
    ----------
    scene
        The scene.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._native = native_scene(_bare(scene))
        fluid = self._native["fluid"]
        self.wet = scene.fluid is not None and scene.fluid.model != "none"
        given = None if fluid is None else fluid["coefficients"]
        self._coefficients = slender_coefficients(scene) if given is None else given
        if fluid is not None:
            self._native["fluid"] = {**fluid, "epsilon": None, "coefficients": self._coefficients}
        nodes = self._native["rest_nodes"]
        stressless = {
            "nodes": nodes,
            "theta": np.zeros_like(self._native["theta"]),
            "natural_curvature": np.full_like(self._native["natural_curvature"], np.nan),
            "natural_twist": np.full_like(self._native["natural_twist"], np.nan),
        }
        rest = _flagrs.Simulation({**self._native, **stressless}, "implicit", 1.0, 1)
        self.count = rest.dof_count
        self.node_dofs, self.edge_dofs = rest.dof_of_node, rest.dof_of_edge
        values, rows, starts = rest.hessian()
        shape = (self.count, self.count)
        self._pattern = scipy.sparse.csc_array((np.ones_like(values), rows, starts), shape=shape)
        hessian = scipy.sparse.csc_array((values, rows, starts), shape=shape)
        self.stiffness = (0.5 * (hessian + hessian.T)).tocsr()
        self.mass = rest.mass
        self.edges = self._native["edges"]
        vectors = nodes[self.edges[:, 1]] - nodes[self.edges[:, 0]]
        self.lengths: FloatArray = np.linalg.norm(vectors, axis=1)
        self._tangents = vectors / self.lengths[:, None]
        self.labels = self._filaments()

    def _filaments(self) -> IntArray:
        """Return the filament (ndof,) of every degree of freedom; -1 where it is prescribed."""
        free = np.ones(self.count, dtype=bool)
        for clamp in self._native["clamps"]:
            for node in clamp["nodes"]:
                free[self.node_dofs[node] : self.node_dofs[node] + 3] = False
            free[self.edge_dofs[clamp["edges"]]] = False
        chosen = np.flatnonzero(free)
        labels = np.full(self.count, -1)
        if len(chosen):
            part = self._pattern[chosen][:, chosen]
            labels[chosen] = connected_components(part, directed=False)[1]
        return labels

    @cached_property
    def resistance(self) -> scipy.sparse.csr_array:
        """Resistance of every degree of freedom by itself [N s/m, N m s]; mass in filaments that are dry."""
        fluid = self._native["fluid"]
        immersed = np.zeros(len(self.edges), bool) if fluid is None else np.array(fluid["immersed"])
        along, across = (self._coefficients * np.where(immersed, 1.0, DRY_SHARE)[:, None]).T
        outer = np.einsum("ei,ej->eij", self._tangents, self._tangents)
        eye = np.eye(3)
        blocks = along[:, None, None] * outer + across[:, None, None] * (eye - outer)
        blocks *= 0.5 * self.lengths[:, None, None]
        dofs = self.node_dofs[self.edges][:, :, None] + np.arange(3)  # (E, 2, 3)
        shape = (len(self.edges), 2, 3, 3)
        rows = np.broadcast_to(dofs[:, :, :, None], shape).ravel()
        columns = np.broadcast_to(dofs[:, :, None, :], shape).ravel()
        values = np.broadcast_to(blocks[:, None], shape).ravel()
        viscosity = self.scene.fluid.viscosity if self.scene.fluid is not None else 0.0
        spin = 4.0 * math.pi * viscosity * self._native["radius"] ** 2 * self.lengths
        diagonal = np.zeros(self.count)
        diagonal[self.edge_dofs] = spin
        # A free motor's shaft resists with its edge; alone it has nothing to.
        diagonal[3 * len(self._native["nodes"]) + len(self.edges) :] = spin.mean()
        head = self._native["head"]
        if head is not None:
            first = self.node_dofs[head["node"]]
            diagonal[first : first + 3] += head["translation"]
        drag = scipy.sparse.coo_array((values, (rows, columns)), shape=(self.count, self.count)).tocsr()
        drag = drag + scipy.sparse.diags_array(diagonal)
        dry = ~self.is_wet[self.labels]
        masses = np.where(self.mass > 0.0, self.mass, self.mass[self.edge_dofs].mean())
        keep = scipy.sparse.diags_array(np.where(dry, 0.0, 1.0))
        total: scipy.sparse.csr_array = (keep @ drag @ keep + scipy.sparse.diags_array(dry * masses)).tocsr()
        return total

    @cached_property
    def is_wet(self) -> BoolArray:
        """Whether each filament has edges in the fluid."""
        wet = np.zeros(self.labels.max(initial=-1) + 2, dtype=bool)
        fluid = self._native["fluid"]
        if fluid is not None and self.wet:
            immersed = np.array(fluid["immersed"])
            wet[self.labels[self.node_dofs[self.edges[immersed]]].ravel()] = True
        return wet

    def gradient(self) -> FloatArray:
        """Return the elastic gradient (ndof,) of the initial shape [N, N m]."""
        return self._start.gradient()

    def energy(self, label: int) -> float:
        """Return the elastic energy of one filament in its initial shape [J]."""
        native = self._native
        edges = (self.labels[self.node_dofs[self.edges]] == label).any(axis=1)
        edges |= self.labels[self.edge_dofs] == label
        hinges = edges[native["hinges"]].any(axis=1)
        # Others are too soft to count: what a term costs is proportional to its stiffness. Determinants of
        # bending stiffness, their squares, must not vanish.
        soft = np.finfo(float).tiny ** 0.25
        own = {
            "stretching": native["stretching"] * np.where(edges, 1.0, soft),
            "bending": native["bending"] * np.where(hinges, 1.0, soft)[:, None, None],
            "twisting": native["twisting"] * np.where(hinges, 1.0, soft),
        }
        return float(sum(_flagrs.Simulation({**native, **own}, "implicit", 1.0, 1).energies().values()))

    @cached_property
    def stressed(self) -> bool:
        """Whether anything is strained at the start, beyond round-off."""
        stretched = 0.5 * float((self._native["stretching"] * self.lengths).sum())
        return float(sum(self._start.energies().values())) > 1e-20 * stretched

    @cached_property
    def _start(self) -> _flagrs.Simulation:
        return _flagrs.Simulation(self._native, "implicit", 1.0, 1)

    def loads(self) -> FloatArray:
        """Return loads at their largest, and weight less buoyancy (ndof,) [N, N m]."""
        native, forces = self._native, np.zeros(self.count)
        given = nodal_loads(native, native["nodes"], self.edges)
        forces[(self.node_dofs[:, None] + np.arange(3)).ravel()] += given.ravel()
        buoyancy = 0.0 if native["fluid"] is None else native["fluid"]["density"]
        volume = math.pi * native["radius"] ** 2 * self.lengths
        gravity = np.array(native["gravity"])
        half = 0.5 * ((native["density"] - buoyancy) * volume)[:, None] * gravity
        for end in (0, 1):
            dofs = self.node_dofs[self.edges[:, end]][:, None] + np.arange(3)
            np.add.at(forces, dofs.ravel(), half.ravel())
        if native["head"] is not None:
            first = self.node_dofs[native["head"]["node"]]
            forces[first : first + 3] += native["head"]["mass"] * gravity
        return forces

    def relaxations(self) -> list[Relaxation]:
        """Return the slowest modes of the filaments that bend; of the extreme ones where there are many."""
        return [found for label in self._chosen() if (found := self._relaxation(label)) is not None]

    def _together(self, label: int, dofs: IntArray) -> FloatArray | None:
        """Return by how much the nodes of a network resist more together than each by itself (n, n) [N s/m].

        In nonlocal drag arms that meet hinder each other's motion, and a mode may decay several times more
        slowly than with local drag. None where drag is local, for chains, for which the slender coefficients
        stand, and for networks too large to be looked at as a whole.
        """
        fluid, model = self.scene.fluid, self.scene.fluid and self.scene.fluid.model
        own = np.flatnonzero((self.labels[self.node_dofs[self.edges]] == label).any(axis=1))
        wet = own[np.array(self._native["fluid"]["immersed"])[own]] if model == "RSS" else own[:0]
        nodes, ends = np.unique(self.edges[wet], return_inverse=True)
        if fluid is None or not 0 < len(nodes) <= NETWORK_NODES or np.bincount(ends.ravel()).max() < 3:
            return None
        ends = ends.reshape(-1, 2)
        at = self._native["rest_nodes"][nodes]
        widths = fluid.epsilon_array(self._native["radius"][wet])
        mobility = matrix_of(at, ends, widths, threads=1) / (8.0 * np.pi * fluid.viscosity)
        # Forces of a density that is linear along edges, tested with the nodes' hat functions.
        hats = np.zeros((len(nodes), len(nodes)))
        for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
            np.add.at(hats, (ends[:, i], ends[:, j]), self.lengths[wet] / (3.0 if i == j else 6.0))
        nonlocal_drag = np.kron(hats, np.eye(3)) @ np.linalg.inv(mobility)
        rows = (self.node_dofs[nodes][:, None] + np.arange(3)).ravel()
        more = 0.5 * (nonlocal_drag + nonlocal_drag.T) - self.resistance[rows][:, rows].toarray()
        free = np.isin(rows, dofs)
        places = np.searchsorted(dofs, rows[free])
        found = np.zeros((len(dofs), len(dofs)))
        found[np.ix_(places, places)] = more[np.ix_(free, free)]
        return found

    @cached_property
    def _order(self) -> tuple[IntArray, IntArray]:
        """Degrees of freedom by filament, and where each filament's start."""
        order = np.argsort(self.labels, kind="stable")
        starts = np.searchsorted(self.labels[order], np.arange(self.labels.max(initial=-1) + 2))
        return order, starts

    @cached_property
    def _least(self) -> FloatArray:
        """Least rate (or square of a frequency) each filament may have; infinite where nothing bends."""
        filaments = self.labels.max(initial=-1) + 1
        length, pull, turn = (np.zeros(filaments + 1) for _ in range(3))
        ends = self.labels[self.node_dofs[self.edges]]
        np.add.at(length, np.maximum(ends[:, 0], ends[:, 1]), self.lengths)
        own = self.resistance.diagonal()
        is_angle = np.zeros(self.count, dtype=bool)
        is_angle[self.edge_dofs] = True
        np.add.at(turn, self.labels[is_angle], own[is_angle])
        np.add.at(pull, self.labels[~is_angle], own[~is_angle])
        soft = np.full(filaments + 1, np.inf)
        hinges = self._native["hinges"]
        if len(hinges):
            bending = np.linalg.eigvalsh(self._native["bending"])[:, 0]
            weakest = np.minimum(bending, self._native["twisting"])
            around = np.concatenate([ends[hinges[:, 0]], ends[hinges[:, 1]]], axis=1)
            np.minimum.at(soft, around.ravel(), np.repeat(weakest, 4))
        with np.errstate(divide="ignore", invalid="ignore"):
            bend, twist = soft / (pull * length**3), soft / (turn * length)
            least: FloatArray = ELASTIC_SHARE * np.fmin(bend, twist)[:filaments]
        return least

    def _chosen(self) -> IntArray:
        bend = np.flatnonzero(np.isfinite(self._least) & (self._least > 0.0))
        if len(bend) <= MOST_FILAMENTS:
            return bend
        by_rate = bend[np.argsort(self._least[bend], kind="stable")]
        half = MOST_FILAMENTS // 2
        return np.concatenate([by_rate[:half], by_rate[-half:]])

    def _relaxation(self, label: int) -> Relaxation | None:
        order, starts = self._order
        dofs = np.sort(order[starts[label] : starts[label + 1]])
        stiffness = self.stiffness[dofs][:, dofs]
        resistance = self.resistance[dofs][:, dofs]
        least = float(self._least[label])
        together = self._together(label, dofs)
        try:
            if together is None:
                eigenvalue = _slowest(stiffness, resistance, least)
            else:
                eigenvalue = _slowest_densely(stiffness, resistance + together, least)
        except (np.linalg.LinAlgError, scipy.sparse.linalg.ArpackError, RuntimeError):
            # Stiffnesses too far apart to find eigenvalues: a clamped beam as soft as the softest part.
            eigenvalue = CLAMPED_ROOT**4 * least / ELASTIC_SHARE
        if eigenvalue is None:
            return None
        edges = self.edges[(self.labels[self.node_dofs[self.edges]] == label).any(axis=1)]
        extent = np.ptp(self._native["rest_nodes"][edges].reshape(-1, 3), axis=0)
        return Relaxation(
            dofs=dofs,
            eigenvalue=eigenvalue,
            time=1.0 / eigenvalue if self.is_wet[label] else 2.0 * math.pi / math.sqrt(eigenvalue),
            size=float(np.linalg.norm(extent)) / 20.0,
        )


def _slowest_densely(stiffness: Any, resistance: FloatArray, least: float) -> float | None:
    """Return what `_slowest` does, for a full resistance."""
    fastest = float((abs(stiffness).sum(axis=1) / resistance.diagonal()).max())
    rates = scipy.linalg.eigh(stiffness.toarray(), resistance, eigvals_only=True)
    return _first_above(rates, max(least, 30.0 * np.finfo(float).eps * fastest))


def _slowest(stiffness: Any, resistance: Any, least: float) -> float | None:
    """Return the smallest eigenvalue of K v = rate R v of a mode with energy; None if there is none."""
    count = stiffness.shape[0]
    drag = resistance.diagonal()
    fastest = float((abs(stiffness).sum(axis=1) / drag).max())
    floor = max(least, 30.0 * np.finfo(float).eps * fastest)
    if count <= DENSE:
        return _first_above(
            scipy.linalg.eigh(stiffness.toarray(), resistance.toarray(), eigvals_only=True), floor
        )
    start = np.random.default_rng(0).standard_normal(count)
    modes = FEWEST_MODES
    while modes <= min(MOST_MODES, count // 2):
        found = scipy.sparse.linalg.eigsh(
            stiffness.tocsc(), k=modes, M=resistance.tocsc(), sigma=-max(least, 1e-11 * fastest),
            v0=start, return_eigenvectors=False, tol=1e-3,
        )  # fmt: skip
        slowest = _first_above(np.sort(found), floor)
        if slowest is not None:
            return slowest
        modes *= 2
    return None


def _first_above(values: FloatArray, floor: float) -> float | None:
    above = values[values > floor]
    return float(above.min()) if len(above) else None


def _bare(scene: Scene) -> Scene:
    """Return the scene without contact and walls, which are not needed here."""
    if scene.contact is None and not scene.walls:
        return scene
    return scene.replace(contact=None, walls=())


def slender_coefficients(scene: Scene) -> FloatArray:
    """Return drag per length along and across every edge (E, 2) [N s/m^2] that stands for nonlocal drag.

    That of a slender body which bends with the wave number k of a free rod's slowest mode, k L = 4.73 with
    the immersed length L: 4 pi mu / (ln(2 / (k a)) - gamma + 1/2) across and half of it along.
    """
    fluid = scene.fluid
    if fluid is None or fluid.model == "none":
        return np.zeros((scene.edge_count, 2))
    return np.concatenate([_slender(fluid, rod) for rod in scene.rods])


def _slender(fluid: Fluid, rod: Rod) -> FloatArray:
    lengths, immersed = rod.rest_lengths(), rod.immersed_array()
    contour = float(lengths[immersed].sum()) or float(lengths.sum())
    logarithm = np.log(2.0 * contour / (FREE_ROOT * rod.radius_array())) - np.euler_gamma
    logarithm = np.maximum(logarithm, 0.5) + 0.5
    across = 4.0 * np.pi * fluid.viscosity / logarithm
    return np.stack([0.5 * across, across], axis=1)
