"""Frames that stay in their file until they are asked for, each checked as it is read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from flagrs.errors import FileError
from flagrs.memory import require_memory
from flagrs.scene.values import FloatArray, IntArray
from flagrs.trajectory_checks import frame_sums

#: Bytes of all fields that are read at once.
BLOCK_BYTES = 32 << 20


class FrameStore:
    """The frames of an open file.

    Parameters
    ----------
    file
        The open file; it stays open as long as its frames are in use.
    path
        Its name, for messages.
    fields, signals
        Datasets (T or more, ...) by name.
    sums
        Checksum (T,) of each frame.
    """

    def __init__(
        self,
        file: h5py.File,
        path: str,
        fields: Mapping[str, h5py.Dataset],
        signals: Mapping[str, h5py.Dataset],
        sums: npt.NDArray[np.uint64],
    ) -> None:
        self._file, self._path = file, path
        self.fields, self._signals, self._sums = fields, signals, sums
        row = sum(max(8, 8 * int(np.prod(data.shape[1:]))) for data in [*fields.values(), *signals.values()])
        self.block = max(1, BLOCK_BYTES // row)
        self._held: tuple[int, int, dict[str, FloatArray]] = (0, 0, {})

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self._sums)

    def rows(self, name: str, start: int, end: int) -> FloatArray:
        """Return some frames, no more than a block, of a field (end - start, ...).

        Raises
        ------
        FileError
            If a frame does not match its checksum, or cannot be read.
        """
        first, last, held = self._held
        if not (first <= start and end <= last):
            # Whoever goes on from where the last ones ended is likely to go on.
            ahead = start + self.block if start in (0, last) else end
            first, last = start, min(max(end, ahead), len(self))
            held = self._checked(first, last)
            self._held = first, last, held
        return held[name][start - first : end - first]

    def _checked(self, start: int, end: int) -> dict[str, FloatArray]:
        try:
            fields = {name: data[start:end] for name, data in self.fields.items()}
            signals = {name: data[start:end] for name, data in self._signals.items()}
        except (OSError, ValueError, RuntimeError) as error:
            raise FileError(self._path, f"frames {start} to {end} cannot be read ({error})") from None
        good = frame_sums(start, fields, signals) == self._sums[start:end]
        if not good.all():
            frame = start + int(np.argmin(good))
            raise FileError(
                self._path, f"changed since it was written: frame {frame} does not match its checksum"
            )
        return fields

    def blocks(self, rows: IntArray) -> Iterator[tuple[int, int]]:
        """Yield begin and end of runs of consecutive frames, no longer than a block, that make up `rows`."""
        breaks = np.flatnonzero(np.diff(rows) != 1) + 1
        for run in np.split(rows, breaks):
            for start in range(0, len(run), self.block):
                part = run[start : start + self.block]
                yield int(part[0]), int(part[-1]) + 1


class LazyField(np.lib.mixins.NDArrayOperatorsMixin):
    """One field of all frames, an array (T, ...) whose frames are read as they are indexed.

    Whatever else an array can do reads all of it first, if there is memory for it.

    Parameters
    ----------
    store
        The file's frames.
    name
        The field.
    marked
        What whole frames are passed through when they are read; None: nothing.
    """

    def __init__(
        self, store: FrameStore, name: str, marked: Callable[[FloatArray], FloatArray] | None = None
    ) -> None:
        self._store, self._name, self._marked = store, name, marked
        self.shape: tuple[int, ...] = (len(store), *store.fields[name].shape[1:])
        self.dtype = np.dtype(np.float64)
        self.ndim = len(self.shape)
        self.size = int(np.prod(self.shape))

    def __len__(self) -> int:
        """Return the number of frames."""
        return self.shape[0]

    def __iter__(self) -> Iterator[Any]:
        """Iterate over the frames."""
        for start in range(0, len(self), self._store.block):
            yield from self._store.rows(self._name, start, min(start + self._store.block, len(self)))

    def __getitem__(self, key: Any) -> Any:
        """Return what an array would, reading only the frames it needs."""
        found = self._item(key)
        whole = self._marked is not None and np.shape(found)[-2:] == self.shape[-2:]
        return self._marked(found) if whole and self._marked is not None else found

    def marked_by(self, marked: Callable[[FloatArray], FloatArray]) -> LazyField:
        """Return the same field with whole frames passed through a function when they are read."""
        return LazyField(self._store, self._name, marked)

    def _item(self, key: Any) -> Any:
        first, *rest = key if isinstance(key, tuple) else (key,)
        if first is Ellipsis or first is None:
            return np.asarray(self)[key]
        chosen = np.arange(len(self))[first]
        if chosen.ndim == 0:
            row = self._store.rows(self._name, int(chosen), int(chosen) + 1)[0]
            return row[tuple(rest)] if rest else np.array(row)
        if chosen.ndim > 1 or (rest and not isinstance(first, slice)):
            return self._read(np.arange(len(self)), ())[key]
        return self._read(chosen, tuple(rest))

    def _read(self, rows: IntArray, rest: tuple[Any, ...]) -> FloatArray:
        probe = np.empty((0, *self.shape[1:]))[(slice(None), *rest)]
        size = 8 * len(rows) * int(np.prod(probe.shape[1:]))
        require_memory(f"reading {len(rows)} frames of {self._name}", size, "take fewer frames at a time")
        found = np.empty((len(rows), *probe.shape[1:]))
        place = 0
        for start, end in self._store.blocks(rows) if len(rows) else ():
            block = self._store.rows(self._name, start, end)
            found[place : place + end - start] = block[(slice(None), *rest)]
            place += end - start
        return found

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        """Return all frames."""
        array = self._read(np.arange(len(self)), ())
        return array if dtype is None else array.astype(dtype)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Let NumPy's functions see an array."""
        plain = [np.asarray(one) if isinstance(one, LazyField) else one for one in inputs]
        return getattr(ufunc, method)(*plain, **options)

    def __getattr__(self, name: str) -> Any:
        """Return what an array has, reading all of it."""
        if name.startswith("_") or not hasattr(np.ndarray, name):
            raise AttributeError(f"a field of frames has no {name!r}")
        return getattr(np.asarray(self), name)

    def __reduce__(self) -> Any:
        """Travel between processes as an array."""
        return np.array, (np.asarray(self),)

    def __repr__(self) -> str:
        """Say what it is without reading it."""
        return f"LazyField({self._name}, shape={self.shape})"
