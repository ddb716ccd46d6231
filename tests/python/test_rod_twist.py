"""Rods with much twist, and with sharp kinks: bending does not feel twist, and frames start without any."""

from __future__ import annotations

import numpy as np
import pytest
from flagrs import Fluid, Material, Rod, Scene, SceneError, Simulation
from rod_statics import critical_twist, michell
from rod_twist import (
    MOMENT,
    TENSION,
    WHIRLING,
    WHIRLING_FREQUENCY,
    critical_turns,
    least_cosine,
    twirling,
    whirling_modes,
    whirling_speed,
)
from scipy.spatial.transform import Rotation

SOFT = Material(youngs_modulus=1e6, density=1000.0)


def angle_between(simulation: Simulation) -> float:
    """Return the largest slope of a filament along x."""
    vectors = np.diff(simulation.nodes, axis=0)
    return float((np.hypot(vectors[:, 1], vectors[:, 2]) / vectors[:, 0]).max())


def test_a_ring_with_its_frames_truly_turned_buckles_like_one_with_natural_twist() -> None:
    # Four turns on 12 edges: 2.1 rad a hinge.
    truly = critical_turns(12, 4)
    natural = critical_twist(12, 1.5) / michell(1.5)
    assert truly == pytest.approx(natural, abs=5e-7)
    # The error of the mesh falls with its square: 0.2434, 0.0558.
    finer = critical_turns(24, 4)
    assert 4.0 < (truly - 1.0) / (finer - 1.0) < 4.5


@pytest.mark.parametrize("stiffness_ratio", [0.2, 2.0 / 3.0])
def test_twirling_turns_into_whirling_at_the_exact_speed_whatever_the_twist(stiffness_ratio: float) -> None:
    errors = np.array([whirling_speed(count, stiffness_ratio) / WHIRLING - 1.0 for count in (10, 20, 40)])
    # 3.00 %, 0.78 %, 0.20 %: at GJ / EI = 0.2 the first hinge of 10 is twisted by 4 rad.
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.abs(orders - 2.0).max() < 0.06
    assert abs((4.0 * errors[2] - errors[1]) / 3.0) < 1e-4
    modes = whirling_modes(40, whirling_speed(40, stiffness_ratio), stiffness_ratio)
    assert abs(modes[np.argmax(modes.real)].imag) == pytest.approx(WHIRLING_FREQUENCY, rel=3e-3)


@pytest.mark.parametrize(("share", "whirls"), [(0.9, False), (1.1, True)])
def test_a_bent_filament_whirls_only_above_the_critical_speed(share: float, whirls: bool) -> None:
    simulation = twirling(10, share * whirling_speed(10, 0.2), 0.2, bend=1e-3)
    # A time of 1.25 zeta L^4 / EI, the first fifth of it left to what dies out at once.
    zeta = simulation.resistance()[3 * 5 + 1, 1::3].sum() * 10.5
    simulation.dt = 2e-3 * zeta
    slopes = []
    for _ in range(6):
        for _ in range(125):
            simulation.step()
        slopes.append(angle_between(simulation))
    assert (slopes[-1] > 1.5 * slopes[1]) == whirls
    assert (slopes[-1] < slopes[1] / 1.5) == (not whirls)


