"""Recording a run, frame by frame, in memory or in a file."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from flagrs import inputs, trajectory_file
from flagrs.errors import FileError, FlagrsError
from flagrs.files import Lock
from flagrs.frame import checked, shapes_of
from flagrs.scene import Scene, codec
from flagrs.scene.values import FloatArray
from flagrs.trajectory import Trajectory, recorded_scene, trajectory_from
from flagrs.trajectory_file import Contents, State
from flagrs.trajectory_writer import TrajectoryWriter
from flagrs.version import installed_version

#: Frames waiting in memory are written when they fill this many, or are this old [s].
BLOCK_FRAMES = 64
BLOCK_SECONDS = 1.0


@dataclass(frozen=True)
class Checkpoint:
    """A run to go on with.

    Attributes
    ----------
    state : dict
        The arrays given to `Recorder.checkpoint`, to the last bit.
    scene : Scene
        The scene of the run.
    settings : dict
        The settings of the run.
    """

    state: State
    scene: Scene
    settings: dict[str, Any]


class Recorder:
    """Collects the frames and checkpoints of a run.

    Parameters
    ----------
    path
        HDF5 file to write; None keeps everything in memory.
    scene
        The scene that runs. Signals that are Python functions are sampled at every frame.
    settings
        How it runs: anything JSON can hold.
    overwrite
        Whether a file that is there already is replaced.

    Raises
    ------
    FileError
        If the file is there already and is not to be overwritten, belongs to another run, or cannot be
        written.
    """

    def __init__(
        self,
        path: str | Path | None,
        scene: Scene,
        settings: Mapping[str, Any],
        overwrite: bool = False,
    ) -> None:
        manifest = {
            "version": installed_version(),
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
            "scene": codec.to_json(scene, codec.named_function),
            "settings": json.dumps(dict(settings), allow_nan=False),
        }
        frames = {name: np.zeros((0, *shape)) for name, shape in shapes_of(scene).items()}
        sampled = codec.sampled_functions_of(scene)
        signals = {name: codec.empty_samples(function) for name, function in sampled.items()}
        contents = Contents(manifest, frames, signals)
        file = None if path is None else Path(path)
        self._start(scene, contents, file)
        self._writer = None if file is None else TrajectoryWriter(file, contents, overwrite)

    @classmethod
    def resume(cls, path: str | Path, scene: Scene | None = None) -> Self:
        """Return a recorder that goes on writing a file from its checkpoint; frames after it are dropped.

        Parameters
        ----------
        path
            The file of the interrupted run.
        scene
            The scene of the run; needed only if Python functions drive it, which no file can hold.
        """
        path = Path(path)
        if path.is_symlink():
            raise FileError(path, "is a link, which no result replaces; give the path it leads to")
        # Locked before it is read: nobody may write to it in between.
        lock = Lock(path)
        try:
            contents = trajectory_file.read(path)
            resumed_scene = _scene_to_resume(contents, scene, path)
            count = contents.state_frames
            contents.frames = {name: array[:count] for name, array in contents.frames.items()}
            contents.signals = {name: array[:count] for name, array in contents.signals.items()}
            contents.finished = False
            recorder = cls.__new__(cls)
            recorder._start(resumed_scene, contents, path)
            recorder._writer = TrajectoryWriter(path, contents, lock=lock)
        finally:
            lock.release()
        return recorder

    def _start(self, scene: Scene, contents: Contents, path: Path | None) -> None:
        self.path = path
        self.scene = scene
        self._contents = contents
        self._shapes = shapes_of(scene)
        self._waiting: list[tuple[dict[str, FloatArray], dict[str, FloatArray]]] = []
        self._waiting_since = time.perf_counter()
        self._began = self._waiting_since - contents.wall_seconds
        times = contents.frames["time"]
        self._last_time = float(times[-1]) if len(times) else -np.inf
        self._count = self._due_last = len(times)

    def is_due(self, frames: int) -> bool:
        """Whether a multiple of so many frames has been reached since this was last true."""
        due = self._count // frames > self._due_last // frames
        if due:
            self._due_last = self._count
        return due

    @property
    def frame_count(self) -> int:
        """Number of frames recorded, resumed ones included."""
        return self._count

    @property
    def last_time(self) -> float:
        """Time of the last frame [s]; minus infinity before the first."""
        return self._last_time

    def append(self, frame: Mapping[str, Any]) -> None:
        """Record a frame: a mapping with the keys of `flagrs.frame.FIELDS`.

        Raises
        ------
        FlagrsError
            If the frame is incomplete, not finite, or not later than the one before.
        """
        arrays = checked(frame, self._shapes)
        now = float(arrays["time"])
        if now <= self._last_time:
            raise FlagrsError(
                f"frame at t = {now:g} s: not later than the one before, at {self._last_time:g} s"
            )
        samples = {
            name: codec.sample_at(self.scene, name, now, array.shape[1:])
            for name, array in self._contents.signals.items()
        }
        self._waiting.append((arrays, samples))
        self._last_time = now
        self._count += 1
        due = time.perf_counter() - self._waiting_since > BLOCK_SECONDS
        if self._writer is not None and (due or len(self._waiting) >= BLOCK_FRAMES):
            self.flush()

    def flush(self) -> None:
        """Bring everything recorded so far into the file, or together in memory."""
        self._waiting_since = time.perf_counter()
        if not self._waiting:
            return
        frames = {name: np.stack([arrays[name] for arrays, _ in self._waiting]) for name in self._shapes}
        signals = {
            name: np.array([samples[name] for _, samples in self._waiting]) for name in self._contents.signals
        }
        self._waiting.clear()
        if self._writer is not None:
            self._writer.write(frames, signals)
            return
        held = self._contents
        held.frames = {name: np.concatenate([held.frames[name], block]) for name, block in frames.items()}
        held.signals = {name: np.concatenate([held.signals[name], block]) for name, block in signals.items()}

    def checkpoint(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Store a state to resume from, to the last bit, in place of the one before.

        It belongs to the frames recorded so far: a resumed run goes on after them.
        """
        self.flush()
        if self._writer is not None:
            self._writer.checkpoint(state)
        else:
            self._contents.state = {name: np.array(array) for name, array in state.items()}
            self._contents.state_frames = self._count

    def close(self, finished: bool = True) -> None:
        """Write what is waiting and close the file; `finished` marks a run that reached its end."""
        try:
            self.flush()
        finally:
            if self._writer is not None:
                self._writer.close(finished)
            else:
                self._contents.finished = finished
                self._contents.wall_seconds = time.perf_counter() - self._began

    def trajectory(self) -> Trajectory:
        """Return what was recorded."""
        self.flush()
        if self.path is not None:
            return Trajectory.load(self.path)
        return trajectory_from(self._contents, None)

    def __enter__(self) -> Self:
        """Return the recorder itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file; the run is finished if nothing was raised."""
        self.close(finished=kind is None)


