"""Trajectories in HDF5 files that stay readable whenever the writing process dies.

The structure is laid out in a temporary file that then takes the final name, and from there on frames are
added (`trajectory_writer`) in HDF5's single-writer-multiple-reader (SWMR) mode, in which the file is
consistent at every instant. SWMR forbids new objects, so everything that may come later has its place from
the start: a count of the frames that are complete, written after them, and two slots for checkpoints, used
in turn, so that one is always whole. Frames, manifest, count and checkpoints have checksums of their own,
and a file that was closed ends in a digest of all its bytes (`trajectory_checks`).
"""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from flagrs import trajectory_checks
from flagrs.errors import FileError, FileMissingError, FlagrsError, file_error
from flagrs.files import Lock, check_output, publish, temporary_beside
from flagrs.frame import ADDED, FIELDS
from flagrs.lazy_frames import FrameStore, LazyField
from flagrs.safe_stream import SafeStream
from flagrs.scene.values import FloatArray
from flagrs.trajectory_checks import FORMAT, FORMAT_VERSION, Damaged

#: Size of a chunk of positions, within the range h5py advises for chunks [bytes].
CHUNK_BYTES = 64 * 1024

#: Longest look at a file that nothing vouches for [s], besides 1 s for every 10 MB: it is limited by its own
#: processor time, this is for a machine that has none to give.
LOOK_SECONDS = 20.0

#: Size of files from which on frames are read as they are asked for [bytes].
LAZY_BYTES = 256 << 20

State = dict[str, npt.NDArray[Any]]


@dataclass
class Contents:
    """Everything a trajectory file holds.

    Attributes
    ----------
    manifest : dict
        Texts by name: ``version``, ``scene``, ``settings``, ``created``.
    frames : dict
        Field arrays (T, ...) by name, complete frames only.
    signals : dict
        Samples (T,) of signals that were Python functions, by path.
    state : dict or None
        The latest checkpoint.
    state_frames : int
        Number of frames recorded when the checkpoint was made.
    finished : bool
        Whether the run reached its end.
    wall_seconds : float
        Wall time of the run, resumed parts included [s].
    """

    manifest: dict[str, str]
    frames: dict[str, FloatArray]
    signals: dict[str, FloatArray] = field(default_factory=dict)
    state: State | None = None
    state_frames: int = 0
    finished: bool = False
    wall_seconds: float = 0.0


def write_whole(path: Path, contents: Contents, overwrite: bool = False) -> None:
    """Write a trajectory at once; the file takes its name when it is whole.

    Raises
    ------
    FileError
        If the file is there already and is not to be overwritten, belongs to a run at work, or cannot be
        written.
    """
    lock = Lock(path) if check_output(path, overwrite) else None
    try:
        temporary = laid_out(path, contents)
        try:
            with temporary.open("r+b", buffering=0) as file:
                seal(path, file.fileno())
            publish(temporary, path, replace=lock is not None)
        finally:
            temporary.unlink(missing_ok=True)
    finally:
        if lock is not None:
            lock.release()


def laid_out(path: Path, contents: Contents) -> Path:
    """Return a temporary file beside a path, with every object the file will ever have and what there is.

    Raises
    ------
    FileError
        If it cannot be written; nothing is left of it then.
    """
    temporary = temporary_beside(path)
    try:
        stream = SafeStream(temporary)
        try:
            with h5py.File(stream, "w", libver="latest") as file:
                _lay_out(file, contents)
        finally:
            stream.close()
        if stream.error is not None:
            raise file_error(path, stream.error, "cannot be written") from None
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return temporary


def seal(path: Path, descriptor: int) -> None:
    """End a closed file in a digest of its bytes.

    Raises
    ------
    FileError
        If there is no room for it; the file is as good without.
    """
    size = trajectory_checks.end_of_data(os.pread(descriptor, 48, 0))
    try:
        os.ftruncate(descriptor, size)
        with os.fdopen(os.dup(descriptor), "rb") as file:
            end = trajectory_checks.seal_of(file, size)
        if os.pwrite(descriptor, end, size) < len(end):
            os.ftruncate(descriptor, size)
    except OSError as error:
        os.ftruncate(descriptor, size)
        raise file_error(path, error, "cannot be written") from None


