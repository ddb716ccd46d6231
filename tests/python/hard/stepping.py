"""Steps: every scheme, fixed and adaptive, against scipy's integrators and what must be conserved."""

from __future__ import annotations

import resource
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from flagrs import Clamp, Fluid, Material, Motor, Rod, Scene, Simulation
from scipy.integrate import solve_ivp

from hard.case import add, hard
from hard.driving import shaft
from hard.parts import LOCAL, SILICONE, apart, bow, elapsed, straight

GROUP = "Steps"

Array = npt.NDArray[np.float64]


def by_scipy(scene: Scene, until: float) -> Array:
    """Return the nodes (N, 3) at a time by scipy's Radau method on the equations of motion without inertia.

    Plane motion of a free rod without twist: the velocity is the elastic force through the inverse of the
    resistance at the present shape. Both come from the simulation; the integrator does not.
    """
    probe = Simulation(scene, threads=1)
    rows = (probe.dof_of_node[:, None] + np.arange(3)).ravel()

    def velocity(_: float, x: Array) -> Array:
        probe.set_state(x.reshape(-1, 3))
        return np.asarray(np.linalg.solve(probe.resistance(), -probe.gradient()[rows]))

    start = scene.node_array().ravel()
    answer = solve_ivp(velocity, (0.0, until), start, method="Radau", rtol=1e-9, atol=1e-13)
    return np.asarray(answer.y[:, -1].reshape(-1, 3))


SOFT = SILICONE.replace(youngs_modulus=1e5)
SCENES = {
    model: Scene(rods=bow(material=SOFT, edge_count=6), fluid=Fluid(viscosity=1.0, model=model))
    for model in ("RFT", "RSS")
}
UNTIL = 0.5
_exact: dict[str, Array] = {}


def exact(model: str) -> Array:
    """Return scipy's answer, found once."""
    if model not in _exact:
        _exact[model] = by_scipy(SCENES[model], UNTIL)
    return _exact[model]


def adaptive(model: str, rtol: float, scheme: str) -> float:
    """Return the error of a bow let go, over rtol of its size (a twentieth of its length)."""
    found = elapsed(Simulation(SCENES[model], rtol=rtol, scheme=scheme, threads=1), UNTIL)
    return apart(found, exact(model), 1e-3) / rtol


for model in ("RFT", "RSS"):
    for rtol in 10.0 ** -np.arange(1, 9):
        add(
            GROUP,
            f"a bow in {model}, overdamped, rtol {rtol:g}",
            partial(adaptive, model, float(rtol), "overdamped"),
            against="scipy's Radau method at 1e-9; error over rtol",
            tolerance=10.0,
        )

for rtol in (1e-1, 1e-2, 1e-3, 1e-4):
    # Inertia matters by the decay time of velocity over the time of motion, some 1e-6 here.
    add(
        GROUP,
        f"a bow in RFT, implicit, rtol {rtol:g}",
        partial(adaptive, "RFT", rtol, "implicit"),
        against="scipy's Radau method without inertia; error over rtol",
        tolerance=10.0,
    )


def first_order(scheme: str, dt: float, rate: float) -> float:
    """Return the error of fixed steps, over rate times dt times the size, as a first order method has it."""
    found = elapsed(Simulation(SCENES["RFT"], dt=dt, scheme=scheme, threads=1), UNTIL)
    return apart(found, exact("RFT"), 0.02) / (rate * dt)


for scheme in ("overdamped", "implicit"):
    for dt in (0.1, 0.01, 0.001):
        add(
            GROUP,
            f"a bow in RFT, {scheme}, fixed steps of {dt:g} s",
            partial(first_order, scheme, dt, 1.0),
            against="scipy's Radau method; error over the length a second of step, which is bounded",
            tolerance=0.3,
        )


def explicit(share: float) -> float:
    """Return the error of the explicit scheme at a share of its limit, over the length."""
    scene = Scene(
        rods=bow(material=SOFT.replace(density=2e4), edge_count=4),
        fluid=Fluid(viscosity=1.0, model="RFT", twist_drag=False),
    )
    limit = Simulation(scene, scheme="explicit", dt=1e-6, threads=1).stable_step()
    found = elapsed(Simulation(scene, scheme="explicit", dt=share * limit, threads=1), 0.05)
    reference = elapsed(Simulation(scene, scheme="implicit", dt=1e-4, threads=1), 0.05)
    return apart(found, reference, 0.02)


