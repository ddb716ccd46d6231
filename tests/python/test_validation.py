"""The problems of ``flagrs validate``: all pass, and each fails when the number it checks is off."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flagrs import Rod, SceneError, Simulation, fluid
from flagrs.cli import app
from flagrs.validation import PROBLEMS, Check, Outcome, Problem, chosen, solve, validate
from flagrs.validation.problem import Evidence, converging, extrapolated, observed_order
from flagrs.validation.problems import flutter, straining
from flagrs.validation.problems.relaxation import wave_numbers
from flagrs.validation.report import write_report
from flagrs.validation.table import plain
from typer.testing import CliRunner


def failures(outcome: Outcome) -> list[str]:
    """Return what did not pass, with the numbers."""
    bad = [
        f"{c.quantity}: {c.found!r} for {c.expected!r}, order {c.order}"
        for c in outcome.checks
        if not c.passed
    ]
    return [outcome.error, *bad] if outcome.error else bad


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_problem_is_solved_to_its_tolerances_with_quick_settings(name: str) -> None:
    outcome = solve(PROBLEMS[name])
    assert failures(outcome) == []
    assert outcome.passed


@pytest.mark.slow
@pytest.mark.parametrize("name", PROBLEMS)
def test_a_problem_is_solved_to_its_tolerances_with_full_settings(name: str) -> None:
    assert failures(solve(PROBLEMS[name], full=True)) == []


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=list(PROBLEMS))
def test_a_problem_says_what_it_is_where_its_answer_is_from_and_why_its_tolerances(problem: Problem) -> None:
    assert re.fullmatch(r"[A-Z].*\.", problem.about)
    assert problem.source
    assert problem.quick.keys() == problem.full.keys()


# A problem that cannot fail proves nothing: each is solved again with the simulator off by a little.


def stiffer_bending(factor: float) -> Any:
    original = Rod.EI_array
    return lambda rod: factor * original(rod)


def stiffer_twisting(factor: float) -> Any:
    original = Rod.GJ_array
    return lambda rod: factor * original(rod)


@pytest.mark.parametrize(
    "name",
    [
        "cantilever",
        "heavy_cantilever",
        "euler_column",
        "greenhill_column",
        "loaded_strip",
        "heavy_strip",
        "relaxation_rates",
        "vibration_frequencies",
        "relaxation_in_time",
        "localized_buckling",
        "whirling",
        "flutter",
        "buckling_in_extension",
    ],
)
def test_a_bending_stiffness_off_by_half_a_per_cent_is_found(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Rod, "EI_array", stiffer_bending(1.005))
    assert not solve(PROBLEMS[name]).passed


def test_references_of_instabilities_are_the_published_numbers() -> None:
    assert flutter.threshold("tip") == pytest.approx(37.6954, abs=5e-5)
    assert flutter.linear_mode(37.6954, "tip")[0].imag == pytest.approx(191.26, abs=5e-3)
    assert flutter.threshold("distributed") == pytest.approx(76.1021, abs=5e-5)
    assert straining.threshold(0.5) == pytest.approx(153.202, abs=5e-4)


@pytest.mark.parametrize("name", ["loaded_strip", "heavy_strip", "untwisting", "helical_spring"])
def test_a_twisting_stiffness_off_by_half_a_per_cent_is_found(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Rod, "GJ_array", stiffer_twisting(1.005))
    assert not solve(PROBLEMS[name]).passed


@pytest.mark.parametrize(
    "name",
    [
        "torus_axial_drag",
        "spheroid_drags",
        "cylinder_drags",
        "helix_propulsion",
        "cylinder_near_a_wall",
        "helix_near_a_wall",
    ],
)
def test_a_mobility_off_by_a_per_cent_is_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    original = fluid.mobility
    monkeypatch.setattr(fluid, "mobility", lambda *args, **options: 1.01 * original(*args, **options))
    assert not solve(PROBLEMS[name]).passed


def test_flow_of_a_segment_off_in_the_tenth_digit_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    original = fluid.velocity
    off = 1.0 + 2e-10
    monkeypatch.setattr(fluid, "velocity", lambda *args, **options: off * original(*args, **options))
    assert not solve(PROBLEMS["segment_integrals"]).passed


@pytest.mark.parametrize("name", ["friction_on_an_incline", "sinking_ring"])
def test_velocities_off_by_a_thousandth_are_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    velocities, nodes = Simulation.velocities.fget, Simulation.nodes.fget
    assert velocities is not None and nodes is not None
    monkeypatch.setattr(Simulation, "velocities", property(lambda self: 1.001 * velocities(self)))
    monkeypatch.setattr(Simulation, "nodes", property(lambda self: 1.001 * nodes(self)))
    assert not solve(PROBLEMS[name]).passed


# What a check is


def check(**changes: Any) -> Check:
    given: dict[str, Any] = {
        "quantity": "q",
        "found": 1.0,
        "expected": 1.0,
        "tolerance": 1e-3,
        "reason": "r",
    }
    return Check(**(given | changes))


def test_a_check_passes_within_its_tolerance_only() -> None:
    assert check(found=1.0009).passed and check(found=0.9991).passed
    assert not check(found=1.0011).passed and not check(found=0.9989).passed
    assert check(found=-2.001, expected=-2.0).passed and not check(found=-2.003, expected=-2.0).passed
    assert check(found=0.0009, expected=0.0, absolute=True).passed
    assert not check(found=0.0011, expected=0.0, absolute=True).passed


def test_a_check_that_found_no_number_does_not_pass() -> None:
    assert not check(found=np.nan).passed
    assert not check(expected=np.nan).passed
    assert not check(order=np.nan, expected_order=2.0).passed
    assert not check(order=None, expected_order=2.0).passed


def test_a_check_with_the_wrong_order_does_not_pass() -> None:
    assert check(order=1.95, expected_order=2.0).passed
    assert not check(order=1.0, expected_order=2.0).passed
    assert not check(order=3.0, expected_order=2.0).passed


@pytest.mark.parametrize("order", [1.0, 2.0, 4.0])
def test_order_and_limit_of_a_sequence_are_found_whatever_its_limit(order: float) -> None:
    sizes = np.array([0.1, 0.04, 0.025])
    values = 3.0 + 0.7 * sizes**order
    assert observed_order(sizes, values, 17.0) == pytest.approx(order, rel=1e-8)
    assert observed_order(sizes[1:], values[1:], 3.0) == pytest.approx(order, rel=1e-8)
    assert extrapolated(sizes, values, order) == pytest.approx(3.0, rel=1e-12)


def test_a_sequence_that_does_not_converge_has_no_order() -> None:
    sizes = np.array([0.4, 0.2, 0.1])
    for values in ([1.0, 1.1, 1.0], [1.0, 1.0, 1.0], [1.0, 1.1, 1.3]):
        assert np.isnan(observed_order(sizes, np.array(values), 1.0))
    spoilt = converging("q", sizes, np.array([1.0, 1.1, 1.0]), 1.0, tolerance=1.0, reason="r")
    assert not spoilt.passed


def test_a_problem_without_checks_or_with_an_exception_does_not_pass() -> None:
    def broken() -> Evidence:
        raise ZeroDivisionError("on purpose")

    def empty() -> Evidence:
        return Evidence(())

    outcome = solve(Problem("broken", "Breaks.", "none", broken, {}, {}))
    assert not outcome.passed and outcome.error == "ZeroDivisionError: on purpose"
    assert not solve(Problem("empty", "Is empty.", "none", empty, {}, {})).passed


def test_a_name_that_is_no_problem_is_an_error_that_suggests_one() -> None:
    with pytest.raises(SceneError, match=r"capstn: unknown problem; did you mean 'capstan'\?"):
        chosen(["capstn"])


# References


def test_wave_numbers_of_beams_are_those_of_textbooks() -> None:
    assert wave_numbers("clamped, free", 3) == pytest.approx([1.87510, 4.69409, 7.85476], abs=5e-6)
    assert wave_numbers("free, free", 2) == pytest.approx([4.73004, 7.85320], abs=5e-6)
    assert wave_numbers("hinged, free", 1) == pytest.approx([3.92660], abs=5e-6)


# Command and report


def test_the_command_prints_the_table_and_ends_with_zero() -> None:
    result = CliRunner().invoke(app, ["validate", "--only", "euler_column", "--only", "motor_torque"])
    assert result.exit_code == 0
    for word in ("euler_column", "motor_torque", "found", "expected", "deviation", "tolerance", "2.4674011"):
        assert word in result.output
    assert "2 of 2 problems passed" in result.output


def test_the_command_ends_with_one_if_a_check_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Rod, "EI_array", stiffer_bending(1.01))
    result = CliRunner().invoke(app, ["validate", "--only", "euler_column"])
    assert result.exit_code == 1
    assert "failed: euler_column" in result.output and "NO" in result.output


def test_the_command_lists_all_problems() -> None:
    result = CliRunner().invoke(app, ["validate", "--list"])
    assert result.exit_code == 0
    assert all(name in result.output for name in PROBLEMS)


def test_a_report_has_every_check_and_a_figure_of_each_problem(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    outcomes = validate(["relaxation_rates", "motor_torque"])
    text = write_report(tmp_path / "new" / "folder", outcomes, full=False).read_text()
    checks = [check for outcome in outcomes for check in outcome.checks]
    assert len(checks) > 5
    assert all(f"| {check.quantity} |" in text and check.reason in text for check in checks)
    assert "2 of 2 problems passed" in text
    for suffix, magic in (("png", b"\x89PNG"), ("pdf", b"%PDF")):
        image = tmp_path / "new" / "folder" / f"relaxation_rates.{suffix}"
        assert image.read_bytes().startswith(magic)
    assert "![" in text.partition("## relaxation_rates")[2]


def test_a_report_of_a_failure_says_so(tmp_path: Path) -> None:
    def broken() -> Evidence:
        raise ZeroDivisionError("on purpose")

    outcome = solve(Problem("broken", "Breaks.", "none", broken, {}, {}))
    text = write_report(tmp_path, [outcome], full=False).read_text()
    assert "**NO**" in text and "ZeroDivisionError: on purpose" in text


def test_formulas_are_readable_in_a_terminal() -> None:
    assert plain("critical $PL^2/\\sqrt{EI\\,GJ}$") == "critical PL^2/sqrt(EI GJ)"
    assert plain("$\\mu UL$") == "mu UL"
