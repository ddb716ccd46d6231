"""A file that never fails HDF5, which after a failed write could only be closed by crashing."""

from __future__ import annotations

import os
from pathlib import Path


class SafeStream:
    """An open file that remembers the first error and from then on keeps what is written in memory.

    What is on the disk is then what had been written before the error. Use it with h5py's driver for
    file-like objects, and look at `error` after closing.

    Parameters
    ----------
    path
        The file; it must be there.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("r+b", buffering=0)
        self._position = 0
        self._kept: list[tuple[int, bytes]] = []
        #: The first error, or None.
        self.error: OSError | None = None

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Move to a place."""
        size = max([os.fstat(self._file.fileno()).st_size, *(at + len(data) for at, data in self._kept)])
        start = {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: size}[whence]
        self._position = start + offset
        return self._position

    def tell(self) -> int:
        """Return the place."""
        return self._position

    def read(self, size: int) -> bytes:
        """Return as many bytes."""
        buffer = bytearray(size)
        self.readinto(buffer)
        return bytes(buffer)

    def readinto(self, buffer: bytearray | memoryview) -> int:
        """Read as much as there is room for."""
        view = memoryview(buffer).cast("B")
        found = os.pread(self._file.fileno(), len(view), self._position)
        view[: len(found)] = found
        view[len(found) :] = bytes(len(view) - len(found))
        for at, data in self._kept:
            low, high = max(at, self._position), min(at + len(data), self._position + len(view))
            if low < high:
                view[low - self._position : high - self._position] = data[low - at : high - at]
        self._position += len(view)
        return len(view)

    def write(self, data: bytes | memoryview) -> int:
        """Write, or keep in memory after an error."""
        content = bytes(data)
        done = 0
        while self.error is None and done < len(content):
            try:
                done += os.pwrite(self._file.fileno(), content[done:], self._position + done)
            except OSError as error:
                self.error = error
        if self.error is not None:
            self._kept.append((self._position, content))
        self._position += len(content)
        return len(content)

    def truncate(self, size: int | None = None) -> int:
        """Set the size."""
        wanted = self._position if size is None else size
        if self.error is None:
            try:
                os.ftruncate(self._file.fileno(), wanted)
            except OSError as error:
                self.error = error
        return wanted

    def flush(self) -> None:
        """Do nothing: nothing waits."""

    def close(self) -> None:
        """Close the file."""
        try:
            self._file.close()
        except OSError as error:
            self.error = self.error or error
