"""What a trajectory file must look like to be believed; as a program, a look at one in a process of its own.

HDF5 can hang or crash on a damaged file, so that one whose bytes are not vouched for is read first by this
program, which may be killed. It stands alone, as importing the package takes longer than reading.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import resource
import struct
import sys
import zlib
from collections.abc import Mapping
from typing import Any, BinaryIO

import h5py
import numpy as np
import numpy.typing as npt

FORMAT = "flagrs trajectory"
#: Version 1 had no checksums, version 2 no reactions of clamps.
FORMAT_VERSION = 3

#: The last bytes of a file that was closed: digest of all bytes before, their number, and a mark.
_MARK = b"flagrs: whole.\r\n"
_SEAL = struct.Struct("<32sQ16s")
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_MANIFEST = ("version", "created", "scene", "settings")
_CHUNK = 1 << 22
#: Longest text of a manifest [bytes]: a scene of some million nodes.
_LONGEST_TEXT = 1 << 28

Raw = dict[str, Any]


class Damaged(Exception):
    """A file that is not what it should be; the message says how."""


def seal_of(file: BinaryIO, size: int) -> bytes:
    """Return the seal for the first `size` bytes of a file."""
    return _SEAL.pack(_digest(file, size), size, _MARK)


def end_of_data(head: bytes) -> int:
    """Return where HDF5's part of a file ends, from its first 48 bytes.

    Raises
    ------
    Damaged
        If it does not begin as HDF5 files of flagrs do.
    """
    if len(head) < 48 or not head.startswith(_SIGNATURE):
        raise Damaged("not an HDF5 file" if head else "an empty file")
    version, offset_size = head[8], head[9]
    if version in (2, 3) and offset_size == 8:
        return int.from_bytes(head[28:36], "little")
    if version in (0, 1) and offset_size == 0:
        raise Damaged("not a flagrs trajectory")
    if version in (0, 1):
        return int.from_bytes(head[40:48], "little")  # not of flagrs, as will be found
    raise Damaged("an HDF5 file of an unknown kind")


def is_sealed(path: str) -> bool:
    """Return whether the bytes of a file are those with which it was closed; False if it never was.

    Raises
    ------
    Damaged
        If the file is cut off, or has changed since it was closed.
    """
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        end = end_of_data(file.read(48))
        if end > size:
            raise Damaged(f"cut off: {size} bytes of at least {end}")
        if size < _SEAL.size:
            return False
        file.seek(size - _SEAL.size)
        digest, sealed, mark = _SEAL.unpack(file.read(_SEAL.size))
        if mark != _MARK:
            return False
        if sealed != size - _SEAL.size or digest != _digest(file, sealed):
            raise Damaged("changed since it was written: its checksum does not match")
        return True


def _digest(file: BinaryIO, size: int) -> bytes:
    found = hashlib.blake2b(digest_size=32)
    file.seek(0)
    left = size
    while left > 0 and (block := file.read(min(left, _CHUNK))):
        found.update(block)
        left -= len(block)
    return found.digest()


def frame_sums(
    first: int, frames: Mapping[str, npt.NDArray[Any]], signals: Mapping[str, npt.NDArray[Any]]
) -> npt.NDArray[np.uint64]:
    """Return a checksum (T,) of each frame: its bits as integers, times odd numbers, summed modulo 2^64.

    One changed bit changes it for certain, any other change but for one in some 10^19. Each frame has its
    own, so that a chunk that a killed process wrote in part loses nothing but what was new in it.

    Parameters
    ----------
    first
        Number of the first frame.
    frames, signals
        Arrays (T, ...) of 64-bit floats by name.
    """
    count = len(frames["time"])
    total: npt.NDArray[np.uint64] = (
        np.arange(first + 1, first + count + 1, dtype=np.uint64) * _odd_numbers("number", 1)[0]
    )
    for group in (frames, signals):
        for name in sorted(group):
            array = group[name]
            width = math.prod(array.shape[1:])
            bits = np.ascontiguousarray(array).view(np.uint64).reshape(count, width)
            total += bits @ _odd_numbers(name, width)
    return total


def _odd_numbers(name: str, count: int) -> npt.NDArray[np.uint64]:
    """Return odd multipliers that belong to a field: the splitmix64 sequence (Steele, Lea and Flood 2014)."""
    z = np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    z += np.uint64(zlib.crc32(name.encode()))
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    odd: npt.NDArray[np.uint64] = (z ^ (z >> np.uint64(31))) | np.uint64(1)
    return odd


def progress_sum(count: int, wall_seconds: float, finished: bool) -> int:
    """Return the checksum of how far a run has come."""
    return zlib.crc32(struct.pack("<qd?", count, wall_seconds, finished))


def manifest_sum(manifest: Mapping[str, str], names: Mapping[str, list[str]]) -> str:
    """Return the digest of the manifest's texts and of the names of frames and signals."""
    text = json.dumps([sorted(manifest.items()), sorted((key, sorted(of)) for key, of in names.items())])
    return hashlib.sha256(text.encode()).hexdigest()


