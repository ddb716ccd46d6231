"""Exports: that other programs' own readers get the run's numbers back."""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fake_simulation import SPEED, FakeSimulation
from flagrs import FileError, FlagrsError, SceneError, Simulation, Trajectory, cli, scenarios
from flagrs.export import export
from flagrs.recorder import Recorder
from flagrs.results.strain import tensions


@pytest.fixture(scope="module")
def swimming() -> Trajectory:
    return Simulation(scenarios.robot(), rtol=1e-2).run(2.0, 0.25, path=False)


def frames_by_vtk(path: Path) -> list[Any]:
    """Return the poly data at every time, and the times, as VTK's own reader gives them."""
    hdf = pytest.importorskip("vtkmodules.vtkIOHDF", reason="no vtk")
    reader = hdf.vtkHDFReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    found = []
    for step in range(reader.GetNumberOfSteps()):
        reader.SetStep(step)
        reader.Update()
        copy = reader.GetOutput().NewInstance()
        copy.DeepCopy(reader.GetOutput())
        found.append((reader.GetTimeValue(), copy))
    return found


def array(attributes: Any, name: str) -> Any:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return vtk_to_numpy(attributes.GetArray(name))


def test_vtk_reads_the_frames_of_a_swimmer(swimming: Trajectory, tmp_path: Path) -> None:
    (path,) = swimming.export("vtkhdf", tmp_path / "run.vtkhdf")
    frames = frames_by_vtk(path)
    from vtkmodules.util.numpy_support import vtk_to_numpy

    assert [time for time, _ in frames] == pytest.approx(swimming.time)
    pulls, directors = tensions(swimming.scene, swimming.nodes), swimming.material_directors()
    for k, (_, data) in enumerate(frames):
        points = vtk_to_numpy(data.GetPoints().GetData())
        assert points[:59] == pytest.approx(swimming.nodes[k], rel=0, abs=0)
        from_head = np.linalg.norm(points[59:] - swimming.position()[k], axis=1)
        assert from_head == pytest.approx(np.full(len(from_head), 31e-3), rel=1e-9)
        values = data.GetPointData()
        assert array(values, "velocity")[:59] == pytest.approx(swimming.velocities[k], rel=1e-6, abs=1e-12)
        density = array(values, "force_density")[:59]
        assert density == pytest.approx(swimming.force_density[k], rel=1e-6, abs=1e-12)
        assert array(values, "radius")[:59] == pytest.approx(np.full(59, 1.6e-3), rel=1e-12)
        assert array(values, "tension")[1:58] == pytest.approx(
            0.5 * (pulls[k, 1:] + pulls[k, :-1]), rel=1e-5, abs=1e-9
        )
        assert array(values, "director")[0] == pytest.approx(directors[k, 0], abs=1e-6)
        ends = [
            (data.GetCell(cell).GetPointId(0), data.GetCell(cell).GetNumberOfPoints()) for cell in range(3)
        ]
        assert ends == [(0, 27), (26, 7), (32, 27)] and data.GetNumberOfLines() == 3
        assert array(data.GetCellData(), "part")[:4].tolist() == [0, 1, 0, 2]


def test_the_sphere_of_a_head_is_closed_and_faces_outwards(swimming: Trajectory, tmp_path: Path) -> None:
    swimming.export("vtkhdf", tmp_path / "run.vtkhdf")
    _, data = frames_by_vtk(tmp_path / "run.vtkhdf")[0]
    ways = set()
    for number in range(data.GetNumberOfLines(), data.GetNumberOfCells()):
        cell = data.GetCell(number)
        ids = [cell.GetPointId(k) for k in range(cell.GetNumberOfPoints())]
        corners = np.array([data.GetPoint(k) for k in ids])
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        assert normal @ (corners.mean(axis=0) - swimming.position()[0]) > 0.0
        ways |= set(zip(ids, ids[1:] + ids[:1]))
    assert all((b, a) in ways for a, b in ways)


