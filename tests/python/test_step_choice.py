"""Which steps a simulation makes: adaptive by default, fixed where their length is given."""

import copy
from pathlib import Path

import numpy as np
import pytest
from flagrs import SceneError, Simulation, scenarios
from flagrs.default_step import default_step
from flagrs.runs import RunSettings, run_to_file
from flagrs.step_choice import DEFAULT_RTOL, chosen_rtol

SCENE = scenarios.relaxing_rod(edge_count=8)


def test_steps_keep_to_an_error_unless_their_length_is_given() -> None:
    assert Simulation(SCENE, threads=1).rtol == DEFAULT_RTOL == 1e-3
    assert Simulation(SCENE, dt=0.01, threads=1).rtol is None
    assert Simulation(SCENE, dt=0.01, rtol=1e-4, threads=1).rtol == 1e-4
    assert Simulation(SCENE, scheme="explicit", threads=1).rtol is None
    fixed = Simulation(SCENE, rtol=None, threads=1)
    assert fixed.rtol is None and fixed.dt == default_step(SCENE)


def test_default_steps_are_those_of_rtol_1e_3_to_the_bit() -> None:
    runs = [
        Simulation(SCENE, threads=1, **options).run(1.0, 0.25, path=False)
        for options in ({}, {"rtol": 1e-3}, {"rtol": None})
    ]
    assert np.array_equal(runs[0].nodes, runs[1].nodes)
    assert not np.array_equal(runs[0].nodes, runs[2].nodes)


def test_default_steps_are_as_exact_as_they_say() -> None:
    exact = Simulation(SCENE, rtol=1e-7, threads=1).run(2.0, 0.5, path=False)
    found = Simulation(SCENE, threads=1).run(2.0, 0.5, path=False)
    length = float(SCENE.rods[0].rest_lengths().sum())
    # The size of a straight rod is a twentieth of its length.
    assert np.linalg.norm(found.nodes - exact.nodes, axis=2).max() < 1e-3 * length / 20.0


def test_setting_the_length_asks_for_fixed_steps_and_setting_the_error_for_adaptive_ones() -> None:
    simulation = Simulation(SCENE, threads=1)
    simulation.dt = 0.02
    assert simulation.rtol is None
    simulation.step(3)
    assert simulation.time == pytest.approx(0.06, rel=1e-12)
    simulation.rtol = 1e-4
    before = simulation.statistics["steps"]
    simulation.step(4)
    assert simulation.time != pytest.approx(0.14, rel=1e-6)
    assert simulation.statistics["steps"] - before >= 4
    with pytest.raises(SceneError, match="rtol"):
        simulation.rtol = 1.0
    assert simulation.rtol == 1e-4


def test_the_file_and_what_restores_it_know_the_steps(tmp_path: Path) -> None:
    simulation = Simulation(SCENE, threads=1)
    simulation.dt = 0.02
    trajectory = simulation.run(0.1, 0.05, path=tmp_path / "fixed.h5")
    assert (trajectory.settings["rtol"], trajectory.settings["dt"]) == (None, 0.02)
    again = Simulation.restore(tmp_path / "fixed.h5")
    assert again.rtol is None and again.dt == 0.02
    Simulation(SCENE, threads=1).run(0.1, 0.05, path=tmp_path / "adaptive.h5")
    assert Simulation.restore(tmp_path / "adaptive.h5").rtol == 1e-3


def test_a_run_goes_on_with_the_steps_it_has_unless_others_are_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    run_to_file(SCENE, path, RunSettings(until=0.1, dt=0.02, threads=1))
    done = run_to_file(SCENE, path, RunSettings(until=0.2, threads=1))
    assert done.trajectory.settings["rtol"] is None
    with pytest.raises(Exception, match=r"rtol = None, not 0\.001"):
        run_to_file(SCENE, path, RunSettings(until=0.3, rtol=1e-3, threads=1))


@pytest.mark.parametrize("wrong", [0.2, 1e-9, float("nan"), "tight"])
def test_an_error_out_of_range_is_refused(wrong: object) -> None:
    with pytest.raises(SceneError, match="rtol"):
        chosen_rtol(wrong, None, "overdamped")  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="rtol"):
        Simulation(SCENE, rtol=wrong)  # type: ignore[arg-type]


def test_the_explicit_scheme_has_no_error_to_keep_to() -> None:
    with pytest.raises(SceneError, match="explicit"):
        Simulation(SCENE, scheme="explicit", rtol=1e-3)


def test_a_copy_makes_the_same_steps() -> None:
    simulation = Simulation(SCENE, threads=1)
    simulation.dt = 0.03
    twin = copy.copy(simulation)
    assert (twin.dt, twin.rtol) == (0.03, None)
    simulation.step(2)
    twin.step(2)
    assert np.array_equal(simulation.nodes, twin.nodes)


def test_what_runs_says_which_steps() -> None:
    assert "adaptive steps, rtol = 0.001" in repr(Simulation(SCENE))
    assert "fixed steps of 0.02 s" in repr(Simulation(SCENE, dt=0.02))
    assert "steps:    adaptive, to rtol = 0.001" in str(SCENE.plan())
