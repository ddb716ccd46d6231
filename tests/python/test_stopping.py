"""Runs and sweeps that are stopped: by Ctrl-C, by a kill, in a child of a fork, from another thread."""

from __future__ import annotations

import copy
import os
import pickle
import random
import signal
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flagrs import FlagrsError, Fluid, Material, Rod, Scene, SceneError, Simulation, scenarios
from flagrs.trajectory import Trajectory
from programs import left_of, linux, started, wait_for

ROBOT = scenarios.robot(edge_length=9e-3)

SWEEP = """
    import sys
    from flagrs import scenarios, sweep
    from flagrs.runs import RunSettings
    if __name__ == "__main__":
        settings = RunSettings(until=5000.0, save_every=0.1)
        cases = [sweep.Case("robot", scenarios.robot(rpm=float(rpm)), settings) for rpm in range(5, 15)]
        for result in sweep.run(cases, sys.argv[1], processes=2, progress=False):
            print(result.error)
    """

RUN = """
    import sys
    import flagrs
    from flagrs.runs import RunSettings, run_to_file
    scene = flagrs.scenarios.robot(edge_length=9e-3)
    settings = RunSettings(until=float(sys.argv[2]), save_every=0.05, threads=1)
    run_to_file(scene, __import__("pathlib").Path(sys.argv[1]), settings)
    """


@linux
@pytest.mark.parametrize("how", ["interrupted", "interrupted twice", "killed"])
def test_a_stopped_sweep_ends_soon_begins_nothing_and_leaves_no_orphans(tmp_path: Path, how: str) -> None:
    folder = tmp_path / "runs"
    sweep = started(SWEEP, tmp_path, folder)
    assert wait_for(lambda: len(list(folder.glob("robot-*.h5"))) == 2, 60.0)
    time.sleep(1.5)
    if how == "killed":
        sweep.kill()
    else:
        os.killpg(sweep.pid, signal.SIGINT)
        if how.endswith("twice"):
            time.sleep(0.2)
            os.killpg(sweep.pid, signal.SIGINT)
    output, _ = sweep.communicate(timeout=10.0)
    assert wait_for(lambda: not left_of(sweep.pid), 4.0), left_of(sweep.pid)
    assert how == "killed" or b"KeyboardInterrupt" in output
    files = list(folder.iterdir())
    assert len(files) == 2 and all(len(Trajectory.load(file)) > 1 for file in files)


def test_a_killed_run_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    kill_and_resume(tmp_path, kills=3, until=8.0)


@pytest.mark.slow
def test_a_run_killed_two_hundred_times_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    for trial in range(20):
        (tmp_path / str(trial)).mkdir()
        kill_and_resume(tmp_path / str(trial), kills=10, until=30.0)


def kill_and_resume(folder: Path, kills: int, until: float) -> None:
    whole = Simulation(ROBOT, threads=1).run(until, 0.05, path=False)
    path, chance, seen, landed = folder / "run.h5", random.Random(5), 0, 0
    for _ in range(kills):
        run = started(RUN, folder, path, until)
        wait_for(path.exists, 30.0)
        time.sleep(chance.uniform(0.0, 0.4))
        landed += run.poll() is None
        run.kill()
        run.communicate()
        trajectory = Trajectory.load(path)
        count = len(trajectory)
        assert np.array_equal(trajectory.nodes, whole.nodes[:count])
        seen = max(seen, count)
    assert landed > 0
    run = started(RUN, folder, path, until)
    output, _ = run.communicate(timeout=120)
    assert run.returncode == 0, output.decode()
    resumed = Trajectory.load(path)
    assert resumed.finished and len(resumed) == len(whole)
    for name in ("time", "nodes", "theta", "velocities", "motor_torque", "energy"):
        assert np.array_equal(getattr(resumed, name), getattr(whole, name)), name
    assert {entry.name for entry in folder.iterdir()} == {"run.h5", "program.py"}


# --- within a process ---------------------------------------------------------------------------------------


def test_ctrl_c_ends_a_long_step_and_leaves_the_last_good_state() -> None:
    # One step of this scene takes half a second with the fastest build, and a minute with the slowest.
    soft = Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
    rod = Rod.straight(length=1.0, edge_count=12000, radius=1e-5, material=soft)
    simulation = Simulation(Scene(rods=rod, fluid=Fluid(viscosity=1.0)), dt=1e-3, threads=1)
    nodes = simulation.nodes.copy()
    nodes[:, 1] += 0.05 * np.sin(20.0 * nodes[:, 0])
    simulation.set_state(nodes)
    before = simulation.state()
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        simulation.step()
    assert 0.05 < time.monotonic() - start < 5.0 and simulation.time == 0.0
    # The account of energies begins, at this state, with the first step that is tried.
    for name, array in simulation.state().items():
        assert name == "account" or np.array_equal(array, before[name]), name


def test_an_interrupted_simulation_goes_on_to_the_same_bits() -> None:
    broken, twin = (Simulation(ROBOT, rtol=1e-3, threads=1) for _ in range(2))
    threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        broken.step(10**6)
    while twin.time < broken.time:
        twin.step()
    assert twin.time == broken.time > 0.0
    broken.step(20)
    twin.step(20)
    assert broken.time == twin.time and np.array_equal(broken.nodes, twin.nodes)


