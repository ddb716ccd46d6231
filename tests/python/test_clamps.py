"""Clamps that move: rigidly, along a signal, sliding."""

from __future__ import annotations

import math

import flagrs
import numpy as np
import pytest

SOFT = flagrs.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
OIL = flagrs.Fluid(viscosity=1.0, model="RFT", density=1000.0)


def rod(**options):
    return flagrs.Rod.straight(length=0.1, edge_count=20, radius=1e-3, material=SOFT, **options)


def test_a_rod_held_everywhere_turns_like_a_rigid_body_with_its_frames():
    helix = flagrs.Rod.helix(
        helix_radius=6e-3, pitch=40e-3, axial_length=60e-3, edge_count=24, radius=1e-3, material=SOFT
    )
    turn = flagrs.Rotation(axis=(1.0, 2.0, -1.0), rate=0.7, center=(0.01, 0.0, 0.0))
    clamp = flagrs.Clamp(nodes=range(25), edges=range(24), rotation=turn, velocity=(1e-3, 0.0, 0.0))
    simulation = flagrs.Simulation(flagrs.Scene(rods=helix, clamps=clamp, fluid=OIL), dt=0.05, threads=1)
    before = simulation.energy()["total"]
    simulation.step(40)
    axis = np.array([1.0, 2.0, -1.0]) / math.sqrt(6.0)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    rotation = np.eye(3) + math.sin(1.4) * cross + (1.0 - math.cos(1.4)) * cross @ cross
    center = np.array([0.01, 0.0, 0.0])
    expected = (helix.nodes - center) @ rotation.T + center + [2e-3, 0.0, 0.0]
    assert simulation.nodes == pytest.approx(expected, abs=1e-12)
    # A rigid motion strains nothing, since frames turned with the nodes: round-off, EA (1e-16 |x| / l)^2 l.
    assert abs(simulation.energy()["total"] - before) < 1e-20


def test_a_displacement_moves_a_clamp_to_where_it_says():
    def place(time):
        return (0.0, 2e-3 * math.sin(3.0 * time), 0.0)

    scene = flagrs.Scene(
        rods=rod(), clamps=flagrs.Clamp(nodes=(0, 1), edges=(0,), displacement=place), fluid=OIL
    )
    simulation = flagrs.Simulation(scene, rtol=1e-3, threads=1)
    trajectory = simulation.run(until=2.0, save_every=0.5, path=False)
    for time, nodes in zip(simulation_times(trajectory), trajectory.nodes, strict=True):
        # Frames between steps are interpolated, to rtol times the size of the rod.
        assert nodes[0, 1] == pytest.approx(2e-3 * math.sin(3.0 * time), abs=1e-3 * 5e-3)


def simulation_times(trajectory):
    return trajectory.time.tolist()


def test_a_sliding_node_gives_way_along_its_free_axis_alone():
    # Gravity pulls down along x; the ends may slide along x only.
    clamps = flagrs.Clamp(nodes=(0, 20), axes="yz")
    scene = flagrs.Scene(rods=rod(), clamps=clamps, fluid=OIL, loads=flagrs.LineLoad(force=(1e-3, 1e-4, 0.0)))
    simulation = flagrs.Simulation(scene, rtol=1e-4, threads=1)
    simulation.run(until=1.0, save_every=1.0, path=False)
    moved = simulation.nodes - rod().nodes
    assert moved[[0, 20], 1:] == pytest.approx(np.zeros((2, 2)), abs=0.0)
    # Falling along x without hindrance: drag on all nodes against the force.
    along = np.zeros_like(moved)
    along[:, 0] = 1.0
    drag = along.ravel() @ flagrs.Simulation(scene).resistance() @ along.ravel()
    assert moved[0, 0] == pytest.approx(1e-3 * 0.1 / drag, rel=2e-2)
    # The middle bends away under the force across.
    assert moved[10, 1] > 2e-5


def test_a_constant_velocity_as_a_function_is_the_same_as_as_numbers():
    numbers = flagrs.Clamp(nodes=(0, 1), edges=(0,), velocity=(0.0, 1e-3, 0.0))
    function = flagrs.Clamp(nodes=(0, 1), edges=(0,), velocity=lambda time: (0.0, 1e-3, 0.0))
    ends = []
    for clamp in (numbers, function):
        simulation = flagrs.Simulation(flagrs.Scene(rods=rod(), clamps=clamp, fluid=OIL), dt=0.05, threads=1)
        simulation.step(20)
        ends.append(simulation.nodes)
    assert ends[0] == pytest.approx(ends[1], abs=1e-15)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"nodes": (), "edges": (0,), "displacement": (1.0, 0.0, 0.0)}, "displacement"),
        ({"nodes": (0,), "axes": "xw"}, "axes"),
        ({"nodes": (0,), "axes": "xy", "rotation": {"axis": (0.0, 0.0, 1.0)}}, "rotation"),
        ({"nodes": (0,), "rotation": {"axis": (0.0, 0.0, 0.0)}}, "axis"),
    ],
)
def test_bad_clamps_name_the_field(options, words):
    with pytest.raises(flagrs.SceneError, match=words):
        flagrs.Clamp(**options)


def test_moving_clamps_survive_toml(tmp_path):
    clamp = flagrs.Clamp(
        nodes=(0, 1),
        edges=(0,),
        rotation=flagrs.Rotation(
            axis=(1.0, 1.0, 0.3), angle=flagrs.Table(times=[0.0, 1.0], values=[0.0, 2.0])
        ),
        displacement=flagrs.Table(times=[0.0, 1.0], values=[[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0]]),
    )
    scene = flagrs.Scene(rods=rod(), clamps=clamp, fluid=OIL)
    scene.to_toml(tmp_path / "scene.toml")
    assert flagrs.Scene.from_toml(tmp_path / "scene.toml") == scene
