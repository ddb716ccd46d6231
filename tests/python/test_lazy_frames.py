"""Frames read as they are asked for: the same numbers of fewer bytes, and no trust in changed ones."""

from __future__ import annotations

import copy
import json
import os
import pickle
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from fake_simulation import FakeSimulation
from flagrs import FileError, Material, Rod, Scene, Trajectory, lazy_frames, scenarios
from flagrs.frame import shapes_of
from flagrs.lazy_frames import LazyField
from flagrs.recorder import Recorder
from flagrs.scene import codec
from flagrs.trajectory_checks import frame_sums, manifest_sum, progress_sum
from flagrs.trajectory_file import Contents, laid_out


@pytest.fixture
def file(tmp_path: Path) -> Path:
    FakeSimulation(scenarios.robot()).run(5.0, 0.1, path=tmp_path / "run.h5")
    return tmp_path / "run.h5"


def bytes_read() -> int:
    """Return how many bytes this process has read through the system, from disk or cache."""
    for line in Path("/proc/self/io").read_text(encoding="ascii").splitlines():
        if line.startswith("rchar:"):
            return int(line.split()[1])
    raise AssertionError


@pytest.mark.parametrize(
    "key",
    [
        0,
        -1,
        slice(None),
        slice(3, 20, 4),
        slice(20, 3, -2),
        slice(5, 5),
        [4, 2, 2, 50],
        np.arange(51) % 3 == 0,
        (slice(None), 7),
        (3, 7, 1),
        (slice(2, 9), [1, 5], 0),
        (slice(None), slice(2, 5), slice(None, None, 2)),
        ([1, 2, 3], [4, 5, 6]),
        (Ellipsis, 1),
        (slice(None), [[1, 2], [3, 4]]),
    ],
    ids=str,
)
def test_indexing_is_that_of_an_array(file: Path, key: Any) -> None:
    whole, lazy = Trajectory.load(file), Trajectory.load(file, lazy=True)
    assert isinstance(lazy.nodes, LazyField)
    found, expected = lazy.nodes[key], whole.nodes[key]
    assert np.array_equal(found, expected) and np.shape(found) == expected.shape


@pytest.mark.parametrize("block", [1, 7, 10_000])
def test_blocks_of_any_size_give_the_same(file: Path, block: int) -> None:
    whole, lazy = Trajectory.load(file), Trajectory.load(file, lazy=True)
    lazy.nodes._store.block = block  # type: ignore[attr-defined]
    assert np.array_equal(np.asarray(lazy.nodes), whole.nodes)
    assert np.array_equal(lazy.nodes[[40, 2, 3, 4, 50]], whole.nodes[[40, 2, 3, 4, 50]])
    assert all(np.array_equal(a, b) for a, b in zip(lazy.velocities, whole.velocities))


def test_arithmetic_and_everything_that_is_read_off_are_the_same(file: Path) -> None:
    whole, lazy = Trajectory.load(file), Trajectory.load(file, lazy=True)
    assert np.array_equal(lazy.nodes.mean(axis=1), whole.nodes.mean(axis=1))
    assert np.array_equal(2.0 * lazy.nodes - lazy.nodes, whole.nodes)
    assert np.array_equal(np.linalg.norm(lazy.velocities, axis=2), np.linalg.norm(whole.velocities, axis=2))
    assert lazy.swimming_speed() == whole.swimming_speed() and lazy.head_rate() == whole.head_rate()
    assert str(lazy.readouts()) == str(whole.readouts())
    assert np.array_equal(lazy.force_density[3].edges, whole.force_density[3].edges)  # type: ignore[attr-defined]
    assert np.array_equal(lazy.contacts, whole.contacts) and np.array_equal(lazy.thrust(), whole.thrust())
    assert lazy.view().page == whole.view().page
    assert str(lazy) == str(whole) and lazy.scene == whole.scene and lazy.has_checkpoint
    with pytest.raises(AttributeError):
        lazy.nodes.pretty  # noqa: B018


def test_frames_travel_and_are_saved_as_arrays(file: Path, tmp_path: Path) -> None:
    lazy = Trajectory.load(file, lazy=True)
    assert isinstance(pickle.loads(pickle.dumps(lazy.nodes)), np.ndarray)
    assert np.array_equal(copy.deepcopy(lazy.nodes), lazy.nodes[:])
    lazy.save(tmp_path / "copy.h5")
    assert np.array_equal(Trajectory.load(tmp_path / "copy.h5").nodes, lazy.nodes[:])


