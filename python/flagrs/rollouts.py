"""Many states of one scene, taken forward side by side by the core."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
import numpy.typing as npt

from flagrs import inputs as live
from flagrs.assemble import native_inputs
from flagrs.errors import FlagrsError, SceneError, not_allowed
from flagrs.frame import FIELDS, shapes_of
from flagrs.frame_times import COPIES, check_frames, frame_times
from flagrs.memory import require_memory
from flagrs.scene import Scene, codec
from flagrs.scene.shapes import number, whole
from flagrs.scene.values import Bounds, FloatArray
from flagrs.simulation import MOST_STEPS, Simulation
from flagrs.step_choice import RelativeError
from flagrs.threads import thread_count
from flagrs.trajectory import Trajectory, trajectory_from
from flagrs.trajectory_file import Contents
from flagrs.version import installed_version

State = Mapping[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class Rollout:
    """What became of K cases, at T instants each.

    Attributes
    ----------
    frames : dict
        Arrays (K, T, ...) by the names of `flagrs.frame.FIELDS`, in SI units: ``nodes`` (K, T, N, 3),
        ``theta`` (K, T, E), ``velocities``, ``motor_torque`` and so on; NaN in the rows of cases that failed.
    states : tuple
        The last state of every case, for `Simulation.load_state` or another rollout; None where it failed.
    errors : tuple
        Why a case failed; None where it did not.
    scenes : tuple of Scene
        The scene of every case, with its inputs.
    settings : dict
        How they ran.
    """

    frames: dict[str, FloatArray]
    states: tuple[State | None, ...]
    errors: tuple[Exception | None, ...]
    scenes: tuple[Scene, ...]
    settings: dict[str, Any]

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self.states)

    @property
    def time(self) -> FloatArray:
        """Instants (K, T) [s]."""
        return self.frames["time"]

    @property
    def nodes(self) -> FloatArray:
        """Positions (K, T, N, 3) of the nodes [m]."""
        return self.frames["nodes"]

    @property
    def theta(self) -> FloatArray:
        """Angles (K, T, E) of the material frames [rad]."""
        return self.frames["theta"]

    @property
    def velocities(self) -> FloatArray:
        """Velocities (K, T, N, 3) of the nodes [m/s]."""
        return self.frames["velocities"]

    def check(self) -> Rollout:
        """Return itself, or raise the error of the first case that failed, with its number."""
        for case, error in enumerate(self.errors):
            if error is not None:
                error.add_note(f"in case {case} of the rollout")
                raise error
        return self

    def trajectory(self, case: int) -> Trajectory:
        """Return the frames of one case as a trajectory, with all that it measures.

        Raises
        ------
        FlagrsError
            If the case failed.
        """
        error = self.errors[case]
        if error is not None:
            raise FlagrsError(f"case {case} failed: {error}") from error
        manifest = {
            "version": installed_version(),
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
            "scene": codec.to_json(self.scenes[case], codec.named_function),
            "settings": json.dumps(self.settings),
        }
        frames = {name: values[case] for name, values in self.frames.items()}
        times = frames["time"]
        signals = {
            path: np.array(
                [codec.sample_at(self.scenes[case], path, float(t), empty.shape[1:]) for t in times]
            )
            for path, function in codec.sampled_functions_of(self.scenes[case]).items()
            for empty in [codec.empty_samples(function)]
        }
        return trajectory_from(Contents(manifest, frames, signals, finished=True), None)


def rollout(
    scene: Scene | Simulation,
    states: Sequence[State] | State | None = None,
    inputs: Sequence[Mapping[str, Any]] | None = None,
    *,
    until: float | None = None,
    steps: int | None = None,
    save_every: float | None = None,
    scheme: str = "overdamped",
    dt: float | None = None,
    rtol: RelativeError = "auto",
    threads: int | None = None,
) -> Rollout:
    """Take many states of one scene forward, side by side on the threads of the core.

    What does not change is built once and shared. Every case goes the way a `Simulation` by itself would, to
    the last bit, whatever the number of threads: ``load_state``, inputs set, ``run`` or ``step``. Nothing of
    Python runs in between, but for functions of time that the scene is driven by.

    Parameters
    ----------
    scene
        The scene, or a simulation of it, whose model, scheme, steps and, without `states`, present state are
        taken.
    states
        For every case what `Simulation.state` returned, or one of them for all; None: the state of the scene.
    inputs
        For every case what drives it from here on: values by path, such as ``{"motors[0].speed": 2.0}`` or
        ``{"loads[0].force": (0.0, 1e-6, 0.0)}``; see `Simulation.motors`. None: as in its state.
    until
        Simulated time to reach [s]; later than every state's.
    steps
        Number of steps instead.
    save_every
        Simulated time between frames [s]; None: the last instant alone.
    scheme, dt, rtol
        As for `Simulation`; not with a simulation, which has its own.
    threads
        Threads to use; None: ``FLAGRS_THREADS``, else all.

    Raises
    ------
    SceneError
        If an argument is not allowed. What a case fails with while it runs is in `Rollout.errors`.

    Examples
    --------
    >>> import flagrs
    >>> scene = flagrs.scenarios.robot(edge_length=9e-3)
    >>> turned = flagrs.rollout(scene, inputs=[{"motors[0].speed": w} for w in (1.0, 2.0)], steps=3)
    >>> turned.nodes.shape
    (2, 1, 37, 3)
    """
    simulation = _simulation(scene, scheme, dt, rtol)
    count = _count(states, inputs)
    given = _states(states, count)
    cases, scenes = _cases(simulation, given, inputs, count)
    plan = _plan(simulation, given, (until, steps, save_every), thread_count(threads))
    size = 8 * sum(math.prod(shape) for shape in shapes_of(simulation.scene).values())
    require_memory(
        f"{count} cases", COPIES * size * count * max(1, len(plan["times"])), "take fewer at a time"
    )
    if plan["steps"] is None:
        check_frames(
            simulation.scene, 0.0, plan["times"][-1], plan["times"][-1] / (len(plan["times"]) * count)
        )
    outcomes = simulation._native.rollout(cases, plan)
    frame_count = len(plan["times"]) if plan["steps"] is None else 1
    frames = {
        name: np.full((count, frame_count, *shape), np.nan)
        for name, shape in shapes_of(simulation.scene).items()
    }
    last: list[State | None] = []
    for case, (rows, state, _) in enumerate(outcomes):
        for row, frame in enumerate(rows or ()):
            for name in FIELDS:
                frames[name][case, row] = frame[name]
        last.append(None if state is None else state | {"inputs": _record(simulation, scenes[case])})
    errors = tuple(error for _, _, error in outcomes)
    return Rollout(frames, tuple(last), errors, scenes, dict(simulation._settings))


def _simulation(scene: Scene | Simulation, scheme: str, dt: float | None, rtol: RelativeError) -> Simulation:
    if not isinstance(scene, Simulation):
        return Simulation(scene, scheme, dt, rtol, threads=1)
    if (scheme, dt, rtol) != ("overdamped", None, "auto"):
        raise not_allowed(
            "scene", "a simulation together with scheme, dt or rtol", "a scene, or a simulation alone"
        )
    if scene._force is not None:
        raise not_allowed(
            "scene", "a simulation with a force function", "one without: cases run outside Python"
        )
    return scene


def _count(states: Any, inputs: Any) -> int:
    counts = {
        name: len(values)
        for name, values in (("states", states), ("inputs", inputs))
        if values is not None and not (name == "states" and isinstance(values, Mapping))
    }
    for name, size in counts.items():
        if size == 0:
            raise not_allowed(name, "no cases", "at least one")
    if len(set(counts.values())) > 1:
        raise not_allowed("inputs", f"{counts['inputs']} cases", f"as many as states, {counts['states']}")
    return next(iter(counts.values()), 1)


def _states(states: Sequence[State] | State | None, count: int) -> list[State | None]:
    if states is None or isinstance(states, Mapping):
        return [states] * count
    return list(states)


def _cases(
    simulation: Simulation,
    states: list[State | None],
    inputs: Sequence[Mapping[str, Any]] | None,
    count: int,
) -> tuple[list[dict[str, Any]], tuple[Scene, ...]]:
    """Return the cases as the core takes them, and the scene of each."""
    given = simulation._given_scene
    native: dict[int, tuple[Scene, Any]] = {}

    def driven(scene: Scene) -> Any:
        # Cases that share a scene share its signals. It is kept, so that no other can have its identity.
        if id(scene) not in native:
            native[id(scene)] = scene, native_inputs(scene, given)
        return native[id(scene)][1]

    cases, scenes = [], []
    for case in range(count):
        state, scene = states[case], simulation.scene
        try:
            if state is not None:
                scene = live.resumed(simulation._record_in(state), scene, given)
            before = scene
            for path, value in ({} if inputs is None else inputs[case]).items():
                scene = live.changed(scene, path, value, given)
                moved = live.turning_clamp_that_moves(path, scene)
                if moved is not None and scene is not before:
                    raise not_allowed(path, value, "left alone: its rotation's axis would have to move along")
            parts = None if state is None else simulation._parts_of(state)
        except SceneError as error:
            raise error.within(f"cases[{case}]") from None
        cases.append(
            {
                "state": parts,
                "inputs": None if before is simulation.scene else driven(before),
                "changed": None if scene is before else driven(scene),
            }
        )
        scenes.append(scene)
    return cases, tuple(scenes)


def _plan(
    simulation: Simulation,
    states: list[State | None],
    asked: tuple[float | None, int | None, float | None],
    threads: int,
) -> dict[str, Any]:
    until, steps, save_every = asked
    if (until is None) == (steps is None):
        raise not_allowed("until", until, "given, or steps, and not both")
    if steps is not None:
        if save_every is not None:
            raise not_allowed("save_every", save_every, "None with steps")
        return {"steps": min(whole("steps", steps, least=1), MOST_STEPS), "times": [], "threads": threads}
    start = max(simulation.time if state is None else float(state["time"][0]) for state in states)
    end = number("until", math.nan if until is None else until, Bounds("s", above=start))
    if save_every is None:
        return {"steps": None, "times": [end], "threads": threads}
    every = number("save_every", save_every, Bounds("s", above=0.0))
    check_frames(simulation.scene, start, end, every)
    return {"steps": None, "times": list(frame_times(start, end, every)), "threads": threads}


def _record(simulation: Simulation, scene: Scene) -> npt.NDArray[np.uint8]:
    return np.zeros(0, np.uint8) if scene is simulation._given_scene else live.recorded(scene)
