"""What clamps exert: against statics, drag, the force on the fluid, and the energy budget."""

import re
from pathlib import Path

import flagrs
import h5py
import numpy as np
import pytest
from flagrs import Clamp, FlagrsError, Fluid, PointLoad, Rod, Scene, SceneError, Simulation, Trajectory

SOFT = flagrs.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
LENGTH, RADIUS = 0.05, 1e-3
OIL = Fluid(viscosity=1.0, model="RFT", density=0.0)
HELD = Clamp(nodes=(0, 1), edges=(0,))
EI = 1e6 * np.pi * RADIUS**4 / 4.0


def rod(**options: object) -> Rod:
    return Rod.straight(length=LENGTH, edge_count=10, radius=RADIUS, material=SOFT, **options)  # type: ignore[arg-type]


def settled(scene: Scene) -> Simulation:
    """Return a simulation whose filaments have come to rest, by fixed steps that grow."""
    simulation = Simulation(scene, rtol=None, threads=1)
    for _ in range(120):
        simulation.step()
        simulation.dt *= 1.5
        if simulation.dt > 1e9:
            break
    return simulation


def test_a_clamp_bears_the_force_and_the_moment_of_a_load_at_the_tip() -> None:
    force = np.array([0.0, 2.0 * EI / LENGTH**2, 0.5 * EI / LENGTH**2])
    simulation = settled(Scene(rods=rod(), fluid=OIL, clamps=HELD, loads=PointLoad(node=10, force=force)))
    reaction = simulation.reaction()
    arm = simulation.nodes[10] - simulation.nodes[0]
    assert arm[1] > 0.2 * LENGTH
    np.testing.assert_allclose(reaction.force, -force, rtol=1e-8, atol=1e-8 * np.linalg.norm(force))
    moment = np.cross(arm, force)
    np.testing.assert_allclose(reaction.torque, -moment, rtol=1e-8, atol=1e-8 * np.linalg.norm(moment))


def test_a_clamp_bears_the_weight_and_its_moment() -> None:
    simulation = settled(Scene(rods=rod(), fluid=OIL, clamps=HELD, gravity=(0.0, 0.0, -2.0)))
    edges = simulation.edges
    weight = 1000.0 * np.pi * RADIUS**2 * rod().rest_lengths()
    middles = simulation.nodes[edges].mean(axis=1) - simulation.nodes[0]
    force = np.array([0.0, 0.0, -2.0 * weight.sum()])
    moment = np.cross(middles, np.outer(weight, [0.0, 0.0, -2.0])).sum(axis=0)
    reaction = simulation.reaction()
    np.testing.assert_allclose(reaction.force, -force, atol=1e-8 * np.abs(force).max())
    np.testing.assert_allclose(reaction.torque, -moment, atol=1e-8 * np.abs(moment).max())


def test_a_torque_at_the_tip_is_borne_as_a_torque_along_the_clamped_edge() -> None:
    torque = np.array([1e-7, 0.0, 0.0])
    simulation = settled(Scene(rods=rod(), fluid=OIL, clamps=HELD, loads=PointLoad(edge=9, torque=torque)))
    np.testing.assert_allclose(simulation.reaction().torque, -torque, atol=1e-13)
    np.testing.assert_allclose(simulation.reaction().force, 0.0, atol=1e-9)


def test_a_clamp_that_drags_a_rod_feels_its_drag() -> None:
    velocity = np.array([2e-3, 1e-3, 0.0])
    clamp = Clamp(nodes=range(11), edges=range(10), velocity=velocity)
    simulation = Simulation(Scene(rods=rod(), fluid=OIL, clamps=clamp), threads=1)
    simulation.step(3)
    drag = simulation.resistance() @ np.tile(velocity, 11)
    expected = drag.reshape(-1, 3).sum(axis=0)
    np.testing.assert_allclose(simulation.reaction().force, expected, rtol=1e-9)
    assert simulation.reaction().power == pytest.approx(expected @ velocity, rel=1e-9)


def test_a_clamp_that_spins_a_rod_feels_its_twist_drag() -> None:
    spun = HELD.replace(angular_velocity=3.0)
    simulation = Simulation(Scene(rods=rod(), fluid=OIL, clamps=spun), dt=1e-2, threads=1)
    simulation.step(300)
    expected = 4.0 * np.pi * RADIUS**2 * LENGTH * 3.0
    np.testing.assert_allclose(simulation.reaction().torque, [expected, 0.0, 0.0], atol=1e-9 * expected)
    assert simulation.reaction().power == pytest.approx(3.0 * expected, rel=1e-9)


