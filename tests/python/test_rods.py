"""Rods: what follows from nodes, edges, material and radius, what is refused, and the shapes there are."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from flagrs import (
    Rod,
)
from flagrs.scene.shapes import frame
from hypothesis import given, settings
from hypothesis import strategies as st
from scene_parts import LINE, SOFT, error_of, fork, rod


def test_a_chain_has_consecutive_edges_and_hinges() -> None:
    assert rod().edge_array().tolist() == [[0, 1], [1, 2], [2, 3]]
    assert rod().hinge_array().tolist() == [[0, 1], [1, 2]]
    assert rod().hinge_nodes().tolist() == [1, 2]
    assert rod().edge_array().dtype == np.int64


def test_a_fork_has_a_hinge_for_every_pair_of_edges() -> None:
    assert fork().hinge_array().tolist() == [[0, 1], [0, 2], [1, 2]]
    assert fork().hinge_nodes().tolist() == [1, 1, 1]


def test_a_hinge_begins_with_the_edge_that_ends_at_its_node() -> None:
    turned = rod(edges=[[1, 2], [0, 1], [2, 3]])
    assert turned.hinge_array().tolist() == [[1, 0], [0, 2]]


def test_stiffnesses_of_a_round_section_follow_from_material_and_radius() -> None:
    made = rod(radius=2e-3)
    assert made.EA_array() == pytest.approx(np.full(3, 1e6 * math.pi * 4e-6), rel=1e-15)
    assert made.EI_array() == pytest.approx(
        np.tile(1e6 * math.pi * 16e-12 / 4 * np.eye(2), (2, 1, 1)), rel=1e-15
    )
    # G = E / 3 at Poisson's ratio 1/2
    assert made.GJ_array() == pytest.approx(np.full(2, 1e6 / 3 * math.pi * 16e-12 / 2), rel=1e-15)


def test_stiffnesses_at_a_hinge_are_means_of_its_two_edges() -> None:
    made = rod(radius=[1e-3, 2e-3, 2e-3])
    expected = 1e6 * math.pi / 4 * np.array([(1e-12 + 16e-12) / 2, 16e-12])
    assert made.EI_array()[:, 0, 0] == pytest.approx(expected, rel=1e-15)
    assert made.GJ_array()[0] / made.GJ_array()[1] == pytest.approx(17 / 32, rel=1e-15)


@pytest.mark.parametrize(
    ("given_stiffness", "expected"),
    [
        (2.0, [2 * np.eye(2), 2 * np.eye(2)]),
        ([2.0, 3.0], [2 * np.eye(2), 3 * np.eye(2)]),
        ([[2.0, 1.0], [1.0, 3.0]], [[[2, 1], [1, 3]]] * 2),
        ([np.eye(2), 5 * np.eye(2)], [np.eye(2), 5 * np.eye(2)]),
    ],
)
def test_bending_stiffness_may_be_a_number_a_matrix_or_one_per_hinge(
    given_stiffness: Any, expected: Any
) -> None:
    assert np.array_equal(rod(EI=given_stiffness).EI_array(), np.array(expected))


def test_the_rest_shape_is_apart_from_the_initial_shape() -> None:
    made = rod(rest_nodes=2.0 * np.array(LINE))
    assert made.rest_lengths() == pytest.approx([0.2, 0.2, 0.2], rel=1e-15)
    assert np.array_equal(made.nodes, LINE)
    assert np.array_equal(rod().rest_array(), LINE)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"nodes": np.zeros((0, 3))}, "nodes"),
        ({"nodes": LINE[:1]}, "nodes"),
        ({"nodes": [*LINE[:2], LINE[1], LINE[3]]}, "nodes[2]"),
        ({"nodes": [*LINE[:2], [0.05, 0.0, 0.0], LINE[3]]}, "nodes[1]"),
        ({"rest_nodes": [*LINE[:2], LINE[1], LINE[3]]}, "rest_nodes[2]"),
        ({"edges": [[0, 1], [1, 2], [2, 4]]}, "edges[2]"),
        ({"edges": [[0, 1], [1, 2], [2, 2]]}, "edges[2]"),
        ({"edges": [[0, 1], [1, 2], [2, 3], [1, 0]]}, "edges[3]"),
        ({"edges": [[0, 1], [1, 2]]}, "nodes[3]"),
        ({"edges": [[0, 1], [1, 2], [-1, 3]]}, "edges"),
        ({"hinges": [[0, 3]]}, "hinges[0]"),
        ({"hinges": [[0, 2]]}, "hinges[0]"),
        ({"hinges": [[0, 0]]}, "hinges[0]"),
        ({"hinges": [[0, 1], [1, 0]]}, "hinges[1]"),
    ],
)
def test_a_rod_that_cannot_be_is_refused_by_name(changes: dict[str, Any], field: str) -> None:
    assert field in [part.field for part in error_of(lambda: rod(**changes)).errors]


def test_antiparallel_edges_are_found_whichever_way_the_edges_run() -> None:
    nodes = [LINE[0], LINE[1], [0.05, 0.0, 0.0], LINE[3]]
    error = error_of(lambda: rod(nodes=nodes, edges=[[1, 0], [1, 2], [3, 2]]))
    assert [part.field for part in error.errors] == ["nodes[1]", "nodes[2]"]
    assert "edges 0 and 1 are antiparallel" in str(error)


@given(st.floats(-12.0, 3.0).map(lambda power: 10.0**power))
@settings(max_examples=30, deadline=None)
def test_no_length_is_too_small_or_too_large_by_itself(scale: float) -> None:
    made = rod(nodes=scale * np.array(LINE), radius=scale * 1e-3)
    assert made.rest_lengths() == pytest.approx(np.full(3, 0.1 * scale), rel=1e-14)


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda d: math.hypot(*d) > 1e-3))
@settings(max_examples=200, deadline=None)
def test_the_frame_about_any_direction_is_right_handed_and_orthonormal(
    direction: tuple[float, float, float],
) -> None:
    axes = np.stack(frame(direction))
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(axes) == pytest.approx(1.0, abs=1e-14)
    assert axes[0] == pytest.approx(np.array(direction) / math.hypot(*direction), abs=1e-14)


def test_the_frame_is_orthonormal_next_to_the_direction_opposite_to_x() -> None:
    for off in (0.0, 1e-12, 1e-9, 1e-6, 1e-4, 2e-3):
        axes = np.stack(frame((-1.0, off, off)))
        assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-14)


@pytest.mark.parametrize(("handedness", "sign"), [("left", -1.0), ("right", 1.0)])
def test_a_helix_has_its_radius_pitch_handedness_and_equal_edges(handedness: Any, sign: float) -> None:
    made = Rod.helix(
        helix_radius=0.01,
        pitch=0.05,
        axial_length=0.1,
        edge_length=2e-3,
        handedness=handedness,
        radius=1e-3,
        material=SOFT,
    )
    x, y, z = made.nodes.T
    assert np.hypot(y, z) == pytest.approx(np.full(len(x), 0.01), rel=1e-14)
    assert x[-1] == pytest.approx(0.1, rel=1e-14)
    assert np.unwrap(np.arctan2(z, y)) == pytest.approx(sign * 2 * math.pi * x / 0.05, abs=1e-12)
    contour = 2 * math.hypot(2 * math.pi * 0.01, 0.05)
    assert len(x) - 1 == int(contour / 2e-3)
    assert made.rest_lengths() == pytest.approx(np.full(len(x) - 1, made.rest_lengths()[0]), rel=1e-12)


def test_a_helix_about_another_axis_is_the_same_helix_turned() -> None:
    size: dict[str, Any] = {"helix_radius": 0.01, "pitch": 0.05, "axial_length": 0.1, "edge_count": 40}
    one = Rod.helix(**size, radius=1e-3, material=SOFT)
    other = Rod.helix(**size, radius=1e-3, material=SOFT, direction=(0.3, -2.0, 1.0), point=(1.0, 2.0, 3.0))
    turn = np.stack(frame((0.3, -2.0, 1.0)))
    assert other.nodes - [1.0, 2.0, 3.0] == pytest.approx(one.nodes @ turn, abs=1e-14)


def test_the_phase_turns_a_helix_right_handed_about_its_axis() -> None:
    for handedness in ("left", "right"):
        made = Rod.helix(
            helix_radius=0.01,
            pitch=0.05,
            axial_length=0.1,
            edge_count=40,
            radius=1e-3,
            material=SOFT,
            handedness=handedness,
            phase=math.pi / 2,
        )
        assert made.nodes[0] == pytest.approx([0.0, 0.0, 0.01], abs=1e-16)


def test_a_straight_rod_takes_either_edge_length_or_edge_count() -> None:
    size: dict[str, Any] = {"length": 0.3, "radius": 1e-3, "material": SOFT}
    # 0.3 / 0.1 is 2.9999999999999996 in floating point
    assert len(Rod.straight(**size, edge_length=0.1).edge_array()) == 3
    assert len(Rod.straight(**size, edge_count=7).edge_array()) == 7
    for both in ({}, {"edge_length": 0.1, "edge_count": 3}):
        assert error_of(lambda both=both: Rod.straight(**size, **both)).field == "edge_length"  # type: ignore[misc]
    for bad in (0, -1, 2.5, True):
        assert error_of(lambda bad=bad: Rod.straight(**size, edge_count=bad)).field == "edge_count"  # type: ignore[misc]


def test_a_straight_rod_can_have_a_curved_rest_shape() -> None:
    bent = np.array(LINE)
    bent[1, 1] = 0.05
    made = Rod.straight(length=0.3, edge_count=3, radius=1e-3, material=SOFT, rest_nodes=bent)
    assert made.rest_lengths()[0] == pytest.approx(math.hypot(0.1, 0.05), rel=1e-14)
