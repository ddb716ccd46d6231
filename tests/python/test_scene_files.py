"""Files of scenes: they keep every bit, name shapes and scenarios, and say what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import flagrs
import numpy as np
import pytest
from flagrs import (
    Motor,
    Rod,
    Scene,
)
from scene_parts import SOFT, error_of, full_scene, rod


def test_a_scene_survives_toml_and_json_to_the_last_bit(tmp_path: Path) -> None:
    scene = full_scene()
    scene.to_toml(tmp_path / "scene.toml")
    for copy in (Scene.from_toml(tmp_path / "scene.toml"), Scene.from_json(scene.to_json())):
        assert copy == scene and hash(copy) == hash(scene) and copy.digest() == scene.digest()


def test_scenes_that_differ_in_one_bit_are_different() -> None:
    scene = full_scene()
    other = scene.replace(gravity=(0.0, 0.0, -np.nextafter(9.81, 10.0)))
    assert other != scene and other.digest() != scene.digest()


def test_a_function_of_time_cannot_be_written(tmp_path: Path) -> None:
    scene = Scene(rods=[rod()], motors=[Motor(node=1, shaft=0, speed=lambda time: time)])
    for write in (scene.to_json, lambda: scene.to_toml(tmp_path / "scene.toml"), scene.digest):
        error = error_of(write)
        assert error.field == "motors[0].speed" and "flagrs.Table" in str(error)


def toml_scene(tmp_path: Path, text: str) -> Scene:
    path = tmp_path / "scene.toml"
    path.write_text(text)
    return Scene.from_toml(path)


MATERIAL = "material = { youngs_modulus = 1e6, density = 1200 }\n"
HELIX = """
[[rods]]
shape = 'helix'
helix_radius = 0.01
pitch = 0.05
axial_length = 0.1
edge_length = 5e-3
radius = 1e-3
"""


def test_a_toml_rod_may_name_a_shape(tmp_path: Path) -> None:
    scene = toml_scene(tmp_path, HELIX + MATERIAL)
    expected = Rod.helix(
        helix_radius=0.01, pitch=0.05, axial_length=0.1, edge_length=5e-3, radius=1e-3, material=SOFT
    )
    assert scene.rods == (expected,)


def test_a_toml_file_may_name_a_scenario_with_parameters(tmp_path: Path) -> None:
    scene = toml_scene(tmp_path, "scenario = 'robot'\n[parameters]\nrpm = 30.0\nfluid = { model = 'RFT' }\n")
    assert scene == flagrs.scenarios.robot(rpm=30.0, fluid={"model": "RFT"})


@pytest.mark.parametrize(
    ("text", "field"),
    [
        (HELIX.replace("pitch = 0.05", "pitch = -1") + MATERIAL, "rods[0].pitch"),
        (HELIX.replace("helix'", "spiral'") + MATERIAL, "rods[0].shape"),
        (HELIX.replace("pitch = 0.05\n", "") + MATERIAL, "rods[0]"),
        (HELIX + MATERIAL.replace("1e6", "-1"), "rods[0].material.youngs_modulus"),
        (HELIX + "radus = 1\n" + MATERIAL, "rods[0].radus"),
        (HELIX + MATERIAL + "[fluids]\nviscosity = 1.0\n", "fluids"),
        (HELIX + MATERIAL + "[fluid]\nviscosity = '1 Pa s'\n", "fluid.viscosity"),
        ("scenario = 'robott'\n", "scenario"),
        ("scenario = 'robot'\n[parameters]\nrmp = 30.0\n", "rmp"),
        ("scenario = 'robot'\nrpm = 30.0\n", "rpm"),
    ],
)
def test_an_error_in_a_toml_file_names_the_field(tmp_path: Path, text: str, field: str) -> None:
    assert error_of(lambda: toml_scene(tmp_path, text)).field == field


def test_a_file_that_is_not_toml_is_named(tmp_path: Path) -> None:
    assert "scene.toml: not a TOML file" in str(error_of(lambda: toml_scene(tmp_path, "rods = [")))
