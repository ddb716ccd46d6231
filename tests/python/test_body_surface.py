"""Rigid bodies in the flow, against closed forms and against what mechanics says of every body."""

from __future__ import annotations

import flagrs
import numpy as np
import pytest
from flagrs.fluid import BodySurface

DRAG = 6.0 * np.pi
TORQUE = 8.0 * np.pi


def test_a_sphere_has_the_drag_and_the_torque_of_stokes() -> None:
    surface = BodySurface(flagrs.Sphere(radius=0.5), accuracy=1e-4)
    expected = np.diag([DRAG * 0.5] * 3 + [TORQUE * 0.5**3] * 3)
    assert np.abs(surface.resistance(1.0) - expected).max() < 1e-4 * DRAG * 0.5
    np.testing.assert_allclose(surface.resistance(3.0), 3.0 * surface.resistance(1.0), rtol=1e-14)


def test_the_flow_around_a_sphere_is_that_of_stokes() -> None:
    surface = BodySurface(flagrs.Sphere(radius=1.0), accuracy=1e-6)
    rng = np.random.default_rng(1)
    points = rng.normal(size=(50, 3))
    points *= rng.uniform(1.2, 5.0, size=(50, 1)) / np.linalg.norm(points, axis=1, keepdims=True)
    velocity, spin = np.array([0.3, -1.0, 0.5]), np.array([1.0, 0.2, -0.7])
    r = np.linalg.norm(points, axis=1)[:, None]
    along = points * (points @ velocity)[:, None]
    exact = (
        velocity * (3.0 / (4.0 * r) + 1.0 / (4.0 * r**3))
        + along * (3.0 / (4.0 * r**3) - 3.0 / (4.0 * r**5))
        + np.cross(spin, points) / r**3
    )
    found = surface.flow(points, np.concatenate([velocity, spin]))
    assert np.abs(found - exact).max() < 1e-4 * np.abs(exact).max()


def test_accuracy_asks_for_sources_and_the_estimate_keeps_to_it() -> None:
    counts = []
    for accuracy in (5e-2, 5e-3, 1e-3):
        surface = BodySurface(flagrs.Capsule(radius=1.0, length=4.0), accuracy)
        assert surface.error <= accuracy
        counts.append(len(surface.sources))
    assert counts == sorted(set(counts))


def test_the_estimate_is_not_below_the_error() -> None:
    shape = flagrs.Cylinder(radius=1.0, length=2.0, edge_radius=0.7)
    coarse, fine = BodySurface(shape, 2e-2), BodySurface(shape, 2e-3)
    fine_diagonal = np.diag(fine.resistance(1.0))
    difference = np.abs(np.diag(coarse.resistance(1.0)) / fine_diagonal - 1.0).max()
    assert difference < coarse.error + fine.error


def test_resistance_is_symmetric_and_dissipates() -> None:
    resistance = BodySurface(flagrs.Ellipsoid(semi_axes=[1.0, 1.5, 2.0])).resistance(1.0)
    assert np.abs(resistance - resistance.T).max() < 1e-3 * np.abs(resistance).max()
    assert np.linalg.eigvalsh(0.5 * (resistance + resistance.T)).min() > 0.0
    drags = np.diag(resistance)[:3]
    assert drags[0] > drags[1] > drags[2]


def test_a_capsule_lies_between_the_spheroids_inside_and_around_it() -> None:
    capsule = np.diag(BodySurface(flagrs.Capsule(radius=1.0, length=4.0)).resistance(1.0))
    inside = np.diag(BodySurface(flagrs.Ellipsoid(semi_axes=[1.0, 1.0, 2.0])).resistance(1.0))
    around = np.diag(BodySurface(flagrs.Ellipsoid(semi_axes=[1.42, 1.42, 2.84])).resistance(1.0))
    assert (inside < capsule).all() and (capsule < around).all()


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: flagrs.Sphere(radius=0.0), "radius"),
        (lambda: flagrs.Sphere(radius=float("nan")), "radius"),
        (lambda: flagrs.Ellipsoid(semi_axes=[1.0, 1.0]), "semi_axes"),
        (lambda: flagrs.Ellipsoid(semi_axes=[1.0, 1.0, 100.0]), "semi_axes"),
        (lambda: flagrs.Capsule(radius=1.0, length=1.5), "length"),
        (lambda: flagrs.Cylinder(radius=1.0, length=1.0, edge_radius=0.6), "edge_radius"),
        (lambda: BodySurface(flagrs.Sphere(radius=1.0), accuracy=0.0), "accuracy"),
        (lambda: BodySurface(flagrs.Cylinder(radius=1.0, length=2.0, edge_radius=1e-3)), "accuracy"),
        (lambda: BodySurface("sphere"), "shape"),  # type: ignore[arg-type]
        (lambda: BodySurface(flagrs.Sphere(radius=1.0)).resistance(-1.0), "viscosity"),
    ],
)
def test_what_is_no_body_is_refused_by_name(make, field: str) -> None:
    with pytest.raises(flagrs.SceneError) as caught:
        make()
    assert field in caught.value.field
