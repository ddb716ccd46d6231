"""The command line: what it writes, how it resumes, and that errors are one clean line."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from fake_simulation import SPEED, FakeSimulation
from flagrs import SceneError, cli, runs, scenarios, study
from flagrs.scene import Fluid
from flagrs.trajectory import Trajectory


@pytest.fixture(autouse=True)
def without_mechanics(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Let the command run the fake simulation, in a folder of its own."""
    monkeypatch.setattr(runs, "Simulation", FakeSimulation)
    monkeypatch.chdir(tmp_path)


def flagrs(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """Return the exit code of a command."""
    monkeypatch.setattr(sys, "argv", ["flagrs", *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    return int(ended.value.code or 0)


def test_run_saves_by_default_and_says_what_came_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert flagrs(monkeypatch, "run", "robot", "--until", "2", "--figure", "robot.png") == 0
    said = capsys.readouterr().out
    assert f"{1e3 * SPEED:.4g} mm/s" in said and "robot.h5 (21 frames)" in said and "times real time" in said
    assert Trajectory.load("robot.h5").scene == scenarios.robot()
    assert Path("robot.png").read_bytes().startswith(b"\x89PNG")


def test_run_goes_on_with_an_unfinished_run_and_skips_a_finished_one(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert flagrs(monkeypatch, "run", "robot", "--until", "1") == 0
    assert flagrs(monkeypatch, "run", "robot", "--until", "2") == 0
    assert "went on from t = 1 s" in capsys.readouterr().out
    assert len(Trajectory.load("robot.h5")) == 21
    assert flagrs(monkeypatch, "run", "robot", "--until", "2") == 0
    assert "finished; --fresh repeats it" in capsys.readouterr().out
    assert flagrs(monkeypatch, "run", "robot", "--until", "1", "--fresh") == 0
    assert len(Trajectory.load("robot.h5")) == 11


@pytest.mark.parametrize("first", [(), ("--dt", "0.1")])
@pytest.mark.parametrize("change", [("--set", "rpm=30"), ("--dt", "0.5"), ("--scheme", "implicit")])
def test_run_does_not_overwrite_another_run(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    first: tuple[str, ...],
    change: tuple[str, str],
) -> None:
    assert flagrs(monkeypatch, "run", "robot", "--until", "1", *first) == 0
    assert flagrs(monkeypatch, "run", "robot", "--until", "1", *change) == 1
    assert "robot.h5: holds a run" in capsys.readouterr().err


def test_set_changes_parameters_of_a_scenario() -> None:
    scene = cli.scene_from("robot", ["rpm=[30, -30]", "contact=false", "fluid.model=RFT"])
    assert scene == scenarios.robot(rpm=(30, -30), contact=False, fluid={"model": "RFT"})


def test_set_changes_fields_of_a_file(tmp_path: Path) -> None:
    scenarios.cantilever().to_toml(tmp_path / "scene.toml")
    scene = cli.scene_from(str(tmp_path / "scene.toml"), ["fluid.viscosity=2.5", "clamps[0].nodes=[0]"])
    assert scene.fluid == Fluid(viscosity=2.5, model="RFT") and scene.clamps[0].nodes == (0,)
    for wrong in ("clamps.7.nodes=[0]", "name.first=1"):
        with pytest.raises(SceneError, match=wrong.partition("=")[0]):
            cli.scene_from(str(tmp_path / "scene.toml"), [wrong])


def test_set_changes_parameters_of_a_scenario_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text("scenario = 'robot'\n[parameters]\nrpm = 10\nedge_length = 9e-3\n")
    scene = cli.scene_from(str(tmp_path / "scene.toml"), ["rpm=30", "fluid.twist_drag=false"])
    assert scene == scenarios.robot(rpm=30, edge_length=9e-3, twist_drag=False)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("run", "robt"), "did you mean 'robot'?"),
        (("run", "none.toml"), "none.toml: no such file"),
        (("run", "robot", "--set", "rmp=3"), "did you mean 'rpm'?"),
        (("run", "robot", "--set", "rpm"), "must be of the form key=value"),
        (("run", "robot", "--set", "edge_length=5"), "given in mm?"),
        (("run", "robot", "--until", "-1"), "until: -1.0 is not allowed; must be > 0 s"),
        (("run", "robot", "--save-every", "nan"), "save_every: nan is not allowed"),
    ],
)
def test_bad_input_is_one_clean_error_and_exit_code_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], said: str
) -> None:
    assert flagrs(monkeypatch, *arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and said in error and "Traceback" not in error


def test_a_failure_is_one_clean_error_and_exit_code_1(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert flagrs(monkeypatch, "plot", "none.h5") == 1
    Path("text.h5").write_text("hello")
    assert flagrs(monkeypatch, "plot", "text.h5") == 1
    error = capsys.readouterr().err
    assert error.count("error: ") == 2 and "Traceback" not in error


def test_plot_draws_next_to_the_file(monkeypatch: pytest.MonkeyPatch) -> None:
    FakeSimulation(scenarios.robot()).run(1.0, 0.1, path="mine.h5")
    assert flagrs(monkeypatch, "plot", "mine.h5") == 0
    assert Path("mine.png").exists()


def test_plan_runs_nothing(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert flagrs(monkeypatch, "run", "robot", "--plan") == 0
    assert "235 degrees of freedom" in capsys.readouterr().out
    assert not Path("robot.h5").exists()


def test_scenarios_are_listed_with_their_parameters(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert flagrs(monkeypatch, "scenarios") == 0
    said = capsys.readouterr().out
    assert "clamped_flagella" in said and "rpm=20.0" in said


def test_a_study_prints_its_table_with_units_and_reports_failures(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    row = {"normalized_pitch": 7.0, "nodes": 59, "rpm": 20.0, "swimming_speed": 1e-3, "head_rate": -1.0}
    good = {**row, "wall_seconds": 3.0, "file": "good.h5", "error": None}
    bad = {**good, "swimming_speed": None, "head_rate": None, "file": "bad.h5", "error": "no"}
    for rows, code in (([good], 0), ([good, bad], 1)):
        done = study.Study(rows, Path("table.csv"), Path("figure.png"), 4.0)
        monkeypatch.setattr(study, "convergence", lambda *_, done=done, **__: done)
        assert flagrs(monkeypatch, "study", "convergence") == code
        said = capsys.readouterr()
        assert "speed [mm/s]" in said.out and "1.0000" in said.out and "table.csv" in said.out
        assert ("bad.h5: no" in said.err) == bool(code)


def test_the_help_keeps_units_in_brackets(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert flagrs(monkeypatch, "run", "--help") == 0
    assert "Length of fixed steps [s]." in capsys.readouterr().out


def test_the_package_runs_as_a_module() -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-m", "flagrs", "run", "robt"]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (2, "error: robt: unknown scenario; did you mean 'robot'?\n")
