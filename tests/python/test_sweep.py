"""Sweeps and studies: complete, repeatable without repeating, and not stopped by a case that fails."""

from __future__ import annotations

import csv
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from fake_simulation import RATE, SPEED, FakeSimulation
from flagrs import ConvergenceError, SceneError, runs, scenarios, study, sweep
from flagrs.runs import RunSettings
from flagrs.sweep import Case, Result
from flagrs.trajectory import Trajectory

SETTINGS = RunSettings(until=2.0, save_every=0.1)


class Failing(FakeSimulation):
    """Fails for robots at 13 rpm."""

    def run(
        self,
        until: float,
        save_every: float,
        path: str | Path | None = None,
        progress: Callable[[float], None] | None = None,
        overwrite: bool = False,
    ) -> Trajectory:
        """Run, or fail."""
        if self.scene == scenarios.robot(rpm=13.0):
            raise ConvergenceError("step 7 did not converge", step=7)
        return super().run(until, save_every, path, progress, overwrite)


@pytest.fixture(autouse=True)
def without_mechanics(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let runs use the fake simulation."""
    monkeypatch.setattr(runs, "Simulation", Failing)


def robot_cases(*rpms: float) -> list[Case]:
    return [Case("robot", scenarios.robot(rpm=rpm), SETTINGS, {"rpm": rpm}) for rpm in rpms]


def carried_out(cases: list[Case], directory: Path) -> dict[float, Result]:
    # Threads, as a spawned process would not know of the fake simulation. One, as h5py has one lock.
    with ThreadPoolExecutor(1) as executor:
        results = sweep.run(cases, directory, executor=executor, progress=False)
        return {result.case.parameters["rpm"]: result for result in results}


def test_each_case_has_a_file_of_its_own_and_its_read_outs(tmp_path: Path) -> None:
    results = carried_out(robot_cases(10.0, 20.0), tmp_path)
    assert len(list(tmp_path.glob("robot-*.h5"))) == 2
    for rpm, result in results.items():
        assert Trajectory.load(result.path).scene == scenarios.robot(rpm=rpm)
        assert result.measured["swimming_speed"] == pytest.approx(SPEED, rel=1e-12)
        assert result.measured["head_rate"] == pytest.approx(RATE, rel=1e-12)
        assert result.measured["minimum_gap"] is None and result.error is None


def test_a_repeated_sweep_skips_what_is_finished_and_keeps_its_wall_time(tmp_path: Path) -> None:
    first = carried_out(robot_cases(10.0), tmp_path)
    again = carried_out(robot_cases(10.0, 20.0), tmp_path)
    assert {rpm: result.skipped for rpm, result in again.items()} == {10.0: True, 20.0: False}
    assert again[10.0].wall_seconds == first[10.0].wall_seconds
    assert again[10.0].measured == first[10.0].measured


def test_another_setting_is_another_case_but_the_number_of_threads_is_not() -> None:
    scene = scenarios.robot()
    keys = [
        Case("robot", scene, RunSettings(until=2.0, dt=dt, threads=threads)).key()
        for dt, threads in ((None, 1), (None, 2), (1e-3, 1))
    ]
    assert keys[0] == keys[1] != keys[2]


def test_a_case_that_fails_does_not_stop_the_others(tmp_path: Path) -> None:
    results = carried_out(robot_cases(10.0, 13.0, 20.0), tmp_path)
    assert results[13.0].error == "ConvergenceError: step 7 did not converge" and not results[13.0].measured
    assert results[10.0].error is None and results[20.0].error is None


def test_a_scene_driven_by_a_function_is_refused_before_anything_runs(tmp_path: Path) -> None:
    scene = scenarios.robot()
    driven = scene.replace(motors=[scene.motors[0].replace(speed=lambda time: time), scene.motors[1]])
    with pytest.raises(SceneError, match=r"flagrs\.Table"):
        carried_out([Case("robot", driven, SETTINGS, {"rpm": 0.0})], tmp_path)
    assert not list(tmp_path.iterdir())


def with_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the studies run their cases in threads."""
    run = sweep.run

    def in_threads(cases: Any, directory: Path, **options: Any) -> Any:
        with ThreadPoolExecutor(1) as executor:
            yield from run(cases, directory, executor=executor, progress=False)

    monkeypatch.setattr(sweep, "run", in_threads)


def test_the_convergence_study_writes_a_tidy_table_and_a_figure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_threads(monkeypatch)
    found = study.convergence(tmp_path, rpms=(13.0, 5.0), edge_lengths=(9e-3, 8e-3), duration=1.0)
    with found.table.open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["nodes"], row["rpm"]) for row in rows] == [
        ("37", "5.0"),
        ("37", "13.0"),
        ("41", "5.0"),
        ("41", "13.0"),
    ]
    assert float(rows[0]["swimming_speed"]) == pytest.approx(SPEED, rel=1e-12)
    assert all(float(row["wall_seconds"]) > 0.0 and (tmp_path / row["file"]).exists() for row in rows)
    assert found.figure.read_bytes().startswith(b"\x89PNG")


def test_the_studies_are_those_of_the_text_by_default() -> None:
    assert study.RPMS == (5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0)
    nodes = [scenarios.robot(edge_length=edge_length).node_count for edge_length in study.EDGE_LENGTHS]
    assert nodes == [37, 41, 45, 51, 59, 73, 81]
    assert [scenarios.robot(normalized_pitch=pitch).node_count for pitch in study.PITCHES] == [69, 59, 55]


def test_the_geometry_study_has_a_line_for_each_pitch(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_threads(monkeypatch)
    found = study.geometries(tmp_path, rpms=(5.0,), duration=1.0)
    assert [row["normalized_pitch"] for row in found.rows] == [5.0, 7.0, 9.0]
