"""Movies of runs, one or several side by side, as MP4, WebM or GIF."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flagrs.errors import FlagrsError, SceneError
from flagrs.files import temporary_beside
from flagrs.plot.canvas import GREY, new_figure
from flagrs.plot.film_strip import Encoder, encoder_for
from flagrs.plot.shape import unit_of
from flagrs.plot.tubes import look_of, place, tubes
from flagrs.scene.shapes import number, whole
from flagrs.scene.values import Bounds, FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from flagrs.trajectory import Trajectory

#: Dots per inch, and inches of a panel's width.
DOTS, WIDTH = 120, 8.0


def movie(
    runs: Trajectory | Sequence[Trajectory],
    path: str | Path,
    *,
    labels: Sequence[str] | None = None,
    seconds: float = 12.0,
    frames_per_second: int = 25,
    yaw: float = -65.0,
    pitch: float = 22.0,
    follow: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Path:
    """Write a movie of one run, or of several below each other at the same time and scale.

    Each picture shows the saved frame that is nearest in time; a run that ends earlier than others stays at
    its end.

    Parameters
    ----------
    runs
        The runs.
    path
        The file: ``.mp4``, ``.webm`` (both need the package imageio-ffmpeg) or ``.gif``; replaced if it is
        there.
    labels
        A text for each run; by default the names of their scenes.
    seconds
        How long it plays [s].
    frames_per_second
        Pictures a second.
    yaw, pitch
        Direction from which it is seen: about z from +x, and above the xy plane [degrees].
    follow
        Whether the picture moves along with each swimmer.
    progress
        Called with the time it plays up to [s] after every picture.

    Raises
    ------
    FlagrsError
        If a run has no frames, or a package is missing.
    SceneError
        For an option out of range.
    FileError
        If the file cannot be written; an `OSError`.
    """
    shown = [runs] if not isinstance(runs, Sequence) else list(runs)
    _check(shown, labels)
    number("seconds", seconds, Bounds("s", above=0.0, at_most=36000.0))
    rate = whole("frames_per_second", frames_per_second, least=1)
    number("yaw", yaw, Bounds("degrees"))
    number("pitch", pitch, Bounds("degrees", at_least=-90.0, at_most=90.0))
    file = Path(path)
    encode = encoder_for(file)
    texts = list(labels) if labels is not None else [run.scene.name for run in shown]
    times = np.linspace(
        min(float(run.time[0]) for run in shown),
        max(float(run.time[-1]) for run in shown),
        max(2, round(seconds * rate)),
    )
    pictures = _pictures(shown, texts, times, view_from(yaw, pitch), follow)
    _write(encode, pictures, file, rate, progress)
    return file


def _check(runs: Sequence[Trajectory], labels: Sequence[str] | None) -> None:
    if not runs:
        raise FlagrsError("no run to make a movie of")
    for run in runs:
        if not len(run):
            raise FlagrsError(f"{run.scene.name}: the trajectory has no frames to show")
    if labels is not None and len(labels) != len(runs):
        raise SceneError(f"labels: {len(labels)} for {len(runs)} runs", field="labels", value=labels)


def view_from(yaw: float, pitch: float) -> FloatArray:
    """Return the rows (3, 3) across, up and towards the viewer of a view from a direction [degrees]."""
    a, b = np.radians(yaw), np.radians(pitch)
    out = np.array([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)])
    across = np.array([-np.sin(a), np.cos(a), 0.0])
    rows: FloatArray = np.stack([across, np.cross(out, across), out])
    return rows


class _Panel:
    """One run in axes of its own."""

    def __init__(self, axes: Axes, run: Trajectory, label: str, view: FloatArray, follow: bool) -> None:
        from matplotlib.patches import Circle

        self._run, self._view, self._axes, self._follow = run, view, axes, follow
        self._look = look_of(run.scene)
        self._tubes = tubes(self._look, run.nodes[0] @ view.T)
        axes.add_collection(self._tubes)
        self._head: list[Circle] = []
        head = run.scene.head
        if head is not None:
            self._head = [
                Circle((0.0, 0.0), head.radius, facecolor="#d9d9d9", edgecolor="none", alpha=0.7, zorder=0.9),
                Circle((0.0, 0.0), head.radius, facecolor="none", edgecolor=GREY, zorder=3.0),
            ]
            for circle in self._head:
                axes.add_patch(circle)
        axes.text(0.01, 0.97, label, transform=axes.transAxes, va="top", fontsize="large")
        axes.set_aspect("equal")
        axes.set_axis_off()

    def box(self) -> FloatArray:
        """Return the lowest and highest place (2, 2) that anything ever takes in the picture [m]."""
        run, margin = self._run, float(self._look.radius.max())
        seen = (run.nodes - self._origin(slice(None))) @ self._view[:2].T
        low, high = seen.min(axis=(0, 1)) - margin, seen.max(axis=(0, 1)) + margin
        if run.scene.head is not None:
            middles = (run.position()[:, None] - self._origin(slice(None))) @ self._view[:2].T
            radius = run.scene.head.radius
            low = np.minimum(low, middles.min(axis=(0, 1)) - radius)
            high = np.maximum(high, middles.max(axis=(0, 1)) + radius)
        return np.stack([low, high])

    def _origin(self, frame: int | slice) -> FloatArray:
        """Return what the picture is centred on in a frame, (3,) or (T, 1, 3)."""
        position = self._run.position()[frame]
        origin = position if self._follow else np.zeros_like(position)
        return origin[:, None] if isinstance(frame, slice) else origin

    def show(self, time: float) -> None:
        """Move everything to the frame nearest to a time [s]."""
        frame = int(np.abs(self._run.time - time).argmin())
        place(self._tubes, self._look, (self._run.nodes[frame] - self._origin(frame)) @ self._view.T)
        if self._head:
            middle = self._view[:2] @ (self._run.position()[frame] - self._origin(frame))
            for circle in self._head:
                circle.center = (float(middle[0]), float(middle[1]))


def _pictures(
    runs: Sequence[Trajectory], labels: Sequence[str], times: FloatArray, view: FloatArray, follow: bool
) -> Iterator[FloatArray]:
    """Yield the pictures (height, width, 3) of a movie, of even height and width as video wants them."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = new_figure(WIDTH, 1.0)
    figure.set_dpi(DOTS)
    axes = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
    panels = [_Panel(*row, view, follow) for row in zip(axes, runs, labels, strict=True)]
    boxes = np.array([panel.box() for panel in panels])
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    pad = 0.04 * float((high - low).max())
    low, high = low - pad, high + pad
    tall = float((high - low)[1] / (high - low)[0])
    # A long run of tall swimmers would not fit a screen: at most square.
    height = min(WIDTH * tall, WIDTH) * len(runs)
    figure.set_size_inches(WIDTH, min(height, 1.2 * WIDTH) + 0.35)
    figure.set_layout_engine(None)
    figure.subplots_adjust(left=0.0, right=1.0, bottom=0.0, top=1.0, hspace=0.0)
    for panel in axes:
        panel.set_xlim(low[0], high[0])
        panel.set_ylim(low[1], high[1])
    clock = figure.text(0.99, 0.985, "", ha="right", va="top", fontsize="large")
    _scale_bar(axes[-1], low, high)
    canvas = FigureCanvasAgg(figure)
    for time in times:
        for drawn in panels:
            drawn.show(float(time))
        clock.set_text(f"t = {time:.{_digits(times)}f} s")
        canvas.draw()  # type: ignore[no-untyped-call]
        picture = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        rows, columns = (2 * (size // 2) for size in picture.shape[:2])
        yield picture[:rows, :columns, :3].copy()


def _digits(times: FloatArray) -> int:
    """Return the decimals with which two pictures' times differ, or all but."""
    return int(np.clip(np.ceil(-np.log10(max(float(times[-1] - times[0]), 1e-12)) + 2.0), 0, 9))


def _scale_bar(axes: Axes, low: FloatArray, high: FloatArray) -> None:
    """Draw a bar of a round length into the lower left corner."""
    span = float((high - low)[0])
    power = 10.0 ** np.floor(np.log10(span / 5.0))
    length = float(power * max(k for k in (1.0, 2.0, 5.0) if k * power <= span / 5.0))
    factor, unit = unit_of(length)
    start, height = low[0] + 0.03 * span, low[1] + 0.03 * span
    axes.plot([start, start + length], [height, height], color="black", linewidth=2.0)
    axes.text(
        start + length / 2.0, height + 0.008 * span, f"{factor * length:g} {unit}", ha="center", va="bottom"
    )


def _write(
    encode: Encoder,
    pictures: Iterator[FloatArray],
    path: Path,
    rate: int,
    progress: Callable[[float], None] | None,
) -> None:
    """Encode the pictures into a file, which takes its name when it is whole."""

    def counted() -> Iterator[FloatArray]:
        for count, picture in enumerate(pictures, start=1):
            yield picture
            if progress is not None:
                progress(count / rate)

    temporary = temporary_beside(path)
    try:
        encode(counted(), temporary, rate)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
