"""Loads, magnetic fields and background flows against closed forms."""

from __future__ import annotations

import math

import flagrs
import numpy as np
import pytest
from flagrs.scene.vector_signal import vector_at

SOFT = flagrs.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
OIL = flagrs.Fluid(viscosity=1.0, model="RFT", density=1000.0)


def rod(**options):
    return flagrs.Rod.straight(length=0.1, edge_count=20, radius=1e-3, material=SOFT, **options)


def direction(simulation):
    nodes = simulation.nodes
    axis = nodes[-1] - nodes[0]
    return axis / np.linalg.norm(axis)


def run(scene, until, **options):
    simulation = flagrs.Simulation(scene, rtol=1e-4, threads=1, **options)
    simulation.run(until=until, save_every=until, path=False)
    return simulation


def test_a_uniform_flow_carries_a_free_rod_along():
    velocity = (1e-3, -2e-3, 5e-4)
    fluid = OIL.replace(background=flagrs.LinearFlow.uniform(velocity))
    for model in ("RFT", "RSS"):
        simulation = run(flagrs.Scene(rods=rod(), fluid=fluid.replace(model=model)), 2.0)
        moved = simulation.nodes - rod().nodes
        # rtol times a twentieth of the length.
        assert moved == pytest.approx(np.broadcast_to(2.0 * np.array(velocity), moved.shape), abs=1e-4 * 5e-3)


def test_a_rod_turns_with_a_fluid_that_turns_like_a_rigid_body():
    # Nothing strains: the rod keeps its shape and turns about the center of rotation, twist included.
    flow = flagrs.LinearFlow.rotation((0.0, 0.0, 0.5))
    simulation = run(flagrs.Scene(rods=rod(), fluid=OIL.replace(background=flow)), 1.0)
    cosine, sine = math.cos(0.5), math.sin(0.5)
    turned = rod().nodes @ np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    # rtol times the size of the rod, a twentieth of its length, times ten.
    assert np.abs(simulation.nodes - turned).max() < 1e-3 * 0.1 / 20.0 * 10.0


def test_a_stiff_rod_in_shear_turns_as_slender_body_theory_says():
    # In the plane of shear d(angle)/dt = -rate sin^2(angle): cot(angle) grows by rate t.
    start = math.radians(60.0)
    along = np.array([math.cos(start), math.sin(start), 0.0])
    stiff = flagrs.Material(youngs_modulus=1e9, poisson_ratio=0.5, density=1000.0)
    bar = flagrs.Rod.straight(
        length=0.1, edge_count=20, radius=1e-3, material=stiff, start=-0.05 * along, direction=along
    )
    fluid = OIL.replace(background=flagrs.LinearFlow.shear(rate=1.0))
    simulation = run(flagrs.Scene(rods=bar, fluid=fluid), 2.0)
    angle = math.atan2(*direction(simulation)[1::-1])
    # The sums over nodes weigh the ends a little differently, by 1e-3.
    assert angle == pytest.approx(math.atan2(1.0, 1.0 / math.tan(start) + 2.0), rel=2e-3)


def test_a_background_function_gives_the_same_as_the_flow_it_stands_for():
    shear = flagrs.LinearFlow.shear(rate=2.0)

    def flow(points, time):
        return np.stack([2.0 * points[:, 1], 0.0 * points[:, 0], 0.0 * points[:, 0]], axis=1)

    given = flagrs.FlowFunction(function=flow, reach=1e-4)
    ends = [
        run(flagrs.Scene(rods=rod(direction=(1.0, 1.0, 0.3)), fluid=OIL.replace(background=background)), 0.5)
        for background in (shear, given)
    ]
    assert ends[0].nodes == pytest.approx(ends[1].nodes, abs=1e-12)
    assert ends[0].theta == pytest.approx(ends[1].theta, abs=1e-9)


