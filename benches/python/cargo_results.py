"""The results of the last ``cargo bench`` in one table, per node or pair where a benchmark has such elements.

Run ``python benches/python/cargo_results.py [--document docs/performance.md]``.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from document import document_option, machine, publish, table

ROOT = Path(__file__).parents[2]
#: What an element of each group is; groups without elements are timed whole.
ELEMENTS = {"elasticity": "node", "RSS assembly": "pair"}
UNITS = (("ns", 1.0), ("us", 1e3), ("ms", 1e6), ("s", 1e9))


def results() -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Return description and estimates of every benchmark, in the order in which they ran."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    files = sorted(target.glob("criterion/**/new/estimates.json"), key=lambda path: path.stat().st_mtime)
    if not files:
        raise SystemExit(f"{target / 'criterion'} holds no results: run `cargo bench` first")
    return [
        (json.loads((file.parent / "benchmark.json").read_text()), json.loads(file.read_text()))
        for file in files
    ]


def duration(nanoseconds: float) -> str:
    """Return a duration in the unit that suits it."""
    unit, size = next((pair for pair in reversed(UNITS) if nanoseconds >= pair[1]), UNITS[0])
    return f"{nanoseconds / size:.3g} {unit}"


def row(benchmark: dict[str, Any], estimates: dict[str, Any]) -> list[str]:
    """Return a line of the table."""
    group = benchmark["group_id"]
    throughput = benchmark["throughput"]
    count = throughput["Elements"] if isinstance(throughput, dict) else 1
    median = estimates["median"]["point_estimate"]
    interval = estimates["median"]["confidence_interval"]
    low, high = (duration(interval[bound] / count) for bound in ("lower_bound", "upper_bound"))
    name = ", ".join(str(part) for part in (benchmark["function_id"], benchmark["value_str"]) if part)
    each = f"{duration(median / count)} per {ELEMENTS[group]}" if group in ELEMENTS else ""
    return [group, name, duration(median), each, f"{low} to {high}"]


def main() -> None:
    """Publish the table."""
    path = document_option("Results of the last cargo bench.")
    head = ("group", "benchmark", "median", "per element", "95 % interval")
    text = "\n\n".join(
        [
            machine(),
            "Medians by criterion, with their 95 % confidence intervals, per element where there is one.",
            table(head, [row(*result) for result in results()]),
        ]
    )
    publish("cargo", text, path)


if __name__ == "__main__":
    main()
