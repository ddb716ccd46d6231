"""Many runs on worker processes, each into a file of its own that a repeated sweep finds again."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import signal
import time
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from tqdm.auto import tqdm

from flagrs import worker
from flagrs.processors import usable_processors
from flagrs.runs import RunSettings, measured, run_to_file
from flagrs.scene import Scene


@dataclass(frozen=True)
class Case:
    """One run of a sweep.

    Attributes
    ----------
    name : str
        Beginning of the file's name.
    scene : Scene
        What runs.
    settings : RunSettings
        How it runs; each run has one thread, as the sweep uses the processors for several runs.
    parameters : mapping
        What tells the case from the others, for tables.
    """

    name: str
    scene: Scene
    settings: RunSettings
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def key(self) -> str:
        """Return a hash of the scene and of the settings that change the result."""
        telling = {name: value for name, value in asdict(self.settings).items() if name != "threads"}
        return hashlib.sha256((self.scene.to_json() + json.dumps(telling)).encode()).hexdigest()

    def path_in(self, directory: Path) -> Path:
        """Return the file of the case in a directory."""
        return directory / f"{self.name}-{self.key()[:12]}.h5"


@dataclass(frozen=True)
class Result:
    """How a case of a sweep ended.

    Attributes
    ----------
    case : Case
        The case.
    path : Path
        Its trajectory file.
    measured : dict
        Its read-outs; see `flagrs.runs.measured`. Empty after an error.
    wall_seconds : float
        Wall time of the run [s], also where it was made by an earlier sweep.
    skipped : bool
        Whether an earlier sweep had finished it.
    error : str or None
        Why it failed.
    """

    case: Case
    path: Path
    measured: dict[str, float | None]
    wall_seconds: float
    skipped: bool = False
    error: str | None = None


def run(
    cases: Iterable[Case],
    directory: str | Path,
    *,
    processes: int | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> Iterator[Result]:
    """Run the cases side by side and yield each result as it comes.

    A case whose file is there and finished is skipped, one that was interrupted goes on. A case that fails
    yields a result with its error and does not stop the others.

    Parameters
    ----------
    cases
        What to run.
    directory
        Where the files go; made if it is not there.
    processes
        Number of worker processes; by default one for each processor this process may use.
    executor
        Where to run instead: any `concurrent.futures.Executor`, of a cluster for example.
    progress
        Whether to show a progress bar.

    Ending the iteration early, as Ctrl-C does, stops the workers within a second or two: no new case begins,
    and what was running is saved and goes on in the next sweep.

    Raises
    ------
    SceneError
        If a scene is driven by a Python function, which another process cannot be given: use a `Table`.
    """
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    jobs = {case.key(): (case, case.path_in(directory)) for case in cases}
    with ExitStack() as stack:
        if executor is None:
            executor = stack.enter_context(_workers(processes or usable_processors()))
        with _without_interrupts():
            futures = {executor.submit(_run_case, case, path): (case, path) for case, path in jobs.values()}
        stack.callback(_cancel, futures)
        bar = stack.enter_context(tqdm(total=len(futures), unit="run", disable=not progress))
        for future in as_completed(futures):
            bar.update()
            try:
                result = future.result()
            except BrokenExecutor as error:
                result = Result(*futures[future], {}, 0.0, error=f"the worker process died: {error}")
            yield result


@contextmanager
def _workers(count: int) -> Iterator[Executor]:
    """Give worker processes, which end with the context: at once if work is left, as after Ctrl-C."""
    # Spawned, not forked: a forked child inherits the locks of threads it does not have.
    context = multiprocessing.get_context("spawn")
    end, line = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(count, mp_context=context, initializer=worker.start, initargs=(end,))
    try:
        yield pool
    finally:
        line.close()
        try:
            pool.shutdown(cancel_futures=True)
        finally:
            end.close()


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Hold Ctrl-C back while workers start: they inherit that, the parent gets it afterwards."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _cancel(futures: Iterable[Future[Result]]) -> None:
    for future in futures:
        future.cancel()


def _run_case(case: Case, path: Path) -> Result:
    started = time.perf_counter()
    worker.check_not_stopping()
    try:
        done = run_to_file(case.scene, path, replace(case.settings, threads=1))
    except Exception as error:  # whatever it was, the other cases go on
        return Result(case, path, {}, time.perf_counter() - started, error=f"{type(error).__name__}: {error}")
    return Result(case, path, measured(done.trajectory), done.trajectory.wall_seconds, skipped=done.skipped)
