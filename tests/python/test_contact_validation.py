"""Rods in contact against closed forms, and what contact must never do: docs/validation/contact.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contact_cases import (
    SILICONE,
    Capstan,
    Knot,
    Plectoneme,
    Watch,
    contact_forces,
    crossing,
    drag,
    heap,
    held,
    incline_velocity,
    linking_numbers,
    pressed,
    ring_pairs,
    settled_heap,
    weight,
)
from flagrs import (
    Clamp,
    Contact,
    ConvergenceError,
    Fluid,
    Head,
    PointLoad,
    Rod,
    Scene,
    SceneError,
    Simulation,
)

#: Centrelines never come closer than this part of the sum of radii: 1 - the default tolerance.
LEAST = 0.95


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.6])
@pytest.mark.parametrize("steepness", [0.5, 0.99, 1.01, 2.0])
@pytest.mark.parametrize("lengthwise", [False, True])
def test_a_rod_on_an_incline_sticks_below_the_angle_of_friction_and_slides_above(
    friction: float, steepness: float, lengthwise: bool
) -> None:
    slip = 1e-6
    velocity, theory, power = incline_velocity(np.arctan(friction * steepness), friction, slip, lengthwise)
    # Lengthwise, the rod tilts a little: the worst of all is 6e-4.
    assert velocity == pytest.approx(theory, rel=1e-3 if lengthwise else 1e-8)
    assert velocity < slip if steepness < 1.0 else velocity > 10.0 * slip
    assert power < 0.0


@pytest.mark.parametrize("wrap", [np.pi / 2.0, np.pi])
@pytest.mark.parametrize("friction", [0.0, 0.1, 0.3, 0.5])
def test_a_rope_around_a_drum_multiplies_its_load_by_the_exponential_of_friction_times_angle(
    wrap: float, friction: float
) -> None:
    capstan = Capstan(wrap, friction)
    # The rope's circle shrinks by up to the range of contact where it is pulled harder: 0.17 % at most.
    assert capstan.ratio() == pytest.approx(capstan.theory(), rel=3e-3)
    # With a bending stiffness of 1e-3 T R^2 the capstan formula itself is as good.
    assert capstan.theory() == pytest.approx(np.exp(friction * wrap), rel=1e-3)


def test_a_trefoil_knot_pulled_tight_never_penetrates() -> None:
    knot = Knot()
    start = knot.force()
    while knot.curvature().max() * knot.RADIUS < 0.25:
        knot.simulation.step(10)
        assert knot.watch.closest() >= LEAST
        assert knot.simulation.frame()["minimum_gap"] >= -0.05 * 2.0 * knot.RADIUS
        assert knot.simulation.time < 60.0
    assert knot.force() > 20.0 * abs(start)


def test_a_twisted_slack_rod_forms_a_plectoneme_with_the_angle_tension_and_pressure_of_theory() -> None:
    ply = Plectoneme()
    ply.wind()
    found = ply.measured()
    theory = ply.theory(found["torque"], found["radius"])
    assert ply.watch.least >= LEAST
    assert found["spread"] < 1e-3
    for name, exact in theory.items():
        assert found[name] == pytest.approx(exact, rel=2e-2), name


def test_a_heap_of_ten_rods_rests_on_its_rails_with_its_whole_weight() -> None:
    scene = heap()
    simulation, watch = settled_heap(scene)
    assert watch.least >= LEAST
    free_edges = sum(len(rod.edge_array()) for rod in scene.rods[:10])
    free_nodes = sum(len(rod.nodes) for rod in scene.rods[:10])
    total = sum(weight(rod) for rod in scene.rods[:10])
    pairs, forces, _ = contact_forces(simulation)
    borne = (pairs[:, 0] < free_edges) & (pairs[:, 1] >= free_edges)
    sideways, up = forces[borne, :2].sum(axis=0), forces[borne, 2].sum()
    resisted = drag(simulation)[:free_nodes].sum(axis=0)
    # What creep is left is small, and the balance is closed with it.
    assert np.abs(resisted).max() < 1e-6 * total
    assert up - resisted[2] == pytest.approx(total, rel=1e-3)
    assert np.abs(sideways - resisted[:2]).max() < 1e-3 * total


def test_contact_between_free_rods_moves_nothing_as_a_whole() -> None:
    scene = pressed()
    loads = (PointLoad(rod=0, node=3, force=np.array([0.0, 0.0, 1e-3])), *scene.loads)
    simulation = Simulation(scene.replace(clamps=(), loads=loads), dt=1e-3, threads=1)
    for _ in range(100):
        resistance = simulation.resistance()  # the step's, at its beginning
        simulation.step()
        force = (resistance @ simulation.velocities.ravel()).reshape(-1, 3).sum(axis=0)
        assert np.abs(force).max() < 1e-9 * 1e-3
    assert simulation.frame()["contacts"] > 0


@pytest.mark.parametrize("options", [{}, {"rtol": 1e-3}])
@pytest.mark.parametrize("dt", [1e-3, 1e-2, 0.1, 1.0])
def test_rods_driven_through_each_other_never_cross(dt: float, options: dict[str, Any]) -> None:
    for speed in (0.1, 1.0, 100.0):
        for angle in (0.3, 1.0, 1.57):
            simulation = Simulation(crossing(speed, angle), dt=dt, threads=1, **options)
            watch = Watch(simulation)
            try:
                while speed * simulation.time < 0.03:
                    simulation.step()
                    assert watch.closest() >= LEAST
            except ConvergenceError:
                # Only where a fixed step stretches the rods to many times their length.
                assert not options
                assert speed * dt >= 0.1
                assert dt >= 0.1
            assert watch.closest() >= LEAST
            upper, lower = simulation.nodes[8:10], simulation.nodes[2:4]
            assert upper[:, 2].min() > lower[:, 2].max()


@pytest.mark.parametrize(
    ("load", "dt", "options"),
    [
        (1e-4, 1e-3, {}),
        (1e-4, 0.1, {}),
        (1e-2, 1e-3, {}),
        (1e-2, 0.1, {}),
        (1e-4, 0.1, {"rtol": 1e-3}),
        (1e-2, 0.1, {"rtol": 1e-3}),
        (1.0, 1.0, {"rtol": 1e-2}),
    ],
)
def test_rings_pulled_through_each_other_stay_linked_or_not(
    load: float, dt: float, options: dict[str, float]
) -> None:
    simulation = Simulation(ring_pairs(30, 1, load), dt=dt, threads=1, **options)
    before = linking_numbers(simulation.nodes)
    assert np.abs(before - np.round(before)).max() < 1e-12 and 0 < np.abs(np.round(before)).sum() < 30
    # Adaptive steps begin small: as many are made as it takes to touch, and some more.
    simulation.step(40 if options else 6)
    assert np.abs(linking_numbers(simulation.nodes) - before).max() < 1e-12
    assert simulation.frame()["minimum_gap"] >= -0.05 * 2e-3
    if dt >= 1e-2 and load >= 1e-2:
        assert simulation.frame()["contacts"] > 0


def test_a_start_with_an_overlap_is_an_error_that_names_the_edges() -> None:
    scene = pressed()
    close = scene.rods[1].replace(nodes=scene.rods[1].nodes - np.array([0.0, 0.0, 0.6e-3]))
    with pytest.raises(SceneError, match=r"edge 3 and edge \d+, 1\.8000e-3 m apart"):
        Simulation(scene.replace(rods=(scene.rods[0], close)), threads=1)
    simulation = Simulation(scene, threads=1)
    simulation.step(3)
    before = simulation.state()
    with pytest.raises(SceneError, match=r"edge 3 and edge \d+"):
        simulation.set_state(np.concatenate([scene.rods[0].nodes, close.nodes]))
    after = simulation.state()
    assert all((after[name] == before[name]).all() for name in before)


def settled(scene: Scene, scheme: str, dt: float, until: float, **options: Any) -> Simulation:
    """Return the simulation after a time."""
    simulation = Simulation(scene, scheme=scheme, dt=dt, threads=1, **options)
    while simulation.time < until * (1.0 - 1e-9):
        simulation.step()
    return simulation


def test_all_schemes_press_rods_into_the_same_shape() -> None:
    scene = pressed()
    rest = settled(scene, "overdamped", 1e-2, 4.0).nodes
    for scheme, dt, options in (
        ("implicit", 1e-2, {}),
        ("explicit", 1e-3, {}),
        ("overdamped", 1e-2, {"rtol": 1e-5}),
    ):
        nodes = settled(scene, scheme, dt, 4.0, **options).nodes
        assert np.abs(nodes - rest).max() < 1e-3 * 2e-3, (scheme, options)


def test_adaptive_steps_follow_the_motion_of_short_ones_through_contact() -> None:
    scene = pressed(viscosity=1.0)
    times = (0.02, 0.05, 0.1)
    exact = Simulation(scene, dt=2.5e-5, threads=1).run(until=0.1, save_every=0.01, path=False)
    adaptive = Simulation(scene, rtol=1e-3, threads=1).run(until=0.1, save_every=0.01, path=False)
    size = 0.003  # flagrs.time_step.size: a twentieth of the longer rod
    for time in times:
        k = round(time / 0.01)
        assert np.abs(exact.nodes[k] - adaptive.nodes[k]).max() < 3e-3 * size


def test_a_run_goes_on_from_a_checkpoint_in_contact_to_the_last_bit(tmp_path: Path) -> None:
    scene = heap(4, friction=0.3)
    simulation = Simulation(scene, dt=4e-3, threads=1)
    simulation.step(400)
    assert simulation.frame()["contacts"] > 0
    simulation.checkpoint(tmp_path / "here.h5")
    again = Simulation.restore(tmp_path / "here.h5")
    both = Simulation(scene, dt=4e-3, threads=2)
    both.step(400)
    for other in (simulation, again, both):
        other.step(40)
    for name, values in simulation.state().items():
        assert (again.state()[name] == values).all() and (both.state()[name] == values).all(), name


@pytest.mark.parametrize("radius", [1e-4, 5e-4, 4e-3])
def test_rods_of_different_radii_rest_at_the_sum_of_both_and_bear_the_load(radius: float) -> None:
    thin = pressed(radius=radius)
    rod = thin.rods[1].replace(EI=thin.rods[0].EI_array()[0, 0, 0], EA=1.0, GJ=1e-6)
    scene = thin.replace(rods=(thin.rods[0], rod))
    simulation = settled(scene, "overdamped", 5e-2, 10.0)
    _, forces, _ = contact_forces(simulation)
    assert LEAST <= Watch(simulation).closest() < 1.05
    # What presses on the lower rod is what its clamps hold.
    gradient, at = simulation.gradient(), simulation.dof_of_node
    held_up = sum(gradient[at[node] : at[node] + 3] for node in (0, 1, 6, 7))
    size = float(np.linalg.norm(held_up))
    assert size > 1e-3
    # Sizes are exact; directions are those of closest points, where an edge presses with its nodes too.
    off = np.abs(np.linalg.norm(forces.sum(axis=0)) - size), np.abs(forces.sum(axis=0) + held_up).max()
    assert off[0] < 1e-2 * size and off[1] < 4e-2 * size


def test_a_branching_network_and_a_fold_touch_as_rods_do() -> None:
    # A fork that lies on a rail with both arms, and whose weight it bears.
    stem = np.array([[-0.03 + 0.01 * k, 0.0, 0.0] for k in range(4)])
    arms = [
        stem[-1] + 0.008 * k * np.array([0.8, side * 0.6, 0.0]) for side in (1.0, -1.0) for k in (1, 2, 3)
    ]
    fork = Rod(
        nodes=np.concatenate([stem, arms]) + np.array([0.0, 0.0, 2.1e-3]),
        edges=[[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 6], [3, 7], [7, 8], [8, 9]],
        radius=1e-3,
        material=SILICONE,
    )
    rails = [
        Rod.straight(
            length=0.06,
            edge_count=6,
            radius=1e-3,
            material=SILICONE,
            start=(x, -0.031, 0.0),
            direction=(0.0, 1.0, 0.0),
        )
        for x in (-0.0123, 0.0111)
    ]
    scene = Scene(
        rods=(fork, *rails),
        fluid=Fluid(viscosity=1.0, model="RFT", density=0.0),
        clamps=(held(1, 6), held(2, 6)),
        contact=Contact(),
        gravity=np.array([0.0, 0.0, -9.81]),
    )
    simulation = settled(scene, "overdamped", 5e-2, 10.0)
    _, forces, _ = contact_forces(simulation)
    assert forces[:, 2].sum() == pytest.approx(weight(fork), rel=1e-2)

    # A hairpin whose two arms are pressed together: self-contact bears the load.
    turn = np.linspace(-np.pi / 2.0, np.pi / 2.0, 13)
    bend = 0.006 * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    arm = np.arange(1, 11)[:, None] * np.array([-2e-3, 0.0, 0.0])
    hairpin = np.concatenate([(bend[0] + arm)[::-1], bend, bend[-1] + arm])
    rod = Rod(nodes=hairpin, radius=1e-3, material=SILICONE)
    last = len(hairpin) - 1
    squeeze = np.array([0.0, 2e-2, 0.0])
    loads = (PointLoad(node=0, force=squeeze), PointLoad(node=last, force=-squeeze))
    scene = Scene(rods=(rod,), fluid=Fluid(viscosity=1.0, model="RFT"), loads=loads, contact=Contact())
    simulation = Simulation(scene, dt=1e-2, threads=1)
    watch = Watch(simulation)
    for _ in range(200):
        simulation.step()
        assert watch.closest() >= LEAST
    assert watch.closest() < 1.05
    assert simulation.frame()["contacts"] > 0


def test_a_rod_rests_on_the_head_as_on_a_sphere() -> None:
    head_radius = 8e-3
    carrier = Rod.straight(length=0.02, edge_count=2, radius=1e-3, material=SILICONE, start=(-0.01, 0.0, 0.0))
    above = Rod.straight(
        length=0.03,
        edge_count=5,
        radius=1e-3,
        material=SILICONE,
        start=(0.0, -0.015, 0.0095),
        direction=(0, 1, 0),
    )
    scene = Scene(
        rods=(carrier, above),
        fluid=Fluid(viscosity=1.0, model="RFT"),
        head=Head(node=1, radius=head_radius),
        clamps=(held(0, 2), Clamp(rod=1, edges=(0,))),
        contact=Contact(head_radius=head_radius),
        loads=tuple(PointLoad(rod=1, node=k, force=np.array([0.0, 0.0, -1e-4])) for k in (0, 5)),
    )
    simulation = settled(scene, "overdamped", 1e-2, 2.0)
    middle = simulation.nodes[3:].mean(axis=0)
    # The rod balances on the sphere: its lowest part stays within the tolerance of the sum of radii.
    nearest = np.linalg.norm(simulation.nodes[5:7].mean(axis=0))
    assert LEAST <= nearest / (head_radius + 1e-3) < 1.05
    assert simulation.frame()["minimum_gap"] >= -0.05 * (head_radius + 1e-3)
    assert abs(middle[1]) < 1e-4
    without = settled(scene.replace(contact=Contact()), "overdamped", 1e-2, 4.0)
    assert without.nodes[3:, 2].max() < head_radius / 2.0


@pytest.mark.parametrize("scale", [1e-3, 1e-6])
def test_contact_does_not_know_the_unit_of_length(scale: float) -> None:
    here, there = (Simulation(pressed(factor), dt=1e-3, threads=1) for factor in (1.0, scale))
    for _ in range(20):
        here.step(10)
        there.step(10)
        assert np.abs(there.nodes / scale - here.nodes).max() < 1e-7 * 2e-3
    assert here.frame()["contacts"] == there.frame()["contacts"] > 0
