"""A simulation without mechanics: every node moves as one rigid body, so that all read-outs are known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt
from flagrs.frame import shapes_of
from flagrs.recorder import Recorder, load_checkpoint
from flagrs.scene import Scene
from flagrs.step_choice import RelativeError, chosen_rtol
from flagrs.trajectory import Trajectory

SPEED = 2e-3
RATE = -0.5
TORQUE = 3e-3
MOTOR_SPEED = 2.0


def rigid_frame(scene: Scene, time: float) -> dict[str, Any]:
    """Return the frame of a body that swims along -x at SPEED and turns about +x at RATE."""
    frame: dict[str, Any] = {name: np.zeros(shape) for name, shape in shapes_of(scene).items()}
    cosine, sine = np.cos(RATE * time), np.sin(RATE * time)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])
    frame["time"] = time
    frame["nodes"] = scene.node_array() @ turn.T + [-SPEED * time, 0.0, 0.0]
    frame["motor_torque"] += TORQUE
    frame["motor_speed"] += MOTOR_SPEED
    frame["minimum_gap"] = np.inf
    frame["energy"] = np.array([1e-9, 1e-6, 1e-7]) * (1.0 + time)
    return frame


class FakeSimulation:
    """Stands in for `flagrs.Simulation`, with the same calls."""

    def __init__(
        self,
        scene: Scene,
        scheme: str = "overdamped",
        dt: float | None = None,
        rtol: RelativeError = "auto",
        threads: int | None = None,
    ) -> None:
        self.scene = scene
        self.settings = {
            "scheme": scheme,
            "dt": dt,
            "rtol": chosen_rtol(rtol, dt, scheme),
            "threads": threads,
        }
        self.time = 0.0
        self._restored: Path | None = None

    @classmethod
    def restore(cls, path: str | Path) -> Self:
        """Return the simulation at the checkpoint in a file."""
        checkpoint = load_checkpoint(path)
        simulation = cls(checkpoint.scene, **checkpoint.settings)
        simulation.load_state(checkpoint.state)
        simulation._restored = Path(path)
        return simulation

    def state(self) -> dict[str, npt.NDArray[Any]]:
        """Return everything that changes."""
        return {"time": np.array(self.time)}

    def load_state(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Take over what `state` returned."""
        self.time = float(state["time"])

    def run(
        self,
        until: float,
        save_every: float,
        path: str | Path | None = None,
        progress: Callable[[float], None] | None = None,
        overwrite: bool = False,
    ) -> Trajectory:
        """Record frames until a time, with a checkpoint at every tenth and at the end."""
        again = path is not None and Path(path) == self._restored
        with (
            Recorder.resume(path, self.scene)
            if again and path
            else self._recorder(path, overwrite) as recorder
        ):
            first = round(self.time / save_every)
            for number in range(first + 1 if again else first, round(until / save_every) + 1):
                self.time = number * save_every
                recorder.append(rigid_frame(self.scene, self.time))
                if number % 10 == 0:
                    recorder.checkpoint(self.state())
                if progress is not None:
                    progress(self.time)
            recorder.checkpoint(self.state())
        return recorder.trajectory()

    def _recorder(self, path: str | Path | None, overwrite: bool) -> Recorder:
        return Recorder(path, self.scene, self.settings, overwrite)