for share in (0.2, 0.9):
    add(
        GROUP,
        f"the explicit scheme at {share:g} of its limit",
        partial(explicit, share),
        against="the implicit scheme in small steps",
        tolerance=4e-3 * share,  # of first order, measured 3.1e-3 to 3.7e-3 times the share
    )
add(
    GROUP,
    "the explicit scheme at 1.6 times its limit",
    partial(explicit, 1.6),
    against="the implicit scheme in small steps",
    tolerance=6e-3,
    may_refuse=True,
)


def vibrating(youngs_modulus: float = 1e7) -> tuple[Scene, float]:
    """Return a cantilever in vacuum, let go in its first mode, and its period by Euler and Bernoulli [s]."""
    length, radius, count = 0.1, 1e-3, 12
    edge = length / (count + 0.5)
    k = 1.8751040687 / length
    x = edge * (np.arange(count + 2) - 0.5)
    inside = np.clip(x, 0.0, None)
    ratio = (np.cosh(k * length) + np.cos(k * length)) / (np.sinh(k * length) + np.sin(k * length))
    mode = np.cosh(k * inside) - np.cos(k * inside) - ratio * (np.sinh(k * inside) - np.sin(k * inside))
    rest = x[:, None] * [1.0, 0.0, 0.0]
    nodes = rest + 5e-4 * mode[:, None] * [0.0, 0.0, 1.0]
    nodes[:2, 2] = 0.0
    material = Material(youngs_modulus=youngs_modulus, density=1000.0)
    rod = Rod(nodes=nodes, rest_nodes=rest, radius=radius, material=material)
    bending, mass = youngs_modulus * np.pi * radius**4 / 4.0, 1000.0 * np.pi * radius**2
    frequency = k**2 * np.sqrt(bending / mass)
    scene = Scene(rods=rod, clamps=Clamp(nodes=(0, 1), edges=(0,)))
    return scene, float(2.0 * np.pi / frequency)


def beam(rtol: float) -> np.ndarray:
    """Return growth of the amplitude, and the error of the tip after two periods, over the amplitude."""
    scene, period = vibrating()
    trajectory = Simulation(scene, scheme="implicit", rtol=rtol, threads=1).run(
        until=2.0 * period, save_every=period / 16.0, path=False
    )
    tip = np.asarray(trajectory.nodes)[:, -1, 2] / 1e-3
    return np.array([max(0.0, float(np.abs(tip[16:]).max()) - 1.0), float(tip[-1] - 1.0)])


for rtol in (1e-3, 1e-4, 1e-5):
    # 12 edges put the frequency off by 1e-3 or so: 0.01 rad in two periods; higher modes of the start remain.
    add(
        GROUP,
        f"a beam vibrates in vacuum, implicit, rtol {rtol:g}",
        partial(beam, rtol),
        against="Euler and Bernoulli's period; the amplitude never grows",
        tolerance=0.05,
    )


STIFF = Scene(rods=bow(material=SILICONE.replace(youngs_modulus=1e9)), fluid=LOCAL)


def bow_energy(rtol: float, until: float) -> float:
    """Return the error of the elastic energy of a stiff bow let go, over what the error of positions allows.

    The energy goes with the square of the deflection that is left; positions are promised to rtol of the
    size, a twentieth of the length.
    """
    simulation = Simulation(STIFF, rtol=rtol, threads=1)
    simulation.run(until=until, save_every=until, path=False)
    exact = Simulation(STIFF, threads=1)
    left = by_scipy(STIFF, until)
    exact.set_state(left)
    straight_line = np.linalg.svd(left - left.mean(axis=0), compute_uv=False)
    deflection = float(np.sqrt((straight_line[1:] ** 2).sum() / len(left)))
    ratio = simulation.energy()["total"] / exact.energy()["total"]
    return float(abs(np.sqrt(ratio) - 1.0) * deflection / (rtol * 1e-3))


for until in (1e-5, 1e-4):
    for rtol in (1e-2, 1e-3, 1e-5):
        add(
            GROUP,
            f"energy of a stiff bow {until:g} s after it is let go, rtol {rtol:g}",
            partial(bow_energy, rtol, until),
            against="scipy's Radau method; error of the deflection that the energy tells of, over rtol",
            tolerance=1.0,
        )


