"""Figures: every kind of scene and of short run gives one, with labelled axes and equal scales."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fake_simulation import RATE, SPEED, FakeSimulation, rigid_frame
from flagrs import FlagrsError, Scene, plot, scenarios
from flagrs.plot.shape import filaments, unit_of
from flagrs.recorder import Recorder
from flagrs.trajectory import Trajectory

SCENES = [scenarios.build(name) for name in scenarios.list()]


def run_of(scene: Scene, seconds: float = 4.0) -> Trajectory:
    return FakeSimulation(scene).run(seconds, 0.1)


def drawn(figure: Any) -> list[Any]:
    """Return the axes of a figure after laying it out."""
    figure.draw_without_rendering()
    axes: list[Any] = figure.axes
    return axes


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_every_scenario_has_a_summary_with_labelled_axes(scene: Scene) -> None:
    for panel in drawn(plot.summary(run_of(scene))):
        assert "[" in panel.get_xlabel() and "[" in panel.get_ylabel(), panel.get_title()


def test_a_summary_says_speed_and_head_rate() -> None:
    axes = drawn(plot.summary(run_of(scenarios.robot())))
    legends = [text.get_text() for panel in axes[:2] for text in panel.get_legend().get_texts()]
    assert legends == [f"mean {1e3 * SPEED:.3g} mm/s", f"mean {RATE * 60 / (2 * np.pi):.3g} rpm"]


def test_a_single_frame_gives_a_summary_that_says_what_is_missing() -> None:
    recorder = Recorder(None, scenarios.robot(), {})
    recorder.append(rigid_frame(scenarios.robot(), 0.0))
    axes = drawn(plot.summary(recorder.trajectory()))
    assert "a rate needs" in axes[0].texts[0].get_text().replace("\n", " ")


def test_a_trajectory_without_frames_is_refused() -> None:
    with pytest.raises(FlagrsError, match="no frames"):
        plot.summary(Recorder(None, scenarios.robot(), {}).trajectory())


def test_the_views_of_a_shape_have_equal_scales() -> None:
    for panel in drawn(plot.shape(run_of(scenarios.robot()), time=2.0)):
        corner, right, up = panel.transData.transform([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
        assert right[0] - corner[0] == pytest.approx(up[1] - corner[1], rel=1e-9)


def test_the_shape_is_that_of_the_nearest_frame() -> None:
    trajectory = run_of(scenarios.straight_rod())
    panel = drawn(plot.shape(trajectory, time=1.04))[0]
    segments = np.concatenate(
        [lines for collection in panel.collections for lines in collection.get_segments()]
    )
    assert segments[0] == pytest.approx(1e3 * trajectory.nodes[10, 0, :2], rel=1e-12)


def test_the_flagella_of_a_one_chain_robot_are_told_apart() -> None:
    pieces = filaments(scenarios.robot().rods[0])
    assert [(piece[0], piece[-1], len(piece)) for piece in pieces] == [(0, 25, 26), (32, 57, 26)]


@pytest.mark.parametrize(
    ("size", "unit"), [(2.0, "m"), (0.1, "mm"), (1e-4, "µm"), (1e-8, "nm"), (1e-12, "nm")]
)
def test_lengths_are_shown_in_the_unit_they_read_best_in(size: float, unit: str) -> None:
    assert unit_of(size)[1] == unit


def study_rows() -> list[dict[str, Any]]:
    return [
        {"nodes": nodes, "rpm": rpm, "swimming_speed": 1e-5 * rpm, "head_rate": 1e-2 * rpm}
        for nodes in (59, 37)
        for rpm in (20.0, 10.0)
    ]


def test_a_study_has_one_line_for_each_mesh_in_order() -> None:
    axes = drawn(plot.study(study_rows(), "nodes", "{} nodes"))
    lines = axes[0].get_lines()
    assert [line.get_label() for line in lines] == ["37 nodes", "59 nodes"]
    assert lines[0].get_xydata() == pytest.approx(np.array([[10.0, 0.1], [20.0, 0.2]]), rel=1e-12)


def test_failed_runs_are_left_out_of_a_study() -> None:
    rows = study_rows()
    rows[0].update(swimming_speed=None, head_rate=None)
    assert len(drawn(plot.study(rows, "nodes"))[0].get_lines()[1].get_xdata()) == 1
    with pytest.raises(FlagrsError, match="no run"):
        plot.study(rows[:1], "nodes")
