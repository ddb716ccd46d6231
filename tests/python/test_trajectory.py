"""Trajectories: what is measured on them, and that files keep them whatever happens to the writer."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from fake_simulation import MOTOR_SPEED, RATE, SPEED, TORQUE, FakeSimulation, rigid_frame
from flagrs import Clamp, FlagrsError, Fluid, Head, Motor, Scene, Table, scenarios
from flagrs.frame import FIELDS
from flagrs.recorder import Recorder, load_checkpoint
from flagrs.trajectory import Trajectory
from flagrs.trajectory_file import read

HERE = Path(__file__).parent
ROBOT = scenarios.robot(edge_length=9e-3)


def recorded(scene: Scene, times: Any, path: Path | None = None, **changes: Any) -> Trajectory:
    with Recorder(path, scene, {"scheme": "overdamped"}) as recorder:
        for time in times:
            recorder.append({**rigid_frame(scene, float(time)), **changes})
    return recorder.trajectory()


def frames_of(trajectory: Trajectory) -> dict[str, Any]:
    names = (*FIELDS.keys() - {"minimum_gap"},)
    return {**{name: getattr(trajectory, name) for name in names}, "minimum_gap": trajectory.minimum_gap()}


# --- measuring ----------------------------------------------------------------------------------------------


def test_speed_and_head_rate_of_a_rigid_motion_are_exact() -> None:
    trajectory = recorded(ROBOT, np.arange(0.0, 20.0, 0.25))
    assert trajectory.swimming_speed() == pytest.approx(SPEED, rel=1e-12)
    assert trajectory.head_rate() == pytest.approx(RATE, rel=1e-12)
    assert trajectory.shaft_axis() == pytest.approx([1.0, 0.0, 0.0], abs=1e-14)


def test_the_speed_without_a_head_is_that_of_the_mean_of_all_nodes() -> None:
    scene = scenarios.straight_rod()
    trajectory = recorded(scene, np.arange(0.0, 4.0, 0.5))
    assert trajectory.swimming_speed() == pytest.approx(SPEED, rel=1e-12)


def test_the_head_rate_counts_on_beyond_half_a_turn() -> None:
    # 8 turns in the window, in steps of 1/12 turn
    trajectory = recorded(ROBOT, np.arange(0.0, 200.0, 1.0))
    assert trajectory.head_rate(start=0.0) == pytest.approx(RATE, rel=1e-12)
    assert trajectory.head_angle()[-1] == pytest.approx(199.0 * RATE, rel=1e-12)


def test_the_sign_of_the_head_rate_does_not_depend_on_the_order_of_the_nodes() -> None:
    rod = ROBOT.rods[0]
    last = len(rod.nodes) - 1
    assert ROBOT.head is not None
    mirrored = Scene(
        rods=[rod.replace(nodes=rod.nodes[::-1])],
        head=ROBOT.head.replace(node=last - ROBOT.head.node),
        motors=[
            motor.replace(node=last - motor.node, shaft=last - 1 - motor.shaft) for motor in ROBOT.motors
        ],
    )
    trajectory = recorded(mirrored, np.arange(0.0, 10.0, 0.25))
    assert trajectory.head_rate() == pytest.approx(RATE, rel=1e-12)


def test_the_window_is_the_last_half_unless_given() -> None:
    with Recorder(None, ROBOT, {}) as recorder:
        for time in np.arange(0.0, 10.5, 0.5):
            frame = rigid_frame(ROBOT, time)
            # At rest until 5 s, then at constant speed.
            frame["nodes"] = ROBOT.node_array() + np.array([max(0.0, time - 5.0), 0.0, 0.0])
            recorder.append(frame)
    trajectory = recorder.trajectory()
    assert trajectory.swimming_speed() == pytest.approx(1.0, rel=1e-12)
    assert trajectory.swimming_speed(0.0, 5.0) == 0.0
    assert 0.0 < trajectory.swimming_speed(0.0, 10.0) < 1.0


def test_power_is_torque_times_speed_summed_over_motors() -> None:
    trajectory = recorded(ROBOT, [0.0, 1.0, 2.0])
    assert trajectory.torque().shape == (3, 2)
    assert trajectory.power() == pytest.approx(np.full(3, 2 * TORQUE * MOTOR_SPEED), rel=1e-14)


def test_efficiency_is_purcells() -> None:
    trajectory = recorded(ROBOT, np.arange(0.0, 4.0, 0.5))
    drag = 4.1 * 6 * np.pi * 1.0 * 31e-3 * SPEED**2
    assert trajectory.efficiency() == pytest.approx(drag / (2 * TORQUE * MOTOR_SPEED), rel=1e-12)


@pytest.mark.parametrize("times", [[], [0.0]])
@pytest.mark.parametrize("measure", ["swimming_speed", "head_rate", "efficiency", "mean_power"])
def test_too_few_frames_are_reported_clearly(times: list[float], measure: str) -> None:
    with pytest.raises(FlagrsError, match="frames"):
        getattr(recorded(ROBOT, times), measure)()


def test_an_empty_window_names_what_there_is() -> None:
    trajectory = recorded(ROBOT, [0.0, 1.0, 2.0])
    with pytest.raises(FlagrsError, match=r"0 frames between 5 s and 6 s.*from 0 s to 2 s"):
        trajectory.swimming_speed(5.0, 6.0)


@pytest.mark.parametrize("measure", ["head_rate", "efficiency", "mean_power"])
def test_what_a_scene_has_no_parts_for_is_reported_clearly(measure: str) -> None:
    with pytest.raises(FlagrsError, match="needs a scene with"):
        getattr(recorded(scenarios.straight_rod(), [0.0, 1.0, 2.0, 3.0]), measure)()


def test_no_efficiency_without_power() -> None:
    trajectory = recorded(ROBOT, [0.0, 1.0, 2.0, 3.0], motor_torque=np.zeros(2))
    with pytest.raises(FlagrsError, match="no power"):
        trajectory.efficiency()


# --- recording ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", [name for name in FIELDS if name not in ("time", "minimum_gap")])
def test_a_frame_that_is_not_finite_is_never_recorded(tmp_path: Path, name: str, bad: float) -> None:
    path, held = tmp_path / "run.h5", ROBOT.replace(clamps=(Clamp(nodes=(0,)),))
    with Recorder(path, held, {}) as recorder:
        recorder.append(rigid_frame(held, 0.0))
        frame = rigid_frame(held, 1.0)
        values = np.array(frame[name], dtype=float)
        values.flat[-1] = bad
        with pytest.raises(FlagrsError, match=name):
            recorder.append({**frame, name: values})
    assert Trajectory.load(path).time.tolist() == [0.0]


def test_the_gap_may_be_infinite_but_not_nan_or_minus_infinite() -> None:
    assert np.isinf(recorded(ROBOT, [0.0], minimum_gap=np.inf).minimum_gap()).all()
    for bad in (np.nan, -np.inf):
        with pytest.raises(FlagrsError, match="minimum_gap"):
            recorded(ROBOT, [0.0], minimum_gap=bad)


@pytest.mark.parametrize(
    ("changes", "what"),
    [({"theta": np.zeros(3)}, "theta has shape"), ({"tehta": 1.0}, "tehta"), ({"time": 0.0}, "not later")],
)
def test_a_frame_that_does_not_fit_is_refused(changes: dict[str, Any], what: str) -> None:
    recorder = Recorder(None, ROBOT, {})
    recorder.append(rigid_frame(ROBOT, 0.0))
    with pytest.raises(FlagrsError, match=what):
        recorder.append({**rigid_frame(ROBOT, 1.0), **changes})


def test_a_frame_with_a_field_missing_is_refused() -> None:
    frame = rigid_frame(ROBOT, 0.0)
    del frame["energy"]
    with pytest.raises(FlagrsError, match="energy"):
        Recorder(None, ROBOT, {}).append(frame)


def test_a_recorded_frame_does_not_change_with_the_array_it_came_from() -> None:
    recorder = Recorder(None, ROBOT, {})
    frame = rigid_frame(ROBOT, 0.0)
    recorder.append(frame)
    frame["nodes"][:] = 7.0
    assert np.array_equal(recorder.trajectory().nodes[0], ROBOT.node_array())


# --- files --------------------------------------------------------------------------------------------------


def test_a_file_keeps_every_bit_of_frames_scene_and_settings(tmp_path: Path) -> None:
    times = np.cumsum(np.random.default_rng(1).random(200))
    held, filed = recorded(ROBOT, times), recorded(ROBOT, times, tmp_path / "run.h5")
    held.save(tmp_path / "copy.h5")
    for other in (filed, Trajectory.load(tmp_path / "copy.h5")):
        for name, array in frames_of(held).items():
            assert np.array_equal(frames_of(other)[name], array), name
        assert other.scene == ROBOT and other.settings == {"scheme": "overdamped"}
    assert filed.finished and filed.path == tmp_path / "run.h5" and filed.wall_seconds > 0.0


def test_a_file_says_what_its_numbers_are(tmp_path: Path) -> None:
    recorded(ROBOT, [0.0, 1.0], tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        assert file.attrs["format"] == "flagrs trajectory"
        assert {name: dataset.attrs["unit"] for name, dataset in file["frames"].items()} == {
            name: field.unit for name, field in FIELDS.items()
        }
        assert Scene.from_json(file["manifest/scene"].asstr()[()]) == ROBOT


def test_a_scene_without_motors_can_be_recorded(tmp_path: Path) -> None:
    scene = scenarios.straight_rod()
    assert recorded(scene, [0.0, 1.0], tmp_path / "run.h5").motor_angle.shape == (2, 0)


def test_a_file_can_be_read_while_it_is_written(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "run.h5", ROBOT, {})
    for time in range(5):
        recorder.append(rigid_frame(ROBOT, float(time)))
    recorder.flush()
    trajectory = Trajectory.load(tmp_path / "run.h5")
    assert len(trajectory) == 5 and not trajectory.finished
    recorder.close()


def test_an_exception_leaves_a_readable_file_that_is_not_finished(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), Recorder(tmp_path / "run.h5", ROBOT, {}) as recorder:
        recorder.append(rigid_frame(ROBOT, 0.0))
        raise KeyboardInterrupt
    trajectory = Trajectory.load(tmp_path / "run.h5")
    assert len(trajectory) == 1 and not trajectory.finished


def test_a_file_that_is_no_trajectory_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "text.h5").write_text("hello")
    with h5py.File(tmp_path / "other.h5", "w"):
        pass
    for name in ("text.h5", "other.h5"):
        with pytest.raises(FlagrsError, match=name):
            Trajectory.load(tmp_path / name)
    with pytest.raises(FileNotFoundError, match=r"none\.h5"):
        Trajectory.load(tmp_path / "none.h5")


def killed_while(tmp_path: Path, body: str) -> Path:
    """Return the file of a process that recorded and then killed itself with SIGKILL."""
    path = tmp_path / "run.h5"
    script = f"""
        import os, signal, sys
        sys.path.insert(0, {str(HERE)!r})
        import numpy as np
        from fake_simulation import rigid_frame
        from flagrs import scenarios
        from flagrs.recorder import Recorder
        scene = scenarios.robot(edge_length=9e-3)
        recorder = Recorder({str(path)!r}, scene, {{}})
        def kill(): os.kill(os.getpid(), signal.SIGKILL)
        """
    code = textwrap.dedent(script) + textwrap.dedent(body)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    ended = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=False)
    assert ended.returncode == -signal.SIGKILL, ended.stderr.decode()
    return path


def test_a_killed_run_stays_readable_and_resumes_from_its_checkpoint(tmp_path: Path) -> None:
    path = killed_while(
        tmp_path,
        """
        for number in range(300):
            recorder.append(rigid_frame(scene, 0.1 * number))
            if number == 199:
                recorder.checkpoint({"q": np.arange(5) / 3.0})
        kill()
        """,
    )
    trajectory = Trajectory.load(path)
    assert 200 <= len(trajectory) <= 300 and not trajectory.finished
    for number in (0, 123, len(trajectory) - 1):
        assert np.array_equal(trajectory.nodes[number], rigid_frame(ROBOT, 0.1 * number)["nodes"])
    checkpoint = load_checkpoint(path)
    assert np.array_equal(checkpoint.state["q"], np.arange(5) / 3.0) and checkpoint.scene == ROBOT
    with Recorder.resume(path) as recorder:
        assert recorder.frame_count == 200 and recorder.last_time == 0.1 * 199
        recorder.append(rigid_frame(ROBOT, 20.0))
    resumed = Trajectory.load(path)
    assert len(resumed) == 201 and resumed.finished
    assert np.array_equal(resumed.nodes[:200], trajectory.nodes[:200])


@pytest.mark.parametrize("after", ["frames.flush", "frames.count", "slot.content", "slot.entry"])
def test_a_run_killed_in_the_middle_of_writing_keeps_what_was_whole(tmp_path: Path, after: str) -> None:
    # The writer flushes four times in a checkpoint that follows frames; kill it right after one of them.
    which = ["frames.flush", "frames.count", "slot.content", "slot.entry"].index(after)
    path = killed_while(
        tmp_path,
        f"""
        for number in range(10):
            recorder.append(rigid_frame(scene, float(number)))
        recorder.checkpoint({{"number": np.array(10)}})
        for number in range(10, 20):
            recorder.append(rigid_frame(scene, float(number)))
        class Counting:
            def __init__(self, file): self.file, self.flushes = file, 0
            def __getitem__(self, name): return self.file[name]
            def __getattr__(self, name): return getattr(self.file, name)
            def flush(self):
                self.file.flush()
                if self.flushes == {which}: kill()
                self.flushes += 1
        recorder._writer._file = Counting(recorder._writer._file)
        recorder.checkpoint({{"number": np.array(20)}})
        """,
    )
    contents = read(path)
    assert len(contents.frames["time"]) == (10 if after == "frames.flush" else 20)
    assert contents.state is not None
    assert (int(contents.state["number"]), contents.state_frames) == (
        (20, 20) if after == "slot.entry" else (10, 10)
    )


def test_a_damaged_checkpoint_gives_way_to_the_one_before(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.h5", ROBOT, {}) as recorder:
        for number in (1, 2):
            recorder.append(rigid_frame(ROBOT, float(number)))
            recorder.checkpoint({"number": np.array(number)})
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file["checkpoint/slot0"][100] ^= 1
    assert int(load_checkpoint(tmp_path / "run.h5").state["number"]) == 1


def test_a_checkpoint_is_kept_to_the_last_bit_whatever_its_type(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    state = {
        "q": rng.random((7, 3)),
        "odd": np.array([np.nan, -0.0, np.inf, 5e-324]),
        "steps": np.array(2**62 + 1),
        "flags": np.array([True, False]),
        "empty": np.zeros((0, 3)),
    }
    with Recorder(tmp_path / "run.h5", ROBOT, {}) as recorder:
        recorder.append(rigid_frame(ROBOT, 0.0))
        recorder.checkpoint(state)
    found = load_checkpoint(tmp_path / "run.h5").state
    assert found.keys() == state.keys()
    for name, array in state.items():
        assert found[name].dtype == array.dtype and found[name].tobytes() == array.tobytes()
        assert found[name].shape == array.shape


def test_a_file_without_a_checkpoint_cannot_be_resumed(tmp_path: Path) -> None:
    recorded(ROBOT, [0.0], tmp_path / "run.h5")
    with pytest.raises(FlagrsError, match="no checkpoint"):
        load_checkpoint(tmp_path / "run.h5")


def test_a_resumed_run_is_the_run_that_was_never_interrupted(tmp_path: Path) -> None:
    whole = FakeSimulation(ROBOT).run(10.0, 0.1, path=tmp_path / "whole.h5")
    FakeSimulation(ROBOT).run(4.0, 0.1, path=tmp_path / "parts.h5")
    parts = FakeSimulation.restore(tmp_path / "parts.h5").run(10.0, 0.1, path=tmp_path / "parts.h5")
    for name, array in frames_of(whole).items():
        assert np.array_equal(frames_of(parts)[name], array), name


# --- functions of time --------------------------------------------------------------------------------------


def driven() -> Scene:
    return ROBOT.replace(motors=[ROBOT.motors[0].replace(speed=lambda time: 3.0 * time**2), ROBOT.motors[1]])


def test_functions_of_time_come_back_as_tables_of_their_values_at_the_frames(tmp_path: Path) -> None:
    scene = recorded(driven(), [0.0, 1.0, 2.0], tmp_path / "run.h5").scene
    assert scene.motors[0].speed == Table(times=[0.0, 1.0, 2.0], values=[0.0, 3.0, 12.0])
    assert scene.motors[1] == ROBOT.motors[1]


def test_a_run_driven_by_a_function_resumes_only_with_its_scene(tmp_path: Path) -> None:
    scene, path = driven(), tmp_path / "run.h5"
    with Recorder(path, scene, {}) as recorder:
        for time in (0.0, 1.0, 2.0):
            recorder.append(rigid_frame(scene, time))
            if time == 1.0:
                recorder.checkpoint({"time": np.array(time)})
    with pytest.raises(FlagrsError, match=r"motors\[0\].speed was a Python function"):
        load_checkpoint(path)
    with pytest.raises(FlagrsError, match="another scene"):
        load_checkpoint(path, scene.replace(name="other"))
    with Recorder.resume(path, driven()) as recorder:
        recorder.append(rigid_frame(scene, 3.0))
    assert Trajectory.load(path).scene.motors[0].speed == Table(times=[0, 1, 3], values=[0.0, 3.0, 27.0])


def test_parts_of_a_second_rod_are_measured_in_the_scenes_numbering() -> None:
    rod = ROBOT.rods[0]
    assert ROBOT.head is not None
    scene = Scene(
        rods=[scenarios.straight_rod().rods[0], rod],
        fluid=Fluid(viscosity=1.0),
        head=Head(node=ROBOT.head.node, rod=1, radius=31e-3),
        motors=[Motor(node=motor.node, shaft=motor.shaft, rod=1, speed=1.0) for motor in ROBOT.motors],
    )
    trajectory = recorded(scene, np.arange(0.0, 10.0, 0.25))
    assert np.array_equal(trajectory.position()[0], rod.nodes[ROBOT.head.node])
    assert trajectory.head_rate() == pytest.approx(RATE, rel=1e-12)
    assert np.array_equal(trajectory.rod_nodes(1)[0], rod.nodes)
