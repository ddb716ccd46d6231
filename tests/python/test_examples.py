"""The documents: their Python blocks and the programs in examples/ run, their links and commands exist."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
PROGRAMS = sorted((ROOT / "examples").glob("*.py"))

FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def blocks(document: Path, language: str) -> list[str]:
    """Return the fenced blocks of a language in a document."""
    found = FENCE.findall(document.read_text(encoding="utf-8"))
    return [text for name, text in found if name == language]


def run(folder: Path, *arguments: str) -> str:
    """Run a Python program in a folder and return what it printed."""
    done = subprocess.run(
        [sys.executable, "-W", "error", *arguments],
        cwd=folder,
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


@pytest.mark.parametrize("document", [path for path in DOCUMENTS if blocks(path, "python")], ids=name_of)
def test_python_blocks_of_a_document_run_one_after_the_other(document: Path, tmp_path: Path) -> None:
    program = tmp_path / "blocks.py"
    program.write_text("\n\n".join(blocks(document, "python")), encoding="utf-8")
    run(tmp_path, str(program))


@pytest.mark.parametrize("program", PROGRAMS, ids=name_of)
def test_example_runs_and_leaves_a_figure(program: Path, tmp_path: Path) -> None:
    assert run(tmp_path, str(program))
    figures = list(tmp_path.glob("*.png"))
    assert figures and all(path.read_bytes().startswith(b"\x89PNG") for path in figures)


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_links_between_documents_lead_to_files(document: Path) -> None:
    targets = LINK.findall(FENCE.sub("", document.read_text(encoding="utf-8")))
    local = [target for target in targets if "://" not in target]
    assert [target for target in local if not (document.parent / target).exists()] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_make_commands_of_a_document_are_in_the_makefile(document: Path) -> None:
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    text = document.read_text(encoding="utf-8")
    named = set(re.findall(r"`make ([\w-]+)`", text))
    for block in blocks(document, "sh"):
        named |= set(re.findall(r"^make ([\w-]+)", block, re.MULTILINE))
    assert named <= targets