def read(path: Path) -> Contents:
    """Return what a file holds, whether its run ended, was killed, or still goes on.

    Every byte that is used has been checked. A file that was closed is compared with its digest; any other is
    looked at by a process of its own first, as HDF5 may hang or crash on what is damaged.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    FileError
        If it cannot be read, is damaged, or not a trajectory of flagrs; an `OSError` and a `FlagrsError`.
    """
    try:
        if not path.exists():
            raise FileMissingError(path, "no such file", 2)
        if not path.is_file():
            raise FileError(path, "not a file")
        if not trajectory_checks.is_sealed(os.fspath(path)):
            _look_at(path)
        raw = trajectory_checks.load(os.fspath(path))
        state = _arrays(raw.pop("state"))
    except Damaged as error:
        raise FileError(path, str(error)) from None
    except (FileError, FlagrsError):
        raise
    except (OSError, ValueError) as error:
        raise file_error(path, error, "cannot be read") from None
    _add_fields(raw)
    if raw["frames"].keys() != FIELDS.keys():
        odd = ", ".join(sorted(raw["frames"].keys() ^ FIELDS.keys()))[:200]
        raise FileError(path, f"damaged: missing or unknown fields: {odd}")
    return Contents(state=state, **raw)


def _add_fields(raw: dict[str, Any]) -> None:
    """Put what was not recorded yet when a file was written into its frames, as NaN."""
    frames, scene = raw["frames"], raw["manifest"]["scene"]
    absent = [name for name in ADDED if name not in frames]
    if absent and "time" in frames:
        try:
            clamps = len(json.loads(scene).get("clamps", ()))
        except (ValueError, AttributeError, TypeError):
            return
        for name in absent:
            width = [clamps if isinstance(size, str) else size for size in FIELDS[name].shape]
            frames[name] = np.full((len(frames["time"]), *width), np.nan)


def read_as(path: Path, lazy: bool | None) -> Contents:
    """Return what a file holds, with frames in memory, or in the file for large ones and if asked for."""
    if lazy is None:
        try:
            lazy = path.stat().st_size >= LAZY_BYTES
        except (OSError, ValueError):
            lazy = False  # `read` says what is wrong
    return read_lazily(path) if lazy else read(path)


def read_lazily(path: Path) -> Contents:
    """Return what a file holds, with frames that are read, and checked, as they are asked for.

    The outline is looked at by a process of its own first. A file whose frames must be read to know how many
    are whole is read as `read` does.

    Raises
    ------
    FileError
        As `read`; for a frame that has changed when it is read.
    """
    try:
        if not path.exists():
            raise FileMissingError(path, "no such file", 2)
        if not path.is_file():
            raise FileError(path, "not a file")
        _look_at(path, lazily=True)
        file = trajectory_checks.opened(os.fspath(path))
        raw = trajectory_checks.outline(file, path.stat().st_size)
        if raw is None or any(name not in raw["frames"] for name in ADDED):
            file.close()
            return read(path)
        if raw["frames"].keys() != FIELDS.keys():
            odd = ", ".join(sorted(raw["frames"].keys() ^ FIELDS.keys()))[:200]
            raise FileError(path, f"damaged: missing or unknown fields: {odd}")
        signals = {name: data[: len(raw["sums"])] for name, data in raw["signals"].items()}
        store = FrameStore(file, os.fspath(path), raw["frames"], raw["signals"], raw["sums"])
        frames: dict[str, Any] = {name: LazyField(store, name) for name in FIELDS}
        frames["time"] = raw["time"]
        state = _arrays(raw["state"])
    except Damaged as error:
        raise FileError(path, str(error)) from None
    except (FileError, FlagrsError):
        raise
    except (OSError, ValueError) as error:
        raise file_error(path, error, "cannot be read") from None
    return Contents(
        raw["manifest"], frames, signals, state, raw["state_frames"], raw["finished"], raw["wall_seconds"]
    )