def slot_sum(content: bytes, sequence: int, size: int, frames: int) -> int:
    """Return the checksum of a checkpoint and of what is noted of it."""
    return zlib.crc32(struct.pack("<qqq", sequence, size, frames), zlib.crc32(content))


def load(path: str) -> Raw:
    """Return everything a file holds, after checking all of it.

    Returns
    -------
    dict
        ``manifest``, ``frames``, ``signals`` (mappings), ``state`` (bytes or None), ``state_frames``,
        ``finished``, ``wall_seconds``.

    Raises
    ------
    Damaged
        If anything is not as flagrs writes it.
    """
    try:
        with opened(path) as file:
            return _contents(file, os.path.getsize(path))
    except (OSError, KeyError, TypeError, ValueError, RuntimeError, AttributeError, MemoryError) as error:
        raise Damaged(f"damaged, or not a flagrs trajectory ({_words(error)})") from None


def _words(error: BaseException) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__


def opened(path: str) -> h5py.File:
    """Return an open file, also of a run that goes on or was killed.

    Raises
    ------
    Damaged
        If HDF5 cannot open it.
    """
    try:
        try:
            return h5py.File(path, "r", locking=False)
        except OSError:
            # The mark of an open writer is still set: it is running, or was killed. SWMR reads both.
            return h5py.File(path, "r", libver="latest", swmr=True, locking=False)
    except (OSError, ValueError, RuntimeError) as error:
        raise Damaged(f"damaged, or not a flagrs trajectory ({_words(error)})") from None


def outline(file: h5py.File, size: int) -> Raw | None:
    """Return everything an open file holds but its frames, which stay in it, after checking all that is read.

    Returns
    -------
    dict or None
        As `load`, with datasets for ``frames``, ``sums`` (T,) and the arrays ``time`` and ``signals``; None
        for a file whose frames must all be read to know how many are whole: one without checksums, or whose
        process died while it noted them.

    Raises
    ------
    Damaged
        If anything is not as flagrs writes it.
    """
    try:
        version, manifest, names, count, wall, finished = _header(file, size)
        if version < 2 or int(_number(file, "progress_sum", size)) != progress_sum(count, wall, finished):
            return None
        frames = {name: _frames(file, f"frames/{name}", size) for name in names["frames"]}
        signals = {name: _frames(file, f"signals/{name}", size) for name in names["signals"]}
        sums = _numbers(file, "sums", "u8", size)
        if count < 0 or any(len(data) < count for data in [sums, *frames.values(), *signals.values()]):
            raise Damaged(f"damaged: {count} frames are not all there")
        time = frames["time"][:count]
        if not (np.isfinite(time).all() and (np.diff(time) > 0.0).all()):
            raise Damaged("damaged: times of frames that do not rise")
        state, state_frames = _newest_slot(file, version, count, size)
    except (OSError, KeyError, TypeError, ValueError, RuntimeError, AttributeError, MemoryError) as error:
        raise Damaged(f"damaged, or not a flagrs trajectory ({_words(error)})") from None
    return {
        "manifest": manifest,
        "frames": frames,
        "time": time,
        "sums": sums[:count],
        "signals": signals,
        "state": state,
        "state_frames": state_frames,
        "finished": finished,
        "wall_seconds": wall,
    }


