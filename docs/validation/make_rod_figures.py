"""Makes every number and figure of rods.md: rods, motors and schemes against closed forms and each other.

Run with ``python docs/validation/make_rod_figures.py`` (five minutes on one core; needs matplotlib); names of
parts may follow. It uses problems of `flagrs validate`, and tests/python/rod_statics.py and rod_motion.py.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from flagrs import Clamp, Fluid, Material, Motor, PointLoad, Rod, Scene, Simulation, scenarios
from flagrs.plot.canvas import COLOURS, GREY, dress, legend, new_figure
from flagrs.validation.elastica import tip_deflection
from flagrs.validation.problems.rings import critical_twist, lowest_stiffness, michell

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "python"))

from rod_motion import (  # noqa: E402
    disturbance_grows,
    imbalance,
    linear_limit,
    moved,
    soft_helix,
)
from rod_statics import (  # noqa: E402
    cantilever_compliance,
    cantilever_tip,
)
from rod_twist import (  # noqa: E402
    WHIRLING,
    buckled_cosine,
    critical_turns,
    least_cosine,
    whirling_modes,
    whirling_speed,
)
from scipy.spatial.transform import Rotation  # noqa: E402

Array = npt.NDArray[np.float64]

FIGURES = Path(__file__).with_name("figures")
PUBLISHED = {1.0: (0.301721, 0.056433), 10.0: (0.810609, 0.554996)}


def cantilever() -> None:
    """Tip deflection against the elastica, and its convergence."""
    counts = (5, 10, 20, 40, 80, 160)
    figure = new_figure(8.0, 3.4)
    left, right = figure.subplots(1, 2)
    for colour, (load, published) in zip(COLOURS, PUBLISHED.items(), strict=False):
        scene = scenarios.cantilever(normalized_load=load)
        exact = tip_deflection(load, cantilever_compliance(scene))
        print(f"load {load}: published {published}, elastica {tip_deflection(load)}, extensible {exact}")
        errors = np.array([cantilever_tip(load, count) - exact for count in counts])
        lengths = 1.0 / (np.array(counts) + 0.5)
        orders = np.log(errors[:-1] / errors[1:]) / np.log(lengths[:-1] / lengths[1:])[:, None]
        for count, error, order in zip(counts, errors, [None, *orders], strict=True):
            print(f"  {count:4d} edges: tip {error + exact}, error {error}, order {order}")
        for component, (name, style) in enumerate((("vertical", "o-"), ("horizontal", "s--"))):
            label = f"$PL^2/EI$ = {load:g}, {name}"
            right.loglog(lengths, np.abs(errors[:, component]), style, color=colour, ms=4, label=label)
    right.loglog(lengths, 0.1 * lengths**2, ":", color=GREY, label="second order")
    dress(right, "edge length / L", "error of tip deflection / L", "Convergence to the extensible elastica")
    right.set_ylim(3e-7, 2.0)
    right.legend(loc="upper left", fontsize="small", ncols=2, edgecolor="none")
    loads = np.linspace(0.0, 10.0, 41)
    curves = np.array([tip_deflection(load) if load > 0.0 else (0.0, 0.0) for load in loads])
    marks = np.array([1.0, 2.0, 4.0, 6.0, 8.0, 10.0])
    points = np.array([cantilever_tip(load, 40) for load in marks])
    for component, name in enumerate(("vertical", "horizontal")):
        left.plot(loads, curves[:, component], color=COLOURS[component], label=f"{name}, elastica")
        left.plot(marks, points[:, component], "o", color=COLOURS[component], ms=5, label=f"{name}, 40 edges")
    dress(left, "$PL^2/EI$", "tip deflection / L", "Cantilever with a dead load")
    legend(left)
    figure.savefig(FIGURES / "rods_cantilever.png", dpi=160)


def ring() -> None:
    """Michell's instability: lowest stiffness against the twist, and critical twist against the mesh."""
    counts = (12, 24, 48, 96)
    figure = new_figure(8.0, 3.4)
    left, right = figure.subplots(1, 2)
    for colour, ratio in zip(COLOURS, (0.73, 1.5), strict=False):
        errors = np.array([critical_twist(count, ratio) / michell(ratio) - 1.0 for count in counts])
        once = (4.0 * errors[1:] - errors[:-1]) / 3.0
        twice = (16.0 * once[1:] - once[:-1]) / 15.0
        print(f"EI/GJ = {ratio}: Michell {michell(ratio):.6f} rad; {counts} edges: {errors}")
        print(f"  orders {np.log2(errors[:-1] / errors[1:])}, extrapolated once {once}, twice {twice}")
        marker = "o" if ratio < 1.0 else "x"
        line = "-" if ratio < 1.0 else "--"
        right.loglog(counts, errors, marker + line, color=colour, ms=6, label=f"EI/GJ = {ratio}")
    right.loglog(counts, 40.0 / np.array(counts, float) ** 2, ":", color=GREY, label="second order")
    dress(right, "edges of the ring", "error of the critical twist", "Convergence")
    right.set_xticks(counts, [str(count) for count in counts])
    right.minorticks_off()
    legend(right)
    shares = np.linspace(0.0, 1.4, 15)
    for colour, count in zip(COLOURS, (12, 24, 48), strict=False):
        lowest = [lowest_stiffness(count, share * michell(0.73), 0.73) for share in shares]
        left.plot(shares, lowest, "-", color=colour, label=f"{count} edges")
    left.axhline(0.0, color=GREY, linewidth=0.8)
    left.axvline(1.0, color=GREY, linewidth=0.8, linestyle=":")
    dress(
        left,
        "twist / Michell's",
        "lowest eigenvalue $\\cdot\\, L^3/EI$",
        "Softest deformation of a twisted ring",
    )
    legend(left)
    figure.savefig(FIGURES / "rods_ring.png", dpi=160)


