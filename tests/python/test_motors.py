"""Motors: stiffness of the joint at every angle, and the balance of torque and speed."""

from __future__ import annotations

import numpy as np
import pytest
from flagrs import Clamp, Fluid, Material, Motor, PointLoad, Rod, Scene, Simulation, Table, scenarios

MATERIAL = Material(youngs_modulus=1e6, density=1000.0)
OIL = Fluid(viscosity=1.0, model="RFT")
#: A straight shaft: length and radius [m], edges in all, and those before the motor.
LENGTH, RADIUS, EDGES, HOUSING = 0.05, 1e-3, 10, 5
CLAMP = Clamp(nodes=(0, 1), edges=(0,))
TURN = 2.0 * np.pi


def straight(**drive: object) -> Scene:
    """Return a straight rod along +x, clamped at its start, with a motor in its middle."""
    rod = Rod.straight(length=LENGTH, edge_count=EDGES, radius=RADIUS, material=MATERIAL)
    motor = Motor(node=HOUSING, shaft=HOUSING, **drive)
    return Scene(rods=(rod,), fluid=OIL, motors=(motor,), clamps=(CLAMP,))


def flagellum(model: str, **drive: object) -> Scene:
    """Return the robot's second flagellum with a straight clamped shaft in place of the head."""
    robot = scenarios.robot(edge_length=9e-3)
    nodes = robot.rods[0].nodes[robot.motors[1].node - 1 :]
    rod = Rod(nodes=nodes, radius=1.6e-3, material=robot.rods[0].material)
    fluid = Fluid(viscosity=1.0, model=model, epsilon=1.65e-3)
    motor = Motor(node=1, shaft=1, **drive)
    return Scene(rods=(rod,), fluid=fluid, motors=(motor,), clamps=(CLAMP,))


def bent_joint(shaft: int) -> Simulation:
    """Return a single hinge, bent and twisted, of a section that is not round and with natural curvature."""
    rng = np.random.default_rng(2)
    nodes = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.8, 0.6, 0.2]]) * 1e-2
    rod = Rod(
        nodes=nodes,
        rest_nodes=nodes + 1e-3 * rng.uniform(-1.0, 1.0, (3, 3)),
        material=MATERIAL,
        radius=RADIUS,
        EI=np.array([[2.0, 0.4], [0.4, 1.1]]) * 1e-6,
        natural_curvature=np.array([0.2, -0.5]),
        theta=np.array([0.3, -0.8]),
    )
    motor = Motor(node=1, shaft=shaft, speed=1.0)
    return Simulation(Scene(rods=(rod,), fluid=OIL, motors=(motor,)), threads=1)


@pytest.mark.parametrize("shaft", [0, 1])
def test_a_loaded_motor_hinge_is_as_stiff_at_every_angle_over_a_thousand_turns(shaft: int) -> None:
    simulation = bent_joint(shaft)
    start = simulation.state()
    energy, hessian = simulation.energy(), simulation.hessian().toarray()
    assert energy["bending"] > 0.0
    for turns in (0, 1, 37, 500, 1000):
        for phase in np.linspace(0.0, TURN, 8, endpoint=False):
            angle = turns * TURN + phase
            state = {name: values.copy() for name, values in start.items()}
            state["motor_angles"][:] = angle
            # A positive angle is right-handed about the shaft away from the motor: edge 0 runs towards it.
            state["q"][simulation.dof_of_edge[shaft]] += angle if shaft == 1 else -angle
            simulation.load_state(state)
            # Angles of 6283 rad are known to half a unit in the last place, 5e-13 rad.
            assert simulation.energy()["bending"] == pytest.approx(energy["bending"], rel=1e-11)
            assert simulation.energy()["twisting"] == pytest.approx(energy["twisting"], rel=1e-11)
            assert np.abs(simulation.hessian().toarray() - hessian).max() < 1e-11 * np.abs(hessian).max()


