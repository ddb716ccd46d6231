"""A headless Chromium that opens a page, runs a script on it and tells what it found."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

PROGRAM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)

needs_browser = pytest.mark.skipif(PROGRAM is None, reason="no Chromium on this machine")

#: Software rendering, so that it draws the same on every machine.
_FLAGS = (
    "--headless=new --no-sandbox --disable-gpu-sandbox --use-gl=angle --use-angle=swiftshader "
    "--enable-unsafe-swiftshader --virtual-time-budget=10000 --enable-logging=stderr --v=0"
)


def told(page: str, script: str, folder: Path) -> dict[str, Any]:
    """Return what a script puts into ``tell`` on a page, with ``errors``, ``console`` and ``requests``.

    Parameters
    ----------
    page
        The page as HTML.
    script
        JavaScript that runs once the page has loaded; it fills the object ``tell``.
    folder
        Where files go.
    """
    before = (
        "<script>const errors = [];"
        "addEventListener('error', (event) => errors.push(String(event.message)));</script>"
    )
    after = (
        "<script>const tell = {}; addEventListener('load', () => { try {"
        + script
        + "} catch (error) { errors.push(String(error)); }"
        "tell.requests = performance.getEntriesByType('resource').map((entry) => entry.name);"
        "const note = document.createElement('pre'); note.id = 'told';"
        "note.textContent = JSON.stringify({ ...tell, errors }); document.body.append(note); });</script>"
    )
    file = folder / "page.html"
    file.write_text(page.replace("<head>", "<head>" + before).replace("</body>", after + "</body>"))
    command = [
        str(PROGRAM),
        *_FLAGS.split(),
        f"--user-data-dir={folder / 'profile'}",
        "--dump-dom",
        file.as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    _, mark, rest = done.stdout.partition('<pre id="told">')
    assert mark, f"the page told nothing: {done.stderr[-2000:]}"
    found: dict[str, Any] = json.loads(
        rest.partition("</pre>")[0].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
    )
    found["console"] = [line for line in done.stderr.splitlines() if ":CONSOLE" in line]
    return found
