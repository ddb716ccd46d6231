"""What is read off runs: winding against closed forms, gaps of known shapes, honest errors."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fake_simulation import SPEED, FakeSimulation, rigid_frame
from flagrs import (
    Clamp,
    FlagrsError,
    Fluid,
    Material,
    Rod,
    Scene,
    SceneError,
    StationarityWarning,
    Trajectory,
    cli,
    scenarios,
)
from flagrs.recorder import Recorder
from flagrs.results import readouts
from flagrs.results.knotting import linking, writhe
from flagrs.results.strain import curvatures, tensions, twists
from flagrs.results.swimming import Estimate, rate_of
from flagrs.scene.values import FloatArray

SILICONE = Material(youngs_modulus=1e6, density=1200.0)


def circle(count: int, centre: tuple[float, float, float], normal: str) -> FloatArray:
    angle = np.linspace(0.0, 2.0 * np.pi, count + 1)
    flat = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    flat[-1] = flat[0]
    return (flat if normal == "z" else flat[:, [0, 2, 1]]) + centre


def helix(turns: float, radius: float, pitch: float, per_turn: int = 200, phase: float = 0.0) -> FloatArray:
    s = np.linspace(0.0, 2.0 * np.pi * turns, round(turns * per_turn) + 1)
    return np.stack(
        [pitch * s / (2.0 * np.pi), radius * np.cos(s + phase), radius * np.sin(s + phase)], axis=1
    )


def torus_knot(p: int, q: int, phase: float = 0.0, count: int = 400) -> FloatArray:
    s = np.linspace(0.0, 2.0 * np.pi, count + 1)
    away = 2.0 + 0.5 * np.cos(q * s + phase)
    curve = np.stack([away * np.cos(p * s), away * np.sin(p * s), 0.5 * np.sin(q * s + phase)], axis=1)
    curve[-1] = curve[0]
    return curve


def gauss_by_quadrature(
    first: Callable[[FloatArray], FloatArray], second: Callable[[FloatArray], FloatArray]
) -> float:
    """Return Gauss's integral of two smooth closed curves by the trapezoidal rule."""
    s, h = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False), 1e-5
    a, b = first(s), second(s)
    da, db = (first(s + h) - first(s - h)) / (2.0 * h), (second(s + h) - second(s - h)) / (2.0 * h)
    apart = a[:, None] - b[None]
    triple = np.einsum("ijk,ijk->ij", apart, np.cross(da[:, None], db[None]))
    return float((triple / np.linalg.norm(apart, axis=2) ** 3).sum() * (s[1] - s[0]) ** 2 / (4.0 * np.pi))


def test_linking_numbers_are_integers_with_the_sign_of_gausss_integral() -> None:
    rings = circle(100, (0, 0, 0), "z"), circle(130, (1, 0, 0), "y")
    assert abs(linking(*rings)) == pytest.approx(1.0, abs=1e-9)
    smooth = gauss_by_quadrature(
        lambda s: np.stack([np.cos(s), np.sin(s), 0 * s], axis=1),
        lambda s: np.stack([1 + np.cos(s), 0 * s, np.sin(s)], axis=1),
    )
    assert linking(*rings) == pytest.approx(smooth, abs=1e-6)
    assert linking(rings[0], rings[1][::-1]) == pytest.approx(-smooth, abs=1e-6)
    assert linking(circle(50, (0, 0, 0), "z"), circle(50, (5, 0, 0), "y")) == pytest.approx(0.0, abs=1e-12)
    # Two strands on a torus that wind q times the short way, left-handed, while they go round once the long
    # way.
    for q in (1, 3, -2):
        assert linking(torus_knot(1, q), torus_knot(1, q, phase=np.pi)) == pytest.approx(-q, abs=1e-9)


def test_a_long_double_helix_winds_once_a_turn() -> None:
    strands = [[helix(turns, 1.0, 3.0, 60, phase) for phase in (0.0, np.pi)] for turns in (20, 40)]
    short, long = (linking(*pair) for pair in strands)
    assert long - short == pytest.approx(
        20.0, rel=2e-3
    )  # the ends' part is the same in both, but for 1/length


