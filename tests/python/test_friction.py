"""Friction under error control, its default smoothing, and contact's output and stiffness pair by pair."""

from __future__ import annotations

import numpy as np
import pytest
from contact_cases import Watch, pairs_apart, pressed, radii
from flagrs import (
    Clamp,
    Contact,
    ContactWarning,
    Fluid,
    Material,
    PointLoad,
    Rod,
    Scene,
    Simulation,
    scenarios,
)
from flagrs.contact import segment_distance
from flagrs.contact_scales import SLIP_SHARE, contact_scales, pair_stiffness
from flagrs.time_step import size
from flagrs.validation.problems.friction import Capstan, incline, incline_theory
from flagrs.validation.touching import SILICONE, held

FRICTION, STEEP = 0.3, 1.5


@pytest.mark.parametrize("slip", [1e-5, 1e-6])
@pytest.mark.parametrize("rtol", [1e-2, 1e-3])
def test_a_rod_steeper_than_the_angle_of_friction_slides_under_error_control(
    rtol: float, slip: float
) -> None:
    angle = float(np.arctan(STEEP * FRICTION))
    simulation = Simulation(incline(angle, FRICTION, slip), rtol=rtol, threads=1)
    start = simulation.nodes[:6, 0].mean()
    simulation.run(until=0.2, save_every=0.05, path=False)
    slid = simulation.nodes[:6, 0].mean() - start
    # It leaps off its rails for a few microseconds at the start; then it slides as theory says.
    expected = 0.2 * incline_theory(simulation, angle)
    assert abs(slid - expected) < 10.0 * rtol * size(simulation.scene)
    assert slid == pytest.approx(expected, rel=5e-3)


def rod_on_rails(friction: float, angle: float, **contact: float) -> Scene:
    """Return a soft rod across two held rails, tilted by an angle [rad], with default scales of contact."""
    rails = [
        Rod.straight(
            length=0.1,
            edge_count=10,
            radius=1e-3,
            material=SILICONE,
            start=(-0.0487, y, 0.0),
            direction=(1.0, 0.0, 0.0),
        )
        for y in (-0.006, 0.006)
    ]
    rod = Rod.straight(
        length=0.02,
        edge_count=5,
        radius=1e-3,
        material=SILICONE,
        start=(0.0, -0.01, 2e-3),
        direction=(0.0, 1.0, 0.0),
    )
    gravity = 9.81 * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    return Scene(
        rods=(rod, *rails),
        fluid=Fluid(viscosity=1.0, model="RFT", density=0.0),
        clamps=(held(1, 10), held(2, 10)),
        gravity=gravity,
        contact=Contact(friction=friction, **contact),
    )


@pytest.mark.parametrize("rtol", [1e-2, 1e-3])
def test_the_error_with_friction_is_within_ten_times_the_error_asked_for(rtol: float) -> None:
    scene = rod_on_rails(FRICTION, float(np.arctan(STEEP * FRICTION)))
    exact = Simulation(scene, rtol=rtol / 100.0, threads=1).run(until=0.1, save_every=0.02, path=False)
    found = Simulation(scene, rtol=rtol, threads=1).run(until=0.1, save_every=0.02, path=False)
    missed = np.linalg.norm(found.nodes[:, :6] - exact.nodes[:, :6], axis=2).max()
    assert missed < 10.0 * rtol * size(scene)
    assert np.abs(exact.nodes[-1, :6, 0] - exact.nodes[0, :6, 0]).min() > 1e-5


@pytest.mark.parametrize("options", [{"dt": 1e-3}, {"rtol": 1e-3}])
def test_a_rod_that_must_stick_creeps_below_a_thousandth_of_its_fall(options: dict[str, float]) -> None:
    scene = rod_on_rails(0.5, float(np.arctan(0.5 * FRICTION)))
    simulation = Simulation(scene, threads=1, **options)
    simulation.run(until=0.5, save_every=0.1, path=False)
    slip = SLIP_SHARE * contact_scales(scene).velocity[0]
    # What gravity gives the rod without friction: the mean drag is the one the scale is made of.
    free = Simulation(rod_on_rails(0.0, float(np.arctan(0.5 * FRICTION))), threads=1, **options)
    free.run(until=0.5, save_every=0.1, path=False)
    assert 0.0 < simulation.velocities[:6, 0].mean() < slip
    assert simulation.velocities[:6, 0].mean() < 1e-2 * free.velocities[:6, 0].mean()


def test_scales_of_a_pair_do_not_know_the_rods_elsewhere() -> None:
    scene = rod_on_rails(0.3, 0.1)
    alone = contact_scales(scene)
    steel = Material(youngs_modulus=2e11, density=7800.0)
    far = Rod.straight(length=1.0, edge_count=5, radius=5e-3, material=steel, start=(0.0, 10.0, 0.0))
    fast = Clamp(rod=3, nodes=(0, 1), edges=(0,), velocity=np.array([5.0, 0.0, 0.0]))
    both = contact_scales(scene.replace(rods=(*scene.rods, far), clamps=(*scene.clamps, fast)))
    for name in ("driven", "bent", "velocity"):
        assert (getattr(both, name)[:1] == getattr(alone, name)[:1]).all(), name
    # A rail is held: neither its stiffness nor its weight decides, only the rod that lies on it.
    own = pair_stiffness(alone, (0, 0), 2e-3, 0.05)
    assert pair_stiffness(both, (0, 1), 2e-3, 0.05) == own
    # Against the softer rod a stiff one is not stiffer than what drives it.
    assert both.bent[3] > 100.0 * both.bent[0]
    driven = max(both.driven[3], both.driven[0])
    assert pair_stiffness(both, (0, 3), 2e-3, 0.05) * both.bent[0] == pytest.approx(
        max(driven, both.bent[0]) * own, rel=1e-12
    )


