"""Figures: every kind of scene and of short run gives one, with labelled axes and equal scales."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fake_simulation import RATE, SPEED, FakeSimulation, rigid_frame
from flagrs import FileError, FlagrsError, Fluid, Rod, Scene, SceneError, plot, scenarios
from flagrs.plot.canvas import new_figure
from flagrs.plot.shape import filaments, unit_of
from flagrs.plot.table import series_of
from flagrs.plot.tubes import look_of, tubes
from flagrs.recorder import Recorder
from flagrs.trajectory import Trajectory
from flagrs.units import prefixed
from matplotlib import rcParams
from matplotlib.collections import PolyCollection

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
    figure = plot.shape(trajectory, time=1.04)
    drawn(figure)
    across = series_of(figure)[0].columns["x [mm]"]
    assert across == pytest.approx(1e3 * trajectory.nodes[10, :, 0], rel=1e-12)


def test_rods_are_drawn_with_their_radius() -> None:
    scene = scenarios.straight_rod()
    panel = drawn(plot.shape(run_of(scene)))[0]
    tube = next(collection for collection in panel.collections if isinstance(collection, PolyCollection))
    heights = np.concatenate([path.vertices[:, 1] for path in tube.get_paths()])
    radius = 1e3 * float(scene.rods[0].radius_array()[0])
    assert np.ptp(heights) == pytest.approx(2.0 * radius, rel=1e-6)


def test_the_nearer_of_two_crossing_rods_is_drawn_last() -> None:
    silicone = scenarios.robot().rods[0].material
    low = Rod.straight(length=0.1, edge_count=9, radius=1e-3, material=silicone, start=(-0.05, 0.0, 0.0))
    high = low.replace(nodes=low.nodes[:, [1, 0, 2]] + [0.0, 0.0, 2.1e-3])
    for rods, nearer in (((low, high), 1), ((high, low), 0)):
        look = look_of(Scene(rods=rods))
        faces = tubes(look, np.concatenate([rod.nodes for rod in rods])).get_facecolor()[:, :3]
        bodies = [[np.allclose(face, tone) for face in faces] for tone in look.tones[1][[0, -1]]]
        last = [int(np.flatnonzero(which)[-1]) for which in bodies]
        assert last[nearer] > last[1 - nearer]


def test_a_table_holds_what_is_drawn(tmp_path: Path) -> None:
    trajectory = run_of(scenarios.robot())
    figure = plot.summary(trajectory)
    rows = list(csv.DictReader(plot.save_table(figure, tmp_path / "t.csv").open(encoding="utf-8")))
    torque = [float(row["torque [mN m]"]) for row in rows if row["series"] == "motor 1"]
    assert torque == pytest.approx(1e3 * trajectory.torque()[:, 1], rel=1e-15)
    lines = [line for panel in figure.axes[:3] for line in panel.get_lines() if len(line.get_xdata()) > 2]
    noted = [series for series in series_of(figure) if "time [s]" in series.columns]
    assert len(lines) == len(noted) == 4
    for line, series in zip(lines, noted):
        assert line.get_xdata() == pytest.approx(series.columns["time [s]"])
        assert line.get_ydata() == pytest.approx(list(series.columns.values())[1])


def test_a_figure_without_numbers_has_no_table(tmp_path: Path) -> None:
    with pytest.raises(FlagrsError, match="no numbers"):
        plot.save_table(new_figure(1.0, 1.0), tmp_path / "t.csv")
    with pytest.raises(FileError):
        plot.save_table(plot.summary(run_of(scenarios.robot())), tmp_path / "none" / "t.csv")


def pushed() -> Trajectory:
    """Return two frames of a rod that pushes the fluid along x."""
    scene = scenarios.straight_rod()
    recorder = Recorder(None, scene.replace(fluid=Fluid(viscosity=2.0)), {})
    for time in (0.0, 1.0):
        frame = rigid_frame(scene, time)
        frame["force_density"][:, 0] = 1e-3
        recorder.append(frame)
    return recorder.trajectory()


@pytest.mark.parametrize("plane", ["xy", "xz", "yz"])
def test_a_flow_figure_shows_the_flow_at_the_points_of_the_plane(plane: str) -> None:
    trajectory = pushed()
    figure = plot.flow(trajectory, plane=plane, at=0.01, points=12)
    drawn(figure)
    columns = series_of(figure)[0].columns
    length, rate = (
        next(key.split("[")[1][:-1] for key in columns if key.startswith(word))
        for word in (plane[0], "speed")
    )
    size = {"m": 1.0, "mm": 1e-3, "µm": 1e-6}[length]
    points = np.full((len(columns[f"speed [{rate}]"]), 3), 0.01)
    for axis in plane:
        points[:, "xyz".index(axis)] = size * columns[f"{axis} [{length}]"]
    fast = {"m/s": 1.0, "mm/s": 1e-3, "µm/s": 1e-6}[rate]
    velocity = fast * np.stack([columns[f"u_{axis} [{rate}]"] for axis in "xyz"], axis=1)
    assert velocity == pytest.approx(trajectory.flow(points), rel=1e-9, abs=1e-15)


def test_a_flow_of_what_has_none_is_refused() -> None:
    with pytest.raises(SceneError, match="plane"):
        plot.flow(pushed(), plane="zz")
    with pytest.raises(FlagrsError, match="Stokeslet"):
        plot.flow(run_of(scenarios.cantilever()))


def test_kymographs_show_curvature_beyond_rest_and_tension_along_each_filament() -> None:
    scene = scenarios.robot()
    recorder = Recorder(None, scene, {})
    for time in np.arange(5.0):
        frame = rigid_frame(scene, float(time))
        frame["nodes"] *= 1.0 + 1e-3 * time
        recorder.append(frame)
    trajectory = recorder.trajectory()
    stiffness = float(scene.rods[0].EA_array()[0])
    # Stretched all over, it keeps its angles, and so its curvature per length at rest.
    for draw, edges, factor in ((plot.curvature, 25, 0.0), (plot.tension, 26, 1e-3 * stiffness)):
        figure = draw(trajectory)
        assert len(drawn(figure)) == 3
        (label, values), unit = list(series_of(figure)[0].columns.items())[2], figure.axes[-1].get_ylabel()
        assert label == unit
        scale = {"mN": 1e3, "µN": 1e6, "N": 1.0}.get(unit[-3:-1].strip("["), 1.0)
        expected = scale * factor * np.repeat(np.arange(5.0), edges)
        assert values == pytest.approx(expected, rel=1e-9, abs=1e-9 if factor else 1e-12)
        mesh = np.asarray(figure.axes[0].collections[0].get_array()).reshape(edges, 5)
        assert mesh.T.ravel() == pytest.approx(values)


def test_a_bundle_figure_says_what_is_missing() -> None:
    pair = drawn(plot.bundle(run_of(scenarios.clamped_flagella())))
    assert [len(panel.get_lines()) for panel in pair] == [1, 1, 1, 1]
    alone = drawn(plot.bundle(run_of(scenarios.straight_rod())))
    assert "needs 2 filaments" in alone[0].texts[0].get_text().replace("\n", " ")


@pytest.mark.parametrize(("size", "millimetres"), [("column", 86.0), ("page", 178.0)])
def test_printed_figures_are_as_wide_as_asked_for_and_leave_the_style_alone(
    size: Any, millimetres: float
) -> None:
    before = rcParams["font.size"]
    with plot.printed(size):
        figure = plot.curvature(run_of(scenarios.robot()))
        assert rcParams["font.size"] == 8.0
    assert figure.get_figwidth() * 25.4 == pytest.approx(millimetres)
    assert rcParams["font.size"] == before
    with pytest.raises(SceneError, match="size"), plot.printed("poster"):  # type: ignore[arg-type]
        pass


@pytest.mark.parametrize(
    ("size", "factor", "unit"),
    [(0.0023, 1e3, "mN m"), (12.0, 1.0, "N m"), (1e-17, 1e18, "aN m"), (0.0, 1.0, "N m")],
)
def test_values_are_shown_with_the_prefix_they_read_best_with(size: float, factor: float, unit: str) -> None:
    assert prefixed(size, "N m") == (factor, unit)


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
    with pytest.raises(FlagrsError, match=r"rows\[0\]: no swimming_speed, head_rate, nodes"):
        plot.study([{"rpm": 3.0}], "nodes")
    with pytest.raises(FlagrsError, match="no run"):
        plot.study(rows[:1], "nodes")
