"""Bundles: no accepted state lets filaments through, whatever their number; two contact methods agree."""

from __future__ import annotations

from typing import Any

import flagrs
import numpy as np
import pytest

DIAMETER = 2e-3
HELIX_RADIUS = 10e-3


def smallest_gap(simulation: flagrs.Simulation, until: float) -> tuple[float, int]:
    """Step to a time; return the smallest gap of all accepted steps over the diameter, and the most pairs."""
    gap, contacts = np.inf, 0
    while simulation.time < until:
        simulation.step()
        gap = min(gap, simulation.minimum_gap)
        contacts = max(contacts, len(simulation.contact_forces()[1]))
    return gap / DIAMETER, contacts


@pytest.mark.parametrize(("count", "until"), [(2, 16.0), (3, 9.0), (5, 8.5)])
def test_clamped_flagella_wrap_without_passing_through_each_other(count: int, until: float) -> None:
    simulation = flagrs.Simulation(flagrs.scenarios.clamped_flagella(count=count), rtol=1e-2)
    gap, contacts = smallest_gap(simulation, until)
    assert contacts >= 5
    assert -0.05 < gap < 0.05
    assert simulation.statistics["steps"] < 100 * until


@pytest.mark.parametrize("tolerance", [0.02, 0.2])
def test_the_tolerance_is_kept(tolerance: float) -> None:
    scene = flagrs.scenarios.clamped_flagella(contact={"tolerance": tolerance})
    gap, contacts = smallest_gap(flagrs.Simulation(scene, rtol=1e-2), 9.0)
    assert contacts >= 5
    assert -tolerance < gap < tolerance


def test_steps_of_any_length_keep_flagella_apart() -> None:
    # A turn of 1.5 rad a step: inaccurate, and safe. From rest such steps damp the bundling itself, so that
    # nothing meets; they begin where short ones have led to.
    simulation = flagrs.Simulation(flagrs.scenarios.clamped_flagella(), dt=0.02)
    met, _ = smallest_gap(simulation, 3.3)
    simulation.dt = 0.1
    gap, contacts = smallest_gap(simulation, 6.0)
    assert contacts > 0
    assert min(met, gap) > -0.05


def test_the_robot_whose_flagella_touch_swims_on() -> None:
    scene = flagrs.scenarios.robot(normalized_pitch=5.0, rpm=50.0)
    simulation = flagrs.Simulation(scene, rtol=1e-2)
    gap = np.inf
    while simulation.time < 30.0:
        simulation.step()
        gap = min(gap, simulation.minimum_gap)
    diameter = 2.0 * float(scene.rods[0].radius_array().min())
    assert -0.05 < gap / diameter < 0.05


def run(contact: dict[str, Any] | bool, rtol: float, until: float) -> np.ndarray[Any, Any]:
    scene = flagrs.scenarios.clamped_flagella(contact=contact)
    return flagrs.Simulation(scene, rtol=rtol).run(until, until, path=False).nodes[-1]


def test_both_methods_and_tolerances_lead_to_the_same_bundle() -> None:
    barrier = run({}, 1e-4, 4.5)
    passes = run({"method": "spillmann-teschner"}, 1e-4, 4.5)
    tight = run({"tolerance": 0.02}, 1e-4, 4.5)
    free = run(False, 1e-4, 4.5)
    apart = [np.linalg.norm(barrier - other, axis=1).max() / HELIX_RADIUS for other in (passes, tight, free)]
    # The tolerance itself is worth a hundredth of the helix radius; a bundle without contact is another one.
    assert apart[0] < 0.02
    assert apart[1] < 0.02
    assert apart[2] > 0.1


def test_errors_in_contact_fall_with_the_error_asked_for() -> None:
    reference = run({}, 1e-5, 4.5)
    errors = [np.linalg.norm(run({}, rtol, 4.5) - reference, axis=1).max() for rtol in (1e-2, 1e-3, 1e-4)]
    assert errors[1] < 0.5 * errors[0]
    assert errors[2] < 0.5 * errors[1]
    assert errors[2] < 1e-2 * HELIX_RADIUS
