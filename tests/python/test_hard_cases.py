"""Hard cases: each is right within its tolerance, or refused with a clear error where it says so."""

from __future__ import annotations

import pytest
from hard import everything
from hard.case import CASES, HardCase


def marked(case: HardCase) -> object:
    marks = []
    if case.awaited is not None:
        marks.append(pytest.mark.xfail(reason=case.awaited, strict=True))
    if case.slow:
        marks.append(pytest.mark.slow)
    return pytest.param(case, id=case.name, marks=marks)


@pytest.mark.parametrize("case", [marked(case) for case in CASES.values()])
def test_hard_case(case: HardCase) -> None:
    found = case.outcome()
    assert found.verdict in case.expected, f"{found}, expected {case.expected} within {case.tolerance:g}"


def test_every_room_of_hard_cases_is_listed() -> None:
    groups = {case.group for case in CASES.values()}
    assert len(groups) == len(everything.ROOMS)