def test_a_simulation_made_before_a_fork_works_in_the_child() -> None:
    scene = scenarios.robot(edge_length=2e-3)
    simulation, twin = (Simulation(scene, threads=2) for _ in range(2))
    simulation.step(2)
    child = os.fork()
    if child == 0:
        status = 1
        try:
            simulation.step(2)
            status = 0 if np.isfinite(simulation.nodes).all() else 2
        finally:
            os._exit(status)
    assert wait_for(lambda: (found := os.waitpid(child, os.WNOHANG))[0] and found[1] == 0, 30.0)
    simulation.step(2)
    twin.step(4)
    assert np.array_equal(simulation.nodes, twin.nodes)


def test_a_second_thread_is_refused_in_words_and_harms_nothing() -> None:
    simulation, twin = (Simulation(ROBOT, threads=1) for _ in range(2))
    refusals: list[str] = []

    def meddle() -> None:
        while worker.is_alive():
            try:
                simulation.step()
            except FlagrsError as error:
                refusals.append(str(error))

    worker = threading.Thread(target=lambda: simulation.run(3.0, 0.05, path=False))
    worker.start()
    time.sleep(0.02)
    meddle()
    assert refusals and all("at work in another thread" in refusal for refusal in refusals)
    steps = int(simulation.statistics["steps"])
    twin.run(3.0, 0.05, path=False)
    twin.step(steps - int(twin.statistics["steps"]))
    assert np.array_equal(simulation.nodes, twin.nodes)


def test_a_function_of_time_cannot_step_its_own_simulation() -> None:
    scene = scenarios.robot(edge_length=9e-3)
    held: list[Simulation] = []

    def speed(time: float) -> float:
        if held:
            held[0].step()
        return 1.0

    motors = [scene.motors[0].replace(speed=speed), scene.motors[1]]
    held.append(Simulation(scene.replace(motors=motors), dt=0.01, threads=1))
    with pytest.raises(FlagrsError, match="in the middle of a step"):
        held[0].step()
    assert held[0].time == 0.0


@pytest.mark.parametrize("value", [None, "a", "1.5", np.nan, np.zeros(2), 1j, 10**400], ids=range(7))
def test_a_function_of_time_that_gives_no_number_is_named(value: Any) -> None:
    motors = [ROBOT.motors[0].replace(speed=lambda time: value if time > 0.0 else 1.0), ROBOT.motors[1]]
    scene = ROBOT.replace(motors=motors)
    with pytest.raises(SceneError, match="must be a finite number"):
        Simulation(scene, threads=1).step()


def test_copies_go_their_own_way_to_the_same_bits() -> None:
    simulation = Simulation(ROBOT, rtol=1e-3, threads=1)
    simulation.step(30)
    for twin in (copy.copy(simulation), copy.deepcopy(simulation)):
        there = simulation.nodes
        twin.step(10)
        assert np.array_equal(simulation.nodes, there)
        other = copy.copy(simulation)
        other.step(10)
        assert np.array_equal(other.nodes, twin.nodes) and not np.array_equal(other.nodes, there)
    with pytest.raises(FlagrsError, match="cannot be pickled"):
        pickle.dumps(simulation)


def test_scenes_that_were_pickled_or_copied_stay_as_they_are() -> None:
    for scene in (pickle.loads(pickle.dumps(ROBOT)), copy.deepcopy(ROBOT), copy.copy(ROBOT)):
        assert scene == ROBOT
        with pytest.raises(ValueError, match="read-only"):
            scene.rods[0].nodes[0, 0] = 7.0


BAD_STATES: dict[str, Any] = {
    "control_order": np.array([0], dtype=np.uint64),
    "history_order": np.array([9], dtype=np.uint64),
    "history_times": np.array([1e9, 0.0, 0.0, 0.0]),
    "steps": np.array([2**63], dtype=np.uint64),
    "time": np.array([np.nan]),
    "control_step": np.array([-1.0]),
    "q": np.zeros(3),
    "directors": None,
    "tangents": None,
    "contact_pairs": np.array([[0, -1]]),
    "contact_anchor": np.zeros((3, 3)),
    "tensions": np.zeros((0,)),
    "motor_angles": np.array([np.inf, 0.0]),
    "density": np.zeros((2, 2)),
    "velocity": np.array(["a", "b"]),
    "twists": 7,
}


@pytest.mark.parametrize("name", BAD_STATES)
def test_a_state_that_cannot_be_is_refused_and_changes_nothing(name: str) -> None:
    simulation = Simulation(ROBOT, rtol=1e-3, threads=1)
    simulation.step(10)
    before = simulation.state()
    bad = 2.0 * before[name] if BAD_STATES[name] is None else BAD_STATES[name]
    with pytest.raises(SceneError, match=rf"state\.{name}: "):
        simulation.load_state({**before, name: bad})
    for key, array in simulation.state().items():
        assert np.array_equal(array, before[key]), key
    simulation.step(2)


def test_nodes_that_coincide_are_no_state() -> None:
    simulation = Simulation(ROBOT, threads=1)
    state = simulation.state()
    with pytest.raises(SceneError):
        simulation.load_state({**state, "q": np.zeros_like(state["q"])})
