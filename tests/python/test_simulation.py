"""The simulation's interface: placing, measuring, stepping, saving, and what it refuses."""

from __future__ import annotations

import math
from typing import Any

import flagrs
import numpy as np
import pytest
from flagrs import Clamp, Motor, SceneError, Simulation, scenarios


@pytest.fixture
def rod() -> Simulation:
    """Return a bent rod at rest that is about to relax."""
    return Simulation(scenarios.relaxing_rod(edge_count=8), threads=1)


def same_states(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Return whether two states are equal to the last bit."""
    return one.keys() == other.keys() and all(np.array_equal(one[key], other[key]) for key in one)


def test_degrees_of_freedom_are_interleaved(rod: Simulation) -> None:
    assert rod.dof_of_node.tolist() == list(range(0, 36, 4))
    assert rod.dof_of_edge.tolist() == list(range(3, 35, 4))
    assert rod.gradient().shape == (35,)
    assert rod.hessian().shape == (35, 35)
    # Hinges couple neighbours and next neighbours: a chain's Hessian has half-bandwidth 10.
    hessian = rod.hessian()
    columns = np.repeat(np.arange(35), np.diff(hessian.indptr))
    assert np.abs(hessian.indices - columns).max() == 10


def test_energies_add_up_and_vanish_at_rest(rod: Simulation) -> None:
    energy = rod.energy()
    assert energy["bending"] > 0.0
    assert energy["total"] == energy["stretching"] + energy["bending"] + energy["twisting"]
    resting = Simulation(scenarios.straight_rod(), threads=1)
    assert resting.energy()["total"] < 1e-25
    assert np.abs(resting.gradient()).max() < 1e-13


def test_the_bending_energy_of_an_arc_is_half_ei_times_turn_squared_over_length() -> None:
    turn, length = math.pi / 2.0, 0.1
    simulation = Simulation(scenarios.relaxing_rod(turn=turn, edge_count=100), threads=1)
    bending = simulation.scene.rods[0].EI_array()[0, 0, 0]
    # 99 hinges of 100 edges carry the arc: one per cent less, and 2 tan(x/2) for x is 2e-5 more.
    expected = 0.5 * bending * turn**2 / length * 0.99
    assert simulation.energy()["bending"] == pytest.approx(expected, rel=1e-4)


def test_a_placement_does_not_depend_on_those_before_it(rod: Simulation) -> None:
    rng = np.random.default_rng(0)
    target = rod.nodes + 1e-3 * rng.normal(size=rod.nodes.shape)
    theta = rng.normal(size=8)
    rod.set_state(target, theta)
    direct = rod.gradient()
    for _ in range(3):
        rod.set_state(rod.nodes + 2e-3 * rng.normal(size=rod.nodes.shape), rng.normal(size=8))
    rod.set_state(target, theta)
    assert np.array_equal(rod.gradient(), direct)
    assert np.array_equal(rod.nodes, target)
    assert np.array_equal(rod.theta, theta)


def test_placing_nodes_alone_keeps_the_angles_and_stops_all_motion(rod: Simulation) -> None:
    rod.step(3)
    assert np.abs(rod.velocities).max() > 0.0
    theta = rod.theta
    rod.set_state(rod.nodes + np.array([0.0, 0.0, 1e-3]))
    assert np.array_equal(rod.theta, theta)
    assert not rod.velocities.any()


def test_arrays_handed_out_are_copies(rod: Simulation) -> None:
    rod.nodes[:] = 0.0
    rod.theta[:] = 1.0
    assert np.ptp(rod.nodes) > 0.0
    assert not rod.theta.any()


def _with(array: np.ndarray, index: Any, value: Any) -> np.ndarray:
    changed = array.copy()
    changed[index] = value
    return changed


@pytest.mark.parametrize(
    ("make", "names"),
    [
        (lambda x: x[:-1], "(9, 3)"),
        (lambda x: x[:, :2], "(N, 3)"),
        (lambda x: x.ravel(), "2 dimensions"),
        (lambda x: None, "2 dimensions"),
        (lambda x: "nodes", "2 dimensions"),
        (lambda x: _with(x, (4, 1), math.nan), "nodes[4]"),
        (lambda x: _with(x, (4, 1), math.inf), "nodes[4]"),
        (lambda x: _with(x, 5, x[4]), "non-zero length"),
        (lambda x: _with(x, 5, x[3]), "folded"),
    ],
    ids=["too few", "plane", "flat", "none", "text", "nan", "infinite", "coincident", "antiparallel"],
)
def test_bad_nodes_are_refused_by_name_and_change_nothing(rod: Simulation, make: Any, names: str) -> None:
    before = rod.state()
    with pytest.raises(SceneError, match="nodes") as caught:
        rod.set_state(make(rod.nodes))
    assert names in str(caught.value)
    assert same_states(rod.state(), before)


@pytest.mark.parametrize("theta", [np.zeros(7), np.full(8, math.nan), np.zeros((2, 4)), "angles"], ids=str)
def test_bad_angles_are_refused_by_name_and_change_nothing(rod: Simulation, theta: Any) -> None:
    before = rod.state()
    with pytest.raises(SceneError, match="theta"):
        rod.set_state(rod.nodes + 1e-3, theta)
    assert same_states(rod.state(), before)


@pytest.mark.parametrize("dt", [0.0, -1e-3, math.nan, math.inf, "fast", True])
def test_a_step_that_is_not_a_positive_time_is_refused(dt: Any) -> None:
    with pytest.raises(SceneError, match="dt") as caught:
        Simulation(scenarios.straight_rod(), dt=dt)
    assert caught.value.field == "dt"
    simulation = Simulation(scenarios.straight_rod())
    with pytest.raises(SceneError, match="dt"):
        simulation.dt = dt


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("scheme", "euler"),
        ("scheme", ""),
        ("rtol", 0.5),
        ("threads", 0),
        ("threads", -1),
        ("threads", 1.5),
        ("threads", "2"),
    ],
)
def test_a_bad_option_is_refused_by_name(option: str, value: Any) -> None:
    with pytest.raises(SceneError, match=option) as caught:
        Simulation(scenarios.straight_rod(), **{option: value})
    assert caught.value.field == option


def test_anything_but_a_scene_is_refused() -> None:
    with pytest.raises(SceneError, match="scene"):
        Simulation("robot")  # type: ignore[arg-type]


@pytest.mark.parametrize("fluid", [None, {"model": "none"}])
def test_the_overdamped_scheme_needs_a_fluid(fluid: Any) -> None:
    scene = scenarios.straight_rod(fluid=fluid)
    if fluid is None:
        scene = scene.replace(fluid=None)
    with pytest.raises(SceneError, match="overdamped") as caught:
        Simulation(scene)
    assert caught.value.field == "scheme"
    Simulation(scene, scheme="implicit").step()


@pytest.mark.parametrize("n", [-1, 1.5, "3", None])
def test_a_number_of_steps_that_is_not_a_count_is_refused(rod: Simulation, n: Any) -> None:
    with pytest.raises(SceneError, match="n:"):
        rod.step(n)
    assert rod.time == 0.0


@pytest.mark.parametrize(
    ("until", "save_every", "field"),
    [
        (0.0, 0.1, "until"),
        (-1.0, 0.1, "until"),
        (math.nan, 0.1, "until"),
        (math.inf, 0.1, "until"),
        (1.0, 0.0, "save_every"),
        (1.0, -0.1, "save_every"),
        (1.0, math.nan, "save_every"),
    ],
)
def test_a_run_with_a_bad_time_is_refused(
    rod: Simulation, until: float, save_every: float, field: str
) -> None:
    with pytest.raises(SceneError) as caught:
        rod.run(until=until, save_every=save_every, path=False)
    assert caught.value.field == field
    assert rod.time == 0.0


def test_many_steps_at_once_are_the_same_as_one_by_one() -> None:
    together, single = (Simulation(scenarios.robot(edge_length=9e-3), threads=1) for _ in range(2))
    together.step(12)
    for _ in range(12):
        single.step()
    assert same_states(together.state(), single.state())
    together.step(0)
    assert same_states(together.state(), single.state())


def test_results_do_not_depend_on_the_number_of_threads() -> None:
    one, two = (Simulation(scenarios.clamped_flagella(count=2), threads=threads) for threads in (1, 2))
    one.step(8)
    two.step(8)
    assert same_states(one.state(), two.state())


def test_a_step_moves_time_by_dt_and_is_counted(rod: Simulation) -> None:
    rod.dt = 1e-3
    rod.step(7)
    assert rod.time == pytest.approx(7e-3, rel=1e-12)
    assert rod.statistics["steps"] == 7
    assert rod.statistics["newton_iterations"] >= 7
    assert rod.statistics["rejected_steps"] == 0


def test_frames_of_a_run_are_at_multiples_of_the_interval_and_at_the_end(rod: Simulation) -> None:
    times: list[float] = []
    trajectory = rod.run(until=0.035, save_every=0.01, path=False, progress=times.append)
    assert trajectory.time == pytest.approx([0.0, 0.01, 0.02, 0.03, 0.035], rel=1e-12)
    assert times == pytest.approx(trajectory.time[1:])


def test_the_resistance_is_that_of_the_mobility_and_the_hat_weights() -> None:
    scene = scenarios.clamped_flagella(count=1, edge_length=1e-2)
    simulation = Simulation(scene, threads=1)
    fluid, nodes, edges = scene.fluid, simulation.nodes, simulation.edges
    mobility = flagrs.fluid.mobility(nodes, edges, epsilon=fluid.epsilon)
    lengths = np.linalg.norm(nodes[edges[:, 1]] - nodes[edges[:, 0]], axis=1)
    weights = np.zeros((len(nodes), len(nodes)))
    for (i, j), length in zip(edges, lengths, strict=True):
        weights[np.ix_([i, j], [i, j])] += length / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    expected = 8.0 * np.pi * fluid.viscosity * np.kron(weights, np.eye(3)) @ np.linalg.inv(mobility)
    resistance = simulation.resistance()
    assert np.abs(resistance - expected).max() < 1e-9 * np.abs(expected).max()
    # It dissipates, although collocation makes it unsymmetric.
    assert np.linalg.eigvalsh(resistance + resistance.T).min() > 0.0


def test_dry_nodes_have_no_resistance() -> None:
    simulation = Simulation(scenarios.robot(edge_length=9e-3), threads=1)
    head = simulation.scene.head.node
    blocks = simulation.resistance().reshape(len(simulation.nodes), 3, -1)
    assert not blocks[head].any()
    assert blocks[0].any()


@pytest.mark.parametrize("scheme", ["overdamped", "implicit", "explicit"])
def test_a_restored_checkpoint_goes_on_to_the_last_bit(scheme: str, tmp_path: Any) -> None:
    dt = 2e-4 if scheme == "explicit" else None
    simulation = Simulation(scenarios.robot(edge_length=9e-3), scheme=scheme, dt=dt, threads=1)
    simulation.step(9)
    simulation.checkpoint(tmp_path / "robot.h5")
    restored = Simulation.restore(tmp_path / "robot.h5")
    assert restored.scheme == scheme
    assert restored.dt == simulation.dt
    assert restored.time == simulation.time
    assert same_states(restored.state(), simulation.state())
    simulation.step(9)
    restored.step(9)
    assert same_states(restored.state(), simulation.state())


def test_a_restored_checkpoint_keeps_free_motor_angles_and_contacts(tmp_path: Any) -> None:
    robot = scenarios.robot(edge_length=9e-3)
    motors = tuple(Motor(node=m.node, shaft=m.shaft, torque=4e-5) for m in robot.motors)
    simulation = Simulation(robot.replace(motors=motors), dt=0.02, threads=1)
    simulation.step(6)
    simulation.checkpoint(tmp_path / "robot.h5")
    restored = Simulation.restore(tmp_path / "robot.h5")
    simulation.step(6)
    restored.step(6)
    assert same_states(restored.state(), simulation.state())
    assert np.abs(simulation.state()["motor_angles"]).min() > 0.0


def test_a_state_of_another_scene_is_refused(rod: Simulation) -> None:
    other = Simulation(scenarios.relaxing_rod(edge_count=9), threads=1).state()
    before = rod.state()
    with pytest.raises(SceneError, match="state"):
        rod.load_state(other)
    assert same_states(rod.state(), before)


@pytest.mark.parametrize("field", ["time", "q", "velocity", "tangents", "directors"])
def test_a_state_that_is_not_finite_is_refused(rod: Simulation, field: str) -> None:
    bad = rod.state()
    bad[field] = np.full_like(bad[field], math.nan)
    with pytest.raises(SceneError):
        rod.load_state(bad)


def test_a_motor_function_that_gives_nan_stops_at_the_last_good_state() -> None:
    def speed(time: float) -> float:
        return 2.0 if time < 0.1 else math.nan

    robot = scenarios.robot(edge_length=9e-3)
    motors = tuple(Motor(node=m.node, shaft=m.shaft, speed=speed) for m in robot.motors)
    simulation = Simulation(robot.replace(motors=motors), dt=0.02, threads=1)
    with pytest.raises(SceneError, match=r"nan|NaN"):
        simulation.step(20)
    assert simulation.time == pytest.approx(0.1, rel=1e-12)
    assert np.isfinite(simulation.nodes).all()
    assert np.isfinite(simulation.gradient()).all()


def test_an_error_in_a_motor_function_reaches_its_author() -> None:
    def speed(time: float) -> float:
        if time > 0.05:
            raise KeyError("no such speed")
        return 1.0

    robot = scenarios.robot(edge_length=9e-3)
    motors = tuple(Motor(node=m.node, shaft=m.shaft, speed=speed) for m in robot.motors)
    with pytest.raises((KeyError, SceneError), match="no such speed"):
        Simulation(robot.replace(motors=motors), dt=0.02, threads=1).step(20)


def test_a_step_that_cannot_be_solved_says_where_and_keeps_the_last_good_state() -> None:
    scene = scenarios.straight_rod(edge_count=6)
    spacing = scene.rods[0].rest_lengths()[0]
    # The second node is pushed through the first: their edge loses its length, then lies on its neighbour.
    clamps = (Clamp(nodes=(0,)), Clamp(nodes=(1,), velocity=np.array([-1.0, 0.0, 0.0])), Clamp(nodes=(2,)))
    simulation = Simulation(scene.replace(clamps=clamps), dt=0.1 * spacing, threads=1)
    with pytest.raises(flagrs.ConvergenceError) as caught:
        simulation.step(20)
    error = caught.value
    assert isinstance(error, ArithmeticError)
    assert error.time == simulation.time
    assert 0.5 * spacing < simulation.time <= 1.001 * spacing
    assert 0 <= error.worst_node < 7
    assert simulation.statistics["rejected_steps"] > 1
    assert np.isfinite(simulation.nodes).all()
    assert np.isfinite(simulation.energy()["total"])


def test_a_state_goes_on_in_another_scheme() -> None:
    scene = scenarios.robot(edge_length=9e-3)
    first = Simulation(scene, threads=1)
    first.step(3)
    for scheme, dt in (("explicit", 1e-4), ("implicit", 1e-3)):
        second = Simulation(scene, scheme=scheme, dt=dt, threads=1)
        second.load_state(first.state())
        assert np.array_equal(second.nodes, first.nodes)
        second.step(3)
        back = Simulation(scene, threads=1)
        back.load_state(second.state())
        back.step(1)
        assert back.time > second.time > first.time
