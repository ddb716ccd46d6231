"""Scenes: what they derive, what they refuse and how, and that files keep them to the last bit."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import flagrs
import numpy as np
import pytest
from flagrs import (
    Clamp,
    Contact,
    ConvergenceError,
    Fluid,
    Head,
    Material,
    Motor,
    PointLoad,
    Rod,
    Scene,
    SceneError,
    Table,
    rpm,
)
from flagrs.scene import signal_value
from flagrs.scene.shapes import frame
from hypothesis import given, settings
from hypothesis import strategies as st

SOFT = Material(youngs_modulus=1e6, density=1200.0)
LINE = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [0.3, 0.0, 0.0]]
#: A Y: three arms of one edge each that meet at node 1.
FORK = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.1, 0.0], [0.2, -0.1, 0.0]]


def rod(**changes: Any) -> Rod:
    return Rod(**{"nodes": LINE, "radius": 1e-3, "material": SOFT, **changes})


def fork(**changes: Any) -> Rod:
    return rod(nodes=FORK, edges=[[0, 1], [1, 2], [1, 3]], **changes)


def error_of(build: Callable[[], Any]) -> SceneError:
    with pytest.raises(SceneError) as caught:
        build()
    return caught.value


# --- errors -------------------------------------------------------------------------------------------------


def test_an_error_names_field_value_and_what_is_allowed() -> None:
    error = error_of(lambda: Scene(rods=[{"nodes": LINE, "radius": -1e-3, "material": SOFT}]))
    assert str(error) == "rods[0].radius: -0.001 is not allowed; must be > 0 m"
    assert (error.field, error.value, error.allowed) == ("rods[0].radius", -1e-3, "> 0 m")
    assert error.errors == [error]


def test_all_errors_are_listed_at_once() -> None:
    error = error_of(lambda: Material(**{"youngs_modulus": -1.0, "poisson_ratio": 0.7, "densty": 1000.0}))
    assert [part.field for part in error.errors] == ["youngs_modulus", "poisson_ratio", "density", "densty"]
    for part in error.errors:
        assert str(part) in str(error)


def test_an_unknown_option_is_answered_with_the_closest_name() -> None:
    error = error_of(lambda: Fluid(**{"viscosity": 1.0, "twistdrag": False}))
    assert "did you mean 'twist_drag'?" in str(error)


def test_errors_can_be_caught_as_value_errors_and_survive_pickling() -> None:
    error = error_of(lambda: Material(youngs_modulus=-1.0, poisson_ratio=0.7, density=1000.0))
    assert isinstance(error, ValueError) and isinstance(error, flagrs.FlagrsError)
    copy = pickle.loads(pickle.dumps(error))
    assert str(copy) == str(error)
    assert [(part.field, part.value, part.allowed) for part in copy.errors] == [
        (part.field, part.value, part.allowed) for part in error.errors
    ]


def test_a_scene_error_can_be_built_from_a_message_alone() -> None:
    error = SceneError("nothing moves")
    assert str(error) == "nothing moves" and error.field is None and error.errors == [error]


def test_a_convergence_error_keeps_its_numbers_through_pickling() -> None:
    error = ConvergenceError(
        "no", time=1.5, step=7, residual=1e-3, iterations=40, smallest_gap=-1e-5, worst_node=3
    )
    copy: ConvergenceError = pickle.loads(pickle.dumps(error))
    assert vars(copy) == vars(error) and copy.worst_node == 3 and str(copy) == "no"
    assert issubclass(ConvergenceError, ArithmeticError)


# --- numbers and arrays -------------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 0.0, -1.0, "1", None, True, 1j, [1.0, "a"]])
def test_a_radius_that_is_no_positive_finite_number_is_refused(bad: Any) -> None:
    assert error_of(lambda: rod(radius=bad)).field in ("radius", "radius[1]")


@pytest.mark.parametrize("where", [(0, 0), (3, 2)])
@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_position_that_is_not_finite_is_named_by_its_index(where: tuple[int, int], bad: float) -> None:
    nodes = np.array(LINE)
    nodes[where] = bad
    assert error_of(lambda: rod(nodes=nodes)).field == f"nodes[{where[0]}, {where[1]}]"


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("nodes", [[0.0, 0.0], [1.0, 0.0]]),
        ("nodes", [0.0, 1.0, 2.0]),
        ("nodes", [[0.0, 0.0, 0.0], [1.0, 0.0]]),
        ("rest_nodes", LINE[:3]),
        ("radius", [1e-3, 1e-3]),
        ("EA", [1.0, 1.0]),
        ("EI", [1e-6, 1e-6, 1e-6]),
        ("EI", np.eye(3)),
        ("EI", [[1.0, 2.0], [2.0, 1.0]]),
        ("EI", [[1.0, 0.5], [0.0, 1.0]]),
        ("GJ", [1e-6]),
        ("natural_curvature", [0.1]),
        ("natural_curvature", np.zeros((3, 2))),
        ("natural_twist", [0.1, 0.1, 0.1]),
        ("theta", [0.0, 0.0]),
        ("director", [1.0, 0.0, 0.0]),
        ("director", [0.0, 0.0, 0.0]),
        ("immersed", [True, False]),
        ("immersed", 1),
        ("edges", [[0, 1, 2]]),
        ("edges", [[0.5, 1.0]]),
    ],
)
def test_a_value_of_the_wrong_shape_or_kind_is_refused_by_name(field: str, value: Any) -> None:
    found = error_of(lambda: rod(**{field: value})).field
    assert found is not None and found.startswith(field)


def test_arrays_of_a_scene_are_copies_that_cannot_be_written() -> None:
    mine = np.array(LINE)
    made = rod(nodes=mine)
    mine[0, 0] = 5.0
    assert made.nodes[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        made.nodes[0, 0] = 1.0


def test_parts_are_frozen_and_replaced_by_validated_copies() -> None:
    with pytest.raises(ValueError, match="frozen"):
        SOFT.density = 1.0  # type: ignore[misc]
    assert SOFT.replace(density=1000.0).density == 1000.0 and SOFT.density == 1200.0
    assert error_of(lambda: SOFT.replace(density=-1.0)).field == "density"


@pytest.mark.parametrize(
    ("build", "question"),
    [
        (lambda: Material(youngs_modulus=1.255, density=1260.0), "given in MPa or GPa?"),
        (lambda: Material(youngs_modulus=1e6, density=0.99), "given in g/cm^3?"),
        (lambda: Fluid(viscosity=2e4), "given in mPa s?"),
        (lambda: rod(radius=1.0), "looks like millimetres"),
        (lambda: Rod.straight(length=0.1, edge_length=5.0, radius=1e-3, material=SOFT), "given in mm?"),
        (lambda: rod(rest_nodes=1e3 * np.array(LINE)), "in the same unit?"),
    ],
)
def test_a_unit_wrong_by_a_thousand_is_asked_about(build: Callable[[], Any], question: str) -> None:
    assert question in str(error_of(build))


# --- rods ---------------------------------------------------------------------------------------------------


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


# --- signals ------------------------------------------------------------------------------------------------


def test_a_table_is_linear_between_its_instants_and_constant_outside() -> None:
    table = Table(times=[1.0, 3.0], values=[10.0, 30.0])
    assert [signal_value(table, time) for time in (0.0, 1.0, 1.5, 3.0, 9.0)] == [10.0, 10.0, 15.0, 30.0, 30.0]


@pytest.mark.parametrize(
    ("times", "values", "field"),
    [
        ([], [], "times"),
        ([0.0, 0.0], [1.0, 2.0], "times[1]"),
        ([0.0, 2.0, 1.0], [1.0, 2.0, 3.0], "times[2]"),
        ([0.0, 1.0], [1.0], "values"),
        ([0.0, math.nan], [1.0, 2.0], "times[1]"),
        ([0.0, 1.0], [1.0, math.inf], "values[1]"),
    ],
)
def test_a_table_that_is_no_function_of_time_is_refused(times: Any, values: Any, field: str) -> None:
    assert error_of(lambda: Table(times=times, values=values)).field == field


@pytest.mark.parametrize("result", [math.nan, math.inf, "fast", None])
def test_a_function_of_time_must_give_finite_numbers(result: Any) -> None:
    assert "must be a finite number" in str(error_of(lambda: signal_value(lambda time: result, 1.0)))


def test_rpm_is_converted_for_numbers_and_arrays() -> None:
    assert rpm(60.0) == pytest.approx(2 * math.pi, rel=1e-15)
    assert rpm(np.array([0.0, 30.0])) == pytest.approx([0.0, math.pi], rel=1e-15)


# --- the other parts ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("build", "field"),
    [
        (lambda: Motor(node=1, shaft=0), "speed"),
        (lambda: Motor(node=1, shaft=0, speed=1.0, torque=1.0), "speed"),
        (lambda: Motor(node=1, shaft=0, speed=math.nan), "speed"),
        (lambda: Motor(node=-1, shaft=0, speed=1.0), "node"),
        (lambda: Motor(node=1.0, shaft=0, speed=1.0), "node"),
        (lambda: Clamp(), "nodes"),
        (lambda: Clamp(nodes=(0, 0)), "nodes"),
        (lambda: Clamp(nodes=(0,), angular_velocity=1.0), "angular_velocity"),
        (lambda: Clamp(edges=(0,), velocity=(1.0, 0.0, 0.0)), "velocity"),
        (lambda: Clamp(nodes=(-1,)), "nodes"),
        (lambda: PointLoad(node=0, force=(1.0, 2.0)), "force"),
        (lambda: Head(node=1, radius=0.0), "radius"),
        (lambda: Head(node=1, radius=1.0, C_t=-1.0), "C_t"),
        (lambda: Fluid(viscosity=0.0), "viscosity"),
        (lambda: Fluid(viscosity=1.0, model="SBT"), "model"),
        (lambda: Fluid(viscosity=1.0, epsilon="thin"), "epsilon"),
        (lambda: Fluid(viscosity=1.0, epsilon=0.0), "epsilon"),
        (lambda: Fluid(viscosity=1.0, twist_drag=1), "twist_drag"),
        (lambda: Contact(tolerance=0.0), "tolerance"),
        (lambda: Contact(max_iterations=0), "max_iterations"),
        (lambda: Contact(exclusion_factor=-1.0), "exclusion_factor"),
    ],
)
def test_a_part_that_cannot_be_is_refused_by_name(build: Callable[[], Any], field: str) -> None:
    assert error_of(build).field == field


@pytest.mark.parametrize(
    ("epsilon", "expected"), [("slender", math.exp(0.5) * 2e-3), ("seed", 1.031 * 2e-3), (5e-4, 5e-4)]
)
def test_the_regularization_is_chosen_by_name_or_length(epsilon: Any, expected: float) -> None:
    found = Fluid(viscosity=1.0, epsilon=epsilon).epsilon_array(np.full(3, 2e-3))
    assert found == pytest.approx(np.full(3, expected), rel=1e-15)


# --- scenes -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("parts", "field"),
    [
        ({"rods": []}, "rods"),
        ({"head": Head(node=4, radius=1e-2)}, "head.node"),
        ({"head": Head(node=0, radius=1e-2)}, "head.node"),
        ({"head": Head(node=1, radius=1e-2, rod=1)}, "head.rod"),
        ({"rods": [fork()], "head": Head(node=1, radius=1e-2)}, "head.node"),
        ({"motors": [Motor(node=9, shaft=0, speed=1.0)]}, "motors[0].node"),
        ({"motors": [Motor(node=1, shaft=9, speed=1.0)]}, "motors[0].shaft"),
        ({"motors": [Motor(node=1, shaft=2, speed=1.0)]}, "motors[0].shaft"),
        ({"motors": [Motor(node=0, shaft=0, speed=1.0)]}, "motors[0].node"),
        ({"rods": [fork()], "motors": [Motor(node=1, shaft=0, speed=1.0)]}, "motors[0].node"),
        (
            {"motors": [Motor(node=1, shaft=0, speed=1.0), Motor(node=1, shaft=1, speed=1.0)]},
            "motors[1].node",
        ),
        ({"motors": [Motor(node=1, shaft=0, speed=1.0)], "clamps": [Clamp(edges=(0,))]}, "motors[0].shaft"),
        ({"clamps": [Clamp(nodes=(0, 7))]}, "clamps[0].nodes[1]"),
        ({"clamps": [Clamp(edges=(3,))]}, "clamps[0].edges[0]"),
        ({"clamps": [Clamp(nodes=(0,)), Clamp(nodes=(0,), velocity=(1.0, 0.0, 0.0))]}, "clamps[1].nodes"),
        ({"clamps": [Clamp(edges=(0,)), Clamp(edges=(0,), angular_velocity=2.0)]}, "clamps[1].edges"),
        ({"loads": [PointLoad(node=4, force=(0.0, 0.0, 1.0))]}, "loads[0].node"),
        ({"gravity": (0.0, 0.0, math.nan)}, "gravity[2]"),
    ],
)
def test_parts_that_do_not_fit_together_are_refused_by_name(parts: dict[str, Any], field: str) -> None:
    assert error_of(lambda: Scene(**{"rods": [rod()], **parts})).field == field


def test_the_same_clamp_given_twice_is_allowed() -> None:
    assert len(Scene(rods=[rod()], clamps=[Clamp(nodes=(0,)), Clamp(nodes=(0, 1))]).clamps) == 2


def test_a_single_part_stands_for_a_list_of_one() -> None:
    scene = Scene(rods=rod(), clamps=Clamp(nodes=(0,)))
    assert scene.rods == (rod(),) and scene.clamps == (Clamp(nodes=(0,)),)


def test_rods_are_numbered_one_after_the_other() -> None:
    scene = Scene(rods=[rod(), fork(), rod()])
    assert [scene.node_offset(number) for number in range(3)] == [0, 4, 8]
    assert [scene.edge_offset(number) for number in range(3)] == [0, 3, 6]
    assert (scene.node_count, scene.edge_count, scene.hinge_count) == (12, 9, 7)
    assert np.array_equal(scene.node_array()[4:8], FORK)


def full_scene() -> Scene:
    """Return a scene with every part and numbers that no short decimal represents."""
    third = 1.0 / 3.0
    return Scene(
        rods=[
            rod(
                nodes=third * np.array(LINE),
                EI=[[2e-6, third * 1e-6], [third * 1e-6, 1e-6]],
                immersed=[True, False, True],
            ),
            fork(
                rest_nodes=1.1 * np.array(FORK),
                radius=[1e-3, 2e-3, third * 1e-3],
                natural_twist=third,
                name="Y",
            ),
        ],
        fluid=Fluid(viscosity=third, model="RFT", epsilon="seed", density=1000.0),
        head=Head(node=1, radius=third * 1e-2),
        motors=[Motor(node=2, shaft=2, torque=Table(times=[0.0, third], values=[third, 2.0]))],
        clamps=[Clamp(rod=1, nodes=(0,), edges=(0,), angular_velocity=third)],
        loads=[PointLoad(rod=1, node=2, force=(third, 0.0, -1.0))],
        contact=Contact(exclusion_factor=1.0 + third),
        gravity=(0.0, 0.0, -9.81),
        name="everything",
    )


def test_a_scene_survives_toml_and_json_to_the_last_bit(tmp_path: Path) -> None:
    scene = full_scene()
    scene.to_toml(tmp_path / "scene.toml")
    for copy in (Scene.from_toml(tmp_path / "scene.toml"), Scene.from_json(scene.to_json())):
        assert copy == scene and hash(copy) == hash(scene) and copy.digest() == scene.digest()


def test_scenes_that_differ_in_one_bit_are_different() -> None:
    scene = full_scene()
    other = scene.replace(gravity=(0.0, 0.0, -np.nextafter(9.81, 10.0)))
    assert other != scene and other.digest() != scene.digest()


def test_a_function_of_time_cannot_be_written(tmp_path: Path) -> None:
    scene = Scene(rods=[rod()], motors=[Motor(node=1, shaft=0, speed=lambda time: time)])
    for write in (scene.to_json, lambda: scene.to_toml(tmp_path / "scene.toml"), scene.digest):
        error = error_of(write)
        assert error.field == "motors[0].speed" and "flagrs.Table" in str(error)


def toml_scene(tmp_path: Path, text: str) -> Scene:
    path = tmp_path / "scene.toml"
    path.write_text(text)
    return Scene.from_toml(path)


MATERIAL = "material = { youngs_modulus = 1e6, density = 1200 }\n"
HELIX = """
[[rods]]
shape = 'helix'
helix_radius = 0.01
pitch = 0.05
axial_length = 0.1
edge_length = 5e-3
radius = 1e-3
"""


def test_a_toml_rod_may_name_a_shape(tmp_path: Path) -> None:
    scene = toml_scene(tmp_path, HELIX + MATERIAL)
    expected = Rod.helix(
        helix_radius=0.01, pitch=0.05, axial_length=0.1, edge_length=5e-3, radius=1e-3, material=SOFT
    )
    assert scene.rods == (expected,)


def test_a_toml_file_may_name_a_scenario_with_parameters(tmp_path: Path) -> None:
    scene = toml_scene(tmp_path, "scenario = 'robot'\n[parameters]\nrpm = 30.0\nfluid = { model = 'RFT' }\n")
    assert scene == flagrs.scenarios.robot(rpm=30.0, fluid={"model": "RFT"})


@pytest.mark.parametrize(
    ("text", "field"),
    [
        (HELIX.replace("pitch = 0.05", "pitch = -1") + MATERIAL, "rods[0].pitch"),
        (HELIX.replace("helix'", "spiral'") + MATERIAL, "rods[0].shape"),
        (HELIX.replace("pitch = 0.05\n", "") + MATERIAL, "rods[0]"),
        (HELIX + MATERIAL.replace("1e6", "-1"), "rods[0].material.youngs_modulus"),
        (HELIX + "radus = 1\n" + MATERIAL, "rods[0].radus"),
        (HELIX + MATERIAL + "[fluids]\nviscosity = 1.0\n", "fluids"),
        (HELIX + MATERIAL + "[fluid]\nviscosity = '1 Pa s'\n", "fluid.viscosity"),
        ("scenario = 'robott'\n", "scenario"),
        ("scenario = 'robot'\n[parameters]\nrmp = 30.0\n", "rmp"),
        ("scenario = 'robot'\nrpm = 30.0\n", "rpm"),
    ],
)
def test_an_error_in_a_toml_file_names_the_field(tmp_path: Path, text: str, field: str) -> None:
    assert error_of(lambda: toml_scene(tmp_path, text)).field == field


def test_a_file_that_is_not_toml_is_named(tmp_path: Path) -> None:
    assert "scene.toml: not a TOML file" in str(error_of(lambda: toml_scene(tmp_path, "rods = [")))


# --- plans --------------------------------------------------------------------------------------------------


def test_a_plan_counts_degrees_of_freedom_and_names_what_is_active_and_left_out() -> None:
    plan = full_scene().plan()
    # 3 per node, 1 per edge, 1 for the torque motor
    assert plan.dofs == 3 * 8 + 6 + 1
    assert plan.fluid_matrix == 0 and "buoyancy" in plan.terms and "contact" not in plan.left_out
    bare = Scene(rods=[rod()]).plan()
    assert bare.dofs == 4 * 4 - 1
    assert {"fluid", "head", "motors", "contact", "gravity"} <= set(bare.left_out)
    assert "15 degrees of freedom" in str(bare)


def test_a_plan_counts_only_immersed_nodes_in_the_fluid_matrix() -> None:
    scene = Scene(rods=[rod(immersed=[True, False, False])], fluid=Fluid(viscosity=1.0))
    assert scene.plan().fluid_matrix == 3 * 2 and scene.plan().fluid_bytes == 8 * 36


def test_a_plan_warns_of_edges_too_short_for_the_regularization() -> None:
    long, short = (
        Scene(rods=[rod()], fluid=Fluid(viscosity=1.0, epsilon=0.1 / ratio)).plan() for ratio in (1.31, 0.5)
    )
    assert not long.warnings
    warning = short.warnings[0]
    assert "3 immersed edges are shorter than 1.3 times the regularization (down to 0.5" in warning
    assert "condition number about 5e+03" in warning
    assert warning in str(short)
