"""The open file of a running simulation: one writer, room reserved, a way out when the disk fails."""

from __future__ import annotations

import errno
import os
import re
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy.typing as npt

from flagrs.errors import FileError, file_error
from flagrs.files import Lock, check_output, publish
from flagrs.scene.values import FloatArray
from flagrs.trajectory_checks import frame_sums, progress_sum
from flagrs.trajectory_file import CHUNK_BYTES, Contents, archived, chunk_rows, laid_out, seal, write_slot

#: Room for what HDF5 itself notes with each block of frames [bytes].
_OVERHEAD = 1 << 18


class TrajectoryWriter:
    """The open file of a running simulation.

    Parameters
    ----------
    path
        Where the file goes.
    contents
        Manifest, and what the file starts with; the shapes of the fields are taken from its arrays.
    overwrite
        Whether a file that is there already is replaced.
    lock
        The lock of the file that is replaced, if the caller holds it; released here.

    Raises
    ------
    FileError
        If the file is there already and is not to be overwritten, belongs to another run, or cannot be
        written.
    """

    def __init__(
        self, path: Path, contents: Contents, overwrite: bool = False, lock: Lock | None = None
    ) -> None:
        self.path = path
        self._count = len(contents.frames["time"])
        self._sequence = 1 if contents.state is not None else 0
        self._started = time.perf_counter() - contents.wall_seconds
        self._rows = chunk_rows(contents)
        if lock is None and check_output(path, overwrite):
            lock = Lock(path)
        try:
            self._file, self._lock = self._opened(contents, replace=lock is not None)
        finally:
            if lock is not None:
                lock.release()
        # Kept open: what HDF5 cannot write as it closes a dataset it does not report.
        self._datasets = _datasets_of(self._file)

    def _opened(self, contents: Contents, replace: bool) -> tuple[h5py.File, Lock]:
        temporary = laid_out(self.path, contents)
        try:
            lock = Lock(temporary)
            file = None
            try:
                file = h5py.File(temporary, "r+", libver="latest", locking=False)
                file.swmr_mode = True
                publish(temporary, self.path, replace)
            except BaseException as error:
                _close_into_nowhere(file, lock)
                if isinstance(error, (OSError, RuntimeError)) and not isinstance(error, FileError):
                    raise self._failed(error) from None
                raise
        finally:
            temporary.unlink(missing_ok=True)
        return file, lock

    def write(self, frames: Mapping[str, FloatArray], signals: Mapping[str, FloatArray]) -> None:
        """Add a block of frames: field arrays (T, ...), and samples (T,) of the signals.

        Raises
        ------
        FileError
            If there is no room; the file then stands at the frames before.
        """
        count, end = self._count, self._count + len(frames["time"])
        sums = {"sums": frame_sums(count, frames, signals)}
        groups = [("frames/", frames), ("signals/", signals), ("", sums)]
        self._reserve(sum(self._room(array) for _, arrays in groups for array in arrays.values()))

        def add() -> None:
            for group, arrays in groups:
                for name, array in arrays.items():
                    dataset = self._datasets[group + name]
                    dataset.resize(end, axis=0)
                    dataset[count:] = array
            self._file.flush()
            # Counted only once they are whole: what dies before this line leaves the old count.
            self._note(end, finished=False)
            self._file.flush()

        self._safely(add)
        self._count = end

    def checkpoint(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Store a state to resume from, in the slot that does not hold the latest one.

        Raises
        ------
        FileError
            If there is no room; the checkpoint before stays.
        """
        archive = archived(state)
        self._reserve(2 * len(archive) + 2 * CHUNK_BYTES)
        self._safely(
            lambda: write_slot(self._datasets, self._file.flush, self._sequence + 1, archive, self._count)
        )
        self._sequence += 1

    def close(self, finished: bool) -> None:
        """Close the file, marking whether the run reached its end."""
        if self._lock.descriptor < 0:
            return
        try:
            if self._file:
                self._safely(lambda: self._end(finished))
                try:
                    seal(self.path, self._lock.descriptor)
                except FileError:
                    pass  # no room for the digest, without which the file is read with more care
        finally:
            self._lock.release()

    def _end(self, finished: bool) -> None:
        self._note(self._count, finished)
        self._file.flush()
        self._file.close()

    def _note(self, count: int, finished: bool) -> None:
        wall = time.perf_counter() - self._started
        self._datasets["count"][()] = count
        self._datasets["wall_seconds"][()] = wall
        self._datasets["finished"][()] = finished
        self._datasets["progress_sum"][()] = progress_sum(count, wall, finished)

    def _room(self, array: npt.NDArray[Any]) -> int:
        """Return how many bytes a block takes at most, in whole chunks."""
        row = max(8, array.nbytes // max(1, len(array)))
        return (len(array) + 2 * self._rows) * row

    def _reserve(self, size: int) -> None:
        """Take room on the disk before HDF5 needs it, since HDF5 cannot be closed after a failed write."""
        if not hasattr(os, "posix_fallocate"):  # macOS
            return
        try:
            os.posix_fallocate(self._lock.descriptor, self._file.id.get_filesize(), size + _OVERHEAD)
        except OSError as error:
            if error.errno in (errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL):
                return  # a file system that cannot
            raise file_error(self.path, error, "cannot be written") from None

    def _safely(self, action: Callable[[], None]) -> None:
        """Do something to the file; where the disk fails, let HDF5 close into nowhere and say so."""
        try:
            action()
        except (OSError, RuntimeError) as error:
            _close_into_nowhere(self._file, self._lock)
            raise self._failed(error) from None

    def _failed(self, error: OSError | RuntimeError) -> FileError:
        """Return what to tell of a failure of the disk, of which HDF5 makes an error of either kind."""
        if not isinstance(error, OSError):
            told = re.search(r"errno = (\d+)", str(error))
            error = OSError(int(told[1]) if told else errno.EIO, str(error))
        return file_error(self.path, error, "cannot be written")


def _close_into_nowhere(file: h5py.File | None, lock: Lock) -> None:
    """Close without another byte going to the disk; what was flushed before stays readable."""
    try:
        if file is None:
            return
        descriptor = file.id.get_vfd_handle()
        sink = os.memfd_create("flagrs") if hasattr(os, "memfd_create") else os.open(os.devnull, os.O_RDWR)
        os.sendfile(sink, lock.descriptor, 0, os.fstat(lock.descriptor).st_size)
        os.dup2(sink, descriptor)
        os.close(sink)
        file.close()
    except (OSError, RuntimeError, ValueError):
        pass  # HDF5 is beyond help; what is on the disk is as after a kill
    finally:
        lock.release()


def _datasets_of(file: h5py.File) -> dict[str, h5py.Dataset]:
    """Return all datasets of a file by their path."""
    found: dict[str, h5py.Dataset] = {}

    def keep(name: str, thing: Any) -> None:
        if isinstance(thing, h5py.Dataset):
            found[name] = thing

    file.visititems(keep)
    return found