def _frames(file: h5py.File, name: str, size: int) -> h5py.Dataset:
    """Return a field's dataset, which claims no more bytes than the file has."""
    dataset = _dataset(file, name)
    _check_claim(dataset, name, "f8", size)
    return dataset


def _contents(file: h5py.File, size: int) -> Raw:
    version, manifest, names, count, wall, finished = _header(file, size)
    frames = {name: _numbers(file, f"frames/{name}", "f8", size) for name in names["frames"]}
    signals = {name: _numbers(file, f"signals/{name}", "f8", size) for name in names["signals"]}
    if version > 1:
        sums = _numbers(file, "sums", "u8", size)
        whole = min(len(sums), *(len(array) for array in [*frames.values(), *signals.values()]))
        cut = [{name: array[:whole] for name, array in group.items()} for group in (frames, signals)]
        good = frame_sums(0, *cut) == sums[:whole]
        leading = whole if good.all() else int(np.argmin(good))
        if int(_number(file, "progress_sum", size)) != progress_sum(count, wall, finished):
            # The process died while it noted how far it had come: the frames speak for themselves.
            count, wall, finished = leading, max(wall, 0.0) if np.isfinite(wall) else 0.0, False
        if leading < count:
            raise Damaged(
                f"changed since it was written: frame {leading} of {count} does not match its checksum"
            )
    if count < 0 or any(len(array) < count for array in [*frames.values(), *signals.values()]):
        raise Damaged(f"damaged: {count} frames are not all there")
    state, state_frames = _newest_slot(file, version, count, size)
    return {
        "manifest": manifest,
        "frames": {name: array[:count] for name, array in frames.items()},
        "signals": {name: array[:count] for name, array in signals.items()},
        "state": state,
        "state_frames": state_frames,
        "finished": finished,
        "wall_seconds": wall,
    }


_Header = tuple[int, dict[str, str], dict[str, list[str]], int, float, bool]


def _header(file: h5py.File, size: int) -> _Header:
    """Return version, manifest, names of datasets, number of frames, wall time, and whether finished."""
    if _attribute(file, "format") != FORMAT:
        raise Damaged("not a flagrs trajectory")
    version = int(_attribute(file, "format_version"))
    manifest = {name: _text(file, f"manifest/{name}") for name in _names(file, "manifest")}
    missing = set(_MANIFEST) - manifest.keys()
    if missing:
        raise Damaged(f"damaged: no {', '.join(sorted(missing))}")
    if version > FORMAT_VERSION:
        raise Damaged(f"written by a newer flagrs, {manifest['version'][:40]}")
    # The count first: what a running simulation adds while the rest is read lies beyond it.
    count = int(_number(file, "count", size))
    wall, finished = float(_number(file, "wall_seconds", size)), bool(_number(file, "finished", size))
    names = {group: _names(file, group) for group in ("frames", "signals")}
    if version > 1 and _text(file, "manifest_sum") != manifest_sum(manifest, names):
        raise Damaged("changed since it was written: the manifest's checksum does not match")
    return version, manifest, names, count, wall, finished


def _newest_slot(file: h5py.File, version: int, count: int, size: int) -> tuple[bytes | None, int]:
    """Return the newest whole checkpoint and its number of frames, or None."""
    entries = _numbers(file, "checkpoint/slots", "i8", size)
    if entries.shape != (2, 4):
        raise Damaged("damaged: the list of checkpoints")
    for which in np.argsort(-entries[:, 0]).tolist():
        sequence, length, checksum, frames = entries[which].tolist()
        content = _numbers(file, f"checkpoint/slot{which}", "u1", size)[: max(length, 0)].tobytes()
        wanted = slot_sum(content, sequence, length, frames) if version > 1 else zlib.crc32(content)
        # A slot whose writing was cut off does not match its checksum; the other one is whole.
        if sequence > 0 and wanted == checksum and 0 <= frames <= count:
            return content, frames
    if entries[:, 0].max() > 1:
        raise Damaged("changed since it was written: no checkpoint matches its checksum")
    return None, 0


