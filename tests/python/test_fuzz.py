"""Random scenes: they run, or end in a clear error; they balance; they repeat to the last bit; rtol holds.

The number of examples is divided among the properties: 500, always the same ones, unless the variable
FLAGRS_FUZZ_EXAMPLES asks for another number, which are then new ones (``make fuzz EXAMPLES=100000``). A scene
that fails is printed as TOML.
"""

from __future__ import annotations

import os
import sys
import threading
import time
import tomllib
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import tomli_w
from flagrs import FlagrsError, Scene, Simulation
from flagrs.scene.codec import plain
from flagrs.scene.toml import from_mapping
from hypothesis import HealthCheck, assume, given, note, settings
from hypothesis import strategies as st
from scene_strategies import changes, driven_scenes, scenes
from scene_strategies import settings as run_settings

EXAMPLES = int(os.environ.get("FLAGRS_FUZZ_EXAMPLES", "500"))
#: Seconds of processor time for one example of a few steps; many times what the slowest takes.
PATIENCE = 60.0


def fuzz(share: float) -> settings:
    """Return the settings of a property with a share of all examples: the same ones in every ordinary run."""
    return settings(
        max_examples=max(1, round(share * EXAMPLES)),
        derandomize="FLAGRS_FUZZ_EXAMPLES" not in os.environ,
        database=None,
        deadline=None,
        print_blob=True,
        suppress_health_check=list(HealthCheck),
    )


def written(scene: Scene, options: dict[str, Any]) -> str:
    """Return a scene as TOML, below the options it was run with."""
    return f"# {options}\n{tomli_w.dumps(plain(scene))}"


@contextmanager
def bounded(scene: Scene, options: dict[str, Any]) -> Iterator[None]:
    """Print the scene if it fails; if it hangs, print it and end the process; fail if it takes too long."""
    text = written(scene, options)
    note(text)

    def give_up() -> None:
        sys.stderr.write(f"\nthis scene hangs:\n{text}\n")
        sys.stderr.flush()
        os._exit(3)

    alarm = threading.Timer(10.0 * PATIENCE, give_up)
    alarm.daemon = True
    alarm.start()
    start = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        alarm.cancel()
    assert time.process_time() - start < PATIENCE


def simulated(scene: Scene, options: dict[str, Any], threads: int = 1, steps: int = 5) -> Simulation | None:
    """Return a simulation after some steps, or None if the scene or the steps are refused."""
    arguments = {name: value for name, value in options.items() if name != "factor"}
    try:
        simulation = Simulation(scene, threads=threads, **arguments)
    except FlagrsError as error:
        assert len(str(error)) > 20
        return None
    simulation.dt *= options.get("factor", 1.0)
    try:
        simulation.step(steps)
    except FlagrsError as error:
        assert len(str(error)) > 20
    return simulation


def numbers(simulation: Simulation) -> dict[str, Any]:
    """Return everything that a simulation tells of itself."""
    energy = {f"energy.{name}": value for name, value in simulation.energy().items()}
    return {**simulation.state(), **simulation.frame(), **energy, "gradient": simulation.gradient()}


def drawn(data: st.DataObject, **options: bool) -> Scene:
    """Return a scene, or give the example up if what was drawn is refused with a clear error."""
    try:
        return data.draw(scenes(**options))
    except FlagrsError as error:
        assert len(str(error)) > 20
        assume(False)
        raise


@fuzz(0.5)
@given(st.data(), run_settings())
def test_a_scene_runs_or_is_refused_and_no_number_is_nan(
    data: st.DataObject, options: dict[str, Any]
) -> None:
    scene = drawn(data)
    with bounded(scene, options):
        simulation = simulated(scene, options)
        if simulation is None:
            return
        for name, value in numbers(simulation).items():
            if not np.issubdtype(np.asarray(value).dtype, np.floating):
                continue
            assert not np.isnan(value).any(), name
            # A gap between things of which none may touch is infinite.
            assert np.isfinite(value).all() or "gap" in name, name
        assert simulation.time >= 0.0


@fuzz(0.1)
@given(st.data())
def test_a_scene_survives_toml(data: st.DataObject) -> None:
    scene = drawn(data)
    text = tomli_w.dumps(plain(scene))
    note(text)
    assert from_mapping(tomllib.loads(text)).digest() == scene.digest()


@fuzz(0.15)
@given(st.data(), run_settings())
def test_a_run_is_the_same_to_the_last_bit_with_one_thread_and_with_two(
    data: st.DataObject, options: dict[str, Any]
) -> None:
    scene = drawn(data)
    with bounded(scene, options):
        first, second = simulated(scene, options), simulated(scene, options, threads=2)
        assert (first is None) == (second is None)
        if first is None or second is None:
            return
        other = numbers(second)
        for name, value in numbers(first).items():
            if name not in ("wall_seconds", "seconds") and "second" not in name:
                assert np.asarray(value).tobytes() == np.asarray(other[name]).tobytes(), name