def test_a_twisted_rod_buckles_to_the_localized_solution() -> None:
    exact = MOMENT**2 / (2.0 * TENSION) - 1.0
    errors = np.array([least_cosine(count) - exact for count in (200, 400, 800)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders[0] > 1.8
    assert orders[1] == pytest.approx(2.0, abs=0.03)
    # What is left after one extrapolation is of fourth order: (0.02 L / width)^4 of the profile.
    assert abs((4.0 * errors[2] - errors[1]) / 3.0) < 1e-4


# --- kinks -------------------------------------------------------------------------------------------------

KINKS = (90.0, 170.0, 179.0, 179.18, 179.2, 179.5, 179.9, 179.918)


def kink(degrees: float, rest: bool = False, chain: int = 1) -> Scene:
    """Return a rod of ``chain`` planar kinks, alternately to either side, oblique; straight at rest."""
    turns = np.deg2rad(degrees) * np.where(np.arange(chain) % 2, -1.0, 1.0)
    headings = np.concatenate([[0.3], 0.3 + np.cumsum(turns)])
    steps = np.stack([np.cos(headings), np.sin(headings), 0.0 * headings], axis=1)
    nodes = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    nodes = nodes @ Rotation.from_rotvec([0.4, -0.7, 0.2]).as_matrix().T
    straight = np.zeros_like(nodes)
    straight[:, 0] = np.arange(len(nodes))
    shape = nodes if rest else straight
    rod = Rod(nodes=nodes, rest_nodes=shape, material=SOFT, radius=0.01, EI=1.0, GJ=1.0, EA=1.0)
    return Scene(rods=(rod,), fluid=Fluid(viscosity=1.0, density=1000.0, model="RFT"))


def bending_energy(degrees: float) -> float:
    """Return the energy of a hinge between edges of length one, EI = 1, naturally straight."""
    return float(0.5 * (2.0 * np.tan(0.5 * np.deg2rad(degrees))) ** 2)


@pytest.mark.parametrize("degrees", KINKS)
@pytest.mark.parametrize("chain", [1, 4])
def test_a_kinked_rod_starts_bent_and_not_twisted(degrees: float, chain: int) -> None:
    energy = Simulation(kink(degrees, chain=chain), dt=1e-3, threads=1).energy()
    # Coordinates known to round-off leave the angle of a kink known to 1e-16 / (pi - angle).
    assert energy["bending"] == pytest.approx(chain * bending_energy(degrees), rel=1e-10)
    assert energy["twisting"] < 1e-20


@pytest.mark.parametrize("degrees", KINKS)
def test_a_rod_kinked_at_rest_stores_nothing(degrees: float) -> None:
    simulation = Simulation(kink(degrees, rest=True, chain=4), dt=1e-3, threads=1)
    assert simulation.energy()["total"] == 0.0


@pytest.mark.parametrize("degrees", KINKS)
def test_a_straight_rod_placed_in_a_kink_is_bent_and_not_twisted(degrees: float) -> None:
    nodes = kink(degrees).rods[0].nodes
    simulation = Simulation(kink(30.0), dt=1e-3, threads=1)
    simulation.set_state(nodes)
    energy = simulation.energy()
    assert energy["bending"] == pytest.approx(bending_energy(degrees), rel=1e-10)
    assert energy["twisting"] < 1e-20


@pytest.mark.parametrize("axis", [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.3, -0.5, 0.8]])
def test_a_straight_rod_turned_right_over_keeps_its_twist(axis: list[float]) -> None:
    direction = np.cross(axis, [0.2, 0.7, -0.4])
    direction /= np.linalg.norm(direction)
    rod = Rod.straight(length=1.0, edge_count=6, radius=0.01, material=SOFT, direction=tuple(direction))
    rod = rod.replace(theta=np.array([0.0, 0.5, 2.0, 2.5, 5.0, 6.0]))
    fluid = Fluid(viscosity=1.0, density=1000.0, model="RFT")
    simulation = Simulation(Scene(rods=(rod,), fluid=fluid), dt=1e-3, threads=1)
    twisting = simulation.energy()["twisting"]
    for degrees in (179.0, 179.5, 180.0, 181.0, 360.0):
        turn = Rotation.from_rotvec(np.deg2rad(degrees) * np.array(axis) / np.linalg.norm(axis))
        simulation.set_state(rod.nodes @ turn.as_matrix().T)
        assert simulation.energy()["twisting"] == pytest.approx(twisting, rel=1e-9), degrees


@pytest.mark.parametrize("count", [5, 101, 401, 2001])
def test_a_star_of_sharp_kinks_closes_without_twist(count: int) -> None:
    # Turns of 144, 178.2, 179.55 and 179.91 degrees; frames of a closed plane curve come back to themselves.
    angles = 2.0 * np.pi * (count // 2) / count * np.arange(count)
    nodes = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    nodes = nodes @ Rotation.from_rotvec([0.4, -0.7, 0.2]).as_matrix().T
    edges = np.stack([np.arange(count), (np.arange(count) + 1) % count], axis=1)
    rod = Rod(nodes=nodes, edges=edges, material=SOFT, radius=0.01, EI=1.0, GJ=1.0, EA=1.0, natural_twist=0.0)
    rod = rod.replace(natural_curvature=np.zeros(2))
    fluid = Fluid(viscosity=1.0, density=1000.0, model="RFT")
    energy = Simulation(Scene(rods=(rod,), fluid=fluid), dt=1e-3, threads=1).energy()
    length = float(np.linalg.norm(nodes[1] - nodes[0]))
    expected = count * bending_energy(360.0 * (count // 2) / count) / length
    assert energy["bending"] == pytest.approx(expected, rel=1e-9)
    assert energy["twisting"] < 1e-16


def test_sharper_kinks_are_refused() -> None:
    with pytest.raises(SceneError, match=r"nodes\[1\].*antiparallel"):
        kink(179.93)