def _attribute(file: h5py.File, name: str) -> Any:
    if name not in file.attrs:
        raise Damaged("not a flagrs trajectory")
    kind = file.attrs.get_id(name)
    if kind.shape != () or kind.dtype.kind not in "Oiu":
        raise Damaged("not a flagrs trajectory")
    return file.attrs[name]


def _names(file: h5py.File, group: str) -> list[str]:
    found = _object(file, group)
    if not isinstance(found, h5py.Group):
        raise Damaged(f"damaged: {group} is no group")
    return list(found)


def _object(file: h5py.File, name: str) -> Any:
    """Return an object of the file itself: links to other places and files are not followed."""
    place: Any = file
    for part in name.split("/"):
        if not isinstance(place, h5py.Group) or not isinstance(place.get(part, getlink=True), h5py.HardLink):
            raise Damaged(f"damaged: no {name} in the file")
        place = place[part]
    return place


def _dataset(file: h5py.File, name: str) -> h5py.Dataset:
    """Return a dataset whose values are plain and in the file itself: no filter, no other file."""
    found = _object(file, name)
    if not isinstance(found, h5py.Dataset):
        raise Damaged(f"damaged: {name} is no dataset")
    plist = found.id.get_create_plist()
    if found.is_virtual or found.external or plist.get_nfilters() > 0:
        raise Damaged(f"refused: {name} is filtered, or refers to other files")
    return found


def _text(file: h5py.File, name: str) -> str:
    dataset = _dataset(file, name)
    kind = h5py.check_string_dtype(dataset.dtype)
    if kind is None or dataset.shape != ():
        raise Damaged(f"damaged: {name} is no text")
    text = dataset.asstr()[()]
    if not isinstance(text, str) or len(text) > _LONGEST_TEXT:
        raise Damaged(f"damaged: {name} is no text")
    return text


def _numbers(file: h5py.File, name: str, kind: str, size: int) -> npt.NDArray[Any]:
    dataset = _dataset(file, name)
    _check_claim(dataset, name, kind, size)
    values: npt.NDArray[Any] = dataset[()]
    return values


def _check_claim(dataset: h5py.Dataset, name: str, kind: str, size: int) -> None:
    """Raise Damaged unless a dataset holds numbers of a kind, and no more than its file has room for."""
    if dataset.dtype != np.dtype(kind):
        raise Damaged(f"damaged: {name} holds {dataset.dtype}")
    claimed = dataset.dtype.itemsize
    for length in dataset.shape:
        claimed *= int(length)
    if claimed > size:
        raise Damaged(f"damaged: {name} claims {claimed} bytes in a file of {size}")


def _number(file: h5py.File, name: str, size: int) -> Any:
    dataset = _dataset(file, name)
    if dataset.shape != () or dataset.dtype.kind not in "iufb":
        raise Damaged(f"damaged: {name} is no number")
    return dataset[()]


#: Memory besides a file's content [bytes], and processor time besides 1 s for every 50 MB [s], of a look.
_LOOK_MEMORY = 1 << 30
_LOOK_SECONDS = 3


def main(path: str, lazily: bool) -> int:
    """Look at a file, or all of it but frames, within limits of memory and time; say what is wrong."""
    size = os.path.getsize(path)
    seconds = _LOOK_SECONDS + size // 50_000_000
    resource.setrlimit(resource.RLIMIT_AS, (_LOOK_MEMORY + 4 * size,) * 2)
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        if lazily:
            with opened(path) as file:
                outline(file, size)
        else:
            load(path)
    except Damaged as error:
        print(error)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:] == ["lazily"]))
