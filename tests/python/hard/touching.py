"""Contact: flagella pressed hard, friction up to 2, very different radii, beside clamps and motors."""

from __future__ import annotations

from functools import partial

import numpy as np
from contact_cases import RING_EDGES, Knot, Watch, linking_numbers
from flagrs import Clamp, Contact, Fluid, Material, Motor, PointLoad, Rod, Scene, Simulation, scenarios
from flagrs.validation.problems.friction import incline, incline_theory
from flagrs.validation.touching import contact_forces, held

from hard.case import add, hard
from hard.parts import SILICONE, placed, straight

GROUP = "Contact"


def incline_error(angle: float, friction: float, options: dict[str, float]) -> float:
    """Return the error of the velocity of a rod on an incline, over what it has without friction."""
    scene = incline(angle, friction, 1e-5)
    simulation = Simulation(scene, threads=1, **options)
    theory = incline_theory(simulation, angle)
    free = incline_theory(Simulation(incline(angle, 0.0, 1e-5), dt=1e-3, threads=1), angle)
    simulation.run(until=0.2, save_every=0.2, path=False)
    count = len(scene.rods[0].nodes)
    here = simulation.nodes[:count, 0].mean()
    until = 0.2 + 1e-3 / max(abs(theory), 0.02)
    simulation.run(until=until, save_every=until, path=False)
    velocity = (simulation.nodes[:count, 0].mean() - here) / (simulation.time - 0.2)
    return (velocity - theory) / free


for friction in (0.0, 0.3, 1.0, 2.0):
    critical = np.arctan(friction)
    for words, angle in (("below", 0.9 * critical), ("above", critical + 0.2)):
        if angle == 0.0:
            continue
        for style, options in (
            ("fixed steps", {"dt": 2e-3}),
            ("rtol 1e-2", {"rtol": 1e-2}),
            ("rtol 1e-4", {"rtol": 1e-4}),
        ):
            add(
                GROUP,
                f"friction {friction:g}, an incline {words} the angle of friction, {style}",
                partial(incline_error, angle, friction, options),
                against="balance of weight, Coulomb's friction and drag",
                tolerance=1e-2,
            )


def resting(thick: float, thin: float, friction: float) -> np.ndarray:
    """Return the errors of the force of contact, over the load, and the depth of a rod across two."""
    supports = [
        Rod(
            nodes=(straight(0.05, 5) - [0.0251, 0.0, 0.0])[:, [1, 0, 2]] + [x, 0, 0],
            radius=thick,
            material=SILICONE,
        )
        for x in (-0.0122, 0.0122)
    ]
    above = Rod(
        nodes=straight(0.05, 5) - [0.025, 0.0, -1.02 * (thick + thin)], radius=thin, material=SILICONE
    )
    force = 1e-3 * 1e6 * np.pi * thin**4 / 4.0 / 0.01**2
    scene = Scene(
        rods=(above, *supports),
        fluid=Fluid(viscosity=1e-3, model="RFT"),
        clamps=(held(1, 5), held(2, 5)),
        loads=[PointLoad(node=k, force=np.array([0.0, 0.0, -force])) for k in (2, 3)],
        contact=Contact(friction=friction),
    )
    # Rods bend at a rate that goes with the fourth power of their radius.
    simulation = Simulation(scene, dt=1e-3 * max(1.0, (5e-4 / thin) ** 4), threads=1)
    watch = Watch(simulation)
    for _ in range(60):
        simulation.step(2)
        simulation.dt *= 1.1
        watch.closest()
    _, forces, _ = contact_forces(simulation)
    upward = float(np.abs(forces[:, 2]).sum())
    return np.array([upward / (2.0 * force) - 1.0, max(0.0, 0.95 - watch.least)])


for thick, thin in ((2e-3, 2e-3), (5e-3, 5e-4), (1e-2, 1e-4), (5e-4, 5e-3)):
    for friction in (0.0, 0.5, 2.0):
        add(
            GROUP,
            f"a rod of {1e3 * thin:g} mm rests on one of {1e3 * thick:g} mm, friction {friction:g}",
            partial(resting, thick, thin, friction),
            against="its load; never deeper than the tolerance",
            tolerance=1e-3,
        )


def bundle(friction: float) -> float:
    """Return how deep five flagella that wrap around each other come below the depth that is allowed."""
    scene = scenarios.clamped_flagella(count=5, contact={"friction": friction})
    simulation = Simulation(scene, rtol=1e-2, threads=1)
    watch = Watch(simulation)
    while simulation.time < 4.3:
        simulation.step()
        watch.closest()
    # They must have come into contact, else this says nothing.
    assert watch.least < 1.05
    return max(0.0, 0.95 - watch.least)


for friction in (0.0, 2.0):
    add(
        GROUP,
        f"five flagella wrap around each other, friction {friction:g}",
        partial(bundle, friction),
        against="all pairs measured at every step: never deeper than the tolerance",
        tolerance=1e-12,
    )


def star_of_five(friction: float, pull: float, prescribed: bool) -> Scene:
    """Return five rods side by side on a circle, each end pulled through the axis against all others."""
    count, length, radius = 10, 0.06, 1e-3
    rods, clamps, loads = [], [], []
    for k in range(5):
        angle = 2.0 * np.pi * k / 5.0
        ring = 2.2e-3 * np.array([0.0, np.cos(angle), np.sin(angle)])
        rods.append(Rod(nodes=straight(length, count) + ring, radius=radius, material=SILICONE))
        clamps.append(Clamp(rod=k, nodes=(0, 1), edges=(0,)))
        inward = np.array([0.0, -np.cos(angle), -np.sin(angle)])
        if prescribed:
            clamps.append(Clamp(rod=k, nodes=(count,), velocity=2e-3 * inward))
        else:
            loads += [PointLoad(rod=k, node=node, force=pull * inward) for node in (count - 2, count)]
    return Scene(
        rods=rods,
        fluid=Fluid(viscosity=1.0, model="RFT"),
        clamps=clamps,
        loads=loads,
        contact=Contact(friction=friction),
    )


