"""Everyday: importing, what is public, files with every problem on its line, new scenes, notebooks."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import flagrs
import numpy as np
import pytest
from fake_simulation import FakeSimulation
from flagrs import Scene, SceneError, cli, scenarios
from flagrs.scene import codec
from flagrs.scene.schema import meanings_of, scene_schema
from flagrs.scene.toml_lines import line_of, lines_of
from scene_parts import full_scene


def fresh(program: str) -> str:
    """Return what a program prints in a process of its own."""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_importing_takes_little_and_imports_little() -> None:
    program = """
import os, sys
import flagrs
seconds = os.times().user + os.times().system
large = ("numpy", "scipy", "pydantic", "h5py", "matplotlib", "typer")
heavy = [name for name in large if name in sys.modules]
print(seconds, heavy)
"""
    seconds, _, heavy = fresh(program).partition(" ")
    assert heavy == "[]"
    assert float(seconds) < 0.3, "processor time, with Python's own start"


def test_figures_and_views_do_without_matplotlib_until_one_is_drawn() -> None:
    program = "import sys, flagrs; flagrs.plot.shape; import flagrs.view; print('matplotlib' in sys.modules)"
    assert fresh(program) == "False"


def test_dir_shows_what_is_public_and_every_name_is_there() -> None:
    assert dir(flagrs) == sorted(flagrs.__all__)
    for name in flagrs.__all__:
        assert getattr(flagrs, name) is not None
    assert flagrs.plot.shape and callable(flagrs.suggest)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        flagrs.nothing  # noqa: B018


def test_star_and_repeated_imports_work() -> None:
    assert fresh("from flagrs import *; import flagrs.suggestion; print(suggest is flagrs.suggest)") == "True"


WRONG = """name = "test"
gravty = [0, 0, -9.81]   # '[' and "[[" in a comment

[[rods]]
shape = "helix"
helix_radius = 6e-3
pitch = 30e-3
axial_length = 90e-3
edge_length = 3e-3
radius = -1e-3
colour = "red [["
[rods.material]
youngs_modulus = 1e6
density = "heavy"

[[rods]]
nodes = [
  [0, 0, 0],
  [0.01, 0, 0],
]
radius = 1e-3
[rods.material]
youngs_modulus = 1.2e6

[fluid]
viscosity = 1.0
modle = "RSS"

[[clamps]]
nodes = [0, "a"]
"""


def test_all_problems_of_a_file_are_told_at_once_with_their_lines(tmp_path: Path) -> None:
    (tmp_path / "wrong.toml").write_text(WRONG)
    with pytest.raises(SceneError) as caught:
        Scene.from_toml(tmp_path / "wrong.toml")
    expected = [
        (2, "gravty"),
        (10, "rods[0].radius"),
        (11, "rods[0].colour"),
        (14, "rods[0].material.density"),
        (22, "rods[1].material.density"),
        (27, "fluid.modle"),
        (30, "clamps[0].nodes"),
    ]
    found = caught.value.errors
    assert [(int(str(part).split()[1].rstrip(":")), part.field) for part in found] == expected
    assert str(caught.value).startswith(f"{tmp_path / 'wrong.toml'}: 7 problems:\n  line 2: gravty")


@pytest.mark.parametrize(
    ("text", "field", "line"),
    [
        ("scenario = 'robot'\n\n[parameters]\nrpm = 20\nrmp = 3\n", "rmp", 5),
        ("scenario = 'robt'\n", "scenario", 1),
        ("scenario = 'robot'\nparameters = { rmp = 3 }\n", "rmp", 2),
    ],
)
def test_problems_of_a_scenario_have_lines_too(tmp_path: Path, text: str, field: str, line: int) -> None:
    (tmp_path / "wrong.toml").write_text(text)
    with pytest.raises(SceneError, match=rf"wrong\.toml, line {line}: (robt|{field})") as caught:
        Scene.from_toml(tmp_path / "wrong.toml")
    assert caught.value.field == field


def test_what_the_command_line_changes_is_not_blamed_on_the_file(tmp_path: Path) -> None:
    scenarios.cantilever().to_toml(tmp_path / "scene.toml")
    with pytest.raises(SceneError) as caught:
        cli.scene_from(str(tmp_path / "scene.toml"), ["fluid.viscosity=-1"])
    assert (
        "scene.toml: fluid.viscosity: -1.0 is not" in str(caught.value)
        and caught.value.field == "fluid.viscosity"
    )


def test_lines_are_found_behind_everything_toml_can_say() -> None:
    text = '''a = """
