"""A run: steps, frames, callbacks and checkpoints in their order."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from flagrs.errors import FlagrsError, not_allowed
from flagrs.recorder import Recorder

if TYPE_CHECKING:
    from flagrs.simulation import Simulation

#: Frames between checkpoints.
CHECKPOINT_FRAMES = 20

#: Called with the simulation; True stops the run.
Callback = Callable[["Simulation"], bool | None]
Every = Literal["frame", "step"]


class Run:
    """A run in progress.

    Parameters
    ----------
    simulation
        What runs.
    recorder
        Where frames go.
    end
        Time to reach [s].
    callback
        Called after every frame or step, or None.
    every
        Which of the two.
    progress
        Called with the time of every frame [s], or None.
    """

    def __init__(
        self,
        simulation: Simulation,
        recorder: Recorder,
        end: float,
        callback: Callback | None,
        every: Every,
        progress: Callable[[float], None] | None,
    ) -> None:
        self._simulation = simulation
        self._native = simulation._native
        self._recorder = recorder
        self._end = end
        self._callback = callback
        self._every_step = callback is not None and every == "step"
        self._progress = progress

    def go(self, times: Iterator[float]) -> None:
        """Run through the times of frames [s], up to the last one or until the callback stops."""
        fixed = self._simulation.rtol is None
        if self._every_step:
            stopped = self._fixed_steps(times) if fixed else self._adaptive_steps(times)
        else:
            stopped = self._frames(times, fixed)
        if stopped and self._recorder.last_time < self._native.time:
            self._record(self._native.frame())

    def _frames(self, times: Iterator[float], fixed: bool) -> bool:
        for time in times:
            self._record(self._frame_at(time, fixed))
            if self._settled():
                return True
        return False

    def _frame_at(self, time: float, fixed: bool) -> dict[str, Any]:
        if fixed:
            reach(self._native, time, self._native.step)
            return self._native.frame()
        if self._callback is not None:
            # What the callback changes counts from the frame on: a step ends there.
            self._native.advance_past(time, time)
            return self._native.frame()
        self._native.advance_past(time, self._end)
        return self._native.frame_at(time)

    def _fixed_steps(self, times: Iterator[float]) -> bool:
        def steps(count: int) -> None:
            for _ in range(count - 1):
                self._native.step(1)
                if self._settled():
                    raise _Stopped
            self._native.step(1)

        try:
            for time in times:
                reach(self._native, time, steps)
                self._record(self._native.frame())
                if self._settled():
                    return True
        except _Stopped:
            return True
        return False

    def _adaptive_steps(self, times: Iterator[float]) -> bool:
        due = next(times, None)
        while due is not None:
            if self._native.time < due:
                self._native.advance_past(math.nextafter(self._native.time, np.inf), self._end)
            while due is not None and due <= self._native.time:
                self._record(self._native.frame_at(due))
                due = next(times, None)
            if self._settled():
                return True
        return False

    def _record(self, frame: dict[str, Any]) -> None:
        self._recorder.append(frame)
        self._simulation._guards.look(self._native.account())
        if self._progress is not None:
            self._progress(float(frame["time"]))

    def _settled(self) -> bool:
        """Let the callback see the step, and then keep what goes on from here; whether it stops the run."""
        stop = self._callback is not None and asked_to_stop(self._callback, self._simulation)
        self._recorder.scene = self._simulation.scene
        if self._recorder.is_due(CHECKPOINT_FRAMES):
            self._recorder.checkpoint(self._simulation.state())
            self._simulation._check_stability()
        return stop


class _Stopped(Exception):
    """The callback has stopped the run in the middle of the steps to a frame."""


def reach(native: Any, time: float, steps: Callable[[int], None]) -> None:
    """Step to a time exactly, in equal steps no longer than `dt`."""
    span = time - native.time
    wanted = native.dt
    count = max(1, math.ceil(span / wanted - 1e-9))
    native.dt = span / count
    try:
        steps(count)
    finally:
        native.dt = wanted


def asked_to_stop(callback: Callback, simulation: Simulation) -> bool:
    """Call a callback; whether it returned True. What it raises tells the time, and ends the run.

    Raises
    ------
    SceneError
        If it returned anything but True, False or None.
    """
    with simulation._calling():
        try:
            answer = callback(simulation)
        except BaseException as error:
            error.add_note(f"in the callback of the run at t = {simulation.time:g} s")
            raise
    if answer is None or isinstance(answer, bool | np.bool_):
        return bool(answer)
    raise not_allowed(
        "callback", f"a function that returned {answer!r}", "one that returns True to stop, or None"
    )


class Calling:
    """Whether a callback is at work: it may look and set inputs, but not step."""

    _called = False

    @contextmanager
    def _calling(self) -> Iterator[None]:
        self._called = True
        try:
            yield
        finally:
            self._called = False

    def _refuse_in_callback(self, what: str) -> None:
        if self._called:
            raise FlagrsError(f"{what} is not allowed in the callback of a run, which steps by itself")
