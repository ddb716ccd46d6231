"""Scenes: what they derive, what they refuse and how, and what their plans say."""

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
from scene_parts import FORK, LINE, SOFT, error_of, fork, full_scene, rod

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
    ("epsilon", "expected"), [("slender", math.exp(0.5) * 2e-3), ("lim-et-al", 1.031 * 2e-3), (5e-4, 5e-4)]
)
def test_the_regularization_is_chosen_by_name_or_length(epsilon: Any, expected: float) -> None:
    found = Fluid(viscosity=1.0, epsilon=epsilon).epsilon_array(np.full(3, 2e-3))
    assert found == pytest.approx(np.full(3, expected), rel=1e-15)


def test_the_former_name_of_a_regularization_is_understood_with_a_warning(tmp_path: Path) -> None:
    with pytest.warns(DeprecationWarning, match="now called 'lim-et-al'"):
        former = Fluid(viscosity=1.0, epsilon="seed")  # type: ignore[arg-type]
    assert former == Fluid(viscosity=1.0, epsilon="lim-et-al") and former.epsilon == "lim-et-al"
    path = tmp_path / "scene.toml"
    Scene(rods=[rod()], fluid=former).to_toml(path)
    path.write_text(path.read_text().replace("lim-et-al", "seed"))
    with pytest.warns(DeprecationWarning, match="epsilon='seed'"):
        assert Scene.from_toml(path) == Scene(rods=[rod()], fluid=former)


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
