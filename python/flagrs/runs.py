"""Running a scene into a file: from the start, or on from where an earlier run was interrupted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flagrs.errors import FlagrsError
from flagrs.files import check_output
from flagrs.scene import Scene
from flagrs.scene.shapes import number
from flagrs.scene.values import Bounds
from flagrs.simulation import Simulation
from flagrs.step_choice import RelativeError, chosen_rtol
from flagrs.trajectory import Trajectory


@dataclass(frozen=True)
class RunSettings:
    """How a scene is run.

    Attributes
    ----------
    until : float
        Simulated time at which the run ends [s].
    save_every : float
        Simulated time between frames [s].
    scheme : str
        Scheme in time; see `flagrs.Simulation`.
    dt : float or None
        Length of fixed steps [s]; see `flagrs.Simulation`.
    rtol : float, "auto" or None
        Relative error of adaptive steps; see `flagrs.Simulation`.
    threads : int or None
        Threads of the simulation; None leaves it to ``FLAGRS_THREADS``.
    """

    until: float = 10.0
    save_every: float = 0.1
    scheme: str = "overdamped"
    dt: float | None = None
    rtol: RelativeError = "auto"
    threads: int | None = None

    def __post_init__(self) -> None:
        """Raise SceneError for times that are not positive, and an error that no steps can keep to."""
        for name in ("until", "save_every", "dt"):
            if getattr(self, name) is not None:
                number(name, getattr(self, name), Bounds("s", above=0.0))
        chosen_rtol(self.rtol, self.dt, self.scheme)


@dataclass(frozen=True)
class Run:
    """What a run left behind.

    Attributes
    ----------
    trajectory : Trajectory
        The frames of the whole run.
    resumed_at : float or None
        Simulated time at which it went on from an earlier run [s]; None if it began at the start.
    skipped : bool
        Whether an earlier run had got there already, so that nothing was left to do.
    """

    trajectory: Trajectory
    resumed_at: float | None = None
    skipped: bool = False


def run_to_file(
    scene: Scene,
    path: Path,
    settings: RunSettings,
    *,
    fresh: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Run a scene into a file, going on from what the file already holds.

    Parameters
    ----------
    scene
        The scene.
    path
        HDF5 file; if it holds an unfinished run of the same scene and settings, that run goes on.
    settings
        How to run.
    fresh
        Whether to start anew whatever the file holds.
    progress
        Called now and then with the simulated time [s].

    Raises
    ------
    FlagrsError
        If the file holds a run of another scene or with other settings, is being written by another run, or
        cannot be read or written.
    """
    present = check_output(path, overwrite=True)
    existing = _existing(scene, path, settings) if present and not fresh else None
    if existing is not None and _reached(existing, settings.until):
        return Run(existing, skipped=True)
    if existing is not None and existing.has_checkpoint:
        simulation = Simulation.restore(path)
        resumed_at = float(simulation.time)
    else:
        simulation = Simulation(scene, settings.scheme, settings.dt, settings.rtol, threads=settings.threads)
        resumed_at = None
    # What is there is a run of the same scene that had no checkpoint yet, or was asked to be replaced.
    trajectory = simulation.run(
        settings.until, settings.save_every, path=path, progress=progress, overwrite=present
    )
    return Run(trajectory, resumed_at)


def _existing(scene: Scene, path: Path, settings: RunSettings) -> Trajectory:
    """Return the trajectory in a file, after checking that it belongs to the same run."""
    trajectory = Trajectory.load(path)
    if trajectory.scene != scene:
        raise FlagrsError(
            f"{path}: holds a run of another scene; choose another file, or start anew (--fresh)"
        )
    for name, wanted in _asked_for(settings).items():
        found = trajectory.settings[name]
        if wanted != found:
            raise FlagrsError(
                f"{path}: holds a run with {name} = {found}, not {wanted}; "
                "choose another file, or start anew (--fresh)"
            )
    return trajectory


def _asked_for(settings: RunSettings) -> dict[str, str | float | None]:
    """Return the settings that change the result: a file made with others is another run."""
    asked: dict[str, str | float | None] = {"scheme": settings.scheme}
    if settings.dt is not None:
        asked["dt"] = settings.dt
    if settings.dt is not None or settings.rtol != "auto":
        asked["rtol"] = chosen_rtol(settings.rtol, settings.dt, settings.scheme)
    return asked


def _reached(trajectory: Trajectory, until: float) -> bool:
    # The last frame falls on the end but for the round-off of summed steps.
    return len(trajectory) > 0 and trajectory.time[-1] >= until * (1.0 - 1e-9)


def measured(trajectory: Trajectory) -> dict[str, float | None]:
    """Return the read-outs of a run: None for those the scene or the run cannot give.

    Speed [m/s], head rate [rad/s], mean power [W] and efficiency [1] over the last half, smallest gap [m].
    """
    return {
        "swimming_speed": _if_given(trajectory.swimming_speed),
        "head_rate": _if_given(trajectory.head_rate),
        "power": _if_given(trajectory.mean_power),
        "efficiency": _if_given(trajectory.efficiency),
        "minimum_gap": float(trajectory.minimum_gap().min())
        if np.isfinite(trajectory.minimum_gap()).any()
        else None,
    }


def _if_given(measure: Callable[[], float]) -> float | None:
    try:
        return measure()
    except FlagrsError:
        return None
