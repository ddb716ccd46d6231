"""Forces from a Python function."""

from __future__ import annotations

import math

import flagrs
import numpy as np
import pytest

SOFT = flagrs.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
OIL = flagrs.Fluid(viscosity=1.0, model="RFT", density=1000.0)
ROD = flagrs.Rod.straight(length=0.1, edge_count=10, radius=1e-3, material=SOFT)
SCENE = flagrs.Scene(rods=ROD, fluid=OIL)


def drag_across():
    across = np.zeros_like(ROD.nodes)
    across[:, 2] = 1.0
    return float(across.ravel() @ flagrs.Simulation(SCENE).resistance() @ across.ravel())


def test_a_constant_force_does_what_a_load_does():
    force = np.zeros_like(ROD.nodes)
    force[3] = (1e-5, 2e-5, 3e-5)
    given = flagrs.Simulation(SCENE, force=lambda *_: force, dt=0.02, threads=1)
    loaded = flagrs.Scene(rods=ROD, fluid=OIL, loads=flagrs.PointLoad(node=3, force=force[3]))
    same = flagrs.Simulation(loaded, dt=0.02, threads=1)
    for simulation in (given, same):
        simulation.step(20)
    assert given.nodes == pytest.approx(same.nodes, abs=1e-14)


def test_a_stiff_trap_with_its_stiffness_is_followed_at_any_step():
    # All nodes in springs: z decays as exp(-k N t / drag), by 1 / (1 + x) a step in backward Euler.
    spring, dt = 1.0, 0.5
    count = len(ROD.nodes)
    nodal = np.broadcast_to(spring * np.eye(3), (count, 3, 3))

    def trap(time, nodes, velocities, directors):
        return {"forces": -spring * (nodes - ROD.nodes - [0.0, 0.0, 1e-3]), "stiffness": nodal}

    simulation = flagrs.Simulation(SCENE, force=trap, dt=dt, threads=1)
    simulation.step(1)
    held = simulation.nodes[:, 2]
    # Every node within the trap's own time: the ends, with half the drag, come closest.
    assert held.min() > 0.9e-3
    assert held.max() <= 1e-3


def test_a_soft_trap_under_rtol_is_as_exact_as_asked():
    total = drag_across()
    spring = 0.2 * total / len(ROD.nodes)

    def trap(time, nodes, velocities, directors):
        force = np.zeros_like(nodes)
        force[:, 2] = spring * (1e-2 - nodes[:, 2].mean())
        return force

    simulation = flagrs.Simulation(SCENE, force=trap, rtol=1e-3, threads=1)
    simulation.run(until=5.0, save_every=5.0, path=False)
    expected = 1e-2 * (1.0 - math.exp(-0.2 * 5.0))
    # Ten times rtol times the size of the rod, a twentieth of its length.
    assert simulation.nodes[:, 2].mean() == pytest.approx(expected, abs=10.0 * 1e-3 * 5e-3)


def test_a_torque_on_an_edge_spins_it():
    torques = np.zeros((10, 3))
    torques[5, 0] = 1e-7

    def twist(time, nodes, velocities, directors):
        assert directors[0, 2] == pytest.approx([1.0, 0.0, 0.0])
        return {"forces": np.zeros_like(nodes), "torques": torques}

    simulation = flagrs.Simulation(SCENE, force=twist, dt=0.1, threads=1)
    simulation.step(200)
    before = simulation.theta.mean()
    simulation.step(10)
    rate = 1e-7 / (4.0 * math.pi * 1e-6 * 0.1)
    assert simulation.theta.mean() - before == pytest.approx(rate, rel=1e-6)


def test_the_function_is_called_once_a_step_even_if_the_step_is_tried_again():
    times = []

    def record(time, nodes, velocities, directors):
        times.append(time)
        return np.zeros_like(nodes)

    simulation = flagrs.Simulation(SCENE, force=record, dt=0.1, threads=1)
    simulation.step(7)
    assert times == pytest.approx([0.1 * k for k in range(7)])


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (None, "force"),
        (np.zeros((3, 3)), r"forces of shape \(3, 3\)"),
        (np.full((11, 3), np.nan), "finite"),
        ({"forces": np.zeros((11, 3)), "torque": 1}, "torques"),
        ({"forces": np.zeros((11, 3)), "torques": np.zeros((11, 3))}, r"\(10, 3\)"),
    ],
)
def test_a_wrong_answer_names_what_is_wrong_and_when(answer, words):
    simulation = flagrs.Simulation(SCENE, force=lambda *_: answer, dt=0.1, threads=1)
    with pytest.raises(flagrs.SceneError, match=words) as caught:
        simulation.step()
    assert "t = 0 s" in str(caught.value)
    assert simulation.time == 0.0


def test_an_exception_reaches_the_caller_with_the_time():
    def broken(time, nodes, velocities, directors):
        raise KeyError("laser")

    simulation = flagrs.Simulation(SCENE, force=broken, dt=0.1, threads=1)
    with pytest.raises(KeyError, match="laser") as caught:
        simulation.step()
    assert any("t = 0 s" in note for note in caught.value.__notes__)
