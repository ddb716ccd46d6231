"""The record of a run: arrays over time, and what is measured on them."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np

from flagrs import trajectory_file
from flagrs.assemble import edges_of, radii_of
from flagrs.budget import EnergyBudget, budget_of
from flagrs.errors import FileError, FlagrsError
from flagrs.flow import flow_of, immersed_edges
from flagrs.fluid import hat_weights
from flagrs.force_density import ForceDensity
from flagrs.frame import shapes_of
from flagrs.guards import Notice, StationarityWarning, notices
from flagrs.lazy_frames import LazyField
from flagrs.measures import along, angle_about, slope, spin_about, window
from flagrs.results.bundle import Bundle, bundle_of
from flagrs.results.drivers import DriverReadOuts
from flagrs.results.material_frames import directors, each_director
from flagrs.results.readouts import ReadOuts, readouts_of
from flagrs.results.swimming import Swimming, swimming_of
from flagrs.scene import Head, Motor, Scene, Table, codec
from flagrs.scene.rod_topology import edges_at_nodes, far_end
from flagrs.scene.scene_checks import edges_of_head
from flagrs.scene.values import FloatArray, IntArray
from flagrs.trajectory_file import Contents

if TYPE_CHECKING:
    import pandas
    import xarray

    from flagrs.view import View


class Trajectory(DriverReadOuts):
    """The frames of a run, in SI units.

    With T frames, N nodes, E edges and M motors, in the scene's numbering:

    Attributes
    ----------
    time : ndarray
        Instants (T,) [s].
    nodes, velocities : ndarray
        Positions (T, N, 3) [m] and velocities (T, N, 3) [m/s].
    theta : ndarray
        Angles (T, E) of the material frames [rad].
    force_density : ndarray
        Force on the fluid per length (T, N, 3) [N/m]; zero where the fluid does not act.
    motor_angle, motor_speed, motor_torque : ndarray
        Angles [rad], speeds [rad/s] and torques [N m] of the shafts (T, M).
    clamp_force, clamp_torque, clamp_power : ndarray
        Forces (T, C, 3) [N], torques about their first nodes (T, C, 3) [N m] and powers (T, C) [W] of the C
        clamps; see `reaction`.
    account : ndarray
        What `energy_budget` and `warnings` read (T, 42).
    energy : ndarray
        Stretching, bending and twisting energy (T, 3) [J].
    scene : Scene
        The scene that ran.
    settings : dict
        How it ran.
    path : Path or None
        The file the trajectory was read from.
    finished : bool
        Whether the run reached its end.
    wall_seconds : float
        Wall time of the run [s].
    """

    def __init__(self, contents: Contents, scene: Scene, path: Path | None = None) -> None:
        frames = contents.frames
        self._contents = contents
        self.time = frames["time"]
        self.nodes = frames["nodes"]
        self.theta = frames["theta"]
        self.velocities = frames["velocities"]
        self.force_density = _known_by_edges(frames["force_density"], immersed_edges(scene)[0])
        self.motor_angle = frames["motor_angle"]
        self.motor_speed = frames["motor_speed"]
        self.motor_torque = frames["motor_torque"]
        self.clamp_force = frames["clamp_force"]
        self.clamp_torque = frames["clamp_torque"]
        self.clamp_power = frames["clamp_power"]
        self.energy = frames["energy"]
        self.account = frames["account"]
        self.scene = scene
        self.settings: dict[str, Any] = json.loads(contents.manifest["settings"])
        self.path = path
        self.finished = contents.finished
        self.wall_seconds = contents.wall_seconds

    @classmethod
    def load(cls, path: str | Path, lazy: bool | None = None) -> Self:
        """Return the trajectory in a file, whether its run finished, goes on, or was killed.

        Signals that were Python functions come back as tables of their values at the frames.

        Parameters
        ----------
        path
            The file.
        lazy
            Whether frames stay in the file until they are asked for, each checked as it is read: then a file
            of any size opens at once. None: from 256 MB on.

        Raises
        ------
        FileError
            If the file is missing, cannot be read, has changed since it was written, or is no trajectory; an
            `OSError`.
        """
        contents = trajectory_file.read_as(Path(path), lazy)
        try:
            scene = recorded_scene(contents)
            trajectory = cls(contents, scene, Path(path))
        except (ValueError, TypeError, KeyError, RecursionError) as error:
            raise FileError(path, f"damaged: its scene or settings ({error})") from None
        wrong = [name for name, shape in shapes_of(scene).items() if contents.frames[name].shape[1:] != shape]
        if wrong:
            raise FileError(path, f"damaged: {', '.join(wrong)} do not fit its scene")
        return trajectory

    def save(self, path: str | Path, overwrite: bool = False) -> None:
        """Write the trajectory to a file, with its last checkpoint if it has one.

        Parameters
        ----------
        path
            The file.
        overwrite
            Whether one that is there already is replaced.

        Raises
        ------
        FileError
            If it is there already, is written by a run, or cannot be written; an `OSError`.
        """
        trajectory_file.write_whole(Path(path), self._contents, overwrite)

    @property
    def contacts(self) -> IntArray:
        """Number of touching pairs of edges (T,)."""
        return np.asarray(self._contents.frames["contacts"]).astype(np.int64)

    @property
    def has_checkpoint(self) -> bool:
        """Whether the run can be gone on with; see `flagrs.Simulation.restore`."""
        return self._contents.state is not None

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.time)

    def __repr__(self) -> str:
        """Return a one-line summary."""
        until = f", 0 to {self.time[-1]:g} s" if len(self) else ""
        return f"Trajectory({self.scene.name}: {len(self)} frames of {self.nodes.shape[1]} nodes{until})"

    def _repr_html_(self) -> str:
        """Show it in a notebook."""
        from flagrs.notebook import trajectory_html  # it reads trajectories, so it is above this module

        return trajectory_html(self)

    def swimming_speed(self, start: float | None = None, end: float | None = None) -> float:
        """Return the speed of the head node, or of the mean of all nodes in a scene without a head [m/s].

        It is the norm of the least-squares slope of the position against time.

        Parameters
        ----------
        start, end
            Window [s]; by default the last half of the run.

        Raises
        ------
        FlagrsError
            If fewer than two frames lie in the window, or clamps hold filaments and there is no head.
        """
        if self.scene.head is None and self.scene.clamps:
            raise FlagrsError(
                "no swimming speed: clamps hold or move the filaments; see energy_budget() for what they "
                "spend, and thrust() for the force on the fluid"
            )
        inside = window(self.time, start, end)
        return float(np.linalg.norm(slope(self.time[inside], self.position()[inside])))

    def position(self) -> FloatArray:
        """Return the position (T, 3) of the head node, or of the mean of all nodes without a head [m]."""
        if self.scene.head is None:
            mean: FloatArray = self.nodes.mean(axis=1)
            return mean
        return self.nodes[:, self._global_node(self.scene.head, self.scene.head.node)]

    def head_rate(self, start: float | None = None, end: float | None = None) -> float:
        """Return how fast the head turns about the mean direction of the shafts [rad/s].

        It is the least-squares slope of `head_angle`; positive is right-handed about the shafts' direction
        from the motor to the flagellum. Frames must be close enough for the head to turn less than half a
        turn between.

        Parameters
        ----------
        start, end
            Window [s]; by default the last half of the run.

        Raises
        ------
        FlagrsError
            If fewer than two frames lie in the window, or the scene has no head or no motors.
        """
        inside = window(self.time, start, end)
        return float(slope(self.time[inside], self.head_angle()[inside]))

    def head_angle(self) -> FloatArray:
        """Return the angle (T,) the head has turned about the mean shaft direction, from zero [rad]."""
        head = self.scene.head
        if head is None or not self.scene.motors:
            raise FlagrsError("the turning of the head needs a scene with a head and motors")
        rod = self.scene.rods[head.rod]
        edges = edges_at_nodes(rod.edge_array(), len(rod.nodes))[head.node]
        before, after = sorted(far_end(rod.edge_array(), edge, head.node) for edge in edges)
        axis = self.shaft_axis()
        arms = self.nodes[:, self._global_node(head, after)] - self.nodes[:, self._global_node(head, before)]
        if not along(axis, arms).any():
            return angle_about(axis, arms)
        # The head's own edges run along the axis: they turn about it with their material frames.
        edge = edges_of_head(self.scene, head)[0]
        start, end = (self.nodes[:, self._global_node(head, int(k))] for k in rod.edge_array()[edge])
        return spin_about(axis, end - start, self.theta[:, self.scene.edge_offset(head.rod) + edge])

    def shaft_axis(self) -> FloatArray:
        """Return the mean direction (3,) of the shafts, from motor to flagellum, over motors and frames.

        Raises
        ------
        FlagrsError
            If there are no motors or frames, or the directions cancel out.
        """
        if not self.scene.motors or not len(self):
            raise FlagrsError("a shaft direction needs a scene with motors, and a frame")
        total = np.zeros(3)
        for motor in self.scene.motors:
            outer = far_end(self.scene.rods[motor.rod].edge_array(), motor.shaft, motor.node)
            shaft = (
                self.nodes[:, self._global_node(motor, outer)]
                - self.nodes[:, self._global_node(motor, motor.node)]
            )
            total += (shaft / np.linalg.norm(shaft, axis=1, keepdims=True)).mean(axis=0)
        size = float(np.linalg.norm(total))
        if size < 1e-3 * len(self.scene.motors):
            raise FlagrsError("the directions of the shafts cancel out; there is no mean direction")
        return total / size

    def torque(self) -> FloatArray:
        """Return the torque (T, M) of each motor on its shaft [N m]."""
        return self.motor_torque

    def power(self) -> FloatArray:
        """Return the power (T,) of all motors together, torque times speed [W]."""
        total: FloatArray = (self.motor_torque * self.motor_speed).sum(axis=1)
        return total

    def mean_power(self, start: float | None = None, end: float | None = None) -> float:
        """Return the mean power of all motors together in a window, by default the last half of the run [W].

        Parameters
        ----------
        start, end
            Window [s].

        Raises
        ------
        FlagrsError
            If the scene has no motors, or the window holds fewer than two frames.
        """
        if not self.scene.motors:
            raise FlagrsError("the power needs a scene with motors")
        return float(self.power()[window(self.time, start, end)].mean())

    def efficiency(self, start: float | None = None, end: float | None = None) -> float:
        """Return Purcell's efficiency R_0 U^2 / P [1].

        R_0 = C_t 6 pi mu r_h is the resistance of the head alone, U the swimming speed and P the mean power
        of the motors: the power an external force would need to drag the head at that speed, over the power
        spent (E. M. Purcell, PNAS 94, 11307, 1997).

        Parameters
        ----------
        start, end
            Window [s]; by default the last half of the run.

        Raises
        ------
        FlagrsError
            If the scene has no head, fluid or motors, the motors spend no power, or the window holds too few
            frames.
        """
        head, fluid = self.scene.head, self.scene.fluid
        if head is None or fluid is None or not self.scene.motors:
            raise FlagrsError("the efficiency needs a scene with a head, a fluid and motors")
        power = self.mean_power(start, end)
        if power <= 0.0:
            raise FlagrsError(f"the motors spend no power in the window (mean {power:g} W); no efficiency")
        resistance = head.C_t * 6.0 * math.pi * fluid.viscosity * head.radius
        return resistance * self.swimming_speed(start, end) ** 2 / power

    def energy_budget(self) -> EnergyBudget:
        """Return the energy given, taken and stored since the start, frame by frame, and the defect."""
        return budget_of(np.asarray(self.account))

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What the run warned of, with the worst value of each kind up to the last frame."""
        return tuple(notices(self.account[-1], self.scene)) if len(self) else ()

    def thrust(self) -> FloatArray:
        """Return the total force (T, 3) of the immersed edges on the fluid [N]; the head's is not in it."""
        edges, _ = immersed_edges(self.scene)
        frames = zip(self.nodes, self.force_density, strict=True)
        forces = [hat_weights(nodes, edges, density).sum(axis=0) for nodes, density in frames]
        return np.array(forces).reshape(-1, 3)

    def flow(self, points: Any, frame: int = -1, threads: int | None = None) -> FloatArray:
        """Return the velocity (M, 3) of the fluid at points (M, 3) [m] in a frame [m/s].

        It is the flow the immersed edges drive; dry edges, whose nodes may belong to immersed ones too, have
        no part in it, and the head stirs none.

        Raises
        ------
        FlagrsError
            If the fluid is not of regularized Stokeslet segments, which alone have a flow.
        SceneError
            For points of the wrong shape.
        """
        return flow_of(self.scene, self.nodes[frame], self.force_density[frame], points, threads)

    def minimum_gap(self) -> FloatArray:
        """Return the smallest gap (T,) between colliding edges, surface to surface, or infinity [m]."""
        return np.asarray(self._contents.frames["minimum_gap"])

    def rod_nodes(self, rod: int) -> FloatArray:
        """Return the positions (T, n, 3) of the nodes of one rod [m]."""
        offset = self.scene.node_offset(rod)
        return self.nodes[:, offset : offset + len(self.scene.rods[rod].nodes)]

    @property
    def edges(self) -> IntArray:
        """Start and end node (E, 2) of the edges."""
        return edges_of(self.scene)

    @property
    def radius(self) -> FloatArray:
        """Radius (E,) of the edges [m]."""
        return radii_of(self.scene)

    def material_directors(self, frames: Any = None) -> FloatArray:
        """Return the material director m1 (F, E, 3) of the edges.

        Frames hold the angles of the directors against others that the simulation carries along in time;
        those are found again from the nodes, to a fraction of a degree if the run ended in a checkpoint, as
        runs do (`flagrs.results.material_frames`).

        Parameters
        ----------
        frames
            Indices (F,) of the frames, in increasing order; None: all.
        """
        chosen = np.arange(len(self)) if frames is None else np.asarray(frames, dtype=np.int64)
        return directors(self.scene, self.time, self.nodes, self.theta, chosen, self._contents.state)

    def each_director(self) -> Iterator[FloatArray]:
        """Yield the material director m1 (E, 3) of the edges, frame by frame, as `material_directors`."""
        return each_director(self.scene, self.time, self.nodes, self.theta, self._contents.state)

    def swimming(self, start: float | None = None, end: float | None = None) -> Swimming:
        """Return the swimming velocity with its uncertainty, in the laboratory and along the swimmer's axis.

        Parameters
        ----------
        start, end
            Window [s]; by default the last half of the run. A `flagrs.StationarityWarning` says if the
            velocity has a trend over it.

        Raises
        ------
        FlagrsError
            If fewer than nine frames lie in the window, or clamps hold filaments and there is no head.
        """
        found = swimming_of(self, start, end)
        if not found.stationary:
            warnings.warn(
                f"the swimming velocity is not steady from {found.start:g} s to {found.end:g} s; "
                "take a later window (start=), or run on",
                StationarityWarning,
                stacklevel=2,
            )
        return found

    def readouts(self, start: float | None = None, end: float | None = None) -> ReadOuts:
        """Return everything that is read off the run in single numbers, with units and errors; print it.

        What means nothing for the scene is there without a value, and says why.

        Parameters
        ----------
        start, end
            Window [s]; by default the last half of the run.

        Raises
        ------
        FlagrsError
            If fewer than two frames lie in the window.
        """
        return readouts_of(self, start, end)

    def bundle(self, frames: Any = None) -> Bundle:
        """Return the filaments, measured together: gaps, phases, tips, twist, writhe, linking.

        Parameters
        ----------
        frames
            Indices (F,) of the frames, in increasing order; None: all.

        Raises
        ------
        FlagrsError
            If the scene has no immersed filament.
        """
        return bundle_of(self, np.arange(len(self)) if frames is None else np.asarray(frames, dtype=np.int64))

    @property
    def manifest(self) -> dict[str, str]:
        """Where the run comes from: version of flagrs, time of creation, scene and settings as JSON."""
        return dict(self._contents.manifest)

    def to_xarray(self) -> xarray.Dataset:
        """Return the run as an xarray Dataset with units; see `flagrs.export.arrays.to_xarray`."""
        from flagrs.export.arrays import to_xarray  # exports read trajectories, so they are above this module

        return to_xarray(self)

    def to_pandas(self, of: str = "frames") -> pandas.DataFrame:
        """Return the run as a table, a row for each of its ``frames`` or of the ``nodes`` in them.

        Units are in the names of the columns; see `flagrs.export.arrays.to_pandas`.
        """
        from flagrs.export.arrays import to_pandas  # exports read trajectories, so they are above this module

        return to_pandas(self, of)

    def export(self, to: str, path: str | Path) -> list[Path]:
        """Write the run as ``vtkhdf``, ``xarray``, ``npz`` or ``csv``; see `flagrs.export.export`."""
        from flagrs.export import export  # exports read trajectories, so they are above this module

        return export(self, to, path)

    def view(self, **options: Any) -> View:
        """Return the run in three dimensions, for a notebook or a page to `save`; see `flagrs.view.view`."""
        from flagrs.view import view  # views read trajectories, so they are above this module

        return view(self, **options)

    def _global_node(self, part: Head | Motor, node: int) -> int:
        return self.scene.node_offset(part.rod) + node


def _known_by_edges(density: FloatArray, edges: IntArray) -> FloatArray:
    """Return a force density (T, N, 3), in memory or in a file, that knows the edges it lives on."""
    if isinstance(density, LazyField):
        lazy: Any = density.marked_by(lambda values: ForceDensity(values, edges))
        return cast(FloatArray, lazy)
    return ForceDensity(density, edges)


def trajectory_from(contents: Contents, path: Path | None) -> Trajectory:
    """Return the trajectory of what a file or a recorder holds."""
    return Trajectory(contents, recorded_scene(contents), path)


def recorded_scene(contents: Contents) -> Scene:
    """Return the scene of a record, with tables of the recorded samples in place of Python functions."""
    data: Mapping[str, Any] = codec.from_json(contents.manifest["scene"])
    times = contents.frames["time"]
    if contents.signals and not len(times):
        raise FlagrsError("no frame was recorded yet, so the scene's functions of time are unknown")
    tables = {path: Table(times=times, values=values) for path, values in contents.signals.items()}
    return Scene(**codec.filled(data, tables))