def twist() -> None:
    """Rods truly twisted: Michell's ring, twirling to whirling, localized buckling."""
    rows: list[tuple[str, tuple[int, ...], Callable[[int], float], float]] = [
        ("ring, four turns", (12, 24, 48), lambda count: critical_turns(count, 4), 1.0),
        ("whirling, GJ/EI = 0.2", (10, 20, 40, 80), lambda count: whirling_speed(count, 0.2), WHIRLING),
        ("whirling, GJ/EI = 2/3", (10, 20, 40, 80), lambda count: whirling_speed(count, 2.0 / 3.0), WHIRLING),
        ("localized buckling", (100, 200, 400, 800), least_cosine, float(buckled_cosine(np.zeros(1))[0])),
    ]
    for name, counts, found, exact in rows:
        values = np.array([found(count) for count in counts])
        errors = values - exact
        print(f"{name}, {counts} edges: {values}, exact {exact}, relative errors {errors / exact}")
        print(f"  errors {errors}, orders {np.log2(errors[:-1] / errors[1:])}")
    for count in (10, 20, 40, 80):
        modes = whirling_modes(count, whirling_speed(count, 0.2), 0.2)
        print(f"  frequency on {count} edges: {abs(modes[np.argmax(modes.real)].imag):.4f}")


def bent_shaft() -> tuple[Array, Array]:
    """Return motor angles and bending energies [J] of a joint held bent."""
    nodes = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.766, 0.643, 0.0]]) * 1e-2
    rod = Rod(
        nodes=nodes,
        rest_nodes=np.outer(np.arange(3.0), [1e-2, 0.0, 0.0]),
        material=Material(youngs_modulus=1e6, density=1000.0),
        radius=1e-3,
    )
    scene = Scene(
        rods=(rod,), fluid=Fluid(viscosity=1.0, model="RFT"), motors=(Motor(node=1, shaft=1, speed=1.0),)
    )
    simulation = Simulation(scene, threads=1)
    start, angles, energies = simulation.state(), np.linspace(0.0, 4.0 * np.pi, 201), []
    for angle in angles:
        state = {name: values.copy() for name, values in start.items()}
        state["q"][simulation.dof_of_edge[1]] += angle
        state["motor_angles"][:] = angle
        simulation.load_state(state)
        energies.append(simulation.energy()["bending"])
    return angles, np.array(energies)