def test_a_background_function_that_fails_says_so():
    broken = flagrs.FlowFunction(function=lambda points, time: points[:2], reach=1e-4)
    scene = flagrs.Scene(rods=rod(), fluid=OIL.replace(background=broken))
    with pytest.raises(flagrs.FlagrsError, match="background flow"):
        flagrs.Simulation(scene).step()


def test_a_magnetised_rod_turns_into_the_field():
    # zeta d(angle)/dt = -m B sin(angle): tan(angle / 2) decays exponentially.
    magnetization, field = 1e4, 1e-2
    stiff = flagrs.Material(youngs_modulus=1e9, poisson_ratio=0.5, density=1000.0)
    bar = rod(magnetization=(0.0, 0.0, magnetization)).replace(material=stiff)
    start = math.radians(80.0)
    scene = flagrs.Scene(
        rods=bar,
        fluid=OIL,
        magnetic_field=flagrs.MagneticField(field=(field * math.cos(start), field * math.sin(start), 0.0)),
    )
    simulation = flagrs.Simulation(scene, rtol=1e-5, threads=1)
    resistance = simulation.resistance()
    nodes = bar.nodes - bar.nodes.mean(axis=0)
    spin = np.cross([0.0, 0.0, 1.0], nodes).ravel()
    drag = spin @ resistance @ spin
    moment = magnetization * math.pi * 1e-6 * 0.1
    rate = moment * field / drag
    simulation.run(until=1.0 / rate, save_every=1.0 / rate, path=False)
    along = direction(simulation)
    left = start - math.atan2(along[1], along[0])
    assert math.tan(0.5 * left) == pytest.approx(math.exp(-1.0) * math.tan(0.5 * start), rel=1e-3)


def test_a_magnetised_rod_in_a_gradient_drifts_by_moment_times_gradient():
    gradient = np.diag([2.0, -1.0, -1.0]) * 0.1
    bar = rod(magnetization=(0.0, 0.0, 1e4))
    scene = flagrs.Scene(
        rods=bar, fluid=OIL, magnetic_field=flagrs.MagneticField(field=(1e-2, 0.0, 0.0), gradient=gradient)
    )
    simulation = flagrs.Simulation(scene, rtol=1e-5, threads=1)
    along = np.zeros_like(bar.nodes)
    along[:, 0] = 1.0
    drag = along.ravel() @ simulation.resistance() @ along.ravel()
    start = bar.nodes.mean(axis=0)
    simulation.run(until=0.1, save_every=0.1, path=False)
    moment = 1e4 * math.pi * 1e-6 * 0.1
    drift = (simulation.nodes.mean(axis=0) - start)[0] / 0.1
    assert drift == pytest.approx(moment * gradient[0, 0] / drag, rel=1e-3)


def test_a_force_that_follows_a_signal_moves_a_rod_by_its_integral():
    force = flagrs.Table(times=[0.0, 1.0, 2.0], values=[[0.0, 0.0, 0.0], [0.0, 0.0, 2e-4], [0.0, 0.0, 0.0]])
    scene = flagrs.Scene(rods=rod(), fluid=OIL, loads=flagrs.LineLoad(force=force))
    simulation = run(scene, 2.0)
    across = np.zeros_like(rod().nodes)
    across[:, 2] = 1.0
    drag = across.ravel() @ flagrs.Simulation(scene).resistance() @ across.ravel()
    moved = (simulation.nodes - rod().nodes)[:, 2].mean()
    # Ten times rtol times a twentieth of the length.
    assert moved == pytest.approx(2e-4 * 0.1 / drag, abs=10.0 * 1e-4 * 5e-3)


def test_a_torque_spins_a_rod_against_its_twist_drag():
    scene = flagrs.Scene(rods=rod(), fluid=OIL, loads=flagrs.PointLoad(edge=10, torque=(1e-7, 0.0, 0.0)))
    simulation = run(scene, 5.0)
    first = simulation.theta.mean()
    simulation.run(until=6.0, save_every=1.0, path=False)
    rate = 1e-7 / (4.0 * math.pi * 1e-6 * 0.1)
    assert simulation.theta.mean() - first == pytest.approx(rate, rel=1e-6)


