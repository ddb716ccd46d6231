"""Movies: that their files play, show what moved, and that what cannot be is refused before anything runs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fake_simulation import SPEED, FakeSimulation
from flagrs import FileError, FlagrsError, SceneError, cli, plot, runs, scenarios
from flagrs.plot.movie import view_from
from flagrs.recorder import Recorder
from flagrs.trajectory import Trajectory
from PIL import Image

ffmpeg: Any = pytest.importorskip("imageio_ffmpeg")


def swimmer(pitch: float = 7.0, seconds: float = 20.0) -> Trajectory:
    return FakeSimulation(scenarios.robot(normalized_pitch=pitch)).run(seconds, 0.5)


def pictures(path: Path) -> tuple[dict[str, Any], list[Any]]:
    """Return what ffmpeg says of a file, and its pictures."""
    reader = ffmpeg.read_frames(str(path))
    meta = next(reader)
    width, height = meta["size"]
    return meta, [np.frombuffer(data, np.uint8).reshape(height, width, 3).astype(int) for data in reader]


@pytest.mark.parametrize("kind", ["mp4", "webm"])
def test_a_video_plays_as_long_as_asked_for_and_moves(kind: str, tmp_path: Path) -> None:
    path = plot.movie([swimmer(), swimmer(5.0)], tmp_path / f"two.{kind}", seconds=1.0, frames_per_second=10)
    meta, shown = pictures(path)
    assert len(shown) == 10 and meta["fps"] == pytest.approx(10.0)
    assert meta["codec"] == {"mp4": "h264", "webm": "vp9"}[kind]
    assert (np.abs(shown[0] - shown[-1]).max(axis=2) > 60).mean() > 0.01
    # Both runs are there: much of both halves is no background.
    for half in np.array_split(shown[0], 2):
        assert (half.min(axis=2) < 200).mean() > 0.02
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_a_gif_has_its_pictures(tmp_path: Path) -> None:
    with Image.open(plot.movie(swimmer(), tmp_path / "one.gif", seconds=0.5, frames_per_second=8)) as image:
        assert getattr(image, "n_frames", 1) == 4 and image.info["duration"] in (120, 125, 130)


def test_following_keeps_the_swimmer_in_its_place(tmp_path: Path) -> None:
    def head(picture: Any) -> float:
        grey = np.abs(picture - 228).max(axis=2) < 8
        return float(np.flatnonzero(grey.sum(axis=0) > 5)[0] / picture.shape[1])  # its front

    moved = {}
    for follow in (False, True):
        path = tmp_path / f"{follow}.mp4"
        plot.movie(swimmer(), path, seconds=0.4, frames_per_second=10, yaw=-90.0, pitch=0.0, follow=follow)
        _, shown = pictures(path)
        moved[follow] = head(shown[-1]) - head(shown[0])
    assert SPEED * 20.0 == 0.04, "it swims by a third of its own length"
    assert moved[False] < -0.1 and abs(moved[True]) < 0.01


@pytest.mark.parametrize("direction", [(0.0, 0.0), (-65.0, 22.0), (130.0, -90.0)])
def test_a_view_is_a_rotation_that_looks_from_where_it_says(direction: tuple[float, float]) -> None:
    rows = view_from(*direction)
    assert rows @ rows.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(rows) == pytest.approx(1.0) and rows[1, 2] >= -1e-12
    yaw, pitch = np.radians(direction)
    assert rows[2] == pytest.approx([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])


def test_what_cannot_be_a_movie_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"\.mp4, \.webm or \.gif"):
        plot.movie(swimmer(), tmp_path / "x.avi")
    with pytest.raises(FileError, match="no folder"):
        plot.movie(swimmer(), tmp_path / "none" / "x.gif")
    with pytest.raises(SceneError, match="labels: 2 for 1"):
        plot.movie(swimmer(), tmp_path / "x.gif", labels=["a", "b"])
    with pytest.raises(FlagrsError, match="no frames"):
        plot.movie(Recorder(None, scenarios.robot(), {}).trajectory(), tmp_path / "x.gif")
    with pytest.raises(SceneError, match="pitch"):
        plot.movie(swimmer(), tmp_path / "x.gif", pitch=100.0)
    with pytest.raises(FlagrsError, match="no run"):
        plot.movie([], tmp_path / "x.gif")
    assert not list(tmp_path.iterdir())


def test_the_movie_of_the_geometries_is_one_command(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = []

    def run(scene: Any, path: Path, settings: Any, **_: Any) -> Any:
        ran.append((round(scene.fluid.wavelength / 6.36e-3, 6), path.name, settings.until))
        return type("Run", (), {"trajectory": FakeSimulation(scene).run(1.0, 0.5)})

    monkeypatch.setattr(runs, "run_to_file", run)
    arguments = ["flagrs", "movie", "geometries", "-o", "m.gif", "--seconds", "0.2", "--until", "5"]
    monkeypatch.setattr(sys, "argv", arguments)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code and "m.gif" in capsys.readouterr().out and Path("m.gif").exists()
    assert ran == [(5.0, "pitch-5.h5", 5.0), (7.0, "pitch-7.h5", 5.0), (9.0, "pitch-9.h5", 5.0)]
