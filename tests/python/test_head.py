"""The head against rigid bodies: any axis is resisted, and a robot with one flagellum swims as it must."""

import flagrs
import numpy as np
import pytest
from flagrs.scene.shapes import Helix, helix_nodes

VISCOSITY, RADIUS, EPSILON = 1.0, 1.6e-3, 1.65e-3
HEAD_RADIUS, C_T, C_R = 15e-3, 1.3, 0.9
# Stiff enough to be rigid: bending by the fluid's forces turns nothing by more than 1e-5.
RIGID = flagrs.Material(youngs_modulus=1e11, poisson_ratio=0.5, density=1260.0)


def uniflagellar(stub, speed: float) -> flagrs.Scene:
    """A stub, the head, a motor, a shaft and a flagellum; all of it but the stub on the x axis."""
    helix = helix_nodes(Helix(6e-3, 40e-3, 80e-3), 30, "left", point=(10e-3, 0.0, 0.0))
    nodes = np.concatenate([[stub], [[-5e-3, 0, 0], [0, 0, 0], [5e-3, 0, 0], [10e-3, 0, 0]], helix])
    rod = flagrs.Rod.from_nodes(nodes, radius=RADIUS, material=RIGID, immersed=np.arange(len(nodes) - 1) >= 4)
    return flagrs.Scene(
        rods=rod,
        head=flagrs.Head(node=1, radius=HEAD_RADIUS, C_t=C_T, C_r=C_R),
        motors=flagrs.Motor(node=2, shaft=2, speed=speed),
        fluid=flagrs.Fluid(viscosity=VISCOSITY, epsilon=EPSILON),
    )


def rigid_motion(scene: flagrs.Scene, speed: float):
    """Velocity and angular velocity (3,) of the head and torque on the shaft, from resistances alone."""
    rod = scene.rods[0]
    wet = rod.edge_array()[rod.immersed_array()]
    first = wet.min()
    nodes, edges = rod.nodes[first:], wet - first
    arms = nodes - rod.nodes[1]
    # Force density and from it forces for each of six rigid motions about the head's node.
    motions = np.concatenate(
        [np.tile(np.eye(3), (len(nodes), 1)), np.concatenate([np.cross(np.eye(3), arm).T for arm in arms])],
        axis=1,
    )
    density = np.linalg.solve(flagrs.fluid.mobility(nodes, edges, EPSILON), 8.0 * np.pi * VISCOSITY * motions)
    forces = [flagrs.fluid.hat_weights(nodes, edges, column.reshape(-1, 3)) for column in density.T]
    resistance = np.array([[*f.sum(axis=0), *np.cross(arms, f).sum(axis=0)] for f in forces]).T
    vectors = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    lengths = np.linalg.norm(vectors, axis=1)
    tangents = vectors / lengths[:, None]
    coefficients = 4.0 * np.pi * VISCOSITY * RADIUS**2 * lengths
    resistance[3:, 3:] += np.einsum("e,ei,ej->ij", coefficients, tangents, tangents)
    head = np.zeros((6, 6))
    head[:3, :3] = C_T * 6.0 * np.pi * VISCOSITY * HEAD_RADIUS * np.eye(3)
    head[3:, 3:] = C_R * 8.0 * np.pi * VISCOSITY * HEAD_RADIUS**3 * np.eye(3)
    # The flagellum turns by the motor's speed about x more than the head, whose node is on that axis.
    driven = np.array([0.0, 0.0, 0.0, speed, 0.0, 0.0])
    motion = np.linalg.solve(resistance + head, -resistance @ driven)
    return motion[:3], motion[3:], float((resistance @ (motion + driven))[3])


@pytest.mark.parametrize("stub", [(-10e-3, 0.0, 0.0), (-5e-3, 6e-3, 0.0), (-2e-3, 3e-3, -5e-3)])
def test_robot_with_one_flagellum_moves_as_rigid_resistances_say(stub):
    speed = flagrs.rpm(60.0)
    scene = uniflagellar(stub, speed)
    velocity, turning, torque = rigid_motion(scene, speed)
    simulation = flagrs.Simulation(scene, dt=1e-4)
    simulation.step(2)  # the first bends the rod into its balance
    frame = simulation.frame()
    head_velocity = simulation.velocities[1]
    tangent = np.array([1.0, 0.0, 0.0])
    rate = (simulation.velocities[2] - simulation.velocities[1]) / 5e-3
    spin = simulation.state()["velocity"][simulation.dof_of_edge[1]]
    found = np.cross(tangent, rate) + spin * tangent
    # Two steps turn the flagellum by 1.3e-3 rad: that is the error of its geometry.
    assert head_velocity == pytest.approx(velocity, abs=2e-3 * np.linalg.norm(velocity))
    assert found == pytest.approx(turning, abs=2e-3 * np.linalg.norm(turning))
    assert frame["motor_torque"][0] == pytest.approx(torque, rel=2e-3)
    assert np.linalg.norm(velocity) > 1e-4 and abs(torque) > 1e-6


def test_shaft_of_a_motor_at_the_head_turns_freely_in_it():
    # The head is fixed to the housing alone: with a stub along the axis
    # the speed is that of a motor one node on.
    speed = flagrs.rpm(60.0)
    scene = uniflagellar((-10e-3, 0.0, 0.0), speed)
    at_head = scene.replace(
        head=scene.head.replace(node=2), motors=(flagrs.Motor(node=2, shaft=2, speed=speed),)
    )
    _, turning, torque = rigid_motion(scene, speed)
    simulation = flagrs.Simulation(at_head, dt=1e-4)
    simulation.step(2)
    spin = simulation.state()["velocity"][simulation.dof_of_edge[1]]
    # The head's node has moved along the axis by 5 mm: about it nothing changes but by the wobble across.
    assert spin == pytest.approx(turning[0], rel=0.02)
    assert simulation.frame()["motor_torque"][0] == pytest.approx(torque, rel=0.02)


def test_head_between_edges_without_a_hinge_is_refused():
    scene = uniflagellar((-10e-3, 0.0, 0.0), 1.0)
    rod = scene.rods[0]
    hinges = [pair for pair in rod.hinge_array().tolist() if pair != [0, 1]]
    with pytest.raises(flagrs.SceneError, match=r"head\.node.*no hinge joins"):
        scene.replace(rods=(rod.replace(hinges=hinges),))


def test_head_rate_is_read_off_where_the_head_lies_on_the_axis_of_the_shaft():
    speed = flagrs.rpm(60.0)
    scene = uniflagellar((-10e-3, 0.0, 0.0), speed)
    simulation = flagrs.Simulation(scene, dt=1e-3)
    trajectory = simulation.run(until=0.02, save_every=2e-3, path=False)
    _, turning, _ = rigid_motion(scene, speed)
    assert trajectory.head_rate() == pytest.approx(turning[0], rel=1e-2)