def test_a_follower_force_turns_with_the_rod():
    # Pushed sideways in its material frame at both ends, a stiff rod spins steadily.
    stiff = flagrs.Material(youngs_modulus=1e9, poisson_ratio=0.5, density=1000.0)
    bar = flagrs.Rod.straight(
        length=0.1, edge_count=20, radius=1e-3, material=stiff, director=(0.0, 1.0, 0.0)
    )
    loads = [
        flagrs.PointLoad(node=20, force=(1e-4, 0.0, 0.0), frame="material"),
        flagrs.PointLoad(node=0, force=(-1e-4, 0.0, 0.0), frame="material"),
    ]
    scene = flagrs.Scene(rods=bar, fluid=OIL, loads=loads)
    nodes = bar.nodes - bar.nodes.mean(axis=0)
    spin = np.cross([0.0, 0.0, 1.0], nodes).ravel()
    drag = spin @ flagrs.Simulation(scene).resistance() @ spin
    rate = 1e-4 * 0.1 / drag
    simulation = run(scene, 2.0 / rate)
    along = direction(simulation)
    assert math.atan2(along[1], along[0]) == pytest.approx(2.0, rel=2e-3)


def test_scenes_with_loads_and_flows_survive_toml(tmp_path):
    scene = flagrs.Scene(
        rods=rod(magnetization=(0.0, 0.0, 1.0)),
        fluid=OIL.replace(
            background=[flagrs.LinearFlow.shear(rate=1.0), flagrs.PoiseuilleFlow(speed=1e-3, radius=0.1)]
        ),
        loads=[
            flagrs.PointLoad(node=3, force=(1.0, 2.0, 3.0)),
            flagrs.PointLoad(edge=2, torque=flagrs.Table(times=[0.0, 1.0], values=[[0, 0, 0], [1, 2, 3]])),
            flagrs.LineLoad(
                force=(0.0, flagrs.Table(times=[0.0, 1.0], values=[0.0, 1.0]), 1.0), edges=(1, 2)
            ),
        ],
        magnetic_field=flagrs.MagneticField(field=(0.0, 0.0, 1e-3)),
    )
    scene.to_toml(tmp_path / "scene.toml")
    assert flagrs.Scene.from_toml(tmp_path / "scene.toml") == scene
    assert flagrs.Scene.from_json(scene.to_json()) == scene


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: flagrs.PointLoad(force=(1.0, 0.0, 0.0)), "node"),
        (lambda: flagrs.PointLoad(node=1, force=(1.0, 0.0)), "force"),
        (lambda: flagrs.LineLoad(force=(1.0, 0.0, 0.0), edges=()), "edges"),
        (lambda: flagrs.MagneticField(field=(1.0, 0.0, 0.0), gradient=np.eye(3)), "trace"),
        (lambda: flagrs.LinearFlow(gradient=np.eye(3)), "trace"),
        (lambda: flagrs.LinearFlow.shear(rate=1.0, across=(1, 0, 0)), "across"),
        (lambda: flagrs.PoiseuilleFlow(speed=1.0, radius=-1.0), "radius"),
        (lambda: flagrs.Scene(rods=rod(), loads=flagrs.PointLoad(node=99, force=(1.0, 0.0, 0.0))), "node"),
        (lambda: rod(magnetization=np.zeros((3, 3))), "magnetization"),
    ],
)
def test_bad_loads_and_flows_name_the_field(make, words):
    with pytest.raises(flagrs.SceneError, match=words):
        make()


def test_a_vector_function_is_called_once_an_instant():
    calls = []

    def force(time):
        calls.append(time)
        return (0.0, 0.0, 1e-6)

    assert vector_at(force, 0.5).tolist() == [0.0, 0.0, 1e-6]
    assert calls == [0.5]