@pytest.mark.parametrize("model", ["RSS", "RFT"])
def test_clamped_flagella_tell_thrust_and_torque(model: str) -> None:
    scene = flagrs.scenarios.clamped_flagella(
        count=1, angular_velocity=2.4, fluid={"viscosity": 0.6, "model": model}, contact=False
    )
    simulation = Simulation(scene, rtol=1e-5, threads=1)
    trajectory = simulation.run(1.0, 0.13, path=False)
    reaction = trajectory.reaction(0)
    assert reaction.force.shape == (9, 3) and reaction.torque.shape == (9, 3) and reaction.power.shape == (9,)
    # Without inertia the clamp gives the fluid its thrust, and all the power that goes into it.
    thrust = trajectory.thrust()[2:]
    np.testing.assert_allclose(reaction.force[2:], thrust, atol=2e-3 * np.abs(thrust).max())
    last = simulation.reaction(0)
    moved = (simulation.resistance() @ simulation.velocities.ravel()).reshape(-1, 3)
    arms = simulation.nodes - simulation.nodes[scene.clamps[0].nodes[0]]
    spun = np.zeros(3)
    if scene.fluid is not None and scene.fluid.twist_drag:
        edges = simulation.edges
        vectors = simulation.nodes[edges[:, 1]] - simulation.nodes[edges[:, 0]]
        rates = simulation._native.velocity_vector[simulation.dof_of_edge]
        wet = scene.rods[0].immersed_array()
        drag = 4.0 * np.pi * 0.6 * scene.rods[0].radius_array() ** 2 * np.linalg.norm(vectors, axis=1) * wet
        spun = ((drag * rates)[:, None] * vectors / np.linalg.norm(vectors, axis=1)[:, None]).sum(axis=0)
    torque = np.cross(arms, moved).sum(axis=0) + spun
    np.testing.assert_allclose(last.torque, torque, atol=5e-3 * np.abs(torque).max())
    # The account is that of the end of the step, which stops at the error of positions, 1e-5.
    assert last.power == pytest.approx(trajectory.powers()["clamps"][-1], rel=1e-6)


def test_powers_of_every_driver_add_up() -> None:
    trajectory = Simulation(flagrs.scenarios.robot(edge_length=9e-3), rtol=1e-4, threads=1).run(
        2.0, 0.5, path=False
    )
    powers = trajectory.powers()
    np.testing.assert_allclose(powers["motors"][2:], trajectory.power()[2:], rtol=2e-2)
    taken = powers["fluid"] + powers["twist_drag"] + powers["head"]
    np.testing.assert_allclose(taken[-1], powers["motors"][-1], rtol=0.05)


def test_a_frame_between_steps_has_the_reaction_of_its_time() -> None:
    shaken = HELD.replace(displacement=lambda t: (0.0, 1e-3 * np.sin(4.0 * t), 0.0))
    scene = Scene(rods=rod(), fluid=OIL, clamps=shaken)
    found = Simulation(scene, rtol=1e-4, threads=1).run(2.0, 0.01, path=False).reaction().force[20:, 1]
    exact = Simulation(scene, dt=2e-4, threads=1).run(2.0, 0.01, path=False).reaction().force[20:, 1]
    assert np.abs(found - exact).max() < 1e-2 * np.abs(exact).max()


def test_pins_bear_forces_alone() -> None:
    scene = Scene(
        rods=rod(), fluid=OIL, clamps=(Clamp(nodes=(0,)), Clamp(nodes=(10,))), gravity=(0.0, 0.0, -0.5)
    )
    simulation = settled(scene)
    left, right = simulation.reaction(0), simulation.reaction(1)
    weight = 1000.0 * np.pi * RADIUS**2 * LENGTH * 0.5
    assert left.force[2] == pytest.approx(0.5 * weight, rel=1e-7)
    assert right.force[2] == pytest.approx(0.5 * weight, rel=1e-7)
    assert left.force[0] == pytest.approx(-right.force[0], rel=1e-6)
    np.testing.assert_array_equal(left.torque, 0.0)


def test_reactions_are_saved_and_restored(tmp_path: Path) -> None:
    simulation = Simulation(Scene(rods=rod(), fluid=OIL, clamps=HELD, gravity=(0.0, 0.0, -2.0)), threads=1)
    trajectory = simulation.run(0.2, 0.1, path=tmp_path / "run.h5")
    # Frames bring forces into balance; the end of a step has them as exactly as its positions ask for.
    size = np.linalg.norm(simulation.reaction().force)
    np.testing.assert_allclose(trajectory.reaction().force[-1], simulation.reaction().force, atol=1e-2 * size)
    assert np.array_equal(Trajectory.load(tmp_path / "run.h5").clamp_force, trajectory.clamp_force)
    again = Simulation.restore(tmp_path / "run.h5")
    np.testing.assert_array_equal(again.reaction().force, simulation.reaction().force)


def test_clamps_that_are_not_there_are_refused() -> None:
    simulation = Simulation(Scene(rods=rod(), fluid=OIL, clamps=HELD), threads=1)
    with pytest.raises(
        SceneError, match=re.escape("clamp: 1 is not allowed; must be a whole number from 0 to 0")
    ):
        simulation.reaction(1)
    with pytest.raises(SceneError, match="the scene has no clamps"):
        Simulation(Scene(rods=rod(), fluid=OIL), threads=1).reaction()


def test_files_of_before_are_read_without_reactions(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    Simulation(Scene(rods=rod(), fluid=OIL, clamps=HELD), threads=1).run(0.2, 0.1, path=path)
    trajectory = Trajectory.load(path)
    for name in ("clamp_force", "clamp_torque", "clamp_power"):
        del trajectory._contents.frames[name]
    old = tmp_path / "old.h5"
    trajectory.save(old)
    with h5py.File(old) as file:
        assert "clamp_force" not in file["frames"]
    read = Trajectory.load(old)
    np.testing.assert_array_equal(read.nodes, trajectory.nodes)
    with pytest.raises(FlagrsError, match="older flagrs"):
        read.reaction()
