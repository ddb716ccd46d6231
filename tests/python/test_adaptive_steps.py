"""Steps of adaptive size and order: the error got is the error asked for, also between steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from flagrs import Fluid, Material, Rod, Scene, SceneError, Simulation, Trajectory, rpm, scenarios
from flagrs.time_step import size


def recorded(
    scene: Scene, until: float, every: float, **options: float
) -> tuple[Trajectory, dict[str, float]]:
    simulation = Simulation(scene, threads=1, **options)
    return simulation.run(until, every, path=False), simulation.statistics


def error(found: Trajectory, reference: Trajectory, scene: Scene) -> float:
    """Return the largest error of a node at any frame, relative to the size of the filaments."""
    return float(np.linalg.norm(found.nodes - reference.nodes, axis=2).max() / size(scene))


@pytest.fixture(scope="module")
def spinning() -> tuple[Scene, Trajectory]:
    scene = scenarios.clamped_flagella(count=1, contact=False, edge_length=1e-2)
    return scene, recorded(scene, 1.0, 0.1, rtol=1e-7)[0]


@pytest.mark.parametrize("rtol", [1e-2, 1e-3, 1e-4, 1e-5])
def test_the_error_got_is_within_ten_times_the_error_asked_for(
    spinning: tuple[Scene, Trajectory], rtol: float
) -> None:
    scene, reference = spinning
    found = error(recorded(scene, 1.0, 0.1, rtol=rtol)[0], reference, scene)
    assert 0.1 * rtol < found < 10.0 * rtol


def test_adaptive_steps_beat_fixed_ones_in_error_and_number(spinning: tuple[Scene, Trajectory]) -> None:
    scene, reference = spinning
    adaptive, spent = recorded(scene, 1.0, 0.1, rtol=1e-3)
    fixed, steps = recorded(scene, 1.0, 0.1, dt=1e-3)
    assert error(adaptive, reference, scene) < error(fixed, reference, scene)
    assert spent["steps"] < 0.3 * steps["steps"]


def test_fixed_steps_converge_to_the_adaptive_result_at_first_order(
    spinning: tuple[Scene, Trajectory],
) -> None:
    scene, reference = spinning
    errors = [error(recorded(scene, 1.0, 0.1, dt=dt)[0], reference, scene) for dt in (4e-3, 2e-3, 1e-3)]
    # First order: each halving of the step halves the error, up to terms of second order.
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.1)


def test_frames_between_steps_are_as_exact_as_steps(spinning: tuple[Scene, Trajectory]) -> None:
    scene, reference = spinning
    dense = recorded(scene, 1.0, 1e-3, rtol=1e-5)[0]
    assert len(dense.time) == 1001
    assert np.allclose(dense.time[::100], reference.time, rtol=0, atol=1e-12)
    every = np.linalg.norm(dense.nodes[::100] - reference.nodes, axis=2).max() / size(scene)
    assert every < 1e-4
    # Interpolated velocities are the derivative of interpolated positions: central differences over 1 ms of a
    # motion that turns at 15 rad/s miss (15e-3)^2 / 6 of it.
    differences = (dense.nodes[2:] - dense.nodes[:-2]) / 2e-3
    late = slice(500, 900)
    worst = np.abs(differences[late] - dense.velocities[1:-1][late]).max()
    assert worst < 2e-3 * np.abs(dense.velocities[late]).max()


def test_a_restored_adaptive_run_goes_on_to_the_last_bit(tmp_path: Path) -> None:
    scene = scenarios.robot(rpm=20.0, edge_length=9e-3)
    whole = Simulation(scene, rtol=1e-3, threads=1)
    whole.step(40)
    whole.checkpoint(tmp_path / "state.h5")
    again = Simulation.restore(tmp_path / "state.h5")
    whole.step(40)
    again.step(40)
    assert again.time == whole.time
    assert np.array_equal(again.nodes, whole.nodes)
    assert np.array_equal(again.theta, whole.theta)


def test_an_adaptive_run_can_be_gone_on_with(tmp_path: Path) -> None:
    scene = scenarios.robot(rpm=20.0, edge_length=9e-3)
    whole = Simulation(scene, rtol=1e-3, threads=1).run(4.0, 0.1, path=tmp_path / "whole.h5")
    Simulation(scene, rtol=1e-3, threads=1).run(2.0, 0.1, path=tmp_path / "parts.h5")
    parts = Simulation.restore(tmp_path / "parts.h5").run(4.0, 0.1, path=tmp_path / "parts.h5")
    assert np.allclose(parts.time, whole.time, rtol=0, atol=1e-12)
    # The first part ended its last step at 2 s, the whole run did not: equal to the error asked for only.
    assert np.linalg.norm(parts.nodes - whole.nodes, axis=2).max() < 1e-2 * size(scene)


def test_the_robot_is_within_a_per_cent_at_fifty_times_fewer_steps_than_explicit_ones() -> None:
    scene = scenarios.robot(rpm=20.0)
    coarse, spent = recorded(scene, 12.0, 0.1, rtol=1e-2)
    fine, _ = recorded(scene, 12.0, 0.1, rtol=1e-4)
    assert coarse.swimming_speed(start=6.0) == pytest.approx(fine.swimming_speed(start=6.0), rel=1e-2)
    assert coarse.head_rate(start=6.0) == pytest.approx(fine.head_rate(start=6.0), rel=1e-2)
    # The explicit scheme is stable up to about 1 ms.
    assert spent["steps"] < 12.0 / 1e-3 / 50.0


def test_a_bent_rod_relaxes_at_the_rate_of_its_slowest_mode_at_second_order_in_the_mesh() -> None:
    coarse, fine = (rate_error(edge_count) for edge_count in (20, 40))
    assert coarse / fine == pytest.approx(4.0, rel=0.1)
    assert (4.0 * fine - coarse) / 3.0 == pytest.approx(0.0, abs=1e-3)


def rate_error(edge_count: int) -> float:
    """Return the relative error of the rate at which a rod relaxes once its deflections are small."""
    scene = scenarios.relaxing_rod(edge_count=edge_count, fluid=Fluid(viscosity=1.0, model="RFT"))
    rate = relaxation_rate(scene)
    trajectory = Simulation(scene, rtol=1e-6, threads=1).run(4.0 / rate, 0.1 / rate, path=False)
    late = trajectory.time > 3.0 / rate
    # Bending energy goes with the square of the deflection and decays twice as fast.
    slope = np.polyfit(trajectory.time[late], np.log(trajectory.energy[late, 1]), 1)[0]
    return float(-slope / 2.0 / rate - 1.0)


def relaxation_rate(scene: Scene) -> float:
    """Return EI k^4 / zeta of the first free-free mode, k L = 4.730, with the drag across the rod."""
    from flagrs.assemble import resistive_coefficients

    assert scene.fluid is not None
    rod = scene.rods[0]
    across = resistive_coefficients(scene, scene.fluid)[0, 1]
    length = rod.rest_lengths().sum()
    return float(rod.EI_array()[0, 0, 0] * (4.730040744862704 / length) ** 4 / across)


@pytest.mark.parametrize("rtol", [0.0, 0.2, 1e-9, float("nan")])
def test_an_error_out_of_range_is_refused(rtol: float) -> None:
    with pytest.raises(SceneError, match="rtol"):
        Simulation(scenarios.straight_rod(), rtol=rtol)


def test_the_explicit_scheme_takes_no_error() -> None:
    with pytest.raises(SceneError, match="explicit"):
        Simulation(scenarios.robot(rpm=float(rpm(1.0))), scheme="explicit", rtol=1e-3)


def test_steps_of_a_scene_at_rest_grow_to_a_bound() -> None:
    rod = Rod.straight(
        length=0.1, edge_count=4, radius=1e-3, material=Material(youngs_modulus=1e6, density=1e3)
    )
    simulation = Simulation(Scene(rods=rod, fluid=Fluid(viscosity=1.0, model="RFT")), rtol=1e-2, dt=1.0)
    simulation.step(1200)
    # A billion fixed steps each; without a bound they would double a thousand times.
    assert 1e11 < simulation.time < 1.3e12
    assert np.isfinite(simulation.state()["control_step"]).all()
