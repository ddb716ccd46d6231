"""The default step: slowest modes against exact eigenvalues, and signals at their fastest."""

from __future__ import annotations

import cProfile
import math
import pstats

import numpy as np
import pytest
import scipy.linalg
from flagrs import Clamp, Fluid, Material, Rod, Scene, Simulation, relaxation, scenarios
from flagrs.default_step import default_step
from flagrs.relaxation import Network

SOFT = Material(youngs_modulus=1e6, density=1000.0)


def exact_time(scene: Scene) -> float:
    """Return the slowest relaxation time from all eigenvalues of the whole scene [s]."""
    simulation = Simulation(scene, threads=1, dt=1.0, scheme="implicit")
    stiffness = simulation.hessian().toarray()
    resistance = np.zeros_like(stiffness)
    nodes = (simulation.dof_of_node[:, None] + np.arange(3)).ravel()
    resistance[np.ix_(nodes, nodes)] = simulation.resistance()
    for rod, offset in zip(
        scene.rods, np.cumsum([0] + [len(r.edge_array()) for r in scene.rods]), strict=False
    ):
        dofs = simulation.dof_of_edge[offset : offset + len(rod.edge_array())]
        spin = 4.0 * math.pi * scene.fluid.viscosity * rod.radius_array() ** 2 * rod.rest_lengths()
        resistance[dofs, dofs] = spin
    free = np.ones(len(stiffness), dtype=bool)
    for clamp in scene.clamps:
        for node in clamp.nodes:
            free[simulation.dof_of_node[node] : simulation.dof_of_node[node] + 3] = False
        free[simulation.dof_of_edge[list(clamp.edges)]] = False
    part = np.ix_(free, free)
    # Motions without energy have no finite relaxation time, and leave rates of round-off.
    rates = scipy.linalg.eigh(stiffness[part], 0.5 * (resistance + resistance.T)[part], eigvals_only=True)
    return 1.0 / rates[rates > 1e-9 * rates.max()].min()


def star(arms: int) -> Rod:
    nodes, edges = [[0.0, 0.0, 0.0]], []
    for arm in range(arms):
        angle = 2.0 * math.pi * arm / arms
        for k in range(1, 6):
            edges.append((len(nodes) - 1 if k > 1 else 0, len(nodes)))
            nodes.append([5e-3 * k * math.cos(angle), 5e-3 * k * math.sin(angle), 0.0])
    return Rod(nodes=nodes, edges=edges, radius=5e-4, material=SOFT)


def straight(edge_count: int = 16, **options: object) -> Rod:
    return Rod.straight(length=0.1, radius=1e-3, material=SOFT, edge_count=edge_count, **options)


def turned(angle: float) -> np.ndarray:
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    return turn @ np.diag([1e-6, 1e-8]) @ turn.T


