"""The page of the viewer: one HTML file with the run and the program that draws it."""

from __future__ import annotations

import base64
import html
import json
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from flagrs.errors import FlagrsError, file_error, not_allowed
from flagrs.scene.shapes import number
from flagrs.scene.values import Bounds
from flagrs.view.film import film_of

if TYPE_CHECKING:
    from flagrs.trajectory import Trajectory

COLOURS = ("filament", "speed", "force", "tension", "contact")
Colour = Literal["filament", "speed", "force", "tension", "contact"]

_SCRIPTS = ("geometry.js", "canvas.js", "viewer.js")


@dataclass(frozen=True)
class View:
    """A run to look at: save it as a page, or let a notebook show it.

    Attributes
    ----------
    page : str
        The page, HTML that needs nothing else.
    height : int
        Height in a notebook [pixels].
    """

    page: str
    height: int = 560

    def save(self, path: str | Path) -> Path:
        """Write the page to a file, replacing one that is there.

        Raises
        ------
        FileError
            If it cannot be written; an `OSError`.
        """
        place = Path(path)
        try:
            place.write_text(self.page, encoding="utf-8")
        except (OSError, ValueError) as error:
            raise file_error(place, error, "cannot be written") from None
        return place

    def __repr__(self) -> str:
        """Return its size."""
        return f"View({len(self.page.encode()) / 1e6:.2f} MB of HTML; save(path) writes it)"

    def _repr_html_(self) -> str:
        """Show it in a notebook."""
        return (
            f'<iframe style="width: 100%; height: {self.height}px; border: 1px solid #ddd" '
            f'srcdoc="{html.escape(self.page)}"></iframe>'
        )


def view(
    trajectory: Trajectory,
    colour: Colour = "filament",
    follow: bool = False,
    play: bool = False,
    megabytes: float = 3.0,
    height: int = 560,
) -> View:
    """Return a run as a page in three dimensions, for browsers and notebooks.

    Filaments are tubes of their radius with a stripe where the material director m1 is, so that twist shows.

    Parameters
    ----------
    trajectory
        The run.
    colour
        What filaments are coloured by at first: ``filament`` gives each its own, ``speed``, ``force`` (on the
        fluid per length), ``tension`` and ``contact`` (the gap to the nearest filament) are values. A scene
        without fluid has no ``force``, and one whose filaments never come near each other no ``contact``.
    follow
        Whether the camera moves along with the swimmer.
    play
        Whether it begins to play at once.
    megabytes
        Size that the frames take at most [MB]; of a longer run every second frame is shown, or every third
        and so on.
    height
        Height in a notebook [pixels].

    Raises
    ------
    FlagrsError
        If the trajectory has no frames.
    SceneError
        For an option out of range.
    """
    if not len(trajectory):
        raise FlagrsError("the trajectory has no frames to view")
    if colour not in COLOURS:
        raise not_allowed("colour", colour, ", ".join(COLOURS))
    size = number("megabytes", megabytes, Bounds("MB", at_least=0.01, at_most=500.0))
    film = film_of(trajectory, int(0.75e6 * size))  # as base64 it takes four thirds of that
    options = {"colour": colour, "follow": bool(follow), "play": bool(play)}
    return View(_page(film.header, bytes(film.data), options), height)


def _page(header: dict[str, Any], data: bytes, options: dict[str, Any]) -> str:
    folder = files("flagrs.view")
    style = (folder / "viewer.css").read_text(encoding="utf-8")
    scripts = "\n".join((folder / name).read_text(encoding="utf-8") for name in _SCRIPTS)
    run = ", ".join([_json(header), f'"{base64.b64encode(data).decode()}"', _json(options)])
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(header['name'])}</title>\n"
        f"<style>\nhtml, body {{ margin: 0; height: 100%; }}\n{style}</style>"
        '</head>\n<body><div class="flagrs" id="flagrs"></div>\n'
        f"<script>\n{scripts}\n"
        f"const viewer = startViewer(document.getElementById('flagrs'), {run});\n</script>"
        "</body></html>\n"
    )


def _json(value: Any) -> str:
    """Return JSON that a script may hold: a name may not end it."""
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c")
