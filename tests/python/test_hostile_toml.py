"""TOML files that are odd, damaged or hostile: a SceneError soon, and nothing else."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from flagrs import FileError, FlagrsError, Scene, SceneError, scenarios

ROD = "[[rods]]\nshape = 'straight'\nlength = 0.1\nradius = 1e-3\nedge_count = 10\n"
MATERIAL = "[rods.material]\nyoungs_modulus = 1e6\npoisson_ratio = 0.5\ndensity = 1e3\n"

HOSTILE = {
    "deep arrays": "name = " + "[" * 100_000,
    "deep closed arrays": "name = " + "[" * 500 + "]" * 500,
    "deep tables": "[" + ".".join("a" * 100_000) + "]",
    "many deep keys": "\n".join(f"a{k}." + ".".join("b" * 500) + " = 1" for k in range(2000)),
    "self": "self = 1",
    "self in a part": ROD + MATERIAL + "[fluid]\nself = 1\nviscosity = 1.0",
    "shape is a list": "[[rods]]\nshape = [1]",
    "shape is a table": "[[rods]]\nshape = {a = 1}",
    "NUL": 'name = "a\\u0000b"\n' + ROD + MATERIAL,
    "huge integer": ROD + MATERIAL + f"[fluid]\nviscosity = {2**64}",
    "digits": ROD + MATERIAL + f"[fluid]\nviscosity = {'9' * 10_000}",
    "date": ROD + MATERIAL + "[fluid]\nviscosity = 1979-05-27",
    "no such date": "a = 1979-15-77",
    "huge count": ROD.replace("10", str(10**12)) + MATERIAL,
    "huge count of 64 bits": ROD.replace("10", str(2**62)) + MATERIAL,
    "scenario is a number": "scenario = 1",
    "scenario is a list": "scenario = [1]",
    "parameters are a list": "scenario = 'robot'\nparameters = [1]",
    "parameters of the wrong kind": "scenario = 'robot'\n[parameters]\nrpm = '20'",
    "tiny edges": "scenario = 'robot'\n[parameters]\nedge_length = 1e-12",
    "tables instead of numbers": "scenario = 'robot'\n[parameters]\nedge_length = {a = 1}",
    "rods is a number": "rods = 1",
    "rods are numbers": "rods = [1, 2]",
    "infinite": ROD.replace("0.1", "inf") + MATERIAL,
    "not UTF-8": "name = '\udcff'",
    "no TOML": "{]",
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE.keys())
def test_a_hostile_file_is_a_scene_error_within_two_seconds(tmp_path: Path, text: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    start = time.process_time()
    with pytest.raises(SceneError) as refused:
        Scene.from_toml(path)
    assert time.process_time() - start < 2.0 and len(str(refused.value)) < 5000


def test_a_file_too_large_to_be_a_scene_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    with path.open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(SceneError, match="must be at most"):
        Scene.from_toml(path)


@pytest.mark.parametrize("path", ["/dev/zero", "/", "missing.toml", "a\0b.toml"])
def test_what_is_no_file_is_an_error_with_the_path(path: str) -> None:
    with pytest.raises(FileError):
        Scene.from_toml(path)


def test_a_scene_that_cannot_be_written_is_an_error_with_the_path(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="nowhere"):
        scenarios.robot().to_toml(tmp_path / "nowhere" / "scene.toml")


@pytest.mark.parametrize("trials", [150, pytest.param(10_000, marks=pytest.mark.slow)])
def test_changed_files_are_read_or_refused_in_words(tmp_path: Path, trials: int) -> None:
    path = tmp_path / "scene.toml"
    scenarios.cantilever().to_toml(path)
    whole, rng = path.read_bytes(), np.random.default_rng(7)
    refused = 0
    for _ in range(trials):
        text = bytearray(whole)
        for place in rng.integers(0, len(text), rng.integers(1, 6)).tolist():
            text[place] = int(rng.choice(list(b"[]{}\"'=.,\n0123456789eE-ainf\x00\xff")))
        cut = int(rng.integers(1, len(text))) if rng.random() < 0.2 else len(text)
        path.write_bytes(bytes(text[:cut]))
        try:
            Scene.from_toml(path)
        except FlagrsError:
            refused += 1
    assert refused > trials // 3
