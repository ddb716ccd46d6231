"""Trajectories in HDF5 files that stay readable whenever the writing process dies.

The structure is laid out in a temporary file that then takes the final name, and from there on frames are
added in HDF5's single-writer-multiple-reader (SWMR) mode, in which the file is consistent at every instant.
SWMR forbids new objects, so everything that may come later has its place from the start: a count of the
frames that are complete, written after them, and two slots for checkpoints, used in turn, so that one is
always whole.
"""

from __future__ import annotations

import io
import os
import time
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from flagrs.errors import FlagrsError
from flagrs.frame import FIELDS
from flagrs.scene.values import FloatArray

FORMAT = "flagrs trajectory"
FORMAT_VERSION = 1
#: Size of a chunk of positions, within the range h5py advises for chunks [bytes].
CHUNK_BYTES = 64 * 1024

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


class TrajectoryWriter:
    """The open file of a running simulation.

    Parameters
    ----------
    path
        Where the file goes; one that is there already is replaced.
    contents
        Manifest, and what the file starts with; the shapes of the fields are taken from its arrays.
    """

    def __init__(self, path: Path, contents: Contents) -> None:
        write_whole(path, contents)
        self._file = h5py.File(path, "r+", libver="latest")
        self._file.swmr_mode = True
        self._count = len(contents.frames["time"])
        self._sequence = 1 if contents.state is not None else 0
        self._started = time.perf_counter() - contents.wall_seconds

    def write(self, frames: Mapping[str, FloatArray], signals: Mapping[str, FloatArray]) -> None:
        """Add a block of frames: field arrays (T, ...), and samples (T,) of the signals."""
        end = self._count + len(frames["time"])
        for group, arrays in (("frames", frames), ("signals", signals)):
            for name, array in arrays.items():
                dataset = self._file[group][name]
                dataset.resize(end, axis=0)
                dataset[self._count :] = array
        self._file.flush()
        # Counted only once they are whole: what dies before this line leaves the old count.
        self._file["count"][()] = end
        self._file["wall_seconds"][()] = time.perf_counter() - self._started
        self._file.flush()
        self._count = end

    def checkpoint(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Store a state to resume from, in the slot that does not hold the latest one."""
        self._sequence += 1
        _write_slot(self._file, self._sequence, state, self._count)

    def close(self, finished: bool) -> None:
        """Close the file, marking whether the run reached its end."""
        if self._file:
            self._file["wall_seconds"][()] = time.perf_counter() - self._started
            self._file["finished"][()] = finished
            self._file.flush()
            self._file.close()


def write_whole(path: Path, contents: Contents) -> None:
    """Write a trajectory at once; a file that is there already is replaced only when the new one is whole."""
    temporary = path.with_name(path.name + ".new")
    with h5py.File(temporary, "w", libver="latest") as file:
        _lay_out(file, contents)
    os.replace(temporary, path)


def read(path: Path) -> Contents:
    """Return what a file holds, whether its run ended, was killed, or still goes on.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    FlagrsError
        If it is not a trajectory of flagrs.
    """
    with _open(path) as file:
        if file.attrs.get("format") != FORMAT:
            raise FlagrsError(f"{path}: not a flagrs trajectory")
        if file.attrs["format_version"] > FORMAT_VERSION:
            raise FlagrsError(f"{path}: written by a newer flagrs, {file['manifest/version'].asstr()[()]}")
        count = int(file["count"][()])
        state, state_frames = _read_newest_slot(file)
        return Contents(
            manifest={name: text.asstr()[()] for name, text in file["manifest"].items()},
            frames={name: dataset[:count] for name, dataset in file["frames"].items()},
            signals={name: dataset[:count] for name, dataset in file["signals"].items()},
            state=state,
            state_frames=state_frames,
            finished=bool(file["finished"][()]),
            wall_seconds=float(file["wall_seconds"][()]),
        )


def _open(path: Path) -> h5py.File:
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        return h5py.File(path, "r")
    except OSError:
        # The mark of an open writer is still set: it is running, or was killed. SWMR reads both.
        try:
            return h5py.File(path, "r", libver="latest", swmr=True)
        except OSError as error:
            raise FlagrsError(f"{path}: not a readable HDF5 file ({error})") from None


def _lay_out(file: h5py.File, contents: Contents) -> None:
    """Create every object the file will ever have, and write what there is."""
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    for name, text in contents.manifest.items():
        # Datasets, as the scene of many rods outgrows the 64 kB of a plain HDF5 attribute.
        file["manifest/" + name] = text
    count = len(contents.frames["time"])
    file["count"], file["finished"], file["wall_seconds"] = count, contents.finished, contents.wall_seconds
    rows = max(
        1, CHUNK_BYTES // (contents.frames["nodes"][:0].itemsize * 3 * contents.frames["nodes"].shape[1])
    )
    for group, arrays in (("frames", contents.frames), ("signals", contents.signals)):
        file.create_group(group)
        for name, array in arrays.items():
            # HDF5 has no empty chunks, but a scene without motors has arrays without columns.
            chunk = (rows, *(max(1, size) for size in array.shape[1:]))
            dataset = file[group].create_dataset(
                name, data=array, maxshape=(None, *(size or None for size in array.shape[1:])), chunks=chunk
            )
            if name in FIELDS:
                dataset.attrs["unit"], dataset.attrs["meaning"] = FIELDS[name].unit, FIELDS[name].meaning
    for slot in ("slot0", "slot1"):
        file.create_dataset(
            "checkpoint/" + slot, shape=(0,), maxshape=(None,), dtype=np.uint8, chunks=(CHUNK_BYTES,)
        )
    # For each slot: sequence number (0: empty), length in bytes, checksum, number of frames.
    file["checkpoint/slots"] = np.zeros((2, 4), dtype=np.int64)
    if contents.state is not None:
        _write_slot(file, 1, contents.state, contents.state_frames)


def _write_slot(file: h5py.File, sequence: int, state: Mapping[str, npt.NDArray[Any]], frames: int) -> None:
    buffer = io.BytesIO()
    for name, array in state.items():
        if np.asarray(array).dtype.hasobject:
            raise FlagrsError(f"checkpoint: {name} holds Python objects, not numbers")
    arrays: dict[str, Any] = {name: np.asarray(array) for name, array in state.items()}
    np.savez(buffer, **arrays)
    content = np.frombuffer(buffer.getvalue(), dtype=np.uint8)
    slot = file[f"checkpoint/slot{sequence % 2}"]
    slot.resize(max(len(slot), len(content)), axis=0)
    slot[: len(content)] = content
    file.flush()
    file["checkpoint/slots"][sequence % 2] = [sequence, len(content), zlib.crc32(content.tobytes()), frames]
    file.flush()


def _read_newest_slot(file: h5py.File) -> tuple[State | None, int]:
    """Return the newest whole checkpoint and its number of frames, or None."""
    entries = file["checkpoint/slots"][()]
    for which in np.argsort(-entries[:, 0]).tolist():
        sequence, size, checksum, frames = entries[which].tolist()
        content = file[f"checkpoint/slot{which}"][:size].tobytes()
        # A slot whose writing was cut off does not match its checksum; the other one is whole.
        if sequence > 0 and zlib.crc32(content) == checksum:
            with np.load(io.BytesIO(content), allow_pickle=False) as archive:
                return {name: archive[name] for name in archive.files}, frames
    return None, 0