@fuzz(0.15)
@given(st.data())
def test_forces_on_a_free_scene_balance(data: st.DataObject) -> None:
    scene = drawn(data, fluid=True, free=True, quiet=True)
    assume(scene.fluid is not None and scene.fluid.far_field_nodes is None)
    options = {"scheme": "overdamped"}
    with bounded(scene, options):
        try:
            simulation = Simulation(scene, rtol=None, threads=1)
            resistance = simulation.resistance()
            simulation.step()
        except FlagrsError:
            return
        # A step made in parts ends with the velocities of its last part, at a resistance not seen here.
        assume(simulation.statistics["rejected_steps"] == 0)
        dragged = (resistance @ simulation.velocities.ravel()).reshape(-1, 3)
        driving = applied(scene)
        total = dragged.sum(axis=0) - driving.sum(axis=0)
        sizes = np.linalg.norm(dragged, axis=1).sum() + np.linalg.norm(driving, axis=1).sum()
        # Newton stops at 1e-10 of the typical force, or where round-off of positions changes elastic forces.
        round_off = max(
            float((rod.EA_array() * np.abs(rod.nodes).max() / rod.rest_lengths()).max()) for rod in scene.rods
        )
        # So do the velocities, which are differences of positions over the step.
        largest = float(np.abs(simulation.nodes).max())
        known = 4.0 * np.finfo(float).eps * largest / simulation.dt * float(np.abs(resistance).sum())
        assert np.linalg.norm(total) <= 1e-7 * sizes + 1e-12 * round_off + known


def applied(scene: Scene) -> np.ndarray:
    """Return weight less buoyancy and loads (N, 3) on the nodes [N]."""
    assert scene.fluid is not None
    forces = []
    for number, rod in enumerate(scene.rods):
        volume = np.pi * rod.radius_array() ** 2 * rod.rest_lengths()
        half = 0.5 * (rod.material.density - scene.fluid.density) * volume
        force = np.zeros((len(rod.nodes), 3))
        for end in (0, 1):
            np.add.at(force, rod.edge_array()[:, end], half[:, None] * scene.gravity)
        for load in scene.loads:
            if load.rod == number:
                force[load.node] += load.force
        forces.append(force)
    return np.concatenate(forces)


@fuzz(0.1)
@given(st.data(), st.sampled_from([1e-2, 1e-3]))
def test_a_tenth_of_rtol_changes_the_motion_by_no_more_than_rtol_allows(
    data: st.DataObject, rtol: float
) -> None:
    scene = drawn(data, fluid=True, quiet=True)
    with bounded(scene, {"rtol": [rtol, 0.1 * rtol]}):
        found = []
        for tolerance in (rtol, 0.1 * rtol):
            try:
                simulation = Simulation(scene, rtol=tolerance, threads=1)
                until = 20.0 * simulation.dt
                while simulation.time < until and simulation.statistics["steps"] < 300:
                    simulation.step()
                assume(simulation.time >= until)
                again = Simulation(scene, rtol=tolerance, threads=1)
                found.append(np.asarray(again.run(until=until, save_every=until, path=False).nodes[-1]))
            except FlagrsError:
                return
        sizes = np.concatenate([np.full(len(rod.nodes), rod.rest_lengths().sum()) for rod in scene.rods])
        # Of the order of rtol of a filament's size; that is never more than its length.
        assert (np.linalg.norm(found[0] - found[1], axis=1) <= 10.0 * rtol * sizes).all()


@fuzz(0.06)
@given(st.data())
def test_inputs_set_between_steps_are_followed_and_restored_to_the_last_bit(data: st.DataObject) -> None:
    try:
        scene = data.draw(driven_scenes())
    except FlagrsError:
        assume(False)
    options = {"rtol": data.draw(st.sampled_from([None, 1e-3]))}
    with bounded(scene, options):
        try:
            simulation = Simulation(scene, threads=1, **options)
            simulation.step(2)
            for path, value in data.draw(changes(scene)).items():
                simulation._change(path, value)
            state, driven = simulation.state(), simulation.scene
            again = Simulation(scene, threads=1, **options)
            again.load_state(state)
            assert again.scene == driven
            simulation.step(2)
        except FlagrsError:
            return
        again.step(2)
        for name, value in simulation.state().items():
            assert np.array_equal(value, again.state()[name]), name
        assert np.isfinite(simulation.nodes).all()