def test_saved_frames_show_no_overlap_deeper_than_the_tolerance() -> None:
    # Loose steps and dense frames: interpolation alone goes below the least distance here.
    scene = pressed(viscosity=1.0)
    simulation = Simulation(scene, rtol=1e-1, threads=1)
    trajectory = simulation.run(until=0.4, save_every=2e-3, path=False)
    pairs, edges = pairs_apart(scene), simulation.edges
    thickness = radii(scene)[pairs].sum(axis=1)
    a, b = edges[pairs[:, 0]], edges[pairs[:, 1]]
    least = min(
        float((segment_distance(x[a[:, 0]], x[a[:, 1]], x[b[:, 0]], x[b[:, 1]])[0] / thickness).min())
        for x in trajectory.nodes
    )
    assert 0.95 <= least < 1.05


@pytest.mark.parametrize("friction", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("thin", [1e-4, 1e-3])
def test_rods_of_very_different_radii_pressed_hard_beside_clamps_keep_apart(
    friction: float, thin: float
) -> None:
    thick = Rod.straight(length=0.05, edge_count=5, radius=4e-3, material=SILICONE, start=(-0.025, 0.0, 0.0))
    upper = Rod.straight(
        length=0.04,
        edge_count=8,
        radius=thin,
        material=SILICONE,
        start=(1e-3, -0.02, 4e-3 + thin),
        direction=(0.0, 1.0, 0.0),
    )
    bending = SILICONE.youngs_modulus * np.pi / 4.0 * 1e-3**4
    upper = upper.replace(EI=bending, EA=1.0, GJ=bending)
    scene = Scene(
        rods=(thick, upper),
        fluid=Fluid(viscosity=1.0, model="RFT"),
        clamps=(held(0, 5), Clamp(rod=1, nodes=(4,), velocity=np.array([1e-3, 0.0, 0.0]))),
        loads=tuple(PointLoad(rod=1, node=k, force=np.array([0.0, 0.0, -1e-2])) for k in (0, 8)),
        contact=Contact(friction=friction),
    )
    simulation = Simulation(scene, rtol=1e-2, threads=1)
    watch = Watch(simulation)
    for _ in range(60):
        simulation.step()
        assert watch.closest() >= 0.95
    assert simulation.frame()["contacts"] > 0


def test_scales_of_many_rods_are_found_in_linear_time() -> None:
    rod = Rod.straight(length=0.01, edge_count=2, radius=1e-4, material=SILICONE)
    rods = tuple(rod.replace(nodes=rod.nodes + np.array([0.0, 1e-3 * k, 0.0])) for k in range(400))
    scene = Scene(rods=rods, fluid=Fluid(viscosity=1.0, model="RFT"), contact=Contact())
    scales = contact_scales(scene)
    assert len(scales.driven) == 400
    assert (scales.bent == scales.bent[0]).all()


@pytest.mark.parametrize("slip", [1e-5, 1e-6])
@pytest.mark.parametrize(("friction", "steep"), [(0.3, 1.5), (1.0, 0.8), (2.0, 0.9), (2.0, 1.3)])
def test_a_rod_that_leaps_off_its_rails_costs_no_more_than_a_few_hundred_iterations(
    friction: float, steep: float, slip: float
) -> None:
    # Pressed with hundreds of times its weight it starts at 180 m/s: friction turns over within 1e-8 of that.
    angle = float(np.arctan(steep * friction))
    simulation = Simulation(incline(angle, friction, slip), rtol=1e-4, threads=1)
    simulation.run(until=0.05, save_every=0.05, path=False)
    statistics = simulation.statistics
    assert statistics["steps"] < 300
    assert statistics["newton_iterations"] < 2500
    theory = incline_theory(simulation, angle)
    assert simulation.velocities[:6, 0].mean() == pytest.approx(theory, rel=1e-2)


def test_a_rope_wrapped_once_around_a_drum_holds_what_the_capstan_says() -> None:
    # Its first step, 1 ms, starts at rest under the whole load.
    rope = Capstan(2.0 * np.pi, 0.5)
    assert rope.ratio() == pytest.approx(rope.theory(), rel=1e-2)


@pytest.mark.parametrize(("stiffness", "side"), [(1.0, "below"), (1e12, "above")])
def test_a_stiffness_far_from_the_suitable_one_is_warned_of(stiffness: float, side: str) -> None:
    scene = scenarios.clamped_flagella(count=4, contact={"stiffness": stiffness})
    own = pair_stiffness(contact_scales(scene), (0, 1), 2e-3, 0.05)
    factor = max(own / stiffness, stiffness / own)
    with pytest.warns(ContactWarning, match=f"is {factor:.1e} times {side}".replace("+", "[+]")):
        Simulation(scene, rtol=1e-2, threads=1)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("factor", [None, 0.02, 50.0])
def test_a_stiffness_near_the_suitable_one_is_not_warned_of(factor: float | None) -> None:
    scene = scenarios.clamped_flagella(count=4)
    own = pair_stiffness(contact_scales(scene), (0, 1), 2e-3, 0.05)
    given = {} if factor is None else {"stiffness": factor * own}
    Simulation(scenarios.clamped_flagella(count=4, contact=given), rtol=1e-2, threads=1)
