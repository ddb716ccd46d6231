"""From pictures to a file of moving ones: MP4 and WebM by ffmpeg, GIF by Pillow."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from flagrs.errors import FileError, FlagrsError, file_error, not_allowed
from flagrs.scene.values import FloatArray

Encoder = Callable[[Iterator[FloatArray], Path, int], None]

#: What ffmpeg is told for each kind: format, codec and options; colours as every player understands them.
_KINDS: dict[str, tuple[str, str, list[str]]] = {
    ".mp4": ("mp4", "libx264", ["-crf", "20", "-movflags", "+faststart"]),
    ".webm": ("webm", "libvpx-vp9", ["-crf", "32", "-b:v", "0", "-row-mt", "1", "-cpu-used", "5"]),
}


def encoder_for(path: Path) -> Encoder:
    """Return what writes a movie of the kind that a file's name ends in.

    Raises
    ------
    SceneError
        For another ending.
    FlagrsError
        If the package that is needed is not installed.
    FileError
        If there is no such folder.
    """
    kind = path.suffix.lower()
    if kind not in (*_KINDS, ".gif"):
        raise not_allowed("output", str(path), "a file ending in .mp4, .webm or .gif")
    if not path.parent.is_dir():
        raise FileError(path, f"there is no folder {str(path.parent)!r}")
    if kind == ".gif":
        return _gif
    try:
        import imageio_ffmpeg
    except ImportError:
        raise FlagrsError(
            f"{kind} movies need ffmpeg: pip install 'flagrs[movie]'; GIF does without"
        ) from None

    def encode(pictures: Iterator[FloatArray], file: Path, rate: int) -> None:
        _video(imageio_ffmpeg, _KINDS[kind], pictures, file, rate)

    return encode


def _video(
    ffmpeg: Any, kind: tuple[str, str, list[str]], pictures: Iterator[FloatArray], file: Path, rate: int
) -> None:
    container, codec, options = kind
    first = next(pictures)
    height, width = first.shape[:2]
    writer = ffmpeg.write_frames(
        str(file),
        (width, height),
        fps=rate,
        codec=codec,
        pix_fmt_in="rgb24",
        pix_fmt_out="yuv420p",
        quality=None,
        macro_block_size=2,
        ffmpeg_log_level="error",
        output_params=[*options, "-f", container],
    )
    writer.send(None)
    try:
        writer.send(np.ascontiguousarray(first, dtype=np.uint8))
        for picture in pictures:
            writer.send(np.ascontiguousarray(picture, dtype=np.uint8))
    except OSError as error:
        raise file_error(file, error, "ffmpeg cannot write") from None
    finally:
        writer.close()


def _gif(pictures: Iterator[FloatArray], file: Path, rate: int) -> None:
    from PIL import Image  # comes with matplotlib

    # One palette for all pictures, so that colours do not flicker; half the size, as GIF is a large format.
    first = Image.fromarray(next(pictures).astype(np.uint8))
    size = (first.width // 2, first.height // 2)
    palette = first.convert("P", palette=Image.Palette.ADAPTIVE, colors=128)

    def small(picture: Any) -> Any:
        return picture.resize(size, Image.Resampling.BOX).quantize(palette=palette, dither=Image.Dither.NONE)

    rest = (small(Image.fromarray(picture.astype(np.uint8))) for picture in pictures)
    duration = max(20, round(1000.0 / rate))  # players take shorter ones for a tenth of a second
    try:
        small(first).save(
            file, format="GIF", save_all=True, append_images=rest, duration=duration, loop=0, optimize=False
        )
    except OSError as error:
        raise file_error(file, error, "cannot be written") from None