@pytest.mark.parametrize("name", list(scenarios.list()))
def test_vtk_reads_every_scenario(name: str, tmp_path: Path) -> None:
    trajectory = FakeSimulation(scenarios.build(name)).run(1.0, 0.5)
    frames = frames_by_vtk(trajectory.export("vtkhdf", tmp_path / "run.vtkhdf")[0])
    assert len(frames) == 3
    edges = sum(
        data.GetCell(cell).GetNumberOfPoints() - 1
        for _, data in frames[:1]
        for cell in range(data.GetNumberOfLines())
    )
    assert edges == trajectory.scene.edge_count


def test_a_dataset_has_the_fields_with_units_and_survives_netcdf(
    swimming: Trajectory, tmp_path: Path
) -> None:
    xarray = pytest.importorskip("xarray")
    data = swimming.to_xarray()
    assert dict(data.sizes) == {
        **{"time": 9, "node": 59, "axis": 3, "edge": 58, "motor": 2, "clamp": 0, "energy_part": 3, "end": 2}
    }
    assert data.nodes.attrs["units"] == "m" and data.motor_torque.attrs["units"] == "N m"
    late = data.nodes.sel(time=1.5, axis="y").values
    assert np.array_equal(late, swimming.nodes[6, :, 1])
    assert np.array_equal(data.edges.values, swimming.edges)
    assert float(data.radius[0]) == 1.6e-3
    pytest.importorskip("h5netcdf")
    (path,) = export(swimming, "xarray", tmp_path / "run.nc")
    with xarray.open_dataset(path, engine="h5netcdf") as again:
        assert again.identical(data) or again.equals(data)
        assert "scene" in again.attrs


def test_tables_have_a_row_for_each_frame_or_node(swimming: Trajectory) -> None:
    pytest.importorskip("pandas")
    frames = swimming.to_pandas()
    assert frames.index.tolist() == swimming.time.tolist()
    assert frames["motor_1_torque [N m]"].to_numpy() == pytest.approx(swimming.motor_torque[:, 1], rel=0)
    assert frames["motors_work [J]"].iloc[-1] > 0.0
    nodes = swimming.to_pandas("nodes")
    assert len(nodes) == 9 * 59
    assert nodes.loc[(1.0, 0, 7), "y [m]"] == swimming.nodes[4, 7, 1]
    with pytest.raises(FlagrsError, match="'frames' or 'nodes'"):
        swimming.to_pandas("edges")


def test_csv_tables_hold_every_digit(swimming: Trajectory, tmp_path: Path) -> None:
    frames, nodes = swimming.export("csv", tmp_path / "run.csv")
    with nodes.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    heights = np.array([float(row["z [m]"]) for row in rows]).reshape(9, 59)
    assert np.array_equal(heights, swimming.nodes[..., 2])
    with frames.open(encoding="utf-8") as file:
        torque = [float(row["motor_0_torque [N m]"]) for row in csv.DictReader(file)]
    assert np.array_equal(torque, swimming.motor_torque[:, 0])


def test_an_archive_opens_without_pickles(swimming: Trajectory, tmp_path: Path) -> None:
    (path,) = swimming.export("npz", tmp_path / "run.npz")
    with np.load(path, allow_pickle=False) as archive:
        assert np.array_equal(archive["nodes"], swimming.nodes)
        assert np.array_equal(archive["edges"], swimming.edges)
        assert '"rods"' in str(archive["scene"])


def test_what_cannot_be_exported_is_refused(swimming: Trajectory, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="vtkhdf, xarray, npz, csv"):
        swimming.export("stl", tmp_path / "x.stl")
    with pytest.raises(FlagrsError, match="no frames"):
        Recorder(None, scenarios.robot(), {}).trajectory().export("npz", tmp_path / "x.npz")
    for to in ("vtkhdf", "npz", "csv"):
        with pytest.raises(FileError):
            swimming.export(to, tmp_path / "none" / "x")


def test_the_command_names_its_files(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    FakeSimulation(scenarios.robot()).run(1.0, 0.5, path=tmp_path / "run.h5")
    monkeypatch.setattr(sys, "argv", ["flagrs", "export", str(tmp_path / "run.h5"), "--to", "csv"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code and "run-nodes.csv" in capsys.readouterr().out
    with (tmp_path / "run.csv").open(encoding="utf-8") as file:
        places = [float(row["position_x [m]"]) for row in csv.DictReader(file)]
    assert places[-1] - places[0] == pytest.approx(-SPEED, rel=1e-9)