CASES = {
    "free": (straight(), ()),
    "clamped": (straight(), Clamp(nodes=(0, 1), edges=(0,))),
    "held at a node": (straight(), Clamp(nodes=(3,))),
    "3 arms": (star(3), ()),
    "16 arms": (star(16), ()),
    "30 arms": (star(30), ()),
    "anisotropic": (straight(EI=turned(0.0)), ()),
    "anisotropic, swapped": (straight(EI=turned(math.pi / 2.0)), ()),
    "anisotropic, askew": (straight(EI=turned(0.7)), ()),
    "stepped": (straight(EI=np.where(np.arange(15) < 8, 1e-6, 1e-9)), ()),
    "helix": (
        Rod.helix(
            helix_radius=5e-3, pitch=0.02, axial_length=0.06, radius=1e-3, material=SOFT, edge_count=60
        ),
        (),
    ),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("model", ["RFT", "RSS"])
def test_the_relaxation_time_is_that_of_the_slowest_mode(case: str, model: str) -> None:
    rod, clamps = CASES[case]
    scene = Scene(rods=rod, fluid=Fluid(viscosity=1.0, model=model), clamps=clamps)
    found = Network(scene).relaxations()
    assert len(found) == 1
    ratio = found[0].time / exact_time(scene)
    if model == "RFT":  # local drag is the whole of it
        assert ratio == pytest.approx(1.0, rel=0.01)
    elif "arms" in case:  # looked at together, as arms that meet hinder each other's motions
        assert ratio == pytest.approx(1.0, rel=0.01)
    else:
        assert 0.5 < ratio < 2.0


def test_the_relaxation_time_of_a_large_network_is_on_the_safe_side(monkeypatch: pytest.MonkeyPatch) -> None:
    # Too many nodes to be looked at together: each resists by itself, and hinders no other.
    monkeypatch.setattr(relaxation, "NETWORK_NODES", 80)
    scene = Scene(rods=star(16), fluid=Fluid(viscosity=1.0, model="RSS"))
    (found,) = Network(scene).relaxations()
    assert 0.1 < found.time / exact_time(scene) < 1.0


def test_a_vacuum_has_the_period_of_the_slowest_vibration() -> None:
    scene = Scene(rods=straight(64), clamps=Clamp(nodes=(0, 1), edges=(0,)))
    (found,) = Network(scene).relaxations()
    stiffness, mass, length = 1e6 * math.pi / 4.0 * 1e-12, 1000.0 * math.pi * 1e-6, 0.1 * 63 / 64
    # First root of cos(k) cosh(k) = -1; the hinge at the clamp bends for half an edge more, 1.6 %.
    period = 2.0 * math.pi * math.sqrt(mass * length**4 / stiffness) / 1.8751**2
    assert found.time == pytest.approx(period, rel=0.02)


@pytest.mark.parametrize(
    ("signal", "least", "most"),
    [
        (20.0, 2.5e-3, 2.5e-3),
        # Zero at every tenth of a second.
        (lambda t: 20.0 * math.sin(2.0 * math.pi * 5.0 * t), 2e-3, 3e-3),
        (lambda t: 20.0 * math.sin(2.0 * math.pi * 16.0 * t), 2e-3, 3e-3),
        # Slow, but back and forth a hundred times a second.
        (lambda t: 0.1 * math.sin(2.0 * math.pi * 100.0 * t), 1e-4, 1e-3),
        (lambda t: 20.0 if t > 1.0 else 0.0, 2.5e-3, 2.5e-3),
        # Nothing to go by but the relaxation of the filaments, 5.6 s.
        (lambda _: 0.0, 1e-2, 0.1),
    ],
)
def test_signals_are_followed_at_their_fastest(signal: object, least: float, most: float) -> None:
    scene = scenarios.robot()
    scene = scene.replace(motors=tuple(motor.replace(speed=signal) for motor in scene.motors))
    assert least * 0.999 <= default_step(scene) <= most * 1.001


def test_a_stiff_rod_elsewhere_leaves_the_step_alone() -> None:
    def arch(stiffness: float, start: float) -> Rod:
        s = np.linspace(0.0, 1.0, 11)
        bent = np.stack([start + 0.1 * s, 0.02 * np.sin(np.pi * s), 0.0 * s], axis=1)
        rest = bent * [1.0, 0.0, 0.0]
        material = Material(youngs_modulus=stiffness, density=1000.0)
        return Rod(nodes=bent, rest_nodes=rest, radius=1e-3, material=material)

    fluid = Fluid(viscosity=1.0, model="RFT")
    alone = default_step(Scene(rods=arch(1e6, 0.0), fluid=fluid))
    at_rest = arch(2e11, 1.0)
    at_rest = at_rest.replace(nodes=at_rest.rest_nodes)
    assert default_step(Scene(rods=(arch(1e6, 0.0), at_rest), fluid=fluid)) == pytest.approx(alone, rel=1e-9)
    # One that starts bent has a motion of its own to be followed.
    assert default_step(Scene(rods=(arch(1e6, 0.0), arch(1e8, 1.0)), fluid=fluid)) < 0.02 * alone
    # A clamp of another rod turns too slowly to say anything of this one.
    slow = Clamp(rod=1, nodes=(0, 1), edges=(0,), angular_velocity=1e-3)
    scene = Scene(rods=(arch(1e6, 0.0), at_rest), fluid=fluid, clamps=slow)
    assert default_step(scene) == pytest.approx(alone, rel=1e-9)


def test_the_work_to_build_many_rods_grows_with_their_number() -> None:
    # Calls are counted: the clock of a loaded machine would not tell.
    def calls(count: int) -> int:
        rods = [straight(3, start=(0.3 * k, 0.0, 0.0)) for k in range(count)]
        profile = cProfile.Profile()
        scene = profile.runcall(Scene, rods=rods, fluid=Fluid(viscosity=1.0, model="RFT"))
        profile.runcall(Simulation, scene, threads=1)
        return pstats.Stats(profile).total_calls

    few, many = calls(100), calls(400)
    # Four times the rods; their square would be sixteen times.
    assert many < 5.0 * few
