"""Friction: a rod on an incline, and a rope around a drum."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from flagrs import Clamp, Contact, Fluid, Material, PointLoad, Rod, Scene, Simulation
from flagrs.validation.problem import Check, Curve, Evidence, Panel, problem
from flagrs.validation.touching import GRAVITY, SILICONE, contact_forces, drag, firm, held, unrolled


def incline(angle: float, friction: float, slip_velocity: float, lengthwise: bool = False) -> Scene:
    """Return a short stiff rod on two fixed rails, under gravity tilted by an angle [rad] towards +x.

    It lies across the rails and slides sideways, along them; or, lengthwise, along itself across them.
    """
    length, radius = 0.02, 1e-3
    direction = np.array([0.0, 1.0, 0.0])
    across = np.array([1.0, 0.0, 0.0]) if lengthwise else direction
    rail = np.array([0.0, 1.0, 0.0]) if lengthwise else np.array([1.0, 0.0, 0.0])
    stiff = Material(youngs_modulus=1e9, density=2000.0)
    rails = [
        Rod.straight(
            length=0.2,
            edge_count=20,
            radius=radius,
            material=stiff,
            start=tuple(side * 0.006 * across - 0.1 * rail + np.array([0.0013, 0.0013, 0.0]) * rail),
            direction=tuple(rail),
        )
        for side in (-1.0, 1.0)
    ]
    rod = Rod.straight(
        length=length,
        edge_count=5,
        radius=radius,
        material=stiff,
        start=tuple(-0.5 * length * across + np.array([0.0, 0.0, 2.0 * radius])),
        direction=tuple(across),
    )
    return Scene(
        rods=(rod, *rails),
        fluid=Fluid(viscosity=1.0, model="RFT", density=0.0),
        clamps=(held(1, 20), held(2, 20)),
        gravity=GRAVITY * np.array([np.sin(angle), 0.0, -np.cos(angle)]),
        contact=Contact(
            friction=friction, slip_velocity=slip_velocity, stiffness=firm(stiff, radius, length)
        ),
    )


def incline_theory(simulation: Simulation, angle: float) -> float:
    """Return the velocity along the incline [m/s] from the balance of weight, Coulomb's friction and drag."""
    scene = simulation.scene
    contact = scene.contact
    assert contact is not None and contact.slip_velocity is not None
    rod, mu, slip = scene.rods[0], contact.friction, contact.slip_velocity
    count = len(rod.nodes)
    resistance = simulation.resistance()[: 3 * count : 3, : 3 * count : 3].sum()
    volume = np.pi * rod.radius_array()[0] ** 2 * rod.rest_lengths().sum()
    weight = rod.material.density * volume * GRAVITY
    pull, normal = weight * np.sin(angle), weight * np.cos(angle)
    if pull - mu * normal >= resistance * slip:
        return float((pull - mu * normal) / resistance)
    # mu N (v / nu) (2 - v / nu) + zeta v = pull, a quadratic in v / nu, its smaller root.
    a, b = mu * normal, 2.0 * mu * normal + resistance * slip
    return float(slip * 2.0 * pull / (b + np.sqrt(b * b - 4.0 * a * pull)))


def incline_velocity(
    angle: float, friction: float, slip_velocity: float, lengthwise: bool = False
) -> tuple[float, float, float]:
    """Return velocity along the incline, theory's [m/s], and the power of friction [W]."""
    simulation = Simulation(incline(angle, friction, slip_velocity, lengthwise), dt=2e-3, threads=1)
    theory = incline_theory(simulation, angle)
    # Settle, then take as large steps as move the rod by a tenth of its diameter.
    simulation.step(100)
    simulation.dt = min(1e-3 / max(theory, 1e-9), 1.0) * 0.1
    simulation.step(10)
    count = len(simulation.scene.rods[0].nodes)
    velocity = float(simulation.velocities[:count, 0].mean())
    force = drag(simulation)[:count].sum(axis=0)
    rod = simulation.scene.rods[0]
    weight = (
        rod.material.density
        * np.pi
        * rod.radius_array()[0] ** 2
        * rod.rest_lengths().sum()
        * simulation.scene.gravity
    )
    _, contact, _ = contact_forces(simulation)
    rubbing = force - weight - contact.sum(axis=0)  # what is left of the balance is friction
    return velocity, theory, float(rubbing[0] * velocity)


