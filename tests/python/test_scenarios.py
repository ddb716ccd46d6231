"""Scenarios: the robot and the benchmark as the tables give them, and what the registry refuses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from flagrs import Contact, Fluid, Scene, SceneError, scenarios

ROBOT_RADIUS = 6.36e-3


@pytest.mark.parametrize(("pitch", "nodes"), [(5.0, 69), (7.0, 59), (9.0, 55)])
def test_the_robot_has_the_published_number_of_nodes_for_each_pitch(pitch: float, nodes: int) -> None:
    assert scenarios.robot(normalized_pitch=pitch).node_count == nodes


@pytest.mark.parametrize(
    ("edge_length", "nodes"), [(9e-3, 37), (8e-3, 41), (7e-3, 45), (6e-3, 51), (5e-3, 59), (4e-3, 73)]
)
def test_the_robot_has_the_published_number_of_nodes_for_each_mesh(edge_length: float, nodes: int) -> None:
    assert scenarios.robot(edge_length=edge_length).node_count == nodes


def test_the_robots_head_region_is_laid_out_as_in_the_table() -> None:
    scene = scenarios.robot()
    millimetres = 1e3 * scene.rods[0].nodes[25:34]
    expected = [
        [10, -14 + 6.36, 0],
        [10, -14, 0],
        [5, -14, 0],
        [0, -14, 0],
        [0, 0, 0],
        [0, 14, 0],
        [5, 14, 0],
        [10, 14, 0],
        [10, 14 + 6.36, 0],
    ]
    assert millimetres == pytest.approx(np.array(expected), abs=1e-12)
    assert scene.head is not None and scene.head.node == 29
    assert [(motor.node, motor.shaft) for motor in scene.motors] == [(27, 26), (31, 31)]


def test_both_flagella_are_left_handed_helices_of_the_published_size() -> None:
    rod = scenarios.robot().rods[0]
    for nodes, y in ((rod.nodes[25::-1], -14e-3), (rod.nodes[33:], 14e-3)):
        s = np.linspace(0.0, 95.4e-3 / (7 * ROBOT_RADIUS) * 2 * math.pi, 26)
        b = 7 * ROBOT_RADIUS / (2 * math.pi)
        expected = np.stack([10e-3 + b * s, y + ROBOT_RADIUS * np.cos(s), -ROBOT_RADIUS * np.sin(s)], axis=1)
        assert nodes == pytest.approx(expected, abs=1e-15)


def test_the_fluid_acts_on_the_robot_from_the_axis_points_outwards() -> None:
    rod = scenarios.robot().rods[0]
    # 25 helix edges and the radial one, six in the head, and the same again
    assert rod.immersed_array().tolist() == [True] * 26 + [False] * 6 + [True] * 26
    assert np.array_equal(rod.colliding_array(), rod.immersed_array())


def test_the_robots_numbers_are_those_of_the_table() -> None:
    scene = scenarios.robot(rpm=30.0)
    rod, fluid, head = scene.rods[0], scene.fluid, scene.head
    assert fluid is not None and head is not None
    assert (rod.material.youngs_modulus, rod.material.poisson_ratio, rod.material.density) == (
        1.255e6,
        0.5,
        1260.0,
    )
    assert (rod.radius, fluid.viscosity, fluid.epsilon, fluid.twist_drag) == (1.6e-3, 1.0, 1.65e-3, True)
    assert (head.radius, head.C_t, head.C_r, head.mass) == (31e-3, 4.1, 0.9, 0.0)
    assert [motor.speed for motor in scene.motors] == [math.pi, math.pi]
    assert scene.contact == Contact() and rod.rest_nodes is None


@pytest.mark.parametrize("scale", [1e-3, 1e-6, 1e-9, 1e3])
@pytest.mark.parametrize("edge_length", [9e-3, 5e-3, 3.5e-3])
def test_a_scaled_robot_is_the_same_robot(scale: float, edge_length: float) -> None:
    large = scenarios.robot(edge_length=edge_length)
    small = scenarios.robot(edge_length=edge_length, scale=scale)
    assert small.rods[0].nodes / scale == pytest.approx(large.rods[0].nodes, rel=1e-14, abs=1e-17)
    assert small.head is not None and small.head.radius == pytest.approx(31e-3 * scale, rel=1e-15)
    assert small.fluid is not None and small.fluid.epsilon == pytest.approx(1.65e-3 * scale, rel=1e-15)
    assert small.plan().dofs == large.plan().dofs


def test_each_motor_can_have_a_speed_of_its_own() -> None:
    assert [motor.speed for motor in scenarios.robot(rpm=(30.0, -60.0)).motors] == pytest.approx(
        [math.pi, -2 * math.pi], rel=1e-15
    )


@pytest.mark.parametrize("count", [1, 2, 3, 5, 10])
def test_the_benchmark_has_68_nodes_for_each_flagellum(count: int) -> None:
    scene = scenarios.clamped_flagella(count)
    assert [len(rod.nodes) for rod in scene.rods] == [68] * count
    for number, clamp in enumerate(scene.clamps):
        assert (clamp.rod, clamp.nodes, clamp.edges, clamp.angular_velocity) == (number, (0, 1), (0,), -15.0)


@pytest.mark.parametrize("count", [2, 3, 5, 10])
def test_the_benchmarks_flagella_are_on_a_regular_polygon_with_sides_of_30_mm(count: int) -> None:
    roots = np.array([rod.nodes[0] for rod in scenarios.clamped_flagella(count).rods])
    assert np.ptp(roots[:, 0]) == 0.0
    assert roots[:, 1:].mean(axis=0) == pytest.approx([0.0, 0.0], abs=1e-15)
    sides = np.linalg.norm(roots - np.roll(roots, 1, axis=0), axis=1)
    assert sides == pytest.approx(np.full(count, 30e-3), rel=1e-12)


def test_a_benchmark_flagellum_is_laid_out_as_published() -> None:
    nodes = scenarios.clamped_flagella(1).rods[0].nodes
    contour = 4 * math.hypot(2 * math.pi * 10e-3, 50e-3)
    assert nodes[:4] == pytest.approx(
        np.array([[-contour / 64 - 10e-3, 0, 0], [-10e-3, 0, 0], [-5e-3, 5e-3, 0], [0, 10e-3, 0]]), abs=1e-16
    )
    s = np.linspace(0.0, 8 * math.pi, 65)
    helix = np.stack([50e-3 * s / (2 * math.pi), 10e-3 * np.cos(s), 10e-3 * np.sin(s)], axis=1)
    assert nodes[3:] == pytest.approx(helix, abs=1e-15)


def test_the_cantilever_is_clamped_with_an_edge_centred_on_the_wall() -> None:
    scene = scenarios.cantilever(edge_count=10, normalized_load=2.0)
    x = scene.rods[0].nodes[:, 0]
    assert (x[0] + x[1]) / 2 == pytest.approx(0.0, abs=1e-17)
    assert x[-1] == pytest.approx(0.1, rel=1e-14)
    stiffness = scene.rods[0].EI_array()[0, 0, 0]
    assert -scene.loads[0].force[2] * 0.1**2 / stiffness == pytest.approx(2.0, rel=1e-14)


def test_the_relaxing_rod_is_bent_without_stretching() -> None:
    rod = scenarios.relaxing_rod(turn=3.0).rods[0]
    lengths = np.linalg.norm(np.diff(rod.nodes, axis=0), axis=1)
    assert lengths == pytest.approx(rod.rest_lengths(), rel=1e-13)
    assert np.linalg.norm(np.diff(rod.rest_array(), axis=0, n=2)) < 1e-15


def test_the_ring_is_closed_and_carries_michells_twist_and_ten_per_cent() -> None:
    rod = scenarios.twisted_ring().rods[0]
    assert rod.edge_array()[-1].tolist() == [59, 0]
    assert len(rod.hinge_array()) == 60 and rod.hinge_array()[0].tolist() == [59, 0]
    ratio = rod.EI_array()[0, 0, 0] / rod.GJ_array()[0]
    assert rod.natural_twist is not None
    assert -60 * rod.natural_twist == pytest.approx(1.1 * 2 * math.pi * math.sqrt(3) * ratio, rel=1e-12)


def test_every_scenario_is_listed_with_a_sentence_and_can_be_built_and_kept() -> None:
    listed = scenarios.list()
    assert {"robot", "clamped_flagella", "cantilever", "relaxing_rod", "straight_rod", "twisted_ring"} == set(
        listed
    )
    for name, sentence in listed.items():
        scene = scenarios.build(name)
        assert scene.name == name and sentence.endswith(".") and not scene.plan().warnings
        assert Scene.from_json(scene.to_json()) == scene


@pytest.mark.parametrize("name", ["robot", "clamped_flagella", "cantilever"])
def test_fluid_and_contact_can_be_overridden_whole_or_in_part(name: str) -> None:
    honey = Fluid(viscosity=10.0, model="RFT")
    assert scenarios.build(name, {"fluid": honey}).fluid == honey
    default = scenarios.build(name).fluid
    assert default is not None
    assert scenarios.build(name, {"fluid": {"viscosity": 3.0}}).fluid == default.replace(viscosity=3.0)
    assert scenarios.build(name, {"contact": False}).contact is None
    assert scenarios.build(name, {"contact": {"tolerance": 0.05}}).contact == Contact(tolerance=0.05)


@pytest.mark.parametrize("fluid", [None, Fluid(viscosity=1.0)])
def test_twist_drag_is_off_where_the_argument_says_so(fluid: Any) -> None:
    scene = scenarios.robot(twist_drag=False, fluid=fluid)
    assert scene.fluid is not None and scene.fluid.twist_drag is False


@pytest.mark.parametrize(
    ("name", "options", "field"),
    [
        ("robot", {"flagella": 3}, "flagella"),
        ("robot", {"edge_length": 5.0}, "edge_length"),
        ("robot", {"edge_length": -5e-3}, "edge_length"),
        ("robot", {"edge_length": math.nan}, "edge_length"),
        ("robot", {"normalized_pitch": 0.0}, "normalized_pitch"),
        ("robot", {"scale": -1.0}, "scale"),
        ("robot", {"rpm": (1.0, 2.0, 3.0)}, "rpm"),
        ("robot", {"rpm": "fast"}, "rpm"),
        ("robot", {"rpm": math.inf}, "rpm"),
        ("robot", {"fluid": {"viscosty": 1.0}}, "fluid.viscosty"),
        ("robot", {"fluid": 1.0}, "fluid"),
        ("robot", {"contact": 1}, "contact"),
        ("robot", {"C_t": -1.0}, "C_t"),
        ("clamped_flagella", {"count": 0}, "count"),
        ("clamped_flagella", {"angular_velocity": math.nan}, "angular_velocity"),
        ("twisted_ring", {"edge_count": 2}, "edge_count"),
        ("relaxing_rod", {"turn": 7.0}, "turn"),
        ("cantilever", {"normalized_load": math.nan}, "normalized_load"),
        ("robot", {"edge_lenght": 5e-3}, "edge_lenght"),
        ("robto", {}, "scenario"),
    ],
)
def test_a_parameter_that_cannot_be_is_refused_by_name(
    name: str, options: dict[str, Any], field: str
) -> None:
    with pytest.raises(SceneError) as caught:
        scenarios.build(name, options)
    assert field in [error.field for error in caught.value.errors]