def motors() -> None:
    """The joint's stiffness against the motor's angle, and the motion of a loaded shaft."""
    figure = new_figure(4.6, 3.2)
    axes = figure.subplots()
    angles, energies = bent_shaft()
    # The text's mean of two directors at this angle is shorter by cos(phi / 2).
    curves = {"as coded": energies / energies[0], "as in the text": np.cos(0.5 * angles) ** 2}
    for colour, (label, relative) in zip(COLOURS, curves.items(), strict=False):
        print(f"{label}: bending energy {relative.min():.3e} to {relative.max()}")
        axes.plot(angles / (2.0 * np.pi), relative, color=colour, label=label)
    dress(
        axes, "motor angle / turns", "bending energy / that at 0", "A joint bent by 40 degrees while it turns"
    )
    axes.set_ylim(-0.05, 1.25)
    legend(axes)
    figure.savefig(FIGURES / "rods_motor.png", dpi=160)

    length, edges = 0.05, 10
    rod = Rod.straight(
        length=length, edge_count=edges, radius=1e-3, material=Material(youngs_modulus=1e6, density=1e3)
    )
    force = np.array([0.0, 0.0, -2.0 * rod.EI_array()[0, 0, 0] / length**2])
    scene = Scene(
        rods=(rod,),
        fluid=Fluid(viscosity=1.0, model="RFT"),
        motors=(Motor(node=5, shaft=5, speed=2.0 * np.pi),),
        clamps=(Clamp(nodes=(0, 1), edges=(0,)),),
        loads=(PointLoad(node=edges, force=force),),
    )
    simulation = Simulation(scene, dt=0.137, threads=1)
    simulation.step(1000)
    tip, farthest = simulation.nodes[-1], 0.0
    first = simulation.state()["motor_angles"][0]
    while simulation.state()["motor_angles"][0] < first + 2000.0 * np.pi:
        simulation.step(7)
        farthest = max(farthest, float(np.abs(simulation.nodes[-1] - tip).max()))
    print(f"loaded shaft over 1000 turns: tip {tip / length} L, wanders by {farthest / length:.1e} L")


def invariants() -> None:
    """Rest, rigid motion, units of length, and the balance of force and torque."""
    rotation = Rotation.from_rotvec([0.7, -1.9, 0.4]).as_matrix()
    shift = np.array([0.03, -0.05, 0.02])
    material = Material(youngs_modulus=1e6, density=1000.0)
    helix = Rod.helix(
        helix_radius=6e-3, pitch=0.04, axial_length=0.05, radius=1e-3, material=material, edge_count=10
    )
    placed = helix.replace(nodes=helix.nodes @ rotation.T + shift, rest_nodes=helix.nodes)
    for scheme, dt in (("overdamped", 1e-2), ("implicit", 1e-2), ("explicit", 1e-4)):
        for model in ("RFT", "RSS"):
            scene = Scene(rods=(placed,), fluid=Fluid(viscosity=1.0, model=model))
            simulation = Simulation(scene, scheme=scheme, dt=dt, threads=1)
            nodes, forces = simulation.nodes, float(np.abs(simulation.gradient()).max())
            simulation.step(100_000)
            drift = float(np.abs(simulation.nodes - nodes).max())
            print(
                f"rest, {scheme}, {model}: round-off forces {forces:.1e} N, drift in 1e5 steps {drift:.1e} m"
            )

    for build in (scenarios.robot, scenarios.clamped_flagella):
        here = Simulation(build(), rtol=None, threads=1)
        there = Simulation(moved(build(), rotation, shift), rtol=None, threads=1)
        scaled = {scale: Simulation(build(scale=scale), rtol=None, threads=1) for scale in (1e-3, 1e-6)}
        size = float(np.ptp(here.nodes, axis=0).max())
        turned, scales = 0.0, dict.fromkeys(scaled, 0.0)
        for _ in range(20):
            here.step(10)
            there.step(10)
            turned = max(turned, float(np.abs(there.nodes - here.nodes @ rotation.T - shift).max()) / size)
            for scale, simulation in scaled.items():
                simulation.step(10)
                error = float(np.abs(simulation.nodes / scale - here.nodes).max()) / size
                scales[scale] = max(scales[scale], error)
        print(f"{here.scene.name}, 200 steps: moved scene differs by {turned:.1e}, other scales by {scales}")

    for options in ({}, {"fluid": {"model": "RFT"}}, {"twist_drag": False}, {"edge_length": 4e-3}):
        simulation = Simulation(scenarios.robot(rpm=20.0, **options), rtol=None, threads=1)
        values = np.array([imbalance(simulation) for _ in range(400)])
        print(
            f"balance {options}: worst force, torque {values.max(axis=0)}, median {np.median(values, axis=0)}"
        )
    for dt in (1e-4, 1e-3, 2e-3, 5e-3, 1e-2):
        simulation = Simulation(scenarios.robot(rpm=20.0), dt=dt, threads=1)
        values = np.array([imbalance(simulation) for _ in range(400)])
        above = np.flatnonzero(values.max(axis=1) > 1e-10)
        worst, late = values.max(axis=0), values[100:].max(axis=0)
        print(f"balance at dt = {dt}: worst {worst}, after 100 steps {late}, steps above 1e-10: {above}")


