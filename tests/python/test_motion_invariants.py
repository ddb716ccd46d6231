"""Motion: rest, frames of reference, units of length, the balance of forces, and where the schemes agree."""

from __future__ import annotations

import numpy as np
import pytest
from flagrs import Fluid, Material, Rod, Scene, Simulation, scenarios
from flagrs.default_step import default_step
from rod_motion import disturbance_grows, imbalance, linear_limit, moved, soft_helix
from rod_statics import settle
from scipy.spatial.transform import Rotation

SCHEMES = {"overdamped": 1e-2, "implicit": 1e-2, "explicit": 1e-4}
ROTATION = Rotation.from_rotvec([0.7, -1.9, 0.4]).as_matrix()
SHIFT = np.array([0.03, -0.05, 0.02])


def resting_helix() -> Scene:
    """Return a helix whose initial shape is its rest shape moved elsewhere: at rest, but for round-off."""
    material = Material(youngs_modulus=1e6, density=1000.0)
    helix = Rod.helix(
        helix_radius=6e-3, pitch=0.04, axial_length=0.05, radius=1e-3, material=material, edge_count=10
    )
    placed = helix.replace(nodes=helix.nodes @ ROTATION.T + SHIFT, rest_nodes=helix.nodes)
    return Scene(rods=(placed,), fluid=Fluid(viscosity=1.0, model="RFT"))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_rod_at_rest_stays_at_rest_for_a_hundred_thousand_steps(scheme: str) -> None:
    scene = resting_helix()
    simulation = Simulation(scene, scheme=scheme, dt=SCHEMES[scheme], threads=1)
    nodes, theta = simulation.nodes, simulation.theta
    assert np.abs(simulation.gradient()).max() > 0.0
    simulation.step(100_000)
    # Lengths are known to a unit in the last place of the coordinates; a drift would add 1e5 of them.
    assert np.abs(simulation.nodes - nodes).max() <= 4.0 * np.spacing(np.abs(nodes).max())
    assert np.abs(simulation.theta - theta).max() <= 1e-14


def test_a_loaded_rod_comes_to_rest_and_stays_there() -> None:
    simulation = settle(scenarios.cantilever(normalized_load=2.0))
    simulation.dt = default_step(simulation.scene)
    nodes = simulation.nodes
    simulation.step(100_000)
    # Newton stops at 1e-10 of the load: the shape may creep by that share of its deflection and no further.
    assert np.abs(simulation.nodes - nodes).max() < 1e-10 * np.ptp(nodes)


@pytest.mark.parametrize(
    "scene", [scenarios.robot(), scenarios.clamped_flagella(count=2)], ids=["robot", "pair"]
)
def test_a_moved_scene_makes_the_same_motion_moved(scene: Scene) -> None:
    here = Simulation(scene, rtol=None, threads=1)
    there = Simulation(moved(scene, ROTATION, SHIFT), rtol=None, threads=1)
    size = np.ptp(here.nodes, axis=0).max()
    for _ in range(5):
        here.step(10)
        there.step(10)
        # Round-off, 4e-16, unless Newton's tolerance is met an iteration earlier in one of the two. Then they
        # differ by up to 1e-10 of a step's motion, itself 3e-3 of the size: at most 1.5e-11 in 50 steps.
        assert np.abs(there.nodes - here.nodes @ ROTATION.T - SHIFT).max() < 1.5e-11 * size
    assert np.abs(here.nodes - scene.node_array()).max() > 0.05 * size


@pytest.mark.parametrize("build", [scenarios.robot, scenarios.clamped_flagella], ids=["robot", "pair"])
@pytest.mark.parametrize("scale", [1e-3, 1e-6], ids=["millimetres", "micrometres"])
def test_a_scene_in_another_unit_of_length_makes_the_same_motion(build, scale: float) -> None:
    large, small = (
        Simulation(build(), rtol=None, threads=1),
        Simulation(build(scale=scale), rtol=None, threads=1),
    )
    size = np.ptp(large.nodes, axis=0).max()
    for _ in range(5):
        large.step(10)
        small.step(10)
        assert np.abs(small.nodes / scale - large.nodes).max() < 1e-9 * size
        assert np.abs(small.theta - large.theta).max() < 1e-9


@pytest.mark.parametrize(
    "options", [{}, {"fluid": {"model": "RFT"}}, {"twist_drag": False}, {"scale": 1e-3}], ids=str
)
def test_force_and_torque_on_the_free_robot_balance_at_every_step(options: dict) -> None:
    simulation = Simulation(scenarios.robot(rpm=20.0, **options), rtol=None, threads=1)
    for _ in range(150):
        force, torque = imbalance(simulation)
        assert force < 1e-10
        assert torque < 1e-10


def _speed_and_rate(scheme: str, dt: float, start: float = 0.5, end: float = 1.5) -> np.ndarray:
    """Return velocity [m/s] and rotation [rad/s] of a coarse robot's head along and about its axis."""
    scene = scenarios.robot(rpm=20.0, edge_length=9e-3, contact=False)
    head = scene.head.node
    simulation = Simulation(scene, scheme=scheme, dt=dt, threads=1)
    seen = []
    for time in (start, end):
        simulation.step(round((time - simulation.time) / dt))
        arm = simulation.nodes[head + 1] - simulation.nodes[head - 1]
        seen.append([simulation.nodes[head, 0], np.arctan2(arm[2], arm[1])])
    return (np.array(seen[1]) - seen[0]) / (end - start)


def test_explicit_and_overdamped_schemes_meet_at_small_steps_but_for_inertia() -> None:
    def limit(scheme: str, dt: float) -> np.ndarray:
        return 2.0 * _speed_and_rate(scheme, 0.5 * dt) - _speed_and_rate(scheme, dt)

    overdamped, explicit = limit("overdamped", 2e-3), limit("explicit", 5e-4)
    implicit = limit("implicit", 2e-3)
    # Two schemes for the same equations: what is left is the square of the steps.
    assert explicit == pytest.approx(implicit, rel=2e-5)
    # Inertia counts with the motors' speed over the decay rate of velocities, 2.1 / 1000 (docs/validation).
    assert explicit == pytest.approx(overdamped, rel=2e-3)
    assert explicit != pytest.approx(overdamped, rel=2e-5)


def test_the_explicit_scheme_is_stable_up_to_two_over_the_largest_rate_of_drag() -> None:
    scene = soft_helix(youngs_modulus=1e2)
    limit = Simulation(scene, scheme="explicit", dt=1e-4, threads=1).stable_step()
    assert not disturbance_grows(scene, 0.99 * limit)
    assert disturbance_grows(scene, 1.01 * limit)


def test_elasticity_raises_the_explicit_schemes_limit_as_its_linear_map_says() -> None:
    scene = soft_helix(youngs_modulus=1e6)
    simulation = Simulation(scene, scheme="explicit", dt=1e-4, threads=1)
    limit = linear_limit(simulation)
    assert limit > 1.2 * simulation.stable_step()
    assert not disturbance_grows(scene, 0.99 * limit)
    assert disturbance_grows(scene, 1.01 * limit)
