"""A swimmer steered as it goes: a callback sets the speeds of its motors, and stops the run."""

import flagrs
import numpy as np
from matplotlib import pyplot as plt

scene = flagrs.scenarios.robot(rpm=20.0, edge_length=9e-3)
simulation = flagrs.Simulation(scene)
log = []


def steer(simulation):
    """Turn the two motors against each other by the way off the line, and stop 4 mm from the start."""
    head = simulation.nodes[scene.node_offset(scene.head.rod) + scene.head.node]
    aside = head[1] - start[1]
    for motor, sign in zip(simulation.motors, (1.0, -1.0), strict=True):
        motor.speed = flagrs.rpm(20.0 + sign * np.clip(2e3 * aside, -5.0, 5.0))
    log.append((simulation.time, *(simulation.motors[k].speed / flagrs.rpm(1.0) for k in (0, 1))))
    return bool(np.linalg.norm(head - start) > 4e-3)


start = scene.node_array()[scene.node_offset(scene.head.rod) + scene.head.node]
# Steps end at every frame here, since what the callback sets counts from there on.
trajectory = simulation.run(until=60.0, save_every=0.5, path=False, callback=steer)
moved = 1e3 * (trajectory.position() - start)
print(f"stopped after {trajectory.time[-1]:.1f} s, {np.linalg.norm(moved[-1]):.2f} mm from the start")

figure, (path, speeds) = plt.subplots(1, 2, figsize=(8.0, 3.0), layout="constrained")
path.plot(moved[:, 0], moved[:, 1])
path.set_xlabel("x [mm]")
path.set_ylabel("y [mm]")
times, first, second = np.array(log).T
speeds.step(times, first, label="motor 0")
speeds.step(times, second, label="motor 1")
speeds.set_xlabel("time [s]")
speeds.set_ylabel("speed [rpm]")
speeds.legend(frameon=False)
figure.savefig("steering.png", dpi=150)
