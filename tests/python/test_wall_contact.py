"""Rods that touch walls: they rest, slide, roll off nothing, and never pass through."""

from __future__ import annotations

import flagrs
import numpy as np
import pytest
from flagrs import Contact, Fluid, Head, Material, Rod, Scene, Simulation, Wall

SOFT = Material(youngs_modulus=1e6, poisson_ratio=0.5, density=2000.0)
RADIUS = 1e-3
FLUID = Fluid(viscosity=0.1, density=1000.0)


def rod(start: tuple[float, ...], end: tuple[float, ...], edges: int = 6) -> Rod:
    """Return a straight rod between two points."""
    return Rod(nodes=np.linspace(start, end, edges + 1), radius=RADIUS, material=SOFT)


def weight(length: float) -> float:
    """Return the weight of a rod less its buoyancy [N]."""
    return float(9.81 * 1000.0 * np.pi * RADIUS**2 * length)


@pytest.mark.parametrize("kind", ["no_slip", "free_surface", "contact"])
def test_a_rod_that_has_fallen_on_a_wall_rests_there_with_its_weight(kind):
    falling = rod((0, 0, 1.5e-3), (24e-3, 0, 4e-3))
    scene = Scene(rods=falling, fluid=FLUID, gravity=(0, 0, -9.81), walls=Wall(kind=kind), contact=Contact())
    simulation = Simulation(scene, rtol=1e-3)
    trajectory = simulation.run(until=3.0, save_every=0.1)
    heights = trajectory.nodes[:, :, 2]
    assert heights.min() > 0.95 * RADIUS
    assert heights[-1].max() < 1.05 * RADIUS
    assert np.abs(simulation.velocities).max() < 1e-6
    pairs, forces = simulation.contact_forces()
    # The wall comes after all edges.
    assert (pairs[:, 1] == 6).all()
    assert forces.sum() == pytest.approx(
        weight(np.linalg.norm(np.diff(falling.nodes[[0, -1]], axis=0))), rel=1e-3
    )


def test_the_balance_of_forces_counts_what_walls_push_and_hold():
    leaning = rod((0, 0, 1.02e-3), (24e-3, 0, 4e-3))
    wall, contact = Wall(normal=(0.1, 0, 1)), Contact(friction=0.3)
    scene = Scene(rods=leaning, fluid=FLUID, gravity=(0, 0, -9.81), walls=wall, contact=contact)
    simulation = Simulation(scene, dt=2e-3)
    simulation.step(60)
    assert simulation.contact_forces()[1].sum() > 0.1 * weight(0.024)
    assert simulation.statistics["force_imbalance"] < 1e-6
    assert simulation.statistics["torque_imbalance"] < 1e-6


@pytest.mark.parametrize("share", [0.8, 1.25])
def test_a_rod_slides_down_a_wall_that_is_steeper_than_friction_holds(share):
    friction = 0.4
    angle = np.arctan(friction * share)
    wall = Wall(normal=(np.sin(angle), 0, np.cos(angle)))
    along = np.array([np.cos(angle), 0, -np.sin(angle)])
    start = wall.normal * RADIUS
    scene = Scene(
        rods=rod(start, start + 0.02 * along),
        fluid=FLUID,
        gravity=(0, 0, -9.81),
        walls=wall,
        contact=Contact(friction=friction),
    )
    trajectory = Simulation(scene, rtol=1e-3).run(until=1.0, save_every=0.5)
    moved = (trajectory.nodes[-1] - trajectory.nodes[1]).mean(axis=0) @ along
    # What is left of the weight drags it at this speed through fluid without a wall, and slower near one.
    left = weight(0.02) * (np.sin(angle) - friction * np.cos(angle))
    fastest = left / (2 * np.pi * 0.1 * 0.02 / np.log(0.02 / RADIUS))
    if share < 1.0:
        assert abs(moved) < 0.5 * 0.02 * abs(fastest)
    else:
        assert 0.5 * 0.1 * fastest < moved < 0.5 * fastest


def test_a_rod_driven_against_walls_from_all_sides_passes_through_none():
    box = [
        Wall(point=8e-3 * np.eye(3)[axis] * sign, normal=-sign * np.eye(3)[axis], kind="contact")
        for axis in range(3)
        for sign in (-1, 1)
    ]
    turn = np.linspace(0, 2 * np.pi, 13)
    nodes = 5e-3 * np.stack([np.cos(turn), np.sin(turn), 0.2 * turn], axis=1)
    scene = Scene(
        rods=Rod(nodes=nodes, radius=RADIUS, material=SOFT),
        fluid=FLUID,
        gravity=(0, 0, 0),
        loads=[
            flagrs.PointLoad(node=0, force=(3e-3, 2e-3, -4e-3)),
            flagrs.PointLoad(node=12, force=(-2e-3, 3e-3, 4e-3)),
        ],
        walls=box,
        contact=Contact(friction=0.5),
    )
    trajectory = Simulation(scene, rtol=1e-2).run(until=2.0, save_every=0.02)
    least = min(float(wall.heights(trajectory.nodes.reshape(-1, 3)).min()) for wall in box)
    # Saved frames keep the tolerance of contact as accepted states do.
    assert 0.95 * RADIUS < least < 1.05 * RADIUS
    assert trajectory.minimum_gap().min() == pytest.approx(least - RADIUS, abs=0.05 * RADIUS)


def test_a_rod_thrown_at_a_wall_in_vacuum_comes_back_with_its_energy():
    thrown = rod((0, 0, 3e-3), (20e-3, 0, 3e-3))
    scene = Scene(rods=thrown, gravity=(0, 0, -9.81), walls=Wall(), contact=Contact())
    simulation = Simulation(scene, scheme="implicit", rtol=1e-5)
    simulation.run(until=0.04, save_every=0.01)
    assert simulation.nodes[:, 2].min() > 0.95 * RADIUS
    # It falls by 2 mm in 20 ms, and is back in as long a time; what it loses is the error of the steps.
    assert simulation.nodes[:, 2].max() > 2.9e-3
    assert abs(simulation.nodes[:, 2] - simulation.nodes[0, 2]).max() < 1e-4


def test_the_head_as_a_sphere_stays_off_the_wall():
    # Stiff, so that its ends are at rest when the head is.
    stiff = SOFT.replace(youngs_modulus=1e10)
    shaft = Rod(nodes=[[-5e-3, 0, 0.1], [0, 0, 0.1], [5e-3, 0, 0.1]], radius=1e-4, material=stiff)
    scene = Scene(
        rods=shaft,
        fluid=Fluid(viscosity=1.0, density=0.0),
        head=Head(node=1, radius=1e-3),
        loads=flagrs.PointLoad(node=1, force=(0, 0, -1e-2)),
        walls=Wall(kind="contact"),
        contact=Contact(head_radius=20e-3),
    )
    simulation = Simulation(scene, rtol=1e-3)
    simulation.run(until=1.0, save_every=0.5)
    assert 0.95 * 20e-3 < simulation.nodes[1, 2] < 1.05 * 20e-3
    pairs, forces = simulation.contact_forces()
    assert pairs.tolist() == [[2, 3]]
    assert forces.sum() == pytest.approx(1e-2, rel=1e-3)


def test_an_overlap_with_a_wall_is_told_by_its_place():
    with pytest.raises(flagrs.SceneError, match=r"rods\[0\].nodes\[0\]: .* gap of") as error:
        Scene(rods=rod((0, 0, 0.5e-3), (20e-3, 0, 4e-3)), fluid=FLUID, walls=Wall(), contact=Contact())
    assert error.value.field == "rods[0].nodes[0]"
