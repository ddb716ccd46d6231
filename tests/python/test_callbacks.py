"""Callbacks of a run: when they are called, what they may do, how they stop it."""

from pathlib import Path

import flagrs
import numpy as np
import pytest
from flagrs import FlagrsError, SceneError, Simulation, Trajectory

ROBOT = flagrs.scenarios.robot(edge_length=9e-3)


@pytest.mark.parametrize("options", [{"dt": 0.03}, {"rtol": 1e-3}])
def test_a_callback_sees_every_frame_at_its_time(options: dict[str, float]) -> None:
    seen: list[float] = []
    nodes: list[np.ndarray] = []

    def look(simulation: Simulation) -> None:
        seen.append(simulation.time)
        nodes.append(simulation.frame()["nodes"])

    trajectory = Simulation(ROBOT, threads=1, **options).run(0.5, 0.1, path=False, callback=look)
    assert seen == list(trajectory.time[1:])
    assert np.array_equal(np.array(nodes), trajectory.nodes[1:])


@pytest.mark.parametrize("options", [{"dt": 0.03}, {"rtol": 1e-3}])
def test_a_callback_that_only_looks_at_steps_changes_nothing(options: dict[str, float]) -> None:
    steps: list[float] = []
    plain = Simulation(ROBOT, threads=1, **options)
    watched = Simulation(ROBOT, threads=1, **options)
    expected = plain.run(0.5, 0.1, path=False)
    found = watched.run(
        0.5, 0.1, path=False, callback=lambda simulation: steps.append(simulation.time), callback_every="step"
    )
    assert np.array_equal(found.nodes, expected.nodes)
    assert len(set(steps)) == len(steps) and steps == sorted(steps) and steps[-1] == 0.5
    assert len(steps) >= (20 if "dt" in options else 3)


@pytest.mark.parametrize("every", ["frame", "step"])
@pytest.mark.parametrize("options", [{"dt": 0.03}, {"rtol": 1e-3}])
def test_true_stops_a_run_at_the_present_instant(
    every: str, options: dict[str, float], tmp_path: Path
) -> None:
    simulation = Simulation(ROBOT, threads=1, **options)
    trajectory = simulation.run(
        5.0,
        0.1,
        path=tmp_path / "run.h5",
        callback=lambda simulation: simulation.time > 0.33,
        callback_every=every,  # type: ignore[arg-type]
    )
    assert 0.33 < simulation.time < 1.0 and trajectory.time[-1] == simulation.time
    assert np.array_equal(trajectory.nodes[-1], simulation.frame()["nodes"])
    again = Simulation.restore(tmp_path / "run.h5")
    assert again.time == simulation.time
    again.run(1.5, 0.1, path=tmp_path / "run.h5")
    assert Trajectory.load(tmp_path / "run.h5").time[-1] == 1.5


def test_what_a_callback_sets_counts_from_its_instant() -> None:
    def turn_around(simulation: Simulation) -> None:
        for motor in simulation.motors:
            motor.speed = -motor.speed

    trajectory = Simulation(ROBOT, threads=1).run(0.6, 0.2, path=False, callback=turn_around)
    speed = float(ROBOT.motors[0].speed)  # type: ignore[arg-type]
    # The frame is taken before the callback sees it.
    np.testing.assert_allclose(trajectory.motor_speed[:, 0], [speed, speed, -speed, speed])
    np.testing.assert_allclose(trajectory.motor_angle[:, 0], [0.0, 0.2 * speed, 0.0, 0.2 * speed], atol=1e-12)


def test_what_a_callback_raises_reaches_the_user_with_the_time(tmp_path: Path) -> None:
    def fail(simulation: Simulation) -> None:
        if simulation.time > 0.25:
            raise ZeroDivisionError("my own mistake")

    simulation = Simulation(ROBOT, threads=1)
    with pytest.raises(ZeroDivisionError, match="my own mistake") as caught:
        simulation.run(1.0, 0.1, path=tmp_path / "run.h5", callback=fail)
    assert any("in the callback of the run at t = 0.3 s" in note for note in caught.value.__notes__)
    simulation.step(2)
    assert len(Trajectory.load(tmp_path / "run.h5")) == 4


def test_a_callback_may_not_step() -> None:
    with pytest.raises(FlagrsError, match=r"step\(\) is not allowed in the callback"):
        Simulation(ROBOT, threads=1).run(1.0, 0.1, path=False, callback=lambda simulation: simulation.step())
    with pytest.raises(FlagrsError, match=r"run\(\) is not allowed in the callback"):
        Simulation(ROBOT, threads=1).run(
            1.0, 0.1, path=False, callback=lambda simulation: bool(simulation.run(2.0, 0.1, path=False))
        )


def test_wrong_answers_and_names_are_refused() -> None:
    with pytest.raises(SceneError, match="returned 'yes'"):
        Simulation(ROBOT, threads=1).run(1.0, 0.1, path=False, callback=lambda _: "yes")  # type: ignore[arg-type,return-value]
    with pytest.raises(SceneError, match="callback_every"):
        Simulation(ROBOT, threads=1).run(1.0, 0.1, path=False, callback_every="year")  # type: ignore[arg-type]