class Capstan:
    """A soft rope wrapped by an angle around a fixed drum, loaded at one end and pulled at the other."""

    DRUM, ROPE, LOAD, SPEED = 5e-3, 5e-4, 1e-2, 1e-4
    #: EI / (T R^2), the rope's bending stiffness over what its load makes of it on the drum.
    STIFFNESS = 1e-3

    def __init__(self, wrap: float, friction: float, turn_per_edge: float = 0.1) -> None:
        self.wrap, self.friction = wrap, friction
        circle = self.DRUM + self.ROPE
        advance = 0.0 if wrap <= 1.01 * np.pi else 2.0 * self.ROPE / np.pi
        angle = np.linspace(-wrap / 2.0, wrap / 2.0, round(wrap / turn_per_edge) + 1)
        around = circle / np.cos((angle[1] - angle[0]) / 2.0)  # so that edges touch the circle
        arc = np.stack([around * np.sin(angle), advance * angle, around * np.cos(angle)], axis=1)
        out = np.stack([np.cos(angle), np.full(len(angle), advance / circle), -np.sin(angle)], axis=1)
        out /= np.linalg.norm(out, axis=1)[:, None]
        tail = turn_per_edge * circle * np.arange(1, round(2.0 / turn_per_edge) + 1)[:, None]
        nodes = np.concatenate([(arc[0] - tail * out[0])[::-1], arc, arc[-1] + tail * out[-1]])
        self.last, self.pull = len(nodes) - 1, out[-1]
        bending = self.STIFFNESS * self.LOAD * circle**2
        rope = Rod(
            nodes=nodes,
            rest_nodes=unrolled(nodes),
            radius=self.ROPE,
            material=SILICONE,
            EI=bending,
            GJ=bending,
            EA=1e4 * self.LOAD,
        )
        drum = Rod.straight(
            length=8.0 * self.DRUM,
            edge_count=4,
            radius=self.DRUM,
            material=SILICONE,
            start=(0.0, -4.0 * self.DRUM + 1e-4, 0.0),
            direction=(0.0, 1.0, 0.0),
        )
        self.scene = Scene(
            rods=(rope, drum),
            fluid=Fluid(viscosity=0.1, model="RFT"),
            clamps=(Clamp(nodes=(self.last,), velocity=self.SPEED * self.pull), held(1, 4)),
            loads=(PointLoad(node=0, force=-self.LOAD * out[0]),),
            # A rope pulled harder lies deeper in the range of contact, on a smaller circle: by its torque
            # about the drum its tension grows by the ratio of the radii, 1.7 % at the default tolerance.
            contact=Contact(friction=friction, slip_velocity=1e-3 * self.SPEED, tolerance=0.01),
        )

    def ratio(self, count: int = 20) -> float:
        """Return the pulling force over the load, when the rope slides."""
        simulation = Simulation(self.scene, dt=1e-3, threads=1)
        while simulation.dt * self.SPEED < 0.02 * self.DRUM:
            simulation.step()
            simulation.dt *= 1.5
        at = simulation.dof_of_node[self.last]
        pulls = []
        for _ in range(count):
            simulation.step()
            pulls.append(float(simulation.gradient()[at : at + 3] @ self.pull))
        assert simulation.frame()["minimum_gap"] > -0.01 * (self.DRUM + self.ROPE)
        return float(np.mean(pulls[count // 2 :])) / self.LOAD

    def theory(self) -> float:
        """Return the ratio of an inextensible elastica in contact with a circle, with Coulomb's friction.

        Where the rope leaves the drum the tension is less by EI / 2R^2 than far away: it leaves before the
        tangent of the load, by the angle d with cos d = 1 - EI / (2 T R^2), and presses there with T sin d.
        """
        mu, stiffness = self.friction, self.STIFFNESS

        def missing(ratio: float) -> float:
            first, last = np.arccos(1.0 - 0.5 * stiffness), np.arccos(1.0 - 0.5 * stiffness / ratio)
            here = ratio * (np.cos(last) - mu * np.sin(last))
            there = np.cos(first) + mu * np.sin(first)
            return float(here - there * np.exp(mu * (self.wrap - first - last)))

        return float(brentq(missing, 0.5, 1e4))


@problem(
    source="Coulomb's law: weight, friction and drag in balance",
    quick={"frictions": (0.3,), "steepness": (0.5, 0.99, 1.01, 2.0)},
    full={"frictions": (0.1, 0.3, 0.6), "steepness": (0.25, 0.5, 0.9, 0.99, 1.01, 1.1, 2.0)},
)
def friction_on_an_incline(frictions: tuple[float, ...], steepness: tuple[float, ...]) -> Evidence:
    """Velocity of a rod on two tilted rails: it creeps below the angle of friction, and slides above."""
    slip = 1e-6
    checks: list[Check] = []
    curves: list[Curve] = []
    for friction in frictions:
        found = []
        for steep in steepness:
            velocity, theory, _ = incline_velocity(float(np.arctan(friction * steep)), friction, slip)
            found.append((velocity / slip, theory / slip))
            checks.append(
                Check(
                    f"velocity over slip velocity, friction {friction:g}, slope / friction = {steep:g}",
                    velocity / slip,
                    theory / slip,
                    1e-6,
                    "Newton's tolerance",
                )
            )
        values, across = np.array(found), np.array(steepness)
        curves.append(Curve(across, values[:, 1], f"theory, friction {friction:g}", "-"))
        curves.append(Curve(across, values[:, 0], "found", "o", paired=True))
    title = "Rod on an incline"
    return Evidence(
        tuple(checks),
        (Panel(title, "slope / friction", "velocity / slip velocity", tuple(curves), "linear", "log"),),
    )


@problem(
    source="L. Euler's and J. A. Eytelwein's capstan, with the bending stiffness of the rope",
    quick={"wraps": (np.pi / 2.0, np.pi), "frictions": (0.3,)},
    full={"wraps": (np.pi / 2.0, np.pi, 2.0 * np.pi), "frictions": (0.0, 0.1, 0.3, 0.5)},
)
def capstan(wraps: tuple[float, ...], frictions: tuple[float, ...]) -> Evidence:
    """Ratio of tensions of a rope that slides around a drum: the exponential of friction times angle."""
    checks: list[Check] = []
    curves: list[Curve] = []
    for wrap in wraps:
        found = []
        for friction in frictions:
            case = Capstan(wrap, friction)
            found.append((case.ratio(), case.theory()))
            checks.append(
                Check(
                    f"ratio of tensions, wrapped by {wrap / np.pi:g} pi, friction {friction:g}",
                    *found[-1],
                    1e-2,
                    "edges of 0.1 rad, worth 0.017 rad of wrap: measured 0.9 % at most",
                )
            )
        values = np.array(found)
        curves.append(Curve(np.array(frictions), values[:, 1], f"theory, {wrap / np.pi:g} $\\pi$", "o:"))
        curves.append(Curve(np.array(frictions), values[:, 0], "found", "x", paired=True))
    panel = Panel("Rope around a drum", "friction", "ratio of tensions", tuple(curves), "linear", "log")
    return Evidence(tuple(checks), (panel,))