def test_the_writhe_of_a_helix_is_one_less_the_sine_of_its_pitch_angle_a_turn() -> None:
    # F. B. Fuller, Proc. Natl. Acad. Sci. 68, 815, 1971; the ends' part cancels in the difference.
    for pitch in (1.0, 3.0, 10.0):
        sine = pitch / np.hypot(pitch, 2.0 * np.pi)
        longer, shorter = writhe(helix(32, 1.0, pitch, 50)), writhe(helix(16, 1.0, pitch, 50))
        assert longer - shorter == pytest.approx(16.0 * (1.0 - sine), rel=1e-2)
        mirrored = helix(16, 1.0, pitch, 50) * [1.0, 1.0, -1.0]
        assert writhe(mirrored) == pytest.approx(-shorter, rel=1e-9)


def test_the_writhe_of_a_plane_curve_is_zero() -> None:
    assert writhe(circle(60, (0, 0, 0), "z")) == 0.0
    bent = np.random.default_rng(1).normal(size=(30, 3)) * [1.0, 1.0, 0.0]
    assert abs(writhe(bent)) < 1e-12


def test_writhe_and_twist_of_a_ribbon_make_its_linking_number() -> None:
    # Calugareanu, White and Fuller: the curve beside a closed one at a small distance links with it Wr + Tw
    # times.
    curve = torus_knot(2, 3, count=1200)
    tangents = np.roll(curve[:-1], -1, axis=0) - np.roll(curve[:-1], 1, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    up = np.array([0.0, 0.0, 1.0]) + 0.3 * curve[:-1]
    side = up - np.einsum("ij,ij->i", up, tangents)[:, None] * tangents
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    slopes = np.roll(side, -1, axis=0) - np.roll(side, 1, axis=0)
    twist = float(np.einsum("ij,ij->i", tangents, np.cross(side, slopes)).sum() / 2.0 / (2.0 * np.pi))
    beside = curve[:-1] + 0.02 * side
    links = linking(curve, np.concatenate([beside, beside[:1]]))
    assert links == pytest.approx(round(links), abs=1e-6)
    assert writhe(curve) + twist == pytest.approx(round(links), abs=2e-3)


def test_curves_that_are_none_are_refused() -> None:
    for wrong in ([[0, 0, 0]], [[0, 0]], [[0, 0, np.nan], [1, 0, 0]]):
        with pytest.raises(SceneError, match="curve"):
            writhe(wrong)


def pair_of_helices(phase: float, apart: float = 0.03) -> Scene:
    shape = {
        "helix_radius": 5e-3,
        "pitch": 30e-3,
        "axial_length": 90e-3,
        "radius": 1e-3,
        "material": SILICONE,
    }
    rods = tuple(
        Rod.helix(**shape, edge_length=3e-3, point=(0.0, side, 0.0), phase=turn)  # type: ignore[arg-type]
        for side, turn in ((0.0, 0.4), (apart, 0.4 + phase))
    )
    clamps = tuple(Clamp(rod=k, nodes=(0, 1), edges=(0,)) for k in (0, 1))
    return Scene(rods=rods, clamps=clamps, fluid=Fluid(viscosity=1.0), name="pair")


@pytest.mark.parametrize("phase", [-2.0, 0.3, 1.5])
def test_the_phase_lag_of_two_helices_is_the_angle_between_them(phase: float) -> None:
    bundle = FakeSimulation(pair_of_helices(phase)).run(1.0, 0.5).bundle()
    assert bundle.phase_lag()[:, 0] == pytest.approx(phase, abs=1e-3)


def test_helices_of_other_handedness_have_no_phase_lag() -> None:
    scene = pair_of_helices(0.5)
    mirrored = scene.rods[1].nodes * [1.0, 1.0, -1.0]
    scene = scene.replace(rods=(scene.rods[0], scene.rods[1].replace(nodes=mirrored)))
    assert np.isnan(FakeSimulation(scene).run(1.0, 0.5).bundle().phase_lag()).all()


def test_a_straight_filament_has_no_phase_and_one_filament_no_gap() -> None:
    rods = tuple(
        Rod.straight(length=0.1, edge_count=10, radius=1e-3, material=SILICONE, start=(0.0, y, 0.0))
        for y in (0.0, 0.1)
    )
    straight = FakeSimulation(Scene(rods=rods, fluid=Fluid(viscosity=1.0))).run(1.0, 0.5)
    with pytest.raises(FlagrsError, match="straight at rest"):
        straight.bundle().phase_lag()
    with pytest.raises(FlagrsError, match="needs 2 filaments"):
        FakeSimulation(scenarios.straight_rod()).run(1.0, 0.5).bundle().gap()


def test_gaps_and_tips_of_two_straight_filaments_are_those_of_their_lines() -> None:
    rods = tuple(
        Rod.straight(length=0.1, edge_count=10, radius=1e-3, material=SILICONE, start=(0.0, y, z))
        for y, z in ((0.0, 0.0), (3e-3, 4e-3))
    )
    bundle = FakeSimulation(Scene(rods=rods, fluid=Fluid(viscosity=1.0))).run(1.0, 0.5).bundle()
    assert bundle.gap() == pytest.approx(np.full((3, 1), 3e-3), rel=1e-9)
    assert bundle.tip_spread() == pytest.approx(np.full(3, 2.5e-3), rel=1e-9)
    assert bundle.linking() == pytest.approx(np.zeros((3, 1)), abs=1e-12)


def test_gaps_of_several_filaments_are_pair_by_pair() -> None:
    rods = tuple(
        Rod.straight(length=0.1, edge_count=10, radius=1e-3, material=SILICONE, start=(0.0, y, 0.0))
        for y in (0.0, 9e-3, 4e-3)
    )
    bundle = FakeSimulation(Scene(rods=rods, fluid=Fluid(viscosity=1.0))).run(1.0, 1.0).bundle([0])
    assert bundle.pairs == [(0, 1), (0, 2), (1, 2)]
    assert bundle.gap()[0] == pytest.approx([7e-3, 2e-3, 3e-3], rel=1e-9)


def test_windings_of_many_edges_are_left_to_be_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(readouts, "MOST_PAIRS", 1000)
    found = FakeSimulation(pair_of_helices(0.3)).run(2.0, 0.1).readouts()
    for name in ("writhe", "linking", "filament_gap"):
        assert found[name].estimate is None and "take long" in found[name].absent
    assert found["tip_spread"].value > 0.0


@pytest.mark.parametrize("flipped", [(), (3,), (0, 4, 9)])
def test_twist_is_that_of_the_angles_on_a_straight_rod_whichever_way_edges_point(
    flipped: tuple[int, ...],
) -> None:
    edges = np.stack([np.arange(10), np.arange(1, 11)], axis=1)
    edges[list(flipped)] = edges[list(flipped), ::-1]
    nodes = np.linspace([0.0, 0.0, 0.0], [0.1, 0.0, 0.0], 11)
    scene = Scene(rods=Rod(nodes=nodes, edges=edges, radius=1e-3, material=SILICONE))
    tangents = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    turn = 0.2 * np.arange(10)
    directors = np.stack([0 * turn, np.cos(turn), np.sin(turn)], axis=1)
    assert np.abs(tangents[:, 0]).min() > 0.0
    assert twists(scene, nodes, directors) == pytest.approx(np.full(9, 0.2), rel=1e-12)


def test_curvature_and_tension_are_those_of_a_stretched_ring() -> None:
    edges = np.stack([np.arange(40), (np.arange(40) + 1) % 40], axis=1)
    ring = Rod(nodes=0.05 * circle(40, (0, 0, 0), "z")[:-1], edges=edges, radius=1e-3, material=SILICONE)
    scene, half = Scene(rods=ring), np.pi / 40
    exact = 2.0 * np.tan(half) / (0.1 * np.sin(half))
    assert curvatures(scene, scene.node_array()) == pytest.approx(
        np.full(scene.hinge_count, exact), rel=1e-12
    )
    rest = np.concatenate([rod.EA_array() for rod in scene.rods])
    assert tensions(scene, 1.01 * scene.rods[0].rest_array()) == pytest.approx(0.01 * rest, rel=1e-9)


def test_the_swimming_velocity_of_a_rigid_swimmer_is_exact() -> None:
    found = FakeSimulation(scenarios.robot()).run(20.0, 0.1).swimming()
    assert [part.value for part in found.velocity] == pytest.approx([-SPEED, 0.0, 0.0], abs=1e-15)
    assert found.speed.value == pytest.approx(SPEED, rel=1e-12) and found.speed.error < 1e-12 * SPEED
    assert found.along_axis is not None and found.along_axis.value == pytest.approx(-SPEED, rel=1e-12)
    assert found.stationary


def noisy(rng: np.random.Generator, count: int, memory: float) -> FloatArray:
    values = np.zeros(count)
    for k in range(1, count):
        values[k] = memory * values[k - 1] + rng.normal()
    return values


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_the_error_of_a_mean_covers_the_truth_as_often_as_it_says(memory: float) -> None:
    rng = np.random.default_rng(7)
    found = [rate_of(1.0 + noisy(rng, 400, memory), np.ones(400), 1.0) for _ in range(300)]
    once = np.mean([abs(one.value - 1.0) < one.error for one in found])
    twice = np.mean([abs(one.value - 1.0) < 2.0 * one.error for one in found])
    # 68 and 95 of 100 for known errors; those of a few blocks are themselves uncertain. 300 draws: +- 3.
    assert 0.60 < once < 0.85 and twice > 0.88
    assert np.mean([one.stationary for one in found]) > 0.98


def test_a_velocity_that_changes_is_called_unsteady() -> None:
    recorder = Recorder(None, scenarios.robot(), {})
    for time in np.linspace(0.0, 20.0, 101):
        frame = rigid_frame(scenarios.robot(), float(time))
        frame["nodes"] = frame["nodes"] + [-5.0 * SPEED * (1.0 - np.exp(-time / 5.0)), 0.0, 0.0]
        recorder.append(frame)
    trajectory = recorder.trajectory()
    with pytest.warns(StationarityWarning, match="not steady from 0 s"):
        trajectory.swimming(start=0.0)
    assert "not steady" in str(trajectory.readouts(start=0.0)["speed"])


def test_what_means_nothing_says_why() -> None:
    held = FakeSimulation(scenarios.clamped_flagella()).run(2.0, 0.1).readouts()
    assert held["speed"].estimate is None and "clamps hold" in held["speed"].absent
    assert "motors" in held["power"].absent and "torque_0" not in held
    with pytest.raises(FlagrsError, match="clamps hold"):
        held["speed"].value  # noqa: B018
    free = FakeSimulation(scenarios.robot()).run(2.0, 0.1).readouts()
    assert free["speed"].value == pytest.approx(SPEED, rel=1e-9) and free["torque_1"].unit == "N m"
    assert "2 mm/s" in str(free) and "swimming speed" in free._repr_html_()


@pytest.mark.parametrize(
    ("estimate", "text"),
    [
        (Estimate(0.28306, 0.0012, True), "0.2831 ± 0.0012"),
        (Estimate(-3.0, float("nan"), True), "-3"),
        (Estimate(0.0, 2.0, True), "0.0 ± 2"),
    ],
)
def test_an_estimate_shows_the_digits_that_mean_something(estimate: Estimate, text: str) -> None:
    assert str(estimate) == text


def test_the_command_prints_read_outs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    FakeSimulation(scenarios.robot()).run(2.0, 0.1, path=tmp_path / "run.h5")
    monkeypatch.setattr(sys, "argv", ["flagrs", "measure", str(tmp_path / "run.h5"), "--start", "0.5"])
    with warnings.catch_warnings(), pytest.raises(SystemExit) as ended:
        warnings.simplefilter("error")
        cli.main()
    said = capsys.readouterr().out
    assert not ended.value.code and "from 0.5 s to 2 s" in said and "head_rate" in said


def test_reading_a_few_frames_of_a_bundle_gives_those_frames() -> None:
    trajectory: Trajectory = FakeSimulation(pair_of_helices(0.5)).run(2.0, 0.5)
    assert trajectory.bundle([0, 3]).time.tolist() == [0.0, 1.5]
    assert trajectory.bundle([1, 4]).twist() == pytest.approx(trajectory.bundle().twist()[[1, 4]], abs=1e-12)