def load_checkpoint(path: str | Path, scene: Scene | None = None) -> Checkpoint:
    """Return the latest checkpoint of a file, with the scene and the settings of its run.

    Parameters
    ----------
    path
        The file of the run; it may still be running, or have been killed.
    scene
        The scene of the run; needed only if Python functions drive it, which no file can hold.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    FlagrsError
        If the file is not a trajectory, has no checkpoint, or belongs to another scene than the one given.
    """
    contents = trajectory_file.read(Path(path))
    resumed = _scene_to_resume(contents, scene, path)
    return Checkpoint(dict(contents.state or {}), resumed, json.loads(contents.manifest["settings"]))


def _scene_to_resume(contents: Contents, given: Scene | None, path: str | Path) -> Scene:
    if contents.state is None:
        raise FlagrsError(f"{path}: no checkpoint to resume from")
    if given is None:
        if contents.signals:
            driven = ", ".join(contents.signals)
            raise FlagrsError(f"{path}: {driven} was a Python function; give the scene to resume with it")
        return recorded_scene(contents)
    recorded = codec.from_json(contents.manifest["scene"])
    found = _without_functions(codec.plain(given, codec.named_function))
    # The scene of the run's beginning will do, and that of the checkpoint, with the inputs set since.
    present = inputs.put_into(recorded, inputs.values_in(contents.state.get("inputs", np.zeros(0))))
    if found not in (_without_functions(recorded), _without_functions(present)):
        raise FlagrsError(f"{path}: recorded from another scene than the one given")
    return given


def _without_functions(data: Any) -> Any:
    """Return a recorded scene with nothing in the place of names of functions, which say little."""
    if isinstance(data, dict):
        named = data.keys() == {"function"}
        return None if named else {name: _without_functions(value) for name, value in data.items()}
    return [_without_functions(value) for value in data] if isinstance(data, list) else data
