"""Suggested settings: each source of error is worth what runs and finer meshes say it is."""

from __future__ import annotations

import flagrs
import numpy as np
import pytest
from flagrs.stiff_filaments import Body, immersed_body, rss_response
from flagrs.suggestion import fluid_errors
from flagrs.time_step import size


def helix(edge_length: float, model: str = "RSS") -> flagrs.Scene:
    silicone = flagrs.Material(youngs_modulus=1e6, density=1200.0)
    rod = flagrs.Rod.helix(
        helix_radius=6e-3,
        pitch=3e-2,
        axial_length=9e-2,
        radius=5e-4,
        material=silicone,
        edge_length=edge_length,
    )
    return flagrs.Scene(rods=[rod], fluid=flagrs.Fluid(viscosity=1.0, model=model))


def test_halved_edges_lie_on_the_curve() -> None:
    body = immersed_body(helix(4e-3))
    halved = body.halved()
    radii = np.linalg.norm(halved.nodes[len(body.nodes) :, 1:], axis=1)
    # The middle of a chord is 0.29 mm off the helix of 6 mm.
    assert np.abs(radii[1:-1] - 6e-3).max() < 1.5e-5
    assert np.abs(radii[[0, -1]] - 6e-3).max() < 1e-4
    assert len(halved.edges) == 2 * len(body.edges)


def test_a_branch_ends_the_curve() -> None:
    nodes = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0], [3.0, 0.2, 0]])
    edges = np.array([[0, 1], [1, 2], [1, 3], [2, 4]])
    zeros = np.zeros(5, dtype=np.int64)
    body = Body(nodes, edges, np.full(4, 0.1), np.arange(4), zeros, np.zeros((1, 3)), np.eye(3)[:1])
    middles = body.halved().nodes[5:]
    np.testing.assert_allclose(middles[0], [0.5, 0, 0])
    np.testing.assert_allclose(middles[2], [1, 0.5, 0])
    # From the branch on, two smooth edges share a parabola.
    np.testing.assert_allclose(middles[1], 0.375 * nodes[1] + 0.75 * nodes[2] - 0.125 * nodes[4])


def test_the_error_of_the_mesh_is_that_of_meshes_finer_still() -> None:
    body = immersed_body(helix(4e-3))
    fluid = flagrs.Fluid(viscosity=1.0)
    estimated = fluid_errors(helix(4e-3), fluid, body)["mesh"]
    finest = rss_response(body.halved().halved(), fluid)
    measured = rss_response(body, fluid).difference(finest)
    # Of a first-order error, two halvings leave a quarter.
    assert estimated == pytest.approx(measured / 0.75, rel=0.35)


def test_the_suggested_step_keeps_to_the_error() -> None:
    scene = flagrs.scenarios.clamped_flagella(count=1, contact=False)
    wanted = 0.02
    rtol = flagrs.suggest(scene, wanted).rtol
    runs = [flagrs.Simulation(scene, rtol=r).run(0.3, 0.1, path=False).nodes for r in (rtol, 1e-6)]
    assert np.linalg.norm(runs[0] - runs[1], axis=2).max() < wanted * size(scene)


def test_a_finer_mesh_is_suggested_in_proportion() -> None:
    scene = flagrs.scenarios.robot()
    coarse, fine = flagrs.suggest(scene, 2e-3), flagrs.suggest(scene, 1e-3)
    assert fine.edge_length == pytest.approx(0.5 * coarse.edge_length)
    assert fine.rtol == pytest.approx(0.5 * coarse.rtol)
    assert any("ill-conditioned" in note for note in fine.notes)


def test_the_local_model_is_told_apart_and_named() -> None:
    found = flagrs.suggest(helix(4e-3, "RFT"), 1e-2)
    assert found.dominant == "fluid model"
    assert any("model='RSS'" in note for note in found.notes)
    assert "fluid model" in str(found)


def test_without_a_fluid_only_the_step_is_judged() -> None:
    scene = helix(4e-3).model_copy(update={"fluid": None})
    found = flagrs.suggest(scene, 1e-2)
    assert found.errors == {"time step": pytest.approx(5e-3)}


@pytest.mark.parametrize("error", [0.0, -1.0, 0.5, float("nan")])
def test_an_error_out_of_range_is_refused(error: float) -> None:
    with pytest.raises(flagrs.SceneError, match="error"):
        flagrs.suggest(helix(4e-3), error)
    with pytest.raises(flagrs.SceneError, match="scene"):
        flagrs.suggest("robot", 1e-2)  # type: ignore[arg-type]