def pressed_together(friction: float, pull: float, prescribed: bool = False) -> float:
    """Return how deep the five are pressed beyond the tolerance."""
    simulation = Simulation(star_of_five(friction, pull, prescribed), dt=5e-3, threads=1)
    watch = Watch(simulation)
    for _ in range(80):
        simulation.step()
        watch.closest()
    assert watch.least < 1.05
    return max(0.0, 0.95 - watch.least)


for friction in (0.0, 0.3, 1.0, 2.0):
    for pull in (1e-3, 1e-1):
        add(
            GROUP,
            f"five rods pressed into each other by {pull:g} N at their ends, friction {friction:g}",
            partial(pressed_together, friction, pull),
            against="all pairs measured: never deeper than the tolerance",
            tolerance=1e-12,
        )
add(
    GROUP,
    "five rods moved through each other by their clamps",
    partial(pressed_together, 0.5, 0.0, True),
    against="a clear error",
    refused=True,
)


@hard(
    GROUP,
    "a filament pressed onto a motor's housing and its clamp",
    against="all pairs measured: never deeper than the tolerance; the motor's own angle",
    tolerance=1e-6,
)
def beside_motor() -> np.ndarray:
    """Return the depth beyond the tolerance and the error of the motor's angle."""
    shaft = Rod(nodes=straight(0.04, 8), radius=1e-3, material=SILICONE)
    other = Rod(
        nodes=(straight(0.04, 8) - [0.02, 0.0, 0.0])[:, [1, 0, 2]] + [0.0075, 0.0, 2.3e-3],
        radius=1e-3,
        material=SILICONE,
    )
    scene = Scene(
        rods=(shaft, other),
        fluid=Fluid(viscosity=1.0, model="RFT"),
        clamps=(Clamp(nodes=(0, 1), edges=(0,)), Clamp(rod=1, nodes=(0, 8))),
        motors=Motor(node=1, shaft=1, speed=10.0),
        loads=[PointLoad(rod=1, node=k, force=np.array([0.0, 0.0, -2e-3])) for k in (3, 4, 5)],
        contact=Contact(),
    )
    simulation = Simulation(scene, dt=5e-3, threads=1)
    watch = Watch(simulation)
    for _ in range(200):
        simulation.step()
        watch.closest()
    assert watch.least < 1.05
    spin = 4.0 * np.pi * 1e-6 * 5e-3 * 10.0
    twisting = float(shaft.GJ_array()[0])
    # Edges 1 to 7 lag by the twist that resists their spin; the first wet edge alone by the torque of all.
    lag = spin * 7.0 * 5e-3 / twisting
    angle = simulation.theta[1] - simulation.theta[0]
    return np.array([max(0.0, 0.95 - watch.least), (angle + lag - 10.0) * 1e-3])


@hard(
    GROUP,
    "a trefoil knot pulled tight",
    against="all pairs measured: never deeper than the tolerance",
    tolerance=1e-12,
)
def knot() -> float:
    """Return the depth beyond the tolerance."""
    tight = Knot(edge_count=60)
    for _ in range(40):
        tight.simulation.step(5)
        tight.watch.closest()
    assert tight.watch.least < 1.05
    return max(0.0, 0.95 - tight.watch.least)


def linked(speed: float) -> float:
    """Return the change of the linking number of two linked rings pulled apart at a speed [m/s]."""
    angle = 2.0 * np.pi * np.arange(RING_EDGES) / RING_EDGES
    flat = 0.02 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    edges = np.stack([np.arange(RING_EDGES), np.roll(np.arange(RING_EDGES), -1)], axis=1)
    # The second stands upright through the middle of the first.
    second = flat[:, [0, 2, 1]] + [0.02, 0.0, 0.0]
    rods = [Rod(nodes=nodes, edges=edges, radius=1e-3, material=SILICONE) for nodes in (flat, second)]
    scene = Scene(
        rods=rods,
        fluid=Fluid(viscosity=1.0, model="RFT"),
        clamps=(
            Clamp(nodes=(RING_EDGES // 2,)),
            Clamp(rod=1, nodes=(0,), velocity=np.array([speed, 0.0, 0.0])),
        ),
        contact=Contact(),
    )
    simulation = Simulation(scene, dt=0.02 / speed / 50.0, threads=1)
    before = linking_numbers(simulation.nodes)
    assert abs(abs(before[0]) - 1.0) < 1e-6
    simulation.step(60)
    return float(np.abs(linking_numbers(simulation.nodes) - before)[0])


for speed in (1e-3, 1.0, 100.0):
    add(
        GROUP,
        f"two linked rings pulled apart at {speed:g} m/s",
        partial(linked, speed),
        against="Gauss's linking integral, which must not change",
        tolerance=1e-6,
        may_refuse=True,
    )

add(
    GROUP,
    "rods that start deep in each other",
    lambda: Simulation(
        Scene(
            rods=[
                Rod(nodes=straight(0.02, 4), radius=1e-3, material=Material(youngs_modulus=1e6, density=1e3)),
                Rod(
                    nodes=placed(straight(0.02, 4), (0.0, 1e-4, 0.0)),
                    radius=1e-3,
                    material=Material(youngs_modulus=1e6, density=1e3),
                ),
            ],
            fluid=Fluid(viscosity=1.0, model="RFT"),
            contact=Contact(),
        ),
        threads=1,
    ).step(),
    against="a clear error",
    refused=True,
)
