"""Scales belong to filaments: what is far away changes nothing, nor do units, order, or a cut in two."""

from __future__ import annotations

import numpy as np
import pytest
from flagrs import Clamp, Fluid, Material, Motor, Rod, Scene, Simulation
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

SIZE = 0.02
COUNT = 11
RTOL = 1e-3

FEW = settings(max_examples=8, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


def arch(stiffness: float = 1e6, length: float = 0.1, start: float = 0.0, **options: object) -> Rod:
    """Return a rod that is straight at rest and starts as an arch a fifth as high as it is long."""
    s = np.linspace(0.0, 1.0, COUNT)
    bent = np.stack([start + length * s, 0.2 * length * np.sin(np.pi * s), 0.0 * s], axis=1)
    straight = np.stack([start + length * s, 0.0 * s, 0.0 * s], axis=1)
    material = Material(youngs_modulus=stiffness, density=1000.0)
    return Rod(nodes=bent, rest_nodes=straight, radius=length / 100.0, material=material, **options)


def straight(stiffness: float, length: float, radius: float, start: float = 3.0, **options: object) -> Rod:
    material = Material(youngs_modulus=stiffness, density=1000.0)
    return Rod.straight(
        length=length,
        radius=radius,
        material=material,
        edge_count=COUNT - 1,
        start=(start, 0.0, 0.0),
        **options,
    )


def neighbour(kind: str, rod: int) -> dict[str, object]:
    """Return a rod far away and what holds or drives it, as rod number `rod`."""
    if kind == "held rail":
        nodes = tuple(range(COUNT))
        return {"rod": straight(2e11, 2.0, 2e-2), "clamps": Clamp(rod=rod, nodes=nodes, edges=(0,))}
    if kind == "clamped steel":
        return {"rod": straight(2e11, 1.0, 2e-2), "clamps": Clamp(rod=rod, nodes=(0, 1), edges=(0,))}
    if kind == "partly held":
        return {"rod": straight(1e9, 2.0, 5e-3), "clamps": Clamp(rod=rod, nodes=tuple(range(COUNT - 2)))}
    if kind == "long":
        return {"rod": arch(1e7, length=5.0, start=10.0)}
    if kind == "stiff":
        return {"rod": arch(1e9, start=3.0)}
    if kind == "slow":
        speed = Clamp(rod=rod, nodes=(0, 1), edges=(0,), angular_velocity=1e-6)
        return {"rod": straight(1e6, 0.1, 1e-3), "clamps": speed}
    if kind == "twisted":
        return {"rod": straight(1e6, 0.1, 1e-3, theta=np.linspace(0.0, 3.0, COUNT - 1))}
    motor = Motor(rod=rod, node=1, shaft=0, speed=10.0)
    return {"rod": straight(1e6, 0.1, 1e-3), "motors": motor}


KINDS = ["held rail", "clamped steel", "partly held", "long", "stiff", "slow", "twisted", "driven"]
FLUID = Fluid(viscosity=1.0, model="RFT")


def with_neighbour(kind: str | None, first: bool = False) -> Scene:
    if kind is None:
        return Scene(rods=arch(), fluid=FLUID)
    far = neighbour(kind, 0 if first else 1)
    rods = (far.pop("rod"), arch()) if first else (arch(), far.pop("rod"))
    return Scene(rods=rods, fluid=FLUID, **far)


def moved(scene: Scene, first: bool = False, **options: float) -> np.ndarray:
    """Return where the arch is after a tenth of its relaxation time or so."""
    simulation = Simulation(scene, threads=1, **options)
    if "rtol" in options:
        return simulation.run(0.2, 0.2, path=False).nodes[-1][-COUNT if first else 0 :][:COUNT]
    simulation.step(20)
    return simulation.nodes[-COUNT if first else 0 :][:COUNT]


@FEW
@given(kind=st.sampled_from(KINDS), first=st.booleans())
def test_fixed_steps_move_a_rod_as_if_it_were_alone(kind: str, first: bool) -> None:
    alone = moved(with_neighbour(None), dt=1e-2)
    together = moved(with_neighbour(kind, first), first, dt=1e-2)
    assert np.abs(alone - arch().nodes).max() > 0.1 * SIZE
    # Newton stops at 1e-10 of the forces on the rod itself, or a step further.
    assert np.abs(together - alone).max() < 1e-8 * SIZE


@FEW
@given(kind=st.sampled_from(KINDS), first=st.booleans())
def test_adaptive_steps_keep_to_the_error_of_each_rod(kind: str, first: bool) -> None:
    exact = moved(with_neighbour(None), rtol=1e-6)
    together = moved(with_neighbour(kind, first), first, rtol=RTOL)
    # A twentieth of its length is what a straight rod is measured by; steps keep to five times rtol at most.
    assert np.abs(together - exact).max() < 5.0 * RTOL * 0.1 / 20.0


@FEW
@given(
    length=st.sampled_from([1e-6, 1e-3, 1e3]),
    time=st.sampled_from([1e-3, 1.0, 1e3]),
    pressure=st.sampled_from([1e-3, 1.0, 10.0]),
    rtol=st.sampled_from([None, 1e-3]),
)
def test_units_change_nothing(length: float, time: float, pressure: float, rtol: float | None) -> None:
    def path(length: float, time: float, pressure: float) -> np.ndarray:
        rod = arch(1e6 * pressure, length=0.1 * length)
        scene = Scene(rods=rod, fluid=Fluid(viscosity=pressure * time, model="RFT"))
        simulation = Simulation(scene, threads=1, rtol=rtol)
        simulation.step(10)
        return np.append(simulation.nodes.ravel() / length, simulation.time / time)

    assert path(length, time, pressure) == pytest.approx(path(1.0, 1.0, 1.0), rel=1e-7, abs=1e-9)


@FEW
@given(kinds=st.lists(st.sampled_from(["stiff", "twisted", "long"]), min_size=2, max_size=3, unique=True))
def test_order_and_cutting_in_two_change_nothing(kinds: list[str]) -> None:
    rods = [arch()] + [neighbour(kind, 1)["rod"] for kind in kinds]
    # Apart from each other, as each kind is somewhere else.
    shifted = [rod.replace(nodes=rod.nodes + np.array([0.0, 20.0 * k, 0.0])) for k, rod in enumerate(rods)]

    def final(chosen: list[Rod]) -> list[np.ndarray]:
        simulation = Simulation(Scene(rods=tuple(chosen), fluid=FLUID), threads=1, dt=1e-2)
        simulation.step(10)
        return np.split(simulation.nodes, len(chosen))

    whole, reversed_ = final(shifted), final(shifted[::-1])[::-1]
    parts = final(shifted[:1]) + final(shifted[1:])
    for rod, a, b, c in zip(shifted, whole, reversed_, parts, strict=True):
        size = float(np.ptp(rod.nodes, axis=0).max())
        # Coordinates are known to their last digit, which counts the more the farther a rod is away.
        assert np.abs(a - b).max() < 1e-8 * size
        assert np.abs(a - c).max() < 1e-8 * size


def test_nonlocal_drag_of_a_far_fast_rod_does_not_blur_a_slow_one() -> None:
    # Three metres apart the flow of the driven rod moves the arch by some 1e-4 of what it does by itself.
    fluid = Fluid(viscosity=1.0, model="RSS")
    far = neighbour("driven", 1)
    scenes = (
        Scene(rods=arch(), fluid=fluid),
        Scene(rods=(arch(), far["rod"]), fluid=fluid, motors=far["motors"]),
    )
    alone, together = (moved(scene, dt=1e-2) for scene in scenes)
    travelled = np.abs(alone - arch().nodes).max()
    assert np.abs(together - alone).max() < 1e-3 * travelled


def test_a_dry_rod_in_local_drag_is_accepted_and_feels_none() -> None:
    held = Clamp(rod=1, nodes=(0, 1), edges=(0,))
    scene = Scene(rods=(arch(), straight(1e6, 0.1, 1e-3, immersed=False)), fluid=FLUID, clamps=held)
    assert moved(scene, dt=1e-2) == pytest.approx(moved(with_neighbour(None), dt=1e-2), abs=1e-10)