[not.a.table]
b = 1
"""
"quoted key" = 1
c.d = [ # [
  "]", ']', # ]
  { x = 1 },
]
[t.u]
e = 'x # y'
[[l]]
[[l.m]]
f = 1
[[l]]
[l.n]
g = { h = [1] }
'''
    expected = {"a": 1, "quoted key": 5, "c": 6, "c.d": 6, "t.u": 10, "t.u.e": 11, "l[0]": 12}
    expected |= {"l[0].m[0]": 13, "l[0].m[0].f": 14, "l[1]": 15, "l[1].n": 16, "l[1].n.g": 17}
    assert lines_of(text) == expected
    assert line_of(lines_of(text), "l[1].n.g.h[0]") == 17 and line_of(lines_of(text), "zz") is None


def validator() -> Any:
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(json.dumps(scene_schema()))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("name", list(scenarios.list()))
def test_every_scene_fits_the_schema(name: str) -> None:
    assert validator().is_valid(codec.plain(scenarios.build(name)))


def test_the_schema_knows_every_part_and_refuses_what_files_may_not_say() -> None:
    check, plain = validator(), codec.plain(full_scene())
    assert check.is_valid(plain)
    assert check.is_valid({"scenario": "robot", "parameters": {"rpm": 20}})
    material = {"youngs_modulus": 1e6, "density": 1000}
    straight = {"shape": "straight", "length": 0.1, "edge_count": 5, "radius": 1e-3, "material": material}
    assert check.is_valid({"rods": [straight]})
    for wrong in (
        {**plain, "gravty": [0, 0, 1]},
        {**plain, "fluid": {"viscosity": "1"}},
        {**plain, "fluid": {"viscosity": 1.0, "model": "SSR"}},
        {"rods": [{**straight, "shape": "helix"}]},
        {"rods": [{**straight, "colour": "red"}]},
        {"scenario": "robot", "rpm": 20},
        {},
    ):
        assert not check.is_valid(wrong), wrong


def test_the_schema_says_what_fields_mean() -> None:
    fluid = scene_schema()["$defs"]["Fluid"]["properties"]
    assert fluid["viscosity"]["description"] == "Dynamic viscosity [Pa s], above 0 and up to 1e4."
    assert meanings_of(scenarios.robot, "Parameters")["C_r"].startswith("Prefactors of the head's drag")


def command(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["flagrs", *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    return int(ended.value.code or 0)


def test_a_new_scene_runs_as_it_is_and_fits_the_schema(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert command(monkeypatch, "new", "mine.toml") == 0
    scene = Scene.from_toml("mine.toml")
    assert scene.name == "flagellum" and not scene.plan().warnings
    tip = flagrs.Simulation(scene).run(0.2, 0.1, path=False).nodes[:, -1]
    assert np.linalg.norm(tip[-1] - tip[0]) > 1e-4
    assert command(monkeypatch, "new", "mine.toml") == 1, "it is there already"
    assert command(monkeypatch, "new", "mine.txt") == 2
    assert command(monkeypatch, "schema") == 0
    assert '"$schema"' in capsys.readouterr().out


@pytest.mark.parametrize("name", list(scenarios.list()))
def test_a_new_scene_from_a_scenario_is_that_scenario(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert command(monkeypatch, "new", "mine.toml", "--scenario", name) == 0
    assert Scene.from_toml("mine.toml") == scenarios.build(name)
    text = Path("mine.toml").read_text(encoding="utf-8")
    assert all(f"{key} =" in text for key in scenarios.parameters(name))


@pytest.mark.parametrize("name", list(scenarios.list()))
def test_notebooks_show_scenes_plans_and_runs(name: str) -> None:
    scene = scenarios.build(name)
    drawn = scene._repr_html_()
    assert drawn.count("<svg") == 2 and "polyline" in drawn and "nan" not in drawn
    assert "degrees of freedom" in scene.plan()._repr_html_()
    shown = FakeSimulation(scene).run(2.0, 0.1)._repr_html_()
    assert "21, 0 s to 2 s" in shown and "none:" not in shown


def test_names_cannot_write_html() -> None:
    scene = scenarios.straight_rod().replace(name="<script>")
    assert "<script>" not in scene._repr_html_() + FakeSimulation(scene).run(1.0, 0.5)._repr_html_()
