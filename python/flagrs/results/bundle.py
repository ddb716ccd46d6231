"""What tells a bundle of filaments from single ones: gaps, phases, tips, twist, writhe, linking."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from flagrs.errors import FlagrsError
from flagrs.results.gaps import EdgeGaps
from flagrs.results.knotting import linking, writhe
from flagrs.results.paths import Path, filaments_of
from flagrs.results.strain import hinges_of, twists
from flagrs.scene.values import FloatArray, IntArray

if TYPE_CHECKING:
    from flagrs.trajectory import Trajectory

#: Coherence of two filaments from which the phase between them means something, and points along them it is
#: taken at.
COHERENT, PHASE_POINTS = 0.5, 64
#: Fewest hinges of a filament that has a shape.
LEAST_HINGES = 3


@dataclass(frozen=True)
class Bundle:
    """The filaments of a run, measured together.

    With F filaments and T frames (those chosen); filaments are the immersed paths of the scene, from base to
    tip.

    Attributes
    ----------
    trajectory : Trajectory
        The run.
    frames : ndarray
        Indices (T,) of its frames.
    filaments : list of Path
        The filaments.
    """

    trajectory: Trajectory
    frames: IntArray
    filaments: list[Path]

    @property
    def time(self) -> FloatArray:
        """Instants (T,) [s]."""
        return self.trajectory.time[self.frames]

    def curve(self, filament: int) -> FloatArray:
        """Return the nodes (T, n, 3) of a filament, from base to tip [m]."""
        return self.trajectory.nodes[self.frames][:, self.filaments[filament].nodes]

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """Every two filaments, in the order of what is measured on pairs."""
        return list(combinations(range(len(self.filaments)), 2))

    @cached_property
    def axis(self) -> FloatArray:
        """Mean direction (3,) from base to tip, over filaments and frames.

        Raises
        ------
        FlagrsError
            If the directions cancel out.
        """
        arms = [self.curve(k)[:, -1] - self.curve(k)[:, 0] for k in range(len(self.filaments))]
        lengths = sum(float(np.linalg.norm(arm, axis=1).mean()) for arm in arms)
        total = np.sum([arm.mean(axis=0) for arm in arms], axis=0)
        size = float(np.linalg.norm(total))
        if size <= 0.1 * lengths:
            raise FlagrsError("the directions from base to tip cancel out; the filaments have no common axis")
        unit: FloatArray = total / size
        return unit

    def gap(self) -> FloatArray:
        """Return the smallest gap (T, F (F - 1) / 2) of every two filaments, surface to surface [m].

        Gaps beyond a tenth of the filaments' length are cut off there.
        """
        self._need(2, "a gap between filaments")
        scene, count = self.trajectory.scene, len(self.filaments)
        owner = np.full(scene.edge_count, -1)
        for number, path in enumerate(self.filaments):
            owner[path.edges] = number
        reach = 0.1 * max(_length(self.curve(number)[0]) for number in range(count))
        near = EdgeGaps(scene, reach, owner)
        found = np.full((len(self.frames), count, count), reach)
        for row, nodes in zip(found, self.trajectory.nodes[self.frames], strict=True):
            pairs, gaps = near.pairs(nodes)
            both = np.sort(owner[pairs], axis=1)
            np.minimum.at(row, (both[:, 0], both[:, 1]), gaps)
        first, second = np.array(self.pairs).T
        return found[:, first, second]

    def tip_spread(self) -> FloatArray:
        """Return the root mean square distance (T,) of the tips from their middle [m]."""
        self._need(2, "the spread of tips")
        tips = np.stack([self.curve(k)[:, -1] for k in range(len(self.filaments))], axis=1)
        spread: FloatArray = np.sqrt(
            ((tips - tips.mean(axis=1, keepdims=True)) ** 2).sum(axis=2).mean(axis=1)
        )
        return spread

    def phase_lag(self) -> FloatArray:
        """Return the phase (T, F - 1) of the others beyond the first filament's, within half a turn [rad].

        It is the angle about the axis by which the first filament's curvature vectors must be turned to match
        another's at the same share of their arc length, in the mean along them: that of equal helices,
        right-handed about the axis. NaN where no angle makes them alike, as for filaments of other pitch or
        handedness (a coherence below a half).

        Raises
        ------
        FlagrsError
            If there is one filament only, or one is straight.
        """
        self._need(2, "a phase lag")
        first, *others = (self._winding(k) for k in range(len(self.filaments)))
        columns = []
        for number, other in enumerate(others, start=1):
            size = np.sqrt((np.abs(first) ** 2).sum(axis=1) * (np.abs(other) ** 2).sum(axis=1))
            if not size.all():
                raise FlagrsError(f"filament 0 or {number} is straight; it has no phase")
            product = (other * first.conj()).sum(axis=1) / size
            columns.append(np.where(np.abs(product) >= COHERENT, np.angle(product), np.nan))
        return np.stack(columns, axis=1)

    def _winding(self, filament: int) -> FloatArray:
        """Return the curvature (T, K) across the axis as complex numbers, at even shares of the arc length.

        Kinks, such as where a helix begins on its shaft, are left out: hinges that are bent twice as much as
        most.
        """
        path = self.filaments[filament]
        rest = np.concatenate([rod.rest_array() for rod in self.trajectory.scene.rods])[path.nodes]
        bent = np.linalg.norm(_curvature(rest), axis=1)
        if len(bent) < LEAST_HINGES or float(bent.max()) * _length(rest) < 1e-6:
            raise FlagrsError(f"filament {filament} is straight at rest; it has no phase")
        arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rest, axis=0), axis=1))])[1:-1]
        smooth = bent <= 2.0 * np.median(bent)
        least = np.eye(3)[int(np.abs(self.axis).argmin())]
        y = np.cross(self.axis, least) / np.linalg.norm(np.cross(self.axis, least))
        z = np.cross(self.axis, y)
        vectors = _curvature(self.curve(filament))
        across = (vectors @ y + 1j * (vectors @ z))[:, smooth]
        shares = np.linspace(0.05, 0.95, PHASE_POINTS)
        places = arc[smooth] / _length(rest)
        return np.array([np.interp(shares, places, row) for row in across])

    def twist(self) -> FloatArray:
        """Return the twist (T, F) of every filament's material from base to tip, in turns [1].

        It is that of the material frames beyond a frame carried along the curve, natural twist included.
        """
        scene = self.trajectory.scene
        inside = [self._hinges(path) for path in self.filaments]
        every = self.trajectory.material_directors(self.frames)
        rows = []
        for nodes, directors in zip(self.trajectory.nodes[self.frames], every, strict=True):
            angles = twists(scene, nodes, directors)
            rows.append([float(angles[hinges].sum()) for hinges in inside])
        return np.array(rows).reshape(-1, len(self.filaments)) / (2.0 * np.pi)

    def _hinges(self, path: Path) -> IntArray:
        """Return the hinges between the edges of a path; twist is the same whichever way they are passed."""
        pairs = {frozenset(pair): k for k, pair in enumerate(hinges_of(self.trajectory.scene).tolist())}
        edges = path.edges.tolist()
        follow = zip(edges, edges[1:] + (edges[:1] if path.closed else []), strict=False)
        found = [pairs[frozenset(pair)] for pair in follow if frozenset(pair) in pairs]
        return np.array(found, dtype=np.int64)

    def writhe(self) -> FloatArray:
        """Return the writhe (T, F) of every filament [1]; see `flagrs.results.knotting.writhe`."""
        columns = [[writhe(shape) for shape in self.curve(k)] for k in range(len(self.filaments))]
        return np.array(columns).T

    @property
    def linking_cost(self) -> int:
        """How many pairs of edges `linking` integrates over in a frame, some microseconds each."""
        sizes = [len(path.edges) for path in self.filaments]
        return sum(sizes[a] * sizes[b] for a, b in self.pairs)

    @property
    def writhe_cost(self) -> int:
        """How many pairs of edges `writhe` integrates over in a frame, some microseconds each."""
        return sum(len(path.edges) ** 2 // 2 for path in self.filaments)

    def linking(self) -> FloatArray:
        """Return how often every two filaments wind about each other (T, F (F - 1) / 2) [1].

        It is Gauss's integral, positive where they wind right-handed; see `flagrs.results.knotting.linking`.
        """
        self._need(2, "linking")
        curves = [self.curve(k) for k in range(len(self.filaments))]
        rows = [[linking(curves[a][t], curves[b][t]) for a, b in self.pairs] for t in range(len(self.frames))]
        return np.array(rows)

    def _need(self, least: int, what: str) -> None:
        if len(self.filaments) < least:
            raise FlagrsError(f"{what} needs {least} filaments; the scene has {len(self.filaments)}")


def bundle_of(trajectory: Trajectory, frames: IntArray) -> Bundle:
    """Return the filaments of a run in some frames.

    Raises
    ------
    FlagrsError
        If the scene has no immersed filament.
    """
    filaments = filaments_of(trajectory.scene)
    if not filaments:
        raise FlagrsError("the scene has no immersed filament to measure")
    return Bundle(trajectory, frames, filaments)


def _curvature(shape: FloatArray) -> FloatArray:
    """Return curvature vectors (..., n - 2, 3) at the inner nodes of a shape (..., n, 3) [1/m]."""
    edges = np.diff(shape, axis=-2)
    lengths = np.linalg.norm(edges, axis=-1, keepdims=True)
    tangents = edges / lengths
    mean = 0.5 * (lengths[..., 1:, :] + lengths[..., :-1, :])
    vectors: FloatArray = np.diff(tangents, axis=-2) / mean
    return vectors


def _length(shape: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(shape, axis=0), axis=1).sum())
