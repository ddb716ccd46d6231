"""Memory is foreseen, and what would not fit is refused before it is taken."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import flagrs
import numpy as np
import pytest
from flagrs import FlagrsError, Fluid, Material, Rod, Scene, SceneError, Simulation, memory, scenarios

SOFT = Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)


def large(nodes: int, **fluid: Any) -> Scene:
    rod = Rod.straight(length=1.0, edge_count=nodes - 1, radius=1e-6, material=SOFT)
    return Scene(rods=rod, fluid=Fluid(viscosity=1.0, **fluid))


def test_there_is_memory_and_limits_of_a_process_count() -> None:
    there = memory.available_memory()
    assert 1e6 < there < 1e16
    with pytest.raises(FlagrsError, match=r"this would take .* TB of .* memory there is; buy more"):
        memory.require_memory("this", 1e18, "buy more")
    memory.require_memory("this", 1e3, "buy more")


def test_frames_that_would_not_fit_are_refused_at_once(tmp_path: Path) -> None:
    simulation = Simulation(scenarios.robot(edge_length=9e-3), threads=1)
    start = time.perf_counter()
    for every in (1e-12, 1e-300, 5e-324):
        for path in (False, tmp_path / "run.h5"):
            with pytest.raises(FlagrsError, match="save_every"):
                simulation.run(1000.0, every, path=path)
    assert time.perf_counter() - start < 2.0 and not list(tmp_path.iterdir()) and simulation.time == 0.0


def test_an_interval_longer_than_the_run_gives_its_end() -> None:
    for every in (1.0, 1e9, 1e300):
        trajectory = Simulation(scenarios.straight_rod(), dt=1e-3, threads=1).run(0.002, every, path=False)
        assert trajectory.time.tolist() == [0.0, 0.002]


def test_an_endless_run_is_refused_in_words() -> None:
    with pytest.raises(SceneError, match=r"until: inf is not allowed; must be finite and > 0"):
        Simulation(scenarios.straight_rod(), threads=1).run(np.inf, 0.1, path=False)


def test_dense_matrices_that_would_not_fit_are_refused() -> None:
    scene = large(100_000, far_field_nodes=1_000_000)
    assert scene.plan().memory > 8.0 * 9e10 and "memory:" in str(scene.plan())
    with pytest.raises(FlagrsError, match="a simulation of 100000 nodes would take"):
        Simulation(scene, threads=1)
    nodes = np.linspace([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 100_000)
    edges = np.stack([np.arange(99_999), np.arange(1, 100_000)], axis=1)
    with pytest.raises(FlagrsError, match="the mobility of 100000 targets"):
        flagrs.fluid.mobility(nodes, edges, 1e-5)


def test_a_bar_shows_progress_and_nonsense_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    simulation = Simulation(scenarios.straight_rod(), dt=1e-3, threads=1)
    simulation.run(0.01, 0.005, path=False, progress=True)
    assert "s simulated" in capsys.readouterr().err
    assert simulation.run(0.02, 0.005, path=False, progress=False).wall_seconds > 0.0
    with pytest.raises(SceneError, match="progress"):
        simulation.run(0.03, 0.005, path=False, progress="yes")  # type: ignore[arg-type]