def test_a_run_that_goes_on_is_read_up_to_where_it_was(tmp_path: Path) -> None:
    scene = scenarios.straight_rod()
    with Recorder(tmp_path / "run.h5", scene, {"scheme": "x"}) as recorder:
        frames = FakeSimulation(scene).run(2.0, 0.1)
        for k in range(5):
            recorder.append({name: frames._contents.frames[name][k] for name in shapes_of(scene)})
        recorder.flush()
        lazy = Trajectory.load(tmp_path / "run.h5", lazy=True)
        recorder.append({name: frames._contents.frames[name][5] for name in shapes_of(scene)})
        recorder.flush()
        assert len(lazy) == 5 and np.array_equal(lazy.nodes[:], frames.nodes[:5])
    assert not lazy.finished


def damaged_at(file: Path, frame: int) -> None:
    """Change a byte of the nodes of one frame behind HDF5's back."""
    with h5py.File(file, "r") as opened:
        data = opened["frames/nodes"]
        rows = data.chunks[0]
        chunk = data.id.get_chunk_info_by_coord((rows * (frame // rows), 0, 0))
        place = chunk.byte_offset + (frame % rows) * 8 * int(np.prod(data.shape[1:]))
    with file.open("r+b") as raw:
        raw.seek(place + 16)
        old = raw.read(1)
        raw.seek(place + 16)
        raw.write(bytes([old[0] ^ 1]))


def test_a_changed_frame_is_refused_when_it_is_read_and_others_are_not(file: Path) -> None:
    damaged_at(file, 30)
    lazy = Trajectory.load(file, lazy=True)
    whole = FakeSimulation(scenarios.robot()).run(5.0, 0.1)
    assert np.array_equal(lazy.nodes[10], whole.nodes[10])
    for _ in range(2):
        with pytest.raises(FileError, match="frame 30 does not match its checksum"):
            lazy.velocities[30]
    with pytest.raises(FileError, match="frame 30"):
        lazy.nodes.mean(axis=1)


def test_a_cut_file_and_one_that_is_none_are_refused(file: Path, tmp_path: Path) -> None:
    os.truncate(file, file.stat().st_size // 2)
    with pytest.raises(FileError):
        Trajectory.load(file, lazy=True)
    (tmp_path / "text.h5").write_text("hello " * 100)
    with pytest.raises(FileError, match=r"not an HDF5 file|damaged"):
        Trajectory.load(tmp_path / "text.h5", lazy=True)
    with pytest.raises(FileNotFoundError):
        Trajectory.load(tmp_path / "none.h5", lazy=True)


def large_file(folder: Path, count: int) -> Path:
    """Write a file of many frames that are zero but for their times, with room on no disk for them."""
    nodes = np.linspace([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 3001)
    material = Material(youngs_modulus=1e6, density=1000.0)
    scene = Scene(rods=Rod(nodes=nodes, radius=1e-3, material=material), name="large")
    manifest = {
        "version": "0",
        "created": "now",
        "scene": codec.to_json(scene),
        "settings": json.dumps({"scheme": "overdamped", "dt": None, "rtol": None, "threads": None}),
    }
    shapes = shapes_of(scene)
    none = {name: np.zeros((0, *shape)) for name, shape in shapes.items()}
    path = folder / "large.h5"
    laid_out(path, Contents(manifest, none)).replace(path)
    times = np.arange(count, dtype=np.float64)
    # Zeros have a checksum of the number of the frame and its time alone.
    bare = {name: np.zeros((count, 0)) for name in shapes} | {"time": times}
    with h5py.File(path, "r+", libver="latest") as file:
        for name in shapes:
            file[f"frames/{name}"].resize(count, axis=0)
        file["frames/time"][:] = times
        file["sums"].resize(count, axis=0)
        file["sums"][:] = frame_sums(0, bare, {})
        file["count"][()] = count
        file["progress_sum"][()] = progress_sum(count, float(file["wall_seconds"][()]), False)
        assert file["manifest_sum"].asstr()[()] == manifest_sum(
            manifest, {"frames": list(none), "signals": []}
        )
    os.truncate(path, 8 * count * sum(int(np.prod(shape)) for shape in shapes.values()) + (1 << 28))
    return path


def test_a_file_of_ten_gigabytes_opens_at_once_and_reads_what_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = large_file(tmp_path, 45_000)
    assert path.stat().st_size > 10e9
    before, begin = bytes_read(), time.perf_counter()
    trajectory = Trajectory.load(path)
    took, used = time.perf_counter() - begin, bytes_read() - before
    assert len(trajectory) == 45_000 and trajectory.nodes.shape == (45_000, 3001, 3)
    # A ten-thousandth of the frames' bytes; the times are in chunks of their own.
    assert used < 20e6, f"{used / 1e6:.1f} MB"
    assert took < 20.0, "some seconds on a busy machine"
    assert trajectory.nodes[20_000].shape == (3001, 3)
    assert trajectory.nodes[::4500, 5].tolist() == [[0.0, 0.0, 0.0]] * 10
    asked = []
    monkeypatch.setattr(lazy_frames, "require_memory", lambda *what: asked.append(what[1]))
    assert len(trajectory.velocities[:100]) == 100 and asked == [8 * 100 * 3001 * 3]
