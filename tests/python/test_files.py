"""Result files: one writer at a time, nothing replaced unasked, clear errors where disk or file fail."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import threading
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from fake_simulation import rigid_frame
from flagrs import FileError, FlagrsError, Simulation, scenarios, trajectory_checks
from flagrs.recorder import Recorder, load_checkpoint
from flagrs.safe_stream import SafeStream
from flagrs.trajectory import Trajectory

HERE = Path(__file__).parent
ROBOT = scenarios.robot(edge_length=9e-3)


def recorded(path: Path, frames: int = 30, close: bool = True) -> Recorder:
    recorder = Recorder(path, ROBOT, {"scheme": "overdamped"})
    for number in range(frames):
        recorder.append(rigid_frame(ROBOT, float(number)))
        if number % 10 == 9:
            recorder.checkpoint({"number": np.array(number)})
    recorder.flush()
    if close:
        recorder.close()
    return recorder


def in_a_process(code: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Return how a program of its own ended, that knows the tests' modules."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(HERE), *filter(None, sys.path)])}
    command = [sys.executable, "-c", textwrap.dedent(code), *map(str, arguments)]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=120)


# --- writing ------------------------------------------------------------------------------------------------


def test_nothing_is_overwritten_unasked(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    simulation = Simulation(ROBOT, threads=1)
    first = simulation.run(0.02, 0.01, path=path)
    before = path.read_bytes()
    for write in (
        lambda: simulation.run(0.04, 0.01, path=path),
        lambda: simulation.checkpoint(path),
        lambda: first.save(path),
    ):
        with pytest.raises(FileExistsError, match=r"run\.h5: is there already.*overwrite=True") as refused:
            write()
        assert isinstance(refused.value, FileError) and isinstance(refused.value, FlagrsError)
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["run.h5"]
    simulation.checkpoint(path, overwrite=True)
    assert len(Trajectory.load(path)) == 1
    first.save(path, overwrite=True)
    assert len(Trajectory.load(path)) == len(first)


def test_a_file_that_is_written_is_refused_to_others_whatever_they_ask(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    recorder = recorded(path, close=False)
    trajectory = Trajectory.load(path)  # reading leaves the lock alone
    for attempt in (
        lambda: Recorder(path, ROBOT, {}, overwrite=True),
        lambda: Recorder.resume(path),
        lambda: trajectory.save(path, overwrite=True),
    ):
        with pytest.raises(FileError, match=r"run\.h5: is being written by another run"):
            attempt()
    elsewhere = in_a_process(
        """
        import sys
        from flagrs import FileError
        from flagrs.recorder import Recorder
        try:
            Recorder.resume(sys.argv[1])
        except FileError as error:
            print(error.problem)
        """,
        path,
    )
    assert "being written by another run" in elsewhere.stdout, elsewhere.stderr
    recorder.append(rigid_frame(ROBOT, 100.0))
    recorder.close()
    assert Trajectory.load(path).time[-1] == 100.0
    with Recorder.resume(path) as again:
        assert again.frame_count == 30
    assert os.listdir(tmp_path) == ["run.h5"]


def test_of_writers_that_start_together_one_gets_the_file(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    gate, outcomes = threading.Barrier(8), []

    def write(number: int) -> None:
        gate.wait()
        try:
            recorder = Recorder(path, ROBOT, {"number": number})
        except FileError:
            outcomes.append(None)
            return
        recorder.append(rigid_frame(ROBOT, float(number)))
        recorder.close()
        outcomes.append(number)

    writers = [threading.Thread(target=write, args=(number,)) for number in range(8)]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    (winner,) = [number for number in outcomes if number is not None]
    assert Trajectory.load(path).time.tolist() == [winner] and os.listdir(tmp_path) == ["run.h5"]


def _link(path: Path) -> None:
    path.with_name("target").write_text("precious")
    path.symlink_to("target")


def _dangling(path: Path) -> None:
    path.symlink_to("nowhere")


@pytest.mark.parametrize(
    "make", [Path.mkdir, _link, _dangling, os.mkfifo], ids=["folder", "link", "dangling", "fifo"]
)
def test_links_folders_and_pipes_are_never_replaced(tmp_path: Path, make: Callable[[Path], Any]) -> None:
    path = tmp_path / "run.h5"
    make(path)
    before = {name: os.lstat(tmp_path / name).st_ino for name in os.listdir(tmp_path)}
    for overwrite in (False, True):
        with pytest.raises(FileError, match=r"run\.h5: is a"):
            Recorder(path, ROBOT, {}, overwrite)
    with pytest.raises(FileError, match=r"run\.h5"):
        Recorder.resume(path)
    assert {name: os.lstat(tmp_path / name).st_ino for name in os.listdir(tmp_path)} == before


@pytest.mark.parametrize("path", ["/dev/full", "/dev/null", "/proc/self/mem"])
def test_devices_are_never_replaced(path: str) -> None:
    before = os.lstat(path)
    with pytest.raises(FileError, match=path):
        Recorder(path, ROBOT, {}, overwrite=True)
    assert os.lstat(path).st_mode == before.st_mode


@pytest.mark.parametrize(
    "name", ["a b.h5", "größe-長い.h5", "-run.h5", "run", ".h5", "a'\"$;.h5", "new\nline.h5", "x" * 255]
)
def test_any_file_name_will_do(tmp_path: Path, name: str) -> None:
    recorded(tmp_path / name)
    assert len(Trajectory.load(tmp_path / name)) == 30 and os.listdir(tmp_path) == [name]


@pytest.mark.parametrize("name", ["x" * 256, "missing/run.h5", "file/run.h5", "a\0b.h5", "\udcff\ud800.h5"])
def test_a_name_that_cannot_be_is_an_error_with_the_path(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError) as refused:
        Recorder(tmp_path / name, ROBOT, {})
    assert isinstance(refused.value, OSError) and str(tmp_path)[:20] in str(refused.value)
    str(refused.value).encode()
    with pytest.raises((FileError, FileNotFoundError)):
        Trajectory.load(tmp_path / name)
    assert os.listdir(tmp_path) == ["file"]


FULL = """
    import os, resource, sys
    import numpy as np
    from fake_simulation import rigid_frame
    from flagrs import FileError, scenarios
    from flagrs.recorder import Recorder
    path, limit, scene = sys.argv[1], int(sys.argv[2]), scenarios.robot(edge_length=9e-3)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    try:
        with Recorder(path, scene, {}) as recorder:
            for number in range(10_000):
                recorder.append(rigid_frame(scene, float(number)))
                if number % 20 == 19:
                    recorder.checkpoint({"number": np.array(number)})
    except FileError as error:
        print(error.errno, error.filename == path)
    """


@pytest.mark.parametrize("limit", [0, 100, 10_000, 120_000, 900_000, 3_000_000])
def test_a_full_disk_is_an_error_that_keeps_what_was_saved(tmp_path: Path, limit: int) -> None:
    path = tmp_path / "run.h5"
    ended = in_a_process(FULL, path, limit)
    assert ended.returncode == 0 and ended.stdout == "27 True\n" and ended.stderr == "", ended
    assert os.listdir(tmp_path) == (["run.h5"] if limit > 100_000 else [])
    if path.exists():
        assert not Trajectory.load(path).finished
    if limit > 800_000:
        count = len(Trajectory.load(path))
        assert count % 20 == 0 and int(load_checkpoint(path).state["number"]) == count - 1 > 0
        with Recorder.resume(path) as recorder:
            recorder.append(rigid_frame(ROBOT, 1e4))


def test_a_stream_hides_a_failed_write_from_hdf5(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "image"
    path.touch()
    stream = SafeStream(path)
    stream.write(b"0123456789")

    def full(*_: Any) -> int:
        raise OSError(28, "full")

    monkeypatch.setattr(os, "pwrite", full)
    stream.seek(8)
    assert stream.write(b"abcd") == 4 and stream.error is not None and stream.error.errno == 28
    stream.seek(0)
    assert stream.read(12) == b"01234567abcd" and stream.seek(0, os.SEEK_END) == 12
    assert path.read_bytes() == b"0123456789"


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_a_folder_that_is_read_only_is_named(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(FileError, match="Permission denied"):
        Recorder(tmp_path / "run.h5", ROBOT, {})


# --- reading ------------------------------------------------------------------------------------------------


def test_every_cut_is_noticed(tmp_path: Path) -> None:
    recorded(tmp_path / "run.h5")
    whole = (tmp_path / "run.h5").read_bytes()
    for size in [*range(0, 100, 7), *range(100, len(whole) - 56, len(whole) // 25)]:
        (tmp_path / "cut.h5").write_bytes(whole[:size])
        with pytest.raises(FileError, match=r"cut\.h5"):
            Trajectory.load(tmp_path / "cut.h5")
    (tmp_path / "cut.h5").write_bytes(whole[:-1])  # only the digest is cut: all data are there
    assert len(Trajectory.load(tmp_path / "cut.h5")) == 30


def test_every_changed_byte_of_a_closed_file_is_noticed(tmp_path: Path) -> None:
    recorded(tmp_path / "run.h5")
    whole = (tmp_path / "run.h5").read_bytes()
    rng = np.random.default_rng(3)
    for place in rng.integers(0, len(whole) - 16, 200).tolist():
        (tmp_path / "bad.h5").write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        with pytest.raises(FileError, match=r"bad\.h5"):
            Trajectory.load(tmp_path / "bad.h5")


@pytest.mark.parametrize(
    "name", ["frames/nodes", "frames/energy", "sums", "manifest/scene", "manifest/settings"]
)
def test_changed_data_are_noticed_where_hdf5_itself_does_not(tmp_path: Path, name: str) -> None:
    path = tmp_path / "run.h5"
    recorded(path)
    with h5py.File(path, "r+") as file:
        if name.startswith("manifest"):
            text = file[name].asstr()[()]
            del file[name]
            file[name] = text.replace("over", "Over").replace("robot", "Robot")
        else:
            values = file[name][()]
            values.view(np.uint8).flat[100] ^= 1
            file[name][()] = values
    with pytest.raises(FileError, match="does not match"):
        Trajectory.load(path)


def test_checksums_notice_each_bit_and_each_exchange() -> None:
    rng = np.random.default_rng(4)
    frames = {"time": rng.random(5), "nodes": rng.random((5, 4, 3)), "theta": rng.random((5, 0))}
    sums = trajectory_checks.frame_sums(7, frames, {})
    for bit in range(64):
        changed = {**frames, "nodes": frames["nodes"].copy()}
        changed["nodes"].view(np.uint64)[2, 1, 1] ^= np.uint64(1) << np.uint64(bit)
        assert (trajectory_checks.frame_sums(7, changed, {}) != sums).tolist() == [False] * 2 + [True] + [
            False
        ] * 2
    swapped = {**frames, "nodes": frames["nodes"][:, [1, 0, 2, 3]]}
    assert (trajectory_checks.frame_sums(7, swapped, {}) != sums).all()
    assert (trajectory_checks.frame_sums(8, frames, {}) != sums).all()
    zeros = {"time": np.zeros(3), "nodes": np.zeros((3, 4, 3)), "theta": np.zeros((3, 0))}
    assert (trajectory_checks.frame_sums(0, zeros, {}) != 0).all()


def _external(file: h5py.File) -> None:
    shape = file["frames/nodes"].shape
    del file["frames/nodes"]
    file["frames"].create_dataset("nodes", shape=shape, dtype="f8", external=[("/etc/passwd", 0, 10**6)])


def _external_link(file: h5py.File) -> None:
    del file["frames/nodes"]
    file["frames/nodes"] = h5py.ExternalLink("/etc/hosts", "/x")


def _virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout(shape=file["frames/nodes"].shape, dtype="f8")
    del file["frames/nodes"]
    file["frames"].create_virtual_dataset("nodes", layout)


def _huge(file: h5py.File) -> None:
    shape = file["frames/nodes"].shape
    del file["frames/nodes"]
    file["frames"].create_dataset("nodes", shape=(10**9, *shape[1:]), dtype="f8", chunks=(1, *shape[1:]))


def _objects(file: h5py.File) -> None:
    del file["frames/theta"]
    file["frames"].create_dataset("theta", shape=(30,), dtype=h5py.string_dtype())


def _group(file: h5py.File) -> None:
    del file["count"]
    file.create_group("count")


def _missing(file: h5py.File) -> None:
    del file["frames/energy"]


def _bomb(file: h5py.File) -> None:
    shape = file["frames/nodes"].shape
    del file["frames/nodes"]
    file["frames"].create_dataset(
        "nodes", shape=shape, dtype="f8", chunks=(1, *shape[1:]), compression="gzip"
    )


def _loop(file: h5py.File) -> None:
    del file["frames"]
    file["frames"] = file["/"]


def _attributes(file: h5py.File) -> None:
    file.attrs["format_version"] = "two"


def _newer(file: h5py.File) -> None:
    file.attrs["format_version"] = 99


HOSTILE = [
    _external,
    _external_link,
    _virtual,
    _huge,
    _objects,
    _group,
    _missing,
    _bomb,
    _loop,
    _attributes,
    _newer,
]


@pytest.mark.parametrize("change", HOSTILE, ids=lambda change: change.__name__)
def test_hostile_files_are_refused_by_name(tmp_path: Path, change: Callable[[h5py.File], None]) -> None:
    path = tmp_path / "run.h5"
    recorded(path)
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(
        FileError, match=r"run\.h5: (damaged|refused|changed|not a flagrs|written by a newer)"
    ):
        Trajectory.load(path)


def test_a_file_of_the_first_version_is_still_read(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    recorded(path)
    with h5py.File(path, "r+") as file:
        file.attrs["format_version"] = 1
        for name in ("sums", "progress_sum", "manifest_sum"):
            del file[name]
        slots = file["checkpoint/slots"][()]
        for which, (_, length, _, _) in enumerate(slots.tolist()):
            slots[which, 2] = zlib.crc32(file[f"checkpoint/slot{which}"][:length].tobytes())
        file["checkpoint/slots"][()] = slots
    assert len(Trajectory.load(path)) == 30 and int(load_checkpoint(path).state["number"]) == 29


def test_a_look_that_does_not_end_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, endless = tmp_path / "run.h5", tmp_path / "endless.py"
    recorded(path, close=False)
    endless.write_text("while True: pass")
    monkeypatch.setattr(trajectory_checks, "__file__", str(endless))
    monkeypatch.setattr("flagrs.trajectory_file.LOOK_SECONDS", 0.5)
    with pytest.raises(FileError, match="does not come to an end"):
        Trajectory.load(path)
