"""Types: checkers let pass what works at run time, in the README too, and refuse what does not."""

from __future__ import annotations

import ast
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import flagrs
import pytest
from flagrs.scene.part import Part

ROOT = Path(__file__).parents[2]
PARTS = [getattr(flagrs, name) for name in flagrs.__all__]
PARTS = [part for part in PARTS if isinstance(part, type) and issubclass(part, Part)]


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the README's code, the calls of `typed_calls.py`, and wrong ones, as one program."""
    readme = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.S)
    calls = (ROOT / "tests/python/typed_calls.py").read_text(encoding="utf-8")
    folder = tmp_path_factory.mktemp("types")
    (folder / "readme.py").write_text("\n".join(readme), encoding="utf-8")
    (folder / "calls.py").write_text(calls, encoding="utf-8")
    wrong = 'import flagrs\n\nflagrs.Scene(rods="rod")\nflagrs.Clamp(nodes=0)\nflagrs.Simulation(scene=3)\n'
    (folder / "wrong.py").write_text(wrong, encoding="utf-8")
    return folder


def findings(command: list[str], folder: Path) -> list[str]:
    environment = {**os.environ, "MYPYPATH": str(ROOT / "python")}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=600, check=False
    )
    return [line.strip() for line in done.stdout.splitlines() if "error" in line and ".py:" in line]


@pytest.mark.slow
def test_mypy_in_strict_mode_lets_pass_what_works_and_nothing_else(program: Path) -> None:
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file=", "--no-error-summary"]
    found = findings([*command, "readme.py", "calls.py", "wrong.py"], program)
    assert [line.split(":")[:2] for line in found] == [
        ["wrong.py", "3"],
        ["wrong.py", "4"],
        ["wrong.py", "5"],
    ]


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("pyright") is None, reason="no pyright")
def test_pyright_lets_pass_what_works_and_nothing_else(program: Path) -> None:
    settings = f'{{"extraPaths": ["{ROOT / "python"}"], "pythonVersion": "3.11"}}'
    (program / "pyrightconfig.json").write_text(settings, encoding="utf-8")
    found = findings(
        [
            sys.executable,
            "-m",
            "pyright",
            "--pythonpath",
            sys.executable,
            "readme.py",
            "calls.py",
            "wrong.py",
        ],
        program,
    )
    places = [re.search(r"(\w+\.py):(\d+)", line).groups() for line in found]  # type: ignore[union-attr]
    assert places == [("wrong.py", "3"), ("wrong.py", "4"), ("wrong.py", "5")]


def test_the_calls_work() -> None:
    source = (ROOT / "tests/python/typed_calls.py").read_text(encoding="utf-8")
    before, _, _ = source.partition("trajectory = ")
    exec(compile(before, "typed_calls.py", "exec"), {})


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.__name__)
def test_declared_constructors_take_exactly_the_fields(part: type[Part]) -> None:
    tree = ast.parse(Path(sys.modules[part.__module__].__file__ or "").read_text(encoding="utf-8"))
    body = next(
        node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == part.__name__
    ).body
    declared = [
        inner
        for node in body
        if isinstance(node, ast.If)
        for inner in node.body
        if isinstance(inner, ast.FunctionDef) and inner.name == "__init__"
    ]
    if not declared:
        pytest.skip("its fields say it all")
    arguments = declared[0].args
    defaults = dict(zip([one.arg for one in arguments.kwonlyargs], arguments.kw_defaults))
    assert list(defaults) == list(part.model_fields)
    for name, field in part.model_fields.items():
        assert field.is_required() == (defaults[name] is None), name
