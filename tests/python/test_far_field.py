"""Products with the mobility without its matrix, and scenes that are stepped with them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from flagrs import FlagrsError, Fluid, Rod, Scene, SceneError, Simulation, scenarios
from flagrs.fluid import FastMobility, mobility

Array = npt.NDArray[np.float64]

NODES = 30
EPSILON = 1.65e-3


def helices(count: int) -> list[Array]:
    """Helices of 30 nodes anywhere in a cube and pointing anywhere [m]."""
    random = np.random.default_rng(3)
    along = np.linspace(0.0, 0.15, NODES)
    local = np.stack([0.01 * np.cos(along / 0.01), 0.01 * np.sin(along / 0.01), along], axis=1)
    frames = [np.linalg.qr(random.normal(size=(3, 3)))[0] for _ in range(count)]
    return [local @ frame.T + 0.1 * count ** (1 / 3) * random.uniform(-0.5, 0.5, 3) for frame in frames]


def segments(count: int) -> tuple[Array, npt.NDArray[np.int64]]:
    first = np.arange(NODES * count).reshape(-1, NODES)[:, :-1].ravel()
    return np.concatenate(helices(count)), np.stack([first, first + 1], axis=1)


def density(count: int) -> Array:
    return np.random.default_rng(4).normal(size=(NODES * count, 3))


def scene(count: int, **options: Any) -> Scene:
    material = scenarios.clamped_flagella(count=1).rods[0].material
    rods = [Rod.from_nodes(nodes, radius=1e-3, material=material) for nodes in helices(count)]
    return Scene(rods=rods, fluid=Fluid(viscosity=0.1, density=0.0, **options), gravity=(0.0, 0.0, -9.81))


def displacement(count: int, steps: int = 2, threads: int = 1, **options: Any) -> Array:
    simulation = Simulation(scene(count, **options), dt=1e-3, threads=threads)
    before = simulation.nodes.copy()
    simulation.step(steps)
    return simulation.nodes - before


@pytest.mark.parametrize("error", [1e-2, 1e-4, 1e-6, 1e-8])
def test_error_is_at_most_that_asked_for(error: float) -> None:
    nodes, edges = segments(30)
    exact = (mobility(nodes, edges, EPSILON) @ density(30).ravel()).reshape(-1, 3)
    found = FastMobility(nodes, edges, EPSILON, error=error).apply(density(30))
    assert np.abs(found - exact).max() <= error * np.abs(exact).max()


def test_targets_of_their_own_and_moved_nodes() -> None:
    nodes, edges = segments(30)
    targets = nodes[::7] + 1e-3
    product = FastMobility(nodes, edges, EPSILON, targets=targets, error=1e-6)
    product.update(1.5 * nodes, targets)
    exact = (mobility(1.5 * nodes, edges, EPSILON, targets) @ density(30).ravel()).reshape(-1, 3)
    assert np.abs(product.apply(density(30)) - exact).max() <= 1e-6 * np.abs(exact).max()


def test_number_of_threads_does_not_change_a_bit() -> None:
    nodes, edges = segments(40)
    products = [
        FastMobility(nodes, edges, EPSILON, error=1e-5, threads=n).apply(density(40)) for n in (1, 2, 3)
    ]
    assert (products[0] == products[1]).all()
    assert (products[0] == products[2]).all()
    steps = [displacement(20, threads=n, far_field_nodes=0) for n in (1, 2)]
    assert (steps[0] == steps[1]).all()


@pytest.mark.parametrize("count", [1, 2])
def test_scenes_of_a_rod_or_two_nodes_need_no_expansion(count: int) -> None:
    nodes, edges = segments(count)
    exact = mobility(nodes, edges, EPSILON) @ density(count).ravel()
    found = FastMobility(nodes, edges, EPSILON, error=1e-8).apply(density(count)).ravel()
    assert np.abs(found - exact).max() <= 1e-8 * np.abs(exact).max()
    pair = FastMobility(nodes[:2], [[0, 1]], EPSILON).apply(np.ones((2, 3))).ravel()
    assert pair == pytest.approx(mobility(nodes[:2], [[0, 1]], EPSILON) @ np.ones(6), rel=1e-6)


def test_coincident_rods_are_summed() -> None:
    nodes, edges = segments(10)
    twice, both = np.concatenate([nodes, nodes]), np.concatenate([edges, edges + len(nodes)])
    force = np.concatenate([density(10), density(10)])
    exact = 2.0 * mobility(nodes, edges, EPSILON) @ density(10).ravel()
    found = FastMobility(twice, both, EPSILON, error=1e-6).apply(force)[: len(nodes)].ravel()
    assert np.abs(found - exact).max() <= 1e-6 * np.abs(exact).max()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_positions_that_are_not_finite_are_named(bad: float) -> None:
    nodes, edges = segments(3)
    product = FastMobility(nodes, edges, EPSILON)
    before = product.apply(density(3))
    broken = nodes.copy()
    broken[7, 1] = bad
    with pytest.raises(SceneError, match=r"nodes\[7\].*finite"):
        FastMobility(broken, edges, EPSILON)
    with pytest.raises(SceneError, match=r"nodes\[7\].*finite"):
        product.update(broken)
    assert (product.apply(density(3)) == before).all()


def test_arguments_are_checked() -> None:
    nodes, edges = segments(3)
    for error in (0.0, 1e-12, 0.5, np.nan):
        with pytest.raises(SceneError, match="error"):
            FastMobility(nodes, edges, EPSILON, error=error)
    with pytest.raises(SceneError, match="epsilon"):
        FastMobility(nodes, edges, -1.0)
    product = FastMobility(nodes, edges, EPSILON)
    with pytest.raises(SceneError, match="force_density"):
        product.apply(density(3)[1:])
    with pytest.raises(SceneError, match="nodes"):
        product.update(nodes[1:])
    with pytest.raises(SceneError, match="targets"):
        product.update(nodes, nodes)
    for options in ({"far_field_error": 1e-12}, {"far_field_error": 1.0}, {"far_field_nodes": -1}):
        with pytest.raises(SceneError, match=next(iter(options))):
            Fluid(viscosity=1.0, **options)


@pytest.mark.parametrize("error", [1e-3, 1e-5, 1e-7])
def test_steps_agree_with_those_of_the_matrix(error: float) -> None:
    exact = displacement(12, far_field_nodes=10**9)
    found = displacement(12, far_field_nodes=0, far_field_error=error)
    assert np.abs(found - exact).max() <= error * np.abs(exact).max()


def test_explicit_steps_agree_with_those_of_the_matrix() -> None:
    moved = []
    for options in ({"far_field_nodes": 10**9}, {"far_field_nodes": 0, "far_field_error": 1e-7}):
        simulation = Simulation(scene(4, **options), scheme="explicit", dt=1e-5, threads=1)
        before = simulation.nodes.copy()
        simulation.step(5)
        moved.append(simulation.nodes - before)
    assert np.abs(moved[1] - moved[0]).max() <= 1e-5 * np.abs(moved[0]).max()


def test_the_crossover_is_where_it_is_said_to_be() -> None:
    small, large = scene(16).plan(), scene(17).plan()
    assert (small.fluid_matrix, small.far_field_error) == (3 * 16 * NODES, None)
    assert (large.fluid_matrix, large.far_field_error) == (0, 1e-6)
    assert "without a matrix" in str(large)


def test_resistance_is_that_of_the_matrix_or_a_clear_error() -> None:
    matrices = [Simulation(scene(3, far_field_nodes=n)).resistance() for n in (0, 10**9)]
    assert (matrices[0] == matrices[1]).all()
    simulation = Simulation(scene(140))
    with pytest.raises(FlagrsError, match=r"resistance of 4200 nodes .* 1\.3 GB"):
        simulation.resistance()
