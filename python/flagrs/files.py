"""Files for results: what may be written where, by one writer at a time, in place only when whole."""

from __future__ import annotations

import errno
import fcntl
import os
import secrets
import stat
import struct
import sys
from pathlib import Path

from flagrs.errors import FileError, FileTakenError, file_error

#: Attempts to lock a file that is replaced at the same moment.
_ATTEMPTS = 100


class Lock:
    """The right to write a file, which the system takes back when the process ends, however it ends.

    It is a lock on the file itself, so that nothing is left beside it.

    Parameters
    ----------
    path
        The file; it must be there.

    Raises
    ------
    FileTakenError
        If another writer has it.
    FileError
        If it cannot be opened for writing.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        for _ in range(_ATTEMPTS):
            try:
                self.descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
            except (OSError, ValueError) as error:
                raise file_error(path, error, "cannot be written") from None
            try:
                _lock(self.descriptor)
            except OSError as error:
                os.close(self.descriptor)
                if error.errno in (errno.EAGAIN, errno.EACCES):
                    raise FileTakenError(path, "is being written by another run", error.errno) from None
                raise file_error(path, error, "cannot be locked") from None
            if same_file(path, self.descriptor):
                return
            # Replaced between opening and locking: what is there now has a lock of its own.
            os.close(self.descriptor)
        raise FileTakenError(path, "is replaced again and again by other runs", errno.EAGAIN)

    def release(self) -> None:
        """Let others write the file."""
        if self.descriptor >= 0:
            # Unlocked before it is closed: a child of a fork may hold the same description open.
            try:
                _lock(self.descriptor, release=True)
            finally:
                os.close(self.descriptor)
                self.descriptor = -1


def _lock(descriptor: int, release: bool = False) -> None:
    if sys.platform == "linux":
        # A lock of the open file, not of the process: closing another descriptor of the file, as reading it
        # does, leaves it; readers that use flock, as HDF5 does, do not see it.
        kind = fcntl.F_UNLCK if release else fcntl.F_WRLCK
        fcntl.fcntl(descriptor, fcntl.F_OFD_SETLK, struct.pack("hhqqi4x", kind, os.SEEK_SET, 0, 0, 0))
    else:
        fcntl.flock(descriptor, fcntl.LOCK_UN if release else fcntl.LOCK_EX | fcntl.LOCK_NB)


def same_file(path: Path, other: Path | int | None) -> bool:
    """Return whether a path leads to another path's or an open descriptor's file."""
    if other is None:
        return False
    try:
        return os.path.samestat(os.stat(path), os.stat(other))
    except (OSError, ValueError):
        return False


def check_output(path: Path, overwrite: bool) -> bool:
    """Return whether a file is in the place of an output and may be replaced.

    Raises
    ------
    FileTakenError
        If it is there, and was not to be overwritten.
    FileError
        If the place is a folder, a link, a device or the like, or its folder is missing.
    """
    try:
        mode = os.lstat(path).st_mode
    except FileNotFoundError:
        if not path.parent.is_dir():
            raise FileError(path, f"there is no folder {str(path.parent)!r}", errno.ENOENT) from None
        return False
    except (OSError, ValueError) as error:
        raise file_error(path, error, "cannot be written") from None
    if not stat.S_ISREG(mode):
        raise FileTakenError(path, f"is {_kind(mode)}, which no result replaces; choose another path")
    if not overwrite:
        raise FileTakenError(
            path,
            "is there already; choose another path, go on with it (Simulation.restore), or replace it "
            "(overwrite=True)",
            errno.EEXIST,
        )
    return True


def _kind(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "a folder"
    return "a link" if stat.S_ISLNK(mode) else "a device, socket or pipe"


def temporary_beside(path: Path) -> Path:
    """Return a new empty file of this process's own in the folder of another.

    Raises
    ------
    FileError
        If the folder is missing or cannot be written.
    """
    temporary = path.with_name(f".flagrs-{secrets.token_hex(8)}")
    try:
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_RDWR | os.O_CLOEXEC, 0o666))
    except (OSError, ValueError) as error:
        raise file_error(path, error, "cannot be written") from None
    return temporary


def publish(temporary: Path, path: Path, replace: bool) -> None:
    """Give a whole file its name, in one move; unless it may replace one, only if the name is free.

    Raises
    ------
    FileTakenError
        If another file has come there in the meantime.
    FileError
        If the system refuses the name.
    """
    try:
        if replace:
            os.replace(temporary, path)
        else:
            _publish_as_new(temporary, path)
    except FileExistsError:
        raise FileTakenError(path, "was made by another run just now", errno.EEXIST) from None
    except (OSError, ValueError) as error:
        raise file_error(path, error, "cannot be written") from None


def _publish_as_new(temporary: Path, path: Path) -> None:
    try:
        os.link(temporary, path)
    except OSError as error:
        if error.errno not in (errno.EPERM, errno.ENOTSUP, errno.EMLINK, errno.EXDEV, errno.ENOSYS):
            raise
        # File systems without links: the name is claimed by an empty file first.
        os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_CLOEXEC))
        os.replace(temporary, path)
    else:
        os.unlink(temporary)
