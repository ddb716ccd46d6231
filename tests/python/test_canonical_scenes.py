"""The files of canonical scenes, which Rust tests and benches read, are what the package makes of them."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "scenes"))

import make_scenes


def differences(found: Any, kept: Any, where: str = "") -> list[str]:
    """Return where two values of plain data differ, numbers by more than round-off on another machine."""
    if isinstance(found, dict) and isinstance(kept, dict) and found.keys() == kept.keys():
        return [line for key in found for line in differences(found[key], kept[key], f"{where}.{key}")]
    if isinstance(found, list) and isinstance(kept, list) and len(found) == len(kept):
        return [
            line
            for k, pair in enumerate(zip(found, kept, strict=True))
            for line in differences(*pair, f"{where}[{k}]")
        ]
    if isinstance(found, float) and isinstance(kept, float):
        return [] if found == pytest.approx(kept, rel=1e-9, abs=1e-15) else [f"{where}: {found}, not {kept}"]
    return [] if type(found) is type(kept) and found == kept else [f"{where}: {found!r}, not {kept!r}"]


@pytest.mark.parametrize("name", make_scenes.SCENES)
def test_the_file_of_a_canonical_scene_is_current(name: str) -> None:
    kept = json.loads(make_scenes.path_of(name).read_text())
    found = json.loads(json.dumps(make_scenes.content(name)))
    assert not differences(found, kept), "run `python tests/scenes/make_scenes.py`"


def test_there_is_no_file_of_a_scene_that_is_not_made() -> None:
    files = {path.stem for path in make_scenes.FOLDER.glob("*.json")}
    assert files == set(make_scenes.SCENES)
