"""The pictures of docs/results.md: what the viewer, `flagrs plot` and `flagrs movie` show of two runs.

The viewer's are taken by a headless Chromium.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import flagrs
from flagrs.plot import movie
from flagrs.runs import RunSettings, run_to_file

HERE = Path(__file__).parent
RUNS = Path("flagrs-runs/pictures")
FLAGS = (
    "--headless=new --no-sandbox --hide-scrollbars --use-gl=angle --use-angle=swiftshader "
    "--enable-unsafe-swiftshader --virtual-time-budget=8000 --force-device-scale-factor=1"
)


def screenshot(page: str, script: str, path: Path, size: str) -> None:
    """Take a picture of a page after a script has set it up."""
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if browser is None:
        sys.exit("these pictures need a Chromium")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "page.html"
        file.write_text(page.replace("</body>", f"<script>{script}</script></body>"), encoding="utf-8")
        command = [browser, *FLAGS.split(), f"--window-size={size}", f"--screenshot={path}", file.as_uri()]
        subprocess.run(command, check=True, capture_output=True)
    print(path)


def main() -> None:
    """Make the runs, unless they are there, and the pictures."""
    RUNS.mkdir(parents=True, exist_ok=True)
    robot = run_to_file(flagrs.scenarios.robot(), RUNS / "robot.h5", RunSettings(until=100.0)).trajectory
    four = flagrs.scenarios.clamped_flagella(count=4)
    bundle = run_to_file(four, RUNS / "bundle.h5", RunSettings(until=20.0)).trajectory
    choose = "viewer.find('field').value = '{}'; viewer.angle.distance *= {}; viewer.show({});"
    screenshot(robot.view().page, choose.format("filament", 0.86, 660), HERE / "view_robot.png", "1000,560")
    screenshot(bundle.view().page, choose.format("contact", 0.62, 110), HERE / "view_bundle.png", "1000,560")
    with flagrs.plot.printed("page"):
        for name, figure in {
            "plot_flow": flagrs.plot.flow(robot, time=66.0),
            "plot_curvature": flagrs.plot.curvature(robot),
            "plot_bundle": flagrs.plot.bundle(bundle),
        }.items():
            figure.savefig(HERE / f"{name}.png", dpi=130)
            print(HERE / f"{name}.png")
    print(movie(robot, RUNS / "robot.mp4", seconds=4.0))


if __name__ == "__main__":
    main()