def speeds(scene: Scene, scheme: str, dt: float, start: float = 2.0, end: float = 5.0) -> Array:
    """Return head velocity along -x [m/s], its rotation about x [rad/s] and the mean motor torque [N m]."""
    assert scene.head is not None
    head = scene.head.node
    simulation = Simulation(scene, scheme=scheme, dt=dt, threads=1)
    simulation.run(until=start, save_every=start, path=False)
    seen, torques = [], []
    for instant in np.linspace(start, end, 31):
        if instant > start:
            simulation.step(round((instant - simulation.time) / dt))
        arm = simulation.nodes[head + 1] - simulation.nodes[head - 1]
        seen.append([-simulation.nodes[head, 0], np.arctan2(arm[2], arm[1])])
        torques.append(np.abs(simulation.frame()["motor_torque"]).mean())
    rates = (np.array(seen[-1]) - seen[0]) / (end - start)
    return np.array([*rates, np.mean(torques)])


def lighter(scene: Scene, factor: float) -> Scene:
    """Return the scene with its density divided by a factor."""
    rod = scene.rods[0]
    material = rod.material.replace(density=rod.material.density / factor)
    return scene.replace(rods=(rod.replace(material=material),))


def schemes() -> None:
    """Head speed, head rotation and torque of the robot at 20 rpm, by scheme and step."""
    robot = scenarios.robot(rpm=20.0, contact=False)
    without = scenarios.robot(rpm=20.0, contact=False, twist_drag=False)
    runs: dict[str, tuple[Scene, str, tuple[float, ...]]] = {
        "overdamped": (robot, "overdamped", (8e-3, 4e-3, 2e-3, 1e-3)),
        "implicit": (robot, "implicit", (8e-3, 4e-3, 2e-3, 1e-3)),
        "explicit": (robot, "explicit", (8e-4, 4e-4, 2e-4, 1e-4)),
        "implicit, a tenth of the density": (lighter(robot, 10.0), "implicit", (2e-3, 1e-3)),
        "overdamped, no twist drag": (without, "overdamped", (2e-3, 1e-3)),
        "explicit, no twist drag": (without, "explicit", (4e-4, 2e-4)),
    }
    figure = new_figure(8.0, 3.2)
    columns = figure.subplots(1, 2)
    results, limits = {}, {}
    for name, (scene, scheme, steps) in runs.items():
        start = time.perf_counter()
        results[name] = np.array([speeds(scene, scheme, dt) for dt in steps])
        limits[name] = 2.0 * results[name][-1] - results[name][-2]
        print(f"{name} ({time.perf_counter() - start:.0f} s), excess over the overdamped limit:")
        for dt, values in zip(steps, results[name], strict=True):
            print(f"  dt = {dt:g} s: {values}, excess {values / limits['overdamped'] - 1.0}")
        print(f"  dt -> 0: {limits[name]}, excess {limits[name] / limits['overdamped'] - 1.0}")
    print(f"explicit over implicit at dt -> 0, - 1: {limits['explicit'] / limits['implicit'] - 1.0}")
    ratio = limits["explicit, no twist drag"] / limits["overdamped, no twist drag"] - 1.0
    print(f"explicit over overdamped without twist drag, - 1: {ratio}")
    for k, axes in enumerate(columns):
        for colour, name in zip(COLOURS, ("overdamped", "implicit", "explicit"), strict=False):
            steps = [*runs[name][2], 0.0]
            values = np.array([*results[name][:, k], limits[name][k]]) / limits["overdamped"][k] - 1.0
            axes.plot(1e3 * np.array(steps), 1e3 * values, color=colour)
            axes.plot(1e3 * np.array(steps[:-1]), 1e3 * values[:-1], "o", color=colour, ms=4, label=name)
        axes.axhline(0.0, color=GREY, linewidth=0.8)
        dress(axes, "step / ms", "difference / 1e-3", ("Head speed", "Head rotation")[k])
        legend(axes)
    figure.savefig(FIGURES / "rods_schemes.png", dpi=160)


