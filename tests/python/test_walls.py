"""Walls in the flow: images, filaments near them, scenes with them, and what is refused."""

from __future__ import annotations

import flagrs
import numpy as np
import pytest
from flagrs import Contact, Fluid, Head, Material, Motor, Rod, Scene, SceneError, Simulation, Wall, plot
from flagrs.validation import wall_reference

SOFT = Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
FLUID = Fluid(viscosity=1.0, density=0.0)


def helix(height: float) -> Rod:
    """Return a helix along x whose axis is at a height above z = 0."""
    return Rod.helix(
        material=SOFT,
        radius=1.6e-3,
        helix_radius=6.4e-3,
        pitch=40e-3,
        axial_length=80e-3,
        edge_length=5e-3,
        point=(0.0, 0.0, height),
    )


def straight(start: tuple[float, ...], end: tuple[float, ...], edges: int, radius: float = 1e-3) -> Rod:
    """Return a straight rod between two points."""
    return Rod(nodes=np.linspace(start, end, edges + 1), radius=radius, material=SOFT)


def curve(height: float, count: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes (N, 3) and edges of a helix along x above z = 0."""
    turn = np.linspace(0.0, 4.0 * np.pi, count)
    nodes = np.stack([6.4e-3 * turn, 6.4e-3 * np.cos(turn), height + 6.4e-3 * np.sin(turn)], axis=1)
    return nodes, np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)


@pytest.mark.parametrize("height", [9e-3, 0.05])
def test_the_matrix_near_a_wall_is_that_of_an_independent_quadrature(height):
    nodes, edges = curve(height)
    expected = wall_reference.mobility(nodes, edges, 2e-3)
    matrix = flagrs.fluid.mobility(nodes, edges, 2e-3, wall=Wall())
    # The reference integrates a kernel of the width of an edge's half with 144 points.
    assert np.abs(matrix - expected).max() < 1e-11 * np.abs(expected).max()


def test_walls_of_any_place_and_direction_give_the_same_flow():
    nodes, edges = curve(0.02)
    density = np.random.default_rng(1).normal(size=nodes.shape)
    points = nodes[:5] + np.array([0.0, 0.0, 3e-3])
    expected = flagrs.fluid.velocity(points, nodes, edges, density, 1.0, 2e-3, wall=Wall())
    turn, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    shift = np.array([0.3, -0.2, 0.5])
    wall = Wall(point=shift, normal=turn @ [0.0, 0.0, 1.0])
    at, moved, turned = points @ turn.T + shift, nodes @ turn.T + shift, density @ turn.T
    flow = flagrs.fluid.velocity(at, moved, edges, turned, 1.0, 2e-3, wall=wall)
    assert np.abs(flow @ turn - expected).max() < 1e-11 * np.abs(expected).max()


@pytest.mark.parametrize("kind", ["no_slip", "free_surface"])
def test_the_flow_of_segments_keeps_the_condition_on_the_wall(kind):
    nodes, edges = curve(0.01)
    density = np.random.default_rng(1).normal(size=nodes.shape)
    wall, points = Wall(kind=kind), np.random.default_rng(3).normal(size=(40, 3)) * [0.05, 0.02, 0.0]
    flow = flagrs.fluid.velocity(points, nodes, edges, density, 1.0, 2e-3, wall=wall)
    free = flagrs.fluid.velocity(points, nodes, edges, density, 1.0, 2e-3)
    size = np.abs(free).max()
    if kind == "no_slip":
        assert np.abs(flow).max() < 1e-11 * size
        return
    assert np.abs(flow[:, 2]).max() < 1e-11 * size
    step = 1e-5
    above = flagrs.fluid.velocity(
        points + np.array([0, 0, step]), nodes, edges, density, 1.0, 2e-3, wall=wall
    )
    # The shear vanishes on the surface, so the change is of second order in the height, (step / 5 mm)^2.
    assert np.abs(above - flow)[:, :2].max() < 1e-4 * size


def test_a_long_rod_near_a_wall_has_the_drag_of_jeffrey_and_onishi():
    # An infinite cylinder of radius a at the height h, Jeffrey and Onishi, Q. J. Mech. Appl. Math. 34 (1981)
    # 129: force per length over mu U along the axis, across it along the wall, and towards the wall.
    radius, height = 1e-3, 10e-3
    nodes = np.linspace([-0.6, 0.0, height], [0.6, 0.0, height], 301)
    edges = np.stack([np.arange(300), np.arange(1, 301)], axis=1)
    matrix = flagrs.fluid.mobility(nodes, edges, np.sqrt(np.e) * radius, wall=Wall())
    alpha = np.arccosh(height / radius)
    exact = 2 * np.pi / alpha, 4 * np.pi / alpha, 4 * np.pi / (alpha - np.tanh(alpha))
    for axis, expected in enumerate(exact):
        velocity = np.zeros((301, 3))
        velocity[:, axis] = 8 * np.pi
        density = np.linalg.solve(matrix, velocity.ravel()).reshape(-1, 3)
        # Ends are 60 heights away; the slender model errs by the square of a / h.
        assert density[150, axis] == pytest.approx(expected, rel=(radius / height) ** 2)


def test_resistances_are_reciprocal_within_the_mesh_and_larger_near_a_wall():
    apart = []
    for count in (24, 96):
        nodes, edges = curve(0.012, count)
        epsilon = 1e-3
        near = wall_reference.resistance(
            nodes, edges, flagrs.fluid.mobility(nodes, edges, epsilon, wall=Wall()), nodes.mean(axis=0)
        )
        free = wall_reference.resistance(
            nodes, edges, flagrs.fluid.mobility(nodes, edges, epsilon), nodes.mean(axis=0)
        )
        scale = np.sqrt(np.outer(np.diag(near), np.diag(near)))
        apart.append(np.abs((near - near.T) / scale).max())
        assert (np.diag(near) > np.diag(free)).all()
    # Collocation is not symmetric; what is left falls with the mesh.
    assert apart[0] < 0.02
    assert apart[1] < 0.5 * apart[0]


def test_a_simulation_moves_as_the_matrix_near_the_wall_says():
    rod = straight((0, 0, 8e-3), (60e-3, 0, 20e-3), 12, 1e-3)
    scene = Scene(rods=rod, fluid=FLUID.replace(twist_drag=False), walls=Wall())
    edges = rod.edge_array()
    matrix = flagrs.fluid.mobility(rod.nodes, edges, np.sqrt(np.e) * 1e-3, wall=Wall())
    velocity = np.random.default_rng(4).normal(size=rod.nodes.shape)
    density = np.linalg.solve(matrix, 8 * np.pi * velocity.ravel()).reshape(-1, 3)
    force = flagrs.fluid.hat_weights(rod.nodes, edges, density)
    resistance = Simulation(scene, dt=1e-3).resistance()
    assert np.abs(resistance @ velocity.ravel() - force.ravel()).max() < 1e-9 * np.abs(force).max()


def test_a_rod_falls_slower_near_a_wall_and_stays_parallel():
    rod = straight((0, 0, 10e-3), (50e-3, 0, 10e-3), 10, 1e-3)
    speeds = []
    for walls in ((), (Wall(),), (Wall(kind="free_surface"),)):
        scene = Scene(rods=rod, fluid=FLUID, gravity=(0, 0, -9.81), walls=walls)
        simulation = Simulation(scene, dt=1e-4)
        simulation.step(3)
        speeds.append(-simulation.velocities[:, 2].mean())
    assert speeds[1] < 0.7 * speeds[0]
    assert speeds[1] < speeds[2] < speeds[0]


def test_walls_survive_files_and_describe_themselves(tmp_path):
    scene = Scene(
        rods=helix(0.03),
        fluid=FLUID,
        walls=[
            Wall(point=(0, 0, -0.01), normal=(0.1, 0, 3)),
            Wall(point=(0, 0, 2), normal=(0, 0, -1), kind="contact"),
        ],
        contact=Contact(),
    )
    scene.to_toml(tmp_path / "scene.toml")
    assert Scene.from_toml(tmp_path / "scene.toml") == scene
    assert "no-slip wall" in str(scene.plan()) and "wall for contact alone" in str(scene.plan())
    assert "may pass through" in str(scene.replace(contact=None).plan())


def test_a_run_near_a_wall_goes_on_from_its_checkpoint_to_the_last_bit(tmp_path):
    scene = Scene(
        rods=helix(0.009), fluid=FLUID, gravity=(0, 0, -9.81), walls=Wall(), contact=Contact(friction=0.3)
    )
    simulation = Simulation(scene, dt=1e-3)
    simulation.step(5)
    simulation.checkpoint(tmp_path / "state.h5")
    simulation.step(5)
    again = Simulation.restore(tmp_path / "state.h5")
    again.step(5)
    assert (again.nodes == simulation.nodes).all()


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"fluid": Fluid(viscosity=1.0, model="RFT")}, "fluid.model"),
        ({"walls": (Wall(), Wall(point=(0, 0, 1), normal=(0, 0, -1)))}, "walls[1].kind"),
        ({"walls": Wall(point=(0, 0, 2.2e-3))}, "rods[0].nodes"),
        ({"walls": Wall(point=(0, 0, 1.0))}, "rods[0].nodes"),
        ({"contact": Contact(method="spillmann-teschner")}, "contact.method"),
        ({"fluid": Fluid(viscosity=1.0, far_field_nodes=0)}, "fluid.far_field_nodes"),
        ({"head": Head(node=5, radius=10e-3)}, "head"),
        (
            {"fluid": Fluid(viscosity=1.0, background=flagrs.LinearFlow.uniform((1, 0, 0)))},
            "fluid.background[0]",
        ),
        (
            {"fluid": Fluid(viscosity=1.0, background=flagrs.LinearFlow.shear(1.0, across=(0, 1, 0)))},
            "fluid.background[0]",
        ),
    ],
)
def test_what_walls_do_not_allow_is_said(changes, field):
    scene = Scene(rods=helix(0.01), fluid=Fluid(viscosity=1.0), walls=Wall())
    with pytest.raises(SceneError) as error:
        scene.replace(**changes)
    assert error.value.field.startswith(field), error.value


@pytest.mark.parametrize(
    "flow",
    [
        flagrs.LinearFlow.shear(1.0, across=(0, 0, 1)),
        flagrs.LinearFlow(
            velocity=(2.0, 0, 0), gradient=[[0, 0, 1.0], [0, 0, 0], [0, 0, 0]], center=(0, 0, 2)
        ),
        flagrs.PoiseuilleFlow(speed=1.0, radius=0.5, normal=(0, 0, 1), center=(0, 0, 0.5)),
    ],
)
def test_flows_that_rest_on_the_wall_are_taken(flow):
    Scene(rods=helix(0.01), fluid=Fluid(viscosity=1.0, background=flow), walls=Wall())


def test_a_rod_without_contact_that_reaches_the_wall_is_an_error_in_words():
    rod = straight((0, 0, 4e-3), (20e-3, 0, 4e-3), 4, 1e-3)
    scene = Scene(
        rods=rod,
        fluid=Fluid(viscosity=1e-3, density=0.0),
        walls=Wall(),
        loads=flagrs.PointLoad(node=0, force=(0, 0, -1e-2)),
    )
    simulation = Simulation(scene, dt=1e-2)
    with pytest.raises(flagrs.ConvergenceError, match="behind the wall"):
        simulation.step(200)


def test_motors_near_a_wall_do_not_disturb_the_balance_of_forces():
    robot = flagrs.scenarios.robot(contact=False)
    scene = robot.replace(head=None, walls=Wall(point=(0, 0, -0.05)))
    assert isinstance(scene.motors[0], Motor)
    simulation = Simulation(scene, dt=1e-2)
    simulation.step(5)
    assert simulation.statistics["force_imbalance"] < 1e-6


def test_a_run_near_a_wall_draws_its_flow_with_nothing_behind_the_wall():
    rod = straight((0, 0, 3e-3), (20e-3, 0, 5e-3), 4)
    scene = Scene(rods=rod, fluid=FLUID, gravity=(0, 0, -9.81), walls=Wall())
    trajectory = Simulation(scene, dt=1e-3).run(until=2e-3, save_every=1e-3)
    with pytest.raises(SceneError, match="from the wall"):
        trajectory.flow([[0.0, 0.0, -1e-3]])
    assert np.abs(trajectory.flow([[5e-3, 0.0, 0.0]])).max() < 1e-9 * np.abs(trajectory.flow(rod.nodes)).max()
    plot.flow(trajectory, plane="xz", points=12)
