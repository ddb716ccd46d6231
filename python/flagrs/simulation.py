"""Simulations: a scene set in motion."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any, Literal, Never, Self, cast

import numpy as np
import numpy.typing as npt

from flagrs import _flagrs, inputs
from flagrs.assemble import native_inputs, native_scene
from flagrs.budget import statistics_of
from flagrs.default_step import default_step
from flagrs.errors import FileError, FlagrsError, not_allowed
from flagrs.exclusive import Exclusive
from flagrs.files import same_file
from flagrs.frame_times import check_frames, frame_times
from flagrs.guards import Guards, Notice, StabilityWarning, check_contact, check_turn
from flagrs.live import LiveInputs
from flagrs.memory import require_memory
from flagrs.outside_force import ForceFunction, OutsideForce
from flagrs.progress import bar_for
from flagrs.read_outs import ReadOuts
from flagrs.recorder import Recorder, load_checkpoint
from flagrs.running import Callback, Calling, Every, Run
from flagrs.scene import Scene
from flagrs.scene.scene import check_scene
from flagrs.scene.shapes import number, whole
from flagrs.scene.values import Bounds
from flagrs.simulation_input import check_scheme, real_array, state_part
from flagrs.step_choice import RelativeError, chosen_rtol, steps_in_words
from flagrs.threads import thread_count
from flagrs.time_step import (
    STABLE_SHARE,
    explicit_limit,
    local_tolerance,
)
from flagrs.trajectory import Trajectory

#: Where runs are saved when no path is given.
RUNS_FOLDER = Path("flagrs-runs")

#: What a state holds of inputs that are those of its scene.
NO_INPUTS = np.zeros(0, np.uint8)

#: More steps than any run makes; larger numbers do not fit the native counter.
MOST_STEPS = 2**62


class Simulation(ReadOuts, LiveInputs, Calling):
    """A scene set in motion.

    Parameters
    ----------
    scene
        What is simulated.
    scheme
        ``overdamped``: no inertia, fluid and elasticity implicit, first order, the default; ``implicit``:
        the same with inertia; ``explicit``: Lim et al.'s scheme, with the fluid forces of the
        last velocities, stable only for small steps (docs/theory/time.md).
    dt
        Length of fixed steps of first order [s]; given together with `rtol`, the scale of the first adaptive
        step. None, for fixed steps: `flagrs.default_step.default_step`, a turn of 0.05 rad of the fastest
        motor or less where filaments relax faster; a fifth of the stability limit for the explicit scheme,
        which warns (`flagrs.StabilityWarning`) of longer ones than that limit.
    rtol
        Relative error to keep to by steps of adaptive size and of order one to three, 1e-8 to 0.1: the error
        of node positions, relative to the size of the filament they are on (docs/theory/time.md). ``auto``,
        the default: 1e-3, but fixed steps if `dt` is given or the scheme is the explicit one, which has no
        others. None: fixed steps.
    force
        A function that gives forces from outside, called once at the beginning of every step with the time
        [s], nodes (N, 3) [m], velocities (N, 3) [m/s] and directors (E, 3, 3), rows ``m1, m2, t``. It returns
        forces (N, 3) [N], or a mapping with ``forces`` and, where there are any, ``torques`` (E, 3) on edges
        [N m] and ``stiffness`` (N, 3, 3) [N/m]: minus the derivative of a node's force with respect to its
        position, with which stiff springs are followed implicitly. A step that is tried again sees the same
        forces; steps are of first order. A call costs what Python costs, some 10 us.
    threads
        Threads to use; None: ``FLAGRS_THREADS``, else all. Results do not depend on it.

    Raises
    ------
    SceneError
        If the scene cannot be simulated by this scheme, or an option is out of range.

    Examples
    --------
    >>> import flagrs
    >>> simulation = flagrs.Simulation(flagrs.scenarios.robot(rpm=20.0))
    >>> simulation.step(10)
    >>> simulation.nodes.shape
    (59, 3)
    """

    def __init__(
        self,
        scene: Scene,
        scheme: str = "overdamped",
        dt: float | None = None,
        rtol: RelativeError = "auto",
        force: ForceFunction | None = None,
        threads: int | None = None,
    ) -> None:
        check_scene(scene)
        require_memory(
            f"a simulation of {scene.node_count} nodes",
            scene.plan().memory,
            "take longer edges, or leave Fluid.far_field_nodes as it is",
        )
        step = default_step(scene) if dt is None else number("dt", dt, Bounds("s", above=0.0))
        check_scheme(scene, scheme)
        check_contact(scene)
        rtol = chosen_rtol(rtol, dt, scheme)
        self._scene = self._given_scene = scene
        native = _flagrs.Simulation(native_scene(scene), scheme, step, thread_count(threads))
        self._exclusive = Exclusive(native, "the simulation")
        self._native = cast(_flagrs.Simulation, self._exclusive)
        self._settings: dict[str, Any] = {
            "scheme": scheme,
            "dt": dt,
            "rtol": rtol,
            "threads": threads,
            "force": None if force is None else repr(force),
        }
        self._force = force
        self._guards = Guards(scene)
        self._restored: Path | None = None
        if force is not None:
            self._native.set_force(OutsideForce(force, scene.node_count, scene.edge_count))
        if rtol is not None:
            self._native.set_tolerance(local_tolerance(scene, rtol))
        if scheme == "explicit" and dt is None:
            self._native.dt = STABLE_SHARE * min(self.stable_step(), step / STABLE_SHARE)
        if dt is not None and rtol is None:
            check_turn(scene, self.dt)
        self._check_stability()

    @classmethod
    def restore(
        cls, path: str | Path, scene: Scene | None = None, force: ForceFunction | None = None
    ) -> Self:
        """Return the simulation at the checkpoint in a file; it goes on to the last bit.

        Parameters
        ----------
        path
            A file written by `checkpoint` or `run`, also of a run that was killed.
        scene
            The scene; needed only if Python functions drive it, which no file can hold.
        force
            The force function of the run, if it had one.

        Raises
        ------
        FlagrsError
            If the file holds no checkpoint, or one of another scene.
        """
        saved = load_checkpoint(path, scene)
        recorded = saved.settings.pop("force", None)
        if (recorded is None) != (force is None):
            told = "had no force function" if recorded is None else f"had the force function {recorded}"
            raise FlagrsError(f"{path}: the run {told}; give force= just as it was")
        try:
            simulation = cls(saved.scene, **saved.settings, force=force)
        except TypeError as error:
            raise FileError(path, f"damaged: its settings ({error})") from None
        simulation.load_state(saved.state)
        simulation._restored = Path(path)
        return simulation

    @property
    def scheme(self) -> str:
        """The scheme in time."""
        return self._native.scheme

    @property
    def dt(self) -> float:
        """Length of fixed steps, scale of the first adaptive one [s].

        Setting it asks for fixed steps of that length from now on.
        """
        return self._native.dt

    @dt.setter
    def dt(self, value: float) -> None:
        self._refuse_in_callback("setting dt")
        self._native.dt = number("dt", value, Bounds("s", above=0.0))
        self._settings.update(dt=self._native.dt, rtol=None)
        self._native.set_tolerance(None)
        check_turn(self._scene, value)
        self._check_stability()

    @property
    def rtol(self) -> float | None:
        """Relative error that adaptive steps keep to; None for fixed steps. It may be set."""
        rtol: float | None = self._settings["rtol"]
        return rtol

    @rtol.setter
    def rtol(self, value: float | None) -> None:
        self._refuse_in_callback("setting rtol")
        rtol = chosen_rtol(value, None, self.scheme)
        self._settings["rtol"] = rtol
        self._native.set_tolerance(None if rtol is None else local_tolerance(self._scene, rtol))

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What has been warned of so far, with the worst value of each kind."""
        return self._guards.found

    @property
    def statistics(self) -> dict[str, float]:
        """Counts of steps, rejected steps, Newton, Krylov and contact iterations, seconds, and balances.

        ``energy_given``, ``energy_taken`` and ``energy_stored`` [J] are sums since the start,
        ``energy_defect`` what is left of them over the energy that has passed; ``force_imbalance`` and
        ``torque_imbalance`` are the largest outer force and torque left over on a free part, relative to the
        sums of their sizes; ``warnings`` is how many kinds there were.
        """
        numbers = statistics_of(self._native.account())
        return self._native.statistics() | numbers | {"warnings": len(self._guards.found)}

    def step(self, n: int = 1) -> None:
        """Make n steps; an adaptive one is made of two parts at the start and after a jump.

        Their length is what the relative error allows, or `dt` if steps are fixed. A fixed step that does not
        converge is made in halves, quarters and so on, an adaptive one again with 0.4 of its length.

        Raises
        ------
        ConvergenceError
            If even the smallest part does not converge; the simulation stands at its last good state.
        SceneError
            If n is not a whole number, at least 0, or a motor's function gives anything but a finite number.
        """
        self._refuse_in_callback("step()")
        self._native.step(min(whole("n", n, least=0), MOST_STEPS))
        self._guards.look(self._native.account())

    def run(
        self,
        until: float,
        save_every: float,
        path: str | Path | Literal[False] | None = None,
        progress: Callable[[float], None] | bool | None = None,
        overwrite: bool = False,
        callback: Callback | None = None,
        callback_every: Every = "frame",
    ) -> Trajectory:
        """Run until a time and return what was recorded.

        Frames between adaptive steps are interpolated; fixed steps are shortened a little so that a whole
        number of them makes `save_every`. The file is
        complete at any moment: a run that is killed can be read, and gone on with by `Simulation.restore`.

        Parameters
        ----------
        until
            Simulated time to reach [s]; later than the present.
        save_every
            Simulated time between frames [s].
        path
            HDF5 file. None: a new file in ``flagrs-runs/``; False: nothing is saved. The file a simulation
            was restored from is gone on with.
        progress
            Called with the simulated time [s] after every frame; True: a progress bar.
        overwrite
            Whether a file that is there already is replaced.
        callback
            Called with the simulation after every frame; it may read whatever it likes and set inputs, such
            as ``simulation.motors[0].speed``, which count from there on. True stops the run, whose last frame
            is the present instant; None and False let it go on. What it raises ends the run and tells the
            time; the simulation stands at its last good state. With it adaptive steps end at every frame.
        callback_every
            ``step`` calls it after every step instead.

        Raises
        ------
        ConvergenceError
            As `step`; frames up to there are saved.
        SceneError
            If a time is out of range, the frames would take more memory than there is, or the callback
            returns anything but True, False or None.
        FileError
            If the file is there already, is written by another run, or cannot be written; an `OSError`.
        """
        self._refuse_in_callback("run()")
        if callback_every not in ("frame", "step"):
            raise not_allowed("callback_every", callback_every, "'frame' or 'step'")
        with self._exclusive.held(), bar_for(progress, until, self._scene.name) as report:
            end = number("until", until, Bounds("s", above=self.time))
            every = number("save_every", save_every, Bounds("s", above=0.0))
            check_frames(self._scene, self.time, end, every)
            target = self._path(path)
            again = target is not None and same_file(target, self._restored)
            if again and target is not None:
                recorder = Recorder.resume(target, self._given_scene)
            else:
                recorder = self._recorder(target, overwrite)
            with recorder:
                recorder.scene = self._scene
                if not again:
                    recorder.append(self.frame())
                start = recorder.last_time if again else self.time
                run = Run(self, recorder, end, callback, callback_every, report)
                run.go(frame_times(start, end, every))
                recorder.checkpoint(self.state())
                self._guards.look(self._native.account(), end=True)
            return recorder.trajectory()

    def _path(self, path: str | Path | Literal[False] | None) -> Path | None:
        if path is False:
            return None
        if path is not None:
            return Path(path)
        RUNS_FOLDER.mkdir(exist_ok=True)
        stamp = f"{self._scene.name}-{datetime.now():%Y%m%d-%H%M%S}"
        names = (f"{stamp}{'' if k == 0 else f'-{k}'}.h5" for k in range(10_000))
        return next(RUNS_FOLDER / name for name in names if not (RUNS_FOLDER / name).exists())

    def _recorder(self, path: Path | None, overwrite: bool) -> Recorder:
        return Recorder(path, self._scene, self._settings, overwrite=overwrite)

    def set_state(self, nodes: Any, theta: Any = None) -> None:
        """Place the nodes and, if given, the edge angles; everything at rest.

        Frames are transported from those of the last accepted step, so that the result does not depend on the
        placements before.

        Parameters
        ----------
        nodes
            Positions (N, 3) [m].
        theta
            Angles (E,) of the material frames [rad]; None: unchanged.

        Raises
        ------
        SceneError
            For a wrong shape, a value that is not finite, or a shape that is not a configuration; nothing
            is changed.
        """
        self._native.place(
            real_array("nodes", nodes, 2), None if theta is None else real_array("theta", theta, 1)
        )

    def stable_step(self) -> float:
        """Return the longest stable step of the explicit scheme [s]: 2 / lambda_max(M^-1 Res)."""
        rows = (self.dof_of_node[:, None] + np.arange(3)).ravel()
        return explicit_limit(self.resistance(), self.mass[rows])

    def _check_stability(self) -> None:
        """Warn of steps of the explicit scheme that are longer than its limit at the present shape."""
        if self.scheme != "explicit":
            return
        try:
            limit = self.stable_step()
        except FlagrsError:  # too many nodes for a resistance: the limit cannot be known
            return
        if self.dt > limit:
            warnings.warn(
                f"dt: {self.dt:g} s is above the explicit scheme's stability limit, {limit:g} s: unless "
                "elasticity raises it, the motion is wrong; take a smaller dt, or scheme='implicit'",
                StabilityWarning,
                stacklevel=3,
            )

    def state(self) -> dict[str, npt.NDArray[Any]]:
        """Return everything that changes, to the last bit."""
        same = self._scene is self._given_scene
        return self._native.state() | {"inputs": NO_INPUTS.copy() if same else inputs.recorded(self._scene)}

    def load_state(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Take over what `state` returned, of a simulation of the same scene.

        Raises
        ------
        SceneError
            If it does not belong to this scene, or is not finite; nothing is changed.
        FlagrsError
            If inputs were Python functions that this simulation does not have.
        """
        self._refuse_in_callback("load_state()")
        parts, record = self._parts_of(state), self._record_in(state)
        present, scene = self._native.state(), self._scene
        self._drive(inputs.resumed(record, scene, self._given_scene))
        try:
            self._native.load_state(parts)
        except BaseException:
            self._drive(scene)
            self._native.load_state(present)
            raise

    def _parts_of(self, state: Mapping[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
        """Return the arrays of a state as the core takes them; states of before lack some."""
        if not isinstance(state, Mapping):
            raise not_allowed("state", state, "what state() returned")
        present = self._native.state()
        still = np.zeros_like(present["clamp_reactions"])
        state = {"clamp_reactions": still} | dict(state)
        missing = present.keys() - state.keys()
        if missing:
            raise not_allowed("state", f"without {', '.join(sorted(missing))}", "what state() returned")
        return {name: state_part(name, state[name], like) for name, like in present.items()}

    def _record_in(self, state: Mapping[str, npt.NDArray[Any]]) -> npt.NDArray[Any]:
        """Return the inputs recorded in a state; states of before have none."""
        return state_part("inputs", state.get("inputs", NO_INPUTS), NO_INPUTS)

    def _change(self, path: str, value: Any) -> None:
        """Give one of the inputs another value from the next step on."""
        scene, before = inputs.changed(self._scene, path, value, self._given_scene), self._scene
        if scene is before:
            return
        with self._exclusive.held():
            moved = inputs.turning_clamp_that_moves(path, scene)
            center = None if moved is None else self._native.clamp_center(moved)
            self._drive(scene)
            if moved is not None and center is not None:
                # The axis goes on from where the motion before has taken it.
                there = self._native.clamp_center(moved)
                shift = np.zeros(3) if there is None else center - there
                self._drive(inputs.with_center_shifted(scene, moved, shift))

    def _drive(self, scene: Scene) -> None:
        """Take over the inputs of a scene that differs in nothing else."""
        if scene is not self._scene:
            self._native.set_inputs(native_inputs(scene, self._given_scene))
            self._scene = scene

    def checkpoint(self, path: str | Path, overwrite: bool = False) -> None:
        """Write the present state to a file that `restore` reads.

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
        with self._exclusive.held(), self._recorder(Path(path), overwrite) as recorder:
            recorder.append(self.frame())
            recorder.checkpoint(self.state())

    def __copy__(self) -> Self:
        """Return a simulation of its own at the same state, which goes on to the same bits."""
        with self._exclusive.held():
            twin = type(self)(self._given_scene, **(self._settings | {"force": self._force}))
            twin._native.dt = self.dt
            twin._drive(self._scene)
            twin.load_state(self.state())
        return twin

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """As `copy.copy`: scenes cannot change, and need no copies."""
        return self.__copy__()

    def __reduce__(self) -> Never:
        """Refuse to be pickled."""
        raise FlagrsError(
            "a simulation cannot be pickled; pickle its scene and its state(), and give them to Simulation "
            "and load_state, or use checkpoint and restore"
        )

    def __repr__(self) -> str:
        """Describe the simulation in a line."""
        steps = steps_in_words(self.rtol, self.dt)
        return f"<flagrs.Simulation of {self._scene.name!r}: {self._native!r}, {steps}>"
