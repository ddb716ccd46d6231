"""Near pairs are searched for only once in several steps."""

from __future__ import annotations

import flagrs


def test_most_steps_search_nothing() -> None:
    simulation = flagrs.Simulation(flagrs.scenarios.clamped_flagella(), rtol=1e-3)
    while simulation.time < 5.0:
        simulation.step()
    counts = simulation.statistics
    assert 0 < counts["contact_searches"] < 0.3 * counts["steps"]
