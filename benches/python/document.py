"""Results as Markdown: printed, and put in their place in a document where one is named."""

from __future__ import annotations

import argparse
import os
import platform
import re
from collections.abc import Sequence
from datetime import date
from importlib.metadata import version
from pathlib import Path


def document_option(description: str) -> Path | None:
    """Return the document named on the command line, if any."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--document", type=Path, help="Markdown file whose block of results is replaced")
    path: Path | None = parser.parse_args().document
    return path


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table, numbers to the right."""
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def machine(*packages: str) -> str:
    """Return a line on the processor, the system, its load, and the versions of packages."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    versions = ", ".join(f"{package} {version(package)}" for package in ("flagrs", *packages))
    load = f"; load average {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return (
        f"{date.today()}, {_processor()}, {cores} cores, {platform.system()} {platform.machine()}{load}. "
        f"Python {platform.python_version()}, {versions}."
    )


def _processor() -> str:
    """Return the processor's name, with family and model where the name says little."""
    try:
        facts = dict(re.findall(r"^(.+?)\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE))
        return f"{facts['model name']} (family {facts['cpu family']}, model {facts['model']})"
    except (OSError, KeyError):
        return platform.processor() or "unknown processor"


def publish(name: str, text: str, path: Path | None) -> None:
    """Print results; in the document, put them between the comments ``<!-- name -->`` and ``<!-- /name -->``.

    Raises
    ------
    SystemExit
        If the document does not have these comments.
    """
    print(text)
    if path is None:
        return
    old = path.read_text(encoding="utf-8")
    first, last = f"<!-- {name} -->", f"<!-- /{name} -->"
    if old.count(first) != 1 or old.count(last) != 1:
        raise SystemExit(f"{path} has no place for these results: {first} ... {last}")
    head, rest = old.split(first)
    path.write_text(f"{head}{first}\n{text}\n{last}{rest.split(last)[1]}", encoding="utf-8")