def _look_at(path: Path, lazily: bool = False) -> None:
    """Read a file in a process of its own; raise FileError for what it finds, and if it has to be ended."""
    if not sys.executable:
        return  # embedded interpreters cannot start another
    command = [sys.executable, "-I", trajectory_checks.__file__, os.fspath(path.absolute())]
    command += ["lazily"] if lazily else []
    limit = LOOK_SECONDS + path.stat().st_size / 1e7
    try:
        look = subprocess.run(
            command, capture_output=True, timeout=limit, check=False, stdin=subprocess.DEVNULL
        )
    except subprocess.TimeoutExpired:
        raise FileError(path, "damaged: reading it does not come to an end") from None
    if look.returncode == 1 and look.stdout.strip():
        raise FileError(path, look.stdout.decode("utf-8", "replace").strip())
    if look.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        raise FileError(path, "damaged: reading it does not come to an end")
    if look.returncode != 0:
        raise FileError(path, "damaged: HDF5 cannot read it")


def _arrays(archive: bytes | None) -> State | None:
    """Return the arrays of a checkpoint."""
    if archive is None:
        return None
    try:
        with np.load(io.BytesIO(archive), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    except Exception as error:  # numpy and zipfile raise whatever they stumble on
        raise Damaged(f"damaged: its checkpoint ({error})") from None


def archived(state: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """Return the arrays of a checkpoint as bytes."""
    buffer = io.BytesIO()
    for name, array in state.items():
        if np.asarray(array).dtype.hasobject:
            raise FlagrsError(f"checkpoint: {name} holds Python objects, not numbers")
    arrays: dict[str, Any] = {name: np.asarray(array) for name, array in state.items()}
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def _lay_out(file: h5py.File, contents: Contents) -> None:
    """Create every object the file will ever have, and write what there is."""
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    for name, text in contents.manifest.items():
        # Datasets, as the scene of many rods outgrows the 64 kB of a plain HDF5 attribute.
        file["manifest/" + name] = text
    names = {"frames": list(contents.frames), "signals": list(contents.signals)}
    file["manifest_sum"] = trajectory_checks.manifest_sum(contents.manifest, names)
    count = len(contents.frames["time"])
    file["count"], file["finished"], file["wall_seconds"] = count, contents.finished, contents.wall_seconds
    file["progress_sum"] = trajectory_checks.progress_sum(count, contents.wall_seconds, contents.finished)
    rows = chunk_rows(contents)
    for group, arrays in (("frames", contents.frames), ("signals", contents.signals)):
        file.create_group(group)
        for name, array in arrays.items():
            dataset = _growing(file[group], name, np.asarray(array, dtype=np.float64), rows)
            if name in FIELDS:
                dataset.attrs["unit"], dataset.attrs["meaning"] = FIELDS[name].unit, FIELDS[name].meaning
    _growing(file, "sums", trajectory_checks.frame_sums(0, contents.frames, contents.signals), rows)
    for slot in ("slot0", "slot1"):
        file.create_dataset(
            "checkpoint/" + slot, shape=(0,), maxshape=(None,), dtype=np.uint8, chunks=(CHUNK_BYTES,)
        )
    # For each slot: sequence number (0: empty), length in bytes, checksum, number of frames.
    file["checkpoint/slots"] = np.zeros((2, 4), dtype=np.int64)
    if contents.state is not None:
        write_slot(file, file.flush, 1, archived(contents.state), contents.state_frames)


def chunk_rows(contents: Contents) -> int:
    """Return how many frames a chunk has."""
    nodes = int(contents.frames["nodes"].shape[1])
    return max(1, CHUNK_BYTES // max(1, 24 * nodes))


def _growing(group: h5py.Group, name: str, array: npt.NDArray[Any], rows: int) -> h5py.Dataset:
    # HDF5 has no empty chunks, but a scene without motors has arrays without columns.
    chunk = (rows, *(max(1, size) for size in array.shape[1:]))
    longest = (None, *(size or None for size in array.shape[1:]))
    return group.create_dataset(name, data=array, maxshape=longest, chunks=chunk)


def write_slot(
    datasets: Mapping[str, h5py.Dataset],
    flush: Callable[[], None],
    sequence: int,
    archive: bytes,
    frames: int,
) -> None:
    """Write a checkpoint into the slot its number belongs to, and note it when it is whole."""
    content = np.frombuffer(archive, dtype=np.uint8)
    slot = datasets[f"checkpoint/slot{sequence % 2}"]
    slot.resize(max(len(slot), len(content)), axis=0)
    slot[: len(content)] = content
    flush()
    checksum = trajectory_checks.slot_sum(archive, sequence, len(archive), frames)
    datasets["checkpoint/slots"][sequence % 2] = [sequence, len(archive), checksum, frames]
    flush()
