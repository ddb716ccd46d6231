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

#: Share of a filament's displacement across the axis that one helix must explain for its phase to mean
#: something.
HELICAL = 0.5


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
        scene = self.trajectory.scene
        reach = 0.1 * max(float(np.linalg.norm(np.diff(self.curve(0)[0], axis=0), axis=1).sum()), 0.0)
        measured = [EdgeGaps(scene, reach, owner=self._owners(a, b)) for a, b in self.pairs]
        frames = self.trajectory.nodes[self.frames]
        gaps: FloatArray = np.array([[pair.at(nodes).min() for pair in measured] for nodes in frames])
        return gaps

    def _owners(self, a: int, b: int) -> IntArray:
        """Return 0 and 1 for the edges (E,) of two filaments, -1 for all others."""
        owner = np.full(self.trajectory.scene.edge_count, -1)
        owner[self.filaments[a].edges], owner[self.filaments[b].edges] = 0, 1
        return owner

    def tip_spread(self) -> FloatArray:
        """Return the root mean square distance (T,) of the tips from their middle [m]."""
        self._need(2, "the spread of tips")
        tips = np.stack([self.curve(k)[:, -1] for k in range(len(self.filaments))], axis=1)
        spread: FloatArray = np.sqrt(
            ((tips - tips.mean(axis=1, keepdims=True)) ** 2).sum(axis=2).mean(axis=1)
        )
        return spread

    @cached_property
    def phase(self) -> FloatArray:
        """Phases (T, F) of the filaments' helices about the axis, continued in time [rad].

        Of a filament, ``y + i z`` across its own straight line from base to tip is compared with
        ``exp(i k x)`` along it, with the wave number k of the shape at rest: the phase is that of their
        product's integral. It rises as a filament turns right-handed about the axis.

        Raises
        ------
        FlagrsError
            If a filament is no helix: half of its displacement across the axis is something else.
        """
        phases = np.stack([self._phase(k) for k in range(len(self.filaments))], axis=1)
        return np.unwrap(phases, axis=0)

    def _phase(self, filament: int) -> FloatArray:
        path = self.filaments[filament]
        rest = np.concatenate([rod.rest_array() for rod in self.trajectory.scene.rods])[path.nodes]
        wave = _wave_number(rest)
        if wave is None:
            raise FlagrsError(f"filament {filament} is no helix at rest; it has no phase")
        parts = [_helix_part(shape, self.axis, wave) for shape in self.curve(filament)]
        amplitude = np.array(parts)
        if not (np.abs(amplitude) > 0.0).all():
            raise FlagrsError(f"filament {filament} is straight at some time; it has no phase")
        angle: FloatArray = np.angle(amplitude)
        return angle

    def phase_lag(self) -> FloatArray:
        """Return the phase (T, F - 1) of the others beyond the first filament's, within half a turn [rad]."""
        self._need(2, "a phase lag")
        lag = self.phase[:, 1:] - self.phase[:, :1]
        wrapped: FloatArray = (lag + np.pi) % (2.0 * np.pi) - np.pi
        return wrapped

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


def _wave_number(rest: FloatArray) -> float | None:
    """Return the wave number of a helix [1/m] by which its displacement across its line is best explained.

    None where no helix explains half of it. Positive for right-handed ones.
    """
    line = rest[-1] - rest[0]
    length = float(np.linalg.norm(line))
    if length == 0.0:
        return None
    across = _across(rest, line / length)
    total = float((np.abs(across) ** 2).mean())
    if total <= 1e-12 * length**2:
        return None
    along = (rest - rest[0]) @ (line / length)
    # Up to a wave for every four nodes, in steps that a finite helix resolves several times over.
    largest = 2.0 * np.pi * len(rest) / (4.0 * length)
    waves = np.linspace(-largest, largest, 32 * len(rest) + 1)
    power = np.abs(np.exp(-1j * np.outer(waves, along)) @ across) / len(rest)
    best = int(power.argmax())
    if power[best] ** 2 < HELICAL * total or abs(waves[best]) * length < np.pi:
        return None
    return float(waves[best])


def _helix_part(shape: FloatArray, axis: FloatArray, wave: float) -> complex:
    """Return the amplitude and phase of a helix of a wave number about an axis in a shape (n, 3)."""
    along = (shape - shape[0]) @ axis
    return complex((_across(shape, axis) * np.exp(-1j * wave * along)).mean())


def _across(shape: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the displacement (n,) across an axis as complex numbers, less its straight part."""
    least = np.eye(3)[int(np.abs(axis).argmin())]
    y = np.cross(axis, least) / np.linalg.norm(np.cross(axis, least))
    z = np.cross(axis, y)
    across = shape @ y + 1j * (shape @ z)
    along = shape @ axis
    # A leaning filament: its line is not part of its helix.
    basis = np.stack([np.ones_like(along), along - along.mean()], axis=1)
    fitted = basis @ np.linalg.lstsq(basis, across, rcond=None)[0]
    rest: FloatArray = across - fitted
    return rest