def share_of_energy(rtol: float, until: float) -> float:
    """Return the error of the elastic energy that is left of the bow, relative to itself, over rtol."""
    simulation = Simulation(STIFF, rtol=rtol, threads=1)
    simulation.run(until=until, save_every=until, path=False)
    exact = Simulation(STIFF, threads=1)
    exact.set_state(by_scipy(STIFF, until))
    return (simulation.energy()["total"] / exact.energy()["total"] - 1.0) / rtol


for rtol in (1e-2, 1e-3):
    add(
        GROUP,
        f"energy left of a stiff bow that is all but straight, relative to itself, rtol {rtol:g}",
        partial(share_of_energy, rtol, 1e-4),
        against="scipy's Radau method; relative error over rtol",
        tolerance=10.0,
        awaited="rtol is a share of the size of a filament, not of the little deflection that is left of it",
    )

TURNING = {
    model: Scene(
        rods=Rod(
            nodes=np.stack(
                [
                    2e-3 * np.arange(25),
                    4e-3 * np.minimum(1.0, np.arange(25) / 4.0) * np.cos(np.pi * np.arange(25) / 6.0),
                    4e-3 * np.minimum(1.0, np.arange(25) / 4.0) * np.sin(np.pi * np.arange(25) / 6.0),
                ],
                axis=1,
            ),
            radius=5e-4,
            material=SILICONE.replace(youngs_modulus=1e10),
        ),
        fluid=Fluid(viscosity=1.0, model=model),
        clamps=Clamp(nodes=(0, 1), edges=(0,)),
        motors=Motor(node=1, shaft=1, torque=2e-6),
    )
    for model in ("RFT", "RSS")
}


def turning_energies(model: str, rtol: float) -> np.ndarray:
    """Return the errors, over rtol, of all energies of a stiff helix turned by a torque, at a step's end."""
    found = []
    for tolerance in (rtol, 1e-7):
        simulation = Simulation(TURNING[model], rtol=tolerance, threads=1)
        simulation.run(until=0.2, save_every=0.2, path=False)
        found.append(np.array(list(simulation.energy().values())))
    return (found[0] / found[1] - 1.0) / rtol


for model in ("RFT", "RSS"):
    for rtol in (1e-1, 1e-2, 1e-3):
        add(
            GROUP,
            f"energies of stretching, bending and twisting of a stiff helix in {model}, rtol {rtol:g}",
            partial(turning_energies, model, rtol),
            against="rtol 1e-7; relative error over rtol",
            tolerance=1.0,
        )


@hard(
    GROUP,
    "a million steps",
    against="closed form of the angle; memory must not grow by more than 8 MB",
    tolerance=1e-6,
    slow=True,
)
def million() -> np.ndarray:
    """Return the error of the angle [rad], and the growth of memory beyond what is allowed [MB]."""
    simulation = Simulation(shaft(speed=10.0), dt=1e-3, threads=1)
    simulation.step(10_000)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    simulation.step(990_000)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024.0
    turned = float(simulation.theta[1])
    spin = 4.0 * np.pi * 1e-6 * 5e-3 * 10.0
    lag = 3.0 * spin * 5e-3 / float(simulation.scene.rods[0].GJ_array()[0])
    return np.array([turned + lag - 1e4, max(0.0, grown - 8.0)])


def chain_of(edge_count: int, options: dict[str, Any]) -> float:
    """Return the error of the velocity at which a straight chain falls in local drag, over that velocity."""
    nodes = straight(0.1, edge_count)
    rod = Rod(nodes=nodes, radius=1e-3, material=SILICONE)
    scene = Scene(rods=rod, fluid=LOCAL.replace(density=0.0), gravity=np.array([0.0, 0.0, -9.81]))
    simulation = Simulation(scene, threads=1, **options)
    simulation.run(until=1e-3, save_every=1e-3, path=False)
    across = 8.0 * np.pi / (2.0 * np.log(2.0 * 0.1 / 1e-3) + 1.0)
    expected = 1200.0 * np.pi * 1e-6 * 9.81 / across * 1e-3
    return float(-simulation.nodes[:, 2].mean() / expected - 1.0)


for edge_count in (1, 2, 3, 300):
    for words, options in (("fixed steps", {"dt": 1e-4}), ("rtol 1e-3", {"rtol": 1e-3})):
        add(
            GROUP,
            f"a rod of {edge_count} edges falls, {words}",
            partial(chain_of, edge_count, options),
            against="Gray and Hancock's drag across",
            tolerance=1e-6,
        )