def bisected(grows: Callable[[float], bool], low: float, high: float, count: int) -> float:
    """Return where a disturbance begins to grow."""
    for _ in range(count):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    return 0.5 * (low + high)


def _ratio(scene: Scene) -> float:
    """Return the linear map's limit over 2 / lambda_max(M^-1 Res)."""
    simulation = Simulation(scene, scheme="explicit", dt=1e-4, threads=1)
    return linear_limit(simulation) / simulation.stable_step()


def stability() -> None:
    """The explicit scheme's limit, measured, against 2 / lambda_max(M^-1 Res) and against its linear map."""
    moduli = (1e2, 1e4, 3e4, 1e5, 3e5, 1.255e6)
    measured = []
    for modulus in moduli:
        scene = soft_helix(modulus)
        simulation = Simulation(scene, scheme="explicit", dt=1e-4, threads=1)
        bound, limit = simulation.stable_step(), linear_limit(simulation)
        found = bisected(lambda dt, scene=scene: disturbance_grows(scene, dt), 0.9 * limit, 1.1 * limit, 8)
        measured.append(found / bound)
        print(
            f"E = {modulus:g} Pa: bound {bound:.6e} s, map {limit / bound:.4f}, measured {found / bound:.4f}"
        )
    figure = new_figure(4.6, 3.2)
    axes = figure.subplots()
    fine = np.geomspace(moduli[0], moduli[-1], 21)
    curve = [_ratio(soft_helix(modulus)) for modulus in fine]
    axes.semilogx(fine, curve, "-", color=COLOURS[0], label="linear map of the scheme")
    axes.semilogx(moduli, measured, "o", color=COLOURS[1], ms=6, label="measured")
    axes.axhline(1.0, color=GREY, linestyle=":", label="$2/\\lambda_{\\max}(M^{-1}\\mathrm{Res})$")
    dress(axes, "Young's modulus / Pa", "largest stable step / bound", "Explicit scheme, a single helix")
    axes.set_ylim(0.9, None)
    legend(axes)
    figure.savefig(FIGURES / "rods_stability.png", dpi=160)
    for name, scene in (
        ("robot, 5 mm", scenarios.robot(contact=False)),
        ("one clamped flagellum, 5 mm", scenarios.clamped_flagella(count=1, contact=False)),
        ("two clamped flagella, 5 mm", scenarios.clamped_flagella(count=2, contact=False)),
    ):
        simulation = Simulation(scene, scheme="explicit", dt=1e-5, threads=1)
        print(f"{name}: 2 / lambda_max(M^-1 Res) = {1e3 * simulation.stable_step():.3f} ms")


def main() -> None:
    """Run everything, or the parts named on the command line."""
    FIGURES.mkdir(exist_ok=True)
    parts = {
        part.__name__: part for part in (cantilever, ring, twist, motors, invariants, stability, schemes)
    }
    for name in sys.argv[1:] or parts:
        start = time.perf_counter()
        print(f"--- {name}")
        parts[name]()
        print(f"({time.perf_counter() - start:.0f} s)", flush=True)


if __name__ == "__main__":
    main()
