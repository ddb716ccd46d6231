"""Whether this installation works, and what it is made of."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from flagrs import _flagrs, scenarios
from flagrs.processors import usable_processors
from flagrs.simulation import Simulation
from flagrs.version import installed_version

_PACKAGES = ("numpy", "scipy", "h5py", "pydantic", "matplotlib")


def report() -> dict[str, str]:
    """Return versions, machine and native build, by name."""
    lines = {
        "flagrs": installed_version(),
        "python": f"{platform.python_version()} on {platform.system()} {platform.machine()}",
        "native module": _flagrs.__version__,
        "processors": f"{usable_processors()} usable of {os.cpu_count()}",
        "vector units": _vector_units(),
        "threads": f"{_flagrs.thread_count()} (FLAGRS_THREADS {os.environ.get('FLAGRS_THREADS', 'not set')})",
    }
    for package in _PACKAGES:
        try:
            lines[package] = version(package)
        except PackageNotFoundError:
            lines[package] = "not installed"
    return lines


def _vector_units() -> str:
    """Return which of the vector instructions that matter here the processor has."""
    listing = Path("/proc/cpuinfo")
    if not listing.exists():
        return "unknown: only Linux lists them"
    words = set(listing.read_text().split())
    return " ".join(unit for unit in ("sse4_2", "avx2", "fma", "avx512f", "asimd") if unit in words) or "none"


def smoke_run() -> str:
    """Run the robot for a moment and return what came out; an installation that does not work raises."""
    simulation = Simulation(scenarios.robot(), threads=1)
    trajectory = simulation.run(0.2, 0.1, path=False)
    return f"{len(trajectory)} frames of {trajectory.nodes.shape[1]} nodes"
