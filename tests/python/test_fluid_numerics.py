"""Regularized Stokeslet segments as numbers: exactness, symmetries, conditioning, and what is refused."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from flagrs import Fluid, Material, Rod, Scene, SceneError, fluid
from mpmath import asinh, cosh, mp, mpf, sinh, sqrt, workdps
from mpmath.calculus.quadrature import GaussLegendre

Array = npt.NDArray[np.float64]

DIGITS = 40
#: mpmath's name for 24 points; on panels of one unit of v, with poles at v = +-i pi/2, they err by 1e-38.
RULE_DEGREE = 4


def rule() -> list[tuple[Any, Any]]:
    """Nodes and weights of the Gauss-Legendre rule on [-1, 1]."""
    with workdps(DIGITS):
        nodes: list[tuple[Any, Any]] = GaussLegendre(mp).calc_nodes(RULE_DEGREE, int(3.33 * DIGITS) + 10)
    return nodes


RULE = rule()


def blocks_by_quadrature(target: Array, start: Array, end: Array, epsilon: float) -> tuple[Array, Array]:
    """Both 3x3 blocks of a segment, by quadrature in 40 digits along v, with zeta = h sinh v."""
    with workdps(DIGITS):
        x, p, q = ([mpf(float(c)) for c in v] for v in (target, start, end))
        span = [b - a for a, b in zip(p, q, strict=True)]
        length = sqrt(sum(c * c for c in span))
        tangent = [c / length for c in span]
        zeta0 = -sum((a - b) * c for a, b, c in zip(x, p, tangent, strict=True))
        zeta1 = zeta0 + length
        offset = [a - b + zeta0 * c for a, b, c in zip(x, p, tangent, strict=True)]
        width = mpf(float(epsilon)) ** 2
        h = sqrt(sum(c * c for c in offset) + width)
        v0, v1 = asinh(zeta0 / h), asinh(zeta1 / h)
        panels = max(1, math.ceil(v1 - v0))
        half = (v1 - v0) / (2 * panels)
        blocks = [[[mpf(0)] * 3 for _ in range(3)] for _ in range(2)]
        for panel in range(panels):
            for node, weight in RULE:
                v = v0 + half * (2 * panel + 1 + node)
                zeta, r2 = h * sinh(v), (h * cosh(v)) ** 2
                d = [a - zeta * b for a, b in zip(offset, tangent, strict=True)]
                # dzeta = R dv: one R of each kernel is gone.
                for block, share in zip(
                    blocks, ((zeta1 - zeta) / length, (zeta - zeta0) / length), strict=True
                ):
                    scale = share * weight * half
                    for i in range(3):
                        for j in range(3):
                            block[i][j] += scale * (d[i] * d[j] / r2 + ((1 + width / r2) if i == j else 0))
        return (
            np.array([[float(c) for c in row] for row in blocks[0]]),
            np.array([[float(c) for c in row] for row in blocks[1]]),
        )


def unit(rng: np.random.Generator) -> Array:
    v: Array = rng.normal(size=3)
    return v / np.linalg.norm(v)


def random_cases() -> Iterator[tuple[Array, Array, Array, float]]:
    """Distances from 1e-6 to 1e6 lengths, epsilon from 1e-6 to 10 lengths, any direction, scale and place."""
    rng = np.random.default_rng(20240610)
    for _ in range(120):
        scale = 10.0 ** rng.uniform(-6.0, 3.0)
        start = scale * rng.uniform(0.0, 10.0) * unit(rng)
        target = start + scale * 10.0 ** rng.uniform(-6.0, 6.0) * unit(rng)
        yield target, start, start + scale * unit(rng), scale * 10.0 ** rng.uniform(-6.0, 1.0)


def cases_near_the_axis() -> Iterator[tuple[Array, Array, Array, float]]:
    """Along the axis on both sides, exactly and a millionth of a radian off, where logarithms cancel."""
    rng = np.random.default_rng(20240611)
    for k, distance in enumerate((1e-6, 1e-3, 0.4, 0.999, 1.0, 1.001, 2.0, 4.0, 5.0, 20.0, 25.0, 1e3, 1e6)):
        for side in (1.0, -1.0):
            start, along = unit(rng), unit(rng)
            across = np.cross(along, unit(rng))
            angle = (0.0, 1e-6)[k % 2]
            target = start + side * distance * (math.cos(angle) * along + math.sin(angle) * across)
            yield target, start, start + along, (1e-6, 1e-3, 0.3, 10.0)[(k + (side > 0.0)) % 4]


def cases_at_the_switches() -> Iterator[tuple[Array, Array, Array, float]]:
    """Just inside and outside the distances at which the code goes over from closed forms to quadrature."""
    rng = np.random.default_rng(20240612)
    for switch in (9.1, 46.0):
        for factor in (0.999, 1.001):
            for epsilon in (1e-6, 0.5 * switch / 2.0):
                start, along = unit(rng), unit(rng)
                centre = start + along / 2.0
                distance = math.sqrt((factor * switch / 2.0) ** 2 - epsilon**2)
                yield centre + distance * unit(rng), start, start + along, epsilon


@pytest.mark.parametrize("cases", [random_cases, cases_near_the_axis, cases_at_the_switches])
def test_blocks_agree_with_quadrature_in_forty_digits(cases: Any) -> None:
    worst = 0.0
    for target, start, end, epsilon in cases():
        found = fluid.mobility([start, end], [[0, 1]], epsilon, targets=[target])
        for block, exact in zip(
            (found[:, :3], found[:, 3:]), blocks_by_quadrature(target, start, end, epsilon), strict=True
        ):
            error = float(np.abs(block - exact).max() / np.abs(exact).max())
            worst = max(worst, error)
            assert error < 1e-12, (error, target, start, end, epsilon)
    # The measured errors are 1e-16 to 1.6e-14; an error of exactly 0 would mean that nothing was compared.
    assert 0.0 < worst < 5e-14


def y_network() -> tuple[Array, npt.NDArray[np.int64], Array]:
    """Three arms of two edges that meet in a node, one of them numbered against its direction."""
    nodes = np.array(
        [[0, 0, 0], [1, 0, 0], [2, 0.3, 0], [-1, 1, 0], [-2, 2, 1], [0, -1, 0.5], [0.2, -2, 1]], float
    )
    edges = np.array([[0, 1], [1, 2], [3, 0], [4, 3], [0, 5], [5, 6]])
    return nodes, edges, np.array([0.1, 0.2, 0.3, 0.1, 0.2, 0.05])


def test_the_matrix_of_a_branching_network_is_the_sum_over_its_segments() -> None:
    nodes, edges, epsilon = y_network()
    total = np.zeros((3 * len(nodes), 3 * len(nodes)))
    for (i, j), width in zip(edges, epsilon, strict=True):
        pair = fluid.mobility(nodes[[i, j]], [[0, 1]], width, targets=nodes)
        total[:, 3 * i : 3 * i + 3] += pair[:, :3]
        total[:, 3 * j : 3 * j + 3] += pair[:, 3:]
    np.testing.assert_allclose(fluid.mobility(nodes, edges, epsilon), total, rtol=0.0, atol=1e-14)


def test_velocity_is_the_matrix_times_the_density() -> None:
    nodes, edges, epsilon = y_network()
    rng = np.random.default_rng(5)
    density, points = rng.normal(size=nodes.shape), rng.normal(size=(40, 3))
    matrix = fluid.mobility(nodes, edges, epsilon, targets=points)
    expected = (matrix @ density.ravel()).reshape(-1, 3) / (8.0 * math.pi * 2.5)
    found = fluid.velocity(points, nodes, edges, density, 2.5, epsilon)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-14)


def test_the_matrix_is_the_same_to_the_last_bit_on_one_thread_and_on_many() -> None:
    nodes = np.random.default_rng(6).normal(size=(120, 3))
    edges = np.stack([np.arange(119), np.arange(1, 120)], axis=1)
    one = fluid.mobility(nodes, edges, 0.1, threads=1)
    assert all(np.array_equal(one, fluid.mobility(nodes, edges, 0.1, threads=n)) for n in (2, 3, 7))


def test_the_matrix_does_not_depend_on_the_unit_of_length() -> None:
    nodes, edges, epsilon = y_network()
    metres = fluid.mobility(nodes, edges, epsilon)
    for unit_of_length in (1e-6, 1e-3, 1e3):
        scaled = fluid.mobility(unit_of_length * nodes, edges, unit_of_length * epsilon)
        np.testing.assert_allclose(scaled, metres, rtol=0.0, atol=3e-14)


def test_far_away_the_flow_is_that_of_the_total_force_at_a_point() -> None:
    nodes, edges, epsilon = y_network()
    density = np.tile([1.0, -2.0, 0.5], (len(nodes), 1))
    force = fluid.hat_weights(nodes, edges, density).sum(axis=0)
    direction = np.array([2.0, -1.0, 2.0]) / 3.0
    for distance in (1e4, 1e6, 1e8):
        found = fluid.velocity([distance * direction], nodes, edges, density, 1.0, epsilon)[0]
        point = (force + direction * (direction @ force)) / (8.0 * math.pi * distance)
        # The next term is a dipole: the network's size over the distance.
        assert np.abs(found - point).max() < 3.0 / distance * np.abs(point).max()


def test_hat_weights_keep_the_force_and_the_torque_of_a_linear_density() -> None:
    nodes, edges, _ = y_network()
    density = np.random.default_rng(7).normal(size=nodes.shape)
    forces = fluid.hat_weights(nodes, edges, density)
    place, weight = np.polynomial.legendre.leggauss(2)
    force, torque = np.zeros(3), np.zeros(3)
    for i, j in edges:
        for s, w in zip((1.0 + place) / 2.0, weight / 2.0, strict=True):
            at, f = (1 - s) * nodes[i] + s * nodes[j], (1 - s) * density[i] + s * density[j]
            share = w * np.linalg.norm(nodes[j] - nodes[i]) * f
            force += share
            torque += np.cross(at, share)
    np.testing.assert_allclose(forces.sum(axis=0), force, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(np.cross(nodes, forces).sum(axis=0), torque, rtol=0.0, atol=1e-14)


def straight(edges: int, ratio: float) -> tuple[Array, npt.NDArray[np.int64]]:
    """A straight chain of edges `ratio` times as long as a regularization of 1."""
    nodes = ratio * np.arange(edges + 1)[:, None] * [1.0, 0.0, 0.0]
    return nodes, np.stack([np.arange(edges), np.arange(1, edges + 1)], axis=1)


def density_across(edges: int, ratio: float) -> Array:
    """Force density of the chain in uniform motion across it, over its median."""
    nodes, pairs = straight(edges, ratio)
    motion = np.tile([0.0, 1.0, 0.0], len(nodes))
    density: Array = np.linalg.solve(fluid.mobility(nodes, pairs, 1.0), motion)[1::3]
    return density / np.median(density)


def test_the_condition_number_explodes_when_edges_are_shorter_than_the_regularization() -> None:
    conditions = {
        ratio: np.linalg.cond(fluid.mobility(*straight(round(60 / ratio), ratio), 1.0))
        for ratio in (4.0, 2.0, 1.0, 0.5, 0.25)
    }
    # Measured: 10, 27, 162, 5.2e3, 3.9e6. The kernel's Fourier transform falls as exp(-k epsilon), and the
    # finest wave that a mesh carries has k = pi / |e|.
    assert conditions[4.0] < 12.0 and conditions[2.0] < 30.0 and conditions[1.0] < 200.0
    assert conditions[0.5] > 4e3 and conditions[0.25] > 3e6
    growth = math.log(conditions[0.25] / conditions[0.5])
    assert growth == pytest.approx(math.pi * (4.0 - 2.0), rel=0.1)


def test_the_density_at_a_blunt_end_changes_sign_once_edges_are_as_short_as_the_regularization() -> None:
    assert density_across(40, 1.5).min() > 0.2  # measured: 0.28
    assert density_across(60, 1.0).min() < -0.5  # -0.59
    assert density_across(240, 0.25).min() < -50.0  # -105
    # Far from the ends nothing oscillates, however short the edges.
    middle = density_across(240, 0.25)[80:160]
    assert np.abs(np.diff(middle, 2)).max() < 1e-4


def test_the_matrix_is_not_symmetric_and_least_so_at_the_ends() -> None:
    nodes, edges = straight(40, 1.0)
    weight = fluid.hat_weights(nodes, edges, np.ones_like(nodes))[:, 0]
    matrix = fluid.mobility(nodes, edges, 1.0).reshape(41, 3, 41, 3).transpose(0, 2, 1, 3)
    # Half a hat at an end is not asymmetry of the operator: compare means over hats.
    means = matrix / weight[None, :, None, None]
    difference = np.linalg.norm(means - means.transpose(1, 0, 3, 2), axis=(2, 3))
    relative = difference / np.linalg.norm(means, axis=(2, 3))
    inside, with_an_end = relative[1:-1, 1:-1].max(), relative[[0, -1]].max()
    # In a uniform straight chain inner pairs are alike by symmetry; an end's hat leans to one side.
    assert inside < 1e-12
    assert 0.15 < with_an_end < 0.30  # measured: 0.22


def test_the_plan_of_a_scene_warns_of_edges_shorter_than_the_regularization_with_numbers() -> None:
    material = Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
    rod = Rod.straight(length=0.1, edge_count=50, radius=2e-3, material=material)
    (warning,) = Scene(rods=(rod,), fluid=Fluid(viscosity=1.0)).plan().warnings
    numbers = [float(n) for n in re.findall(r"\d+\.?\d*", warning)]
    assert 50.0 in numbers  # as many edges
    assert any(
        n == pytest.approx(2.0 / (2.0 * math.sqrt(math.e)), abs=5e-3) for n in numbers
    )  # |e| / epsilon
    assert "ill-conditioned" in warning
    longer = rod.replace(nodes=3.0 * rod.nodes)
    assert Scene(rods=(longer,), fluid=Fluid(viscosity=1.0)).plan().warnings == ()


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"epsilon": 0.0}, "epsilon"),
        ({"epsilon": -1e-3}, "epsilon"),
        ({"epsilon": math.nan}, "epsilon"),
        ({"epsilon": [0.1, 0.1, 0.1]}, "epsilon"),
        ({"nodes": [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]}, "nodes"),
        ({"nodes": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]}, "nodes"),
        ({"nodes": [[0.0, 0.0, 0.0], [math.nan, 0.0, 0.0], [1.0, 0.0, 0.0]]}, "nodes[1]"),
        ({"edges": [[0, 1], [1, 3]]}, "edges"),
        ({"edges": [[0, 0], [1, 2]]}, "edges"),
        ({"edges": [0, 1]}, "edges"),
        ({"targets": [[0.0, 1.0]]}, "targets"),
        ({"targets": [[0.0, 1.0, math.inf]]}, "targets[0]"),
    ],
)
def test_bad_arrays_are_refused_by_name(changed: dict[str, Any], field: str) -> None:
    given: dict[str, Any] = {
        "nodes": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]],
        "edges": [[0, 1], [1, 2]],
        "epsilon": 0.1,
    }
    assert np.isfinite(fluid.mobility(**given)).all()
    with pytest.raises(SceneError) as refused:
        fluid.mobility(**(given | changed))
    assert refused.value.field == field
