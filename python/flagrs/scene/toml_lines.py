"""On which line of a TOML file each value stands, so that errors can say it."""

from __future__ import annotations

import re

_KEY = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
_DOTTED = rf"{_KEY}(?:\s*\.\s*{_KEY})*"
_TABLE = re.compile(rf"\s*\[\s*({_DOTTED})\s*\]")
_LISTED = re.compile(rf"\s*\[\[\s*({_DOTTED})\s*\]\]")
_ENTRY = re.compile(rf"\s*({_DOTTED})\s*=")
#: What a value may hold that hides brackets: strings of four kinds, and comments.
_HIDDEN = re.compile(
    r'"""(?:\\.|[^\\])*?"""|' + r"'''.*?'''|" + r'"(?:\\.|[^"\\\n])*"|' + r"'[^'\n]*'|#[^\n]*", re.S
)


def lines_of(text: str) -> dict[str, int]:
    """Return the line of every table and key in a TOML text that parses, by path such as ``rods[0].radius``.

    What stands within a list or an inline table has no line of its own.
    """
    plain = _HIDDEN.sub(lambda found: _blank(found.group()), text)
    found: dict[str, int] = {}
    counts: dict[str, int] = {}
    prefix, depth = "", 0
    # Keys may be quoted, so they are read from the text; brackets and strings are counted in the blanked
    # copy.
    for number, (line, shown) in enumerate(zip(text.split("\n"), plain.split("\n"), strict=True), start=1):
        if depth == 0 and shown.strip():
            if listed := _LISTED.match(line):
                prefix = _path(listed[1], counts, listed=True)
                found.setdefault(prefix, number)
            elif table := _TABLE.match(line):
                prefix = _path(table[1], counts)
                found.setdefault(prefix, number)
            elif entry := _ENTRY.match(line):
                parts = _parts(entry[1])
                path = prefix
                for part in parts:
                    path = f"{path}.{part}" if path else part
                    found.setdefault(path, number)
                value = shown[shown.index("=") + 1 :] if "=" in shown else ""
                depth = _depth(value)
            continue
        depth += _depth(shown)
    return found


def line_of(lines: dict[str, int], field: str) -> int | None:
    """Return the line of a field, or of the innermost thing around it that has one."""
    while field:
        if field in lines:
            return lines[field]
        cut = max(field.rfind("."), field.rfind("["))
        field = field[:cut] if cut > 0 else ""
    return None


def _blank(hidden: str) -> str:
    """Return what takes the place of a string or comment: as many lines, and no brackets."""
    return "\n" * hidden.count("\n") or ("" if hidden.startswith("#") else "_")


def _depth(text: str) -> int:
    return sum(text.count(mark) for mark in "[{") - sum(text.count(mark) for mark in "]}")


def _parts(dotted: str) -> list[str]:
    return [key.strip().strip("\"'") for key in re.findall(_KEY, dotted)]


def _path(dotted: str, counts: dict[str, int], listed: bool = False) -> str:
    """Return the path of a table's header; a list of tables stands for its last one so far."""
    path = ""
    parts = _parts(dotted)
    for place, part in enumerate(parts):
        path = f"{path}.{part}" if path else part
        if listed and place == len(parts) - 1:
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path = f"{path}[{counts[path]}]"
    return path
