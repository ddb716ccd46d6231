"""Makes hard.md: every hard case of the tests, what came of it, and how long it took.

Run with ``python docs/validation/make_hard_cases.py`` (some minutes on one core). The cases are those of
tests/python/hard, which the tests hold to the same tolerances.
"""

from __future__ import annotations

import platform
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "python"))

from hard import everything  # noqa: E402
from hard.case import CASES, HardCase, Outcome  # noqa: E402

PAGE = Path(__file__).with_name("hard.md")

HEAD = """# Hard cases

Scenes at the edge of what is allowed.
Each is compared with something that does not come from the same computation:
a closed form, an invariance, scipy, the same part alone, a run in much smaller steps.
`python docs/validation/make_hard_cases.py` makes this page from `tests/python/hard`;
`tests/python/test_hard_cases.py` holds every case to the tolerance given here.

A case is *right* if its error is within the tolerance, or *refused* if it ends in a clear error.
Where the column says *wrong* or *unclear* (an error whose text says nothing useful), the reason is below
the table, and the test of the case fails as soon as that is mended.
"""


def row(case: HardCase, found: Outcome) -> str:
    """Return a line of a table."""
    error = "" if np.isnan(found.error) else f"{found.error:.1e}"
    allowed = "" if np.isnan(case.tolerance) else f"{case.tolerance:.0e}"
    return f"| {case.name} | {case.against} | {found.verdict} | {error} | {allowed} | {found.seconds:.2f} |"


def main() -> None:
    """Run all cases and write the page."""
    assert everything.ROOMS
    parts = [HEAD]
    found = {name: case.outcome() for name, case in CASES.items()}
    verdicts = [outcome.verdict for outcome in found.values()]
    counts = ", ".join(f"{verdicts.count(verdict)} {verdict}" for verdict in sorted(set(verdicts)))
    parts.append(
        f"{len(CASES)} cases: {counts}.\n"
        f"Times are in seconds on one core of {processor()}, with others at work."
    )
    for group in dict.fromkeys(case.group for case in CASES.values()):
        cases = [case for case in CASES.values() if case.group == group]
        lines = [
            f"## {group}\n",
            "| case | against | outcome | error | allowed | s |",
            "|---|---|---|---|---|---|",
        ]
        lines += [row(case, found[case.name]) for case in cases]
        reasons = {case.awaited for case in cases if case.awaited is not None}
        if reasons:
            lines += ["", *(f"Not right yet: {reason}." for reason in sorted(reasons))]
        refused = [case for case in cases if found[case.name].verdict == "refused"]
        if refused:
            lines += ["", "What is refused, in the words of the error:", ""]
            lines += [f"* {case.name}: `{found[case.name].message}`" for case in refused]
        parts.append("\n".join(lines))
    PAGE.write_text("\n\n".join(part.strip() for part in parts) + "\n", encoding="utf-8")
    unexpected = [name for name, case in CASES.items() if found[name].verdict not in case.expected]
    print(f"{counts}; not as wanted: {', '.join(unexpected) or 'none'}")


def processor() -> str:
    """Return the name of the processor."""
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