def test_the_shaft_of_a_loaded_motor_stays_bent_alike_while_it_turns_a_thousand_times() -> None:
    scene = straight(speed=Table(times=[0.0, 1.0], values=[0.0, TURN]))
    bending = scene.rods[0].EI_array()[0, 0, 0]
    load = PointLoad(node=EDGES, force=np.array([0.0, 0.0, -2.0 * bending / LENGTH**2]))
    simulation = Simulation(scene.replace(loads=(load,)), dt=0.137, threads=1)
    simulation.step(1000)
    tip, angle = simulation.nodes[-1], simulation.state()["motor_angles"][0]
    assert -tip[2] > 0.4 * LENGTH
    farthest = 0.0
    while simulation.state()["motor_angles"][0] < angle + 1000 * TURN:
        simulation.step(7)
        farthest = max(farthest, np.abs(simulation.nodes[-1] - tip).max())
    # A joint without the correction would give way once a turn. Newton's tolerance is 1e-10 of the forces.
    assert farthest < 1e-9 * LENGTH


def test_the_torque_of_a_straight_shaft_is_its_twist_drag() -> None:
    speed = 2.0
    simulation = Simulation(straight(speed=speed), dt=0.05, threads=1)
    simulation.step(200)
    expected = 4.0 * np.pi * OIL.viscosity * RADIUS**2 * (LENGTH / 2.0) * speed
    assert simulation.frame()["motor_torque"][0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_torque_driven_straight_shaft_turns_at_the_torque_over_its_drag(sign: float) -> None:
    torque = sign * 1e-6
    simulation = Simulation(straight(torque=torque), dt=0.05, threads=1)
    simulation.step(200)
    expected = torque / (4.0 * np.pi * OIL.viscosity * RADIUS**2 * (LENGTH / 2.0))
    frame = simulation.frame()
    assert frame["motor_speed"][0] == pytest.approx(expected, rel=1e-9)
    assert frame["motor_torque"][0] == pytest.approx(torque, rel=1e-9)


@pytest.mark.parametrize("model", ["RFT", "RSS"])
def test_a_motor_given_the_torque_of_a_speed_driven_one_runs_at_its_speed(model: str) -> None:
    speed, dt = 2.0, 0.1
    by_speed = Simulation(flagellum(model, speed=speed), dt=dt, threads=1)
    by_speed.step(1000)
    torque = by_speed.frame()["motor_torque"][0]
    # A shape that turns without changing solves the same equations for both drives, whatever the error of the
    # step. What has not died out after 100 s is below 1e-9 of the speed.
    by_torque = Simulation(flagellum(model, torque=float(torque)), dt=dt, threads=1)
    by_torque.step(1000)
    frame = by_torque.frame()
    assert frame["motor_torque"][0] == pytest.approx(torque, rel=1e-9)
    assert frame["motor_speed"][0] == pytest.approx(speed, rel=1e-8)


def test_the_power_of_a_steady_motor_is_dissipated_in_the_fluid() -> None:
    speed, dt = 2.0, 0.005
    simulation = Simulation(flagellum("RFT", speed=speed), dt=dt, threads=1)
    simulation.step(4000)
    theta, resistance = simulation.theta, simulation.resistance()
    simulation.step()
    velocities = simulation.velocities.ravel()
    rod = simulation.scene.rods[0]
    drag = 4.0 * np.pi * rod.radius_array() ** 2 * rod.rest_lengths()
    spin = (simulation.theta - theta) / dt
    dissipated = velocities @ resistance @ velocities + drag @ spin**2
    # Secants stand for arcs of 0.01 rad: first order in the step, 1e-2 rad / 2.
    assert simulation.frame()["motor_torque"][0] * speed == pytest.approx(dissipated, rel=5e-3)


def test_a_reversed_motor_turns_back_the_same_way() -> None:
    there_and_back = Table(times=[0.0, 1.0, 1.0 + 1e-9, 2.0], values=[3.0, 3.0, -3.0, -3.0])
    simulation = Simulation(straight(speed=there_and_back), dt=0.05, threads=1)
    simulation.step(20)
    assert simulation.state()["motor_angles"][0] == pytest.approx(3.0, rel=1e-9)
    simulation.step(20)
    assert simulation.state()["motor_angles"][0] == pytest.approx(0.0, abs=1e-8)
