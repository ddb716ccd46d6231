"""A controller that looks ahead: at every instant 16 choices of motor speeds are tried side by side."""

import itertools

import flagrs
import numpy as np
from matplotlib import pyplot as plt

scene = flagrs.scenarios.robot(edge_length=9e-3)
head = scene.node_offset(scene.head.rod) + scene.head.node
simulation = flagrs.Simulation(scene)
choices = [
    {"motors[0].speed": flagrs.rpm(first), "motors[1].speed": flagrs.rpm(second)}
    for first, second in itertools.product((-20.0, -10.0, 10.0, 20.0), repeat=2)
]

# Swim as far towards -x and +y as can be: the best choice of the next second, made again every half second.
towards = np.array([-1.0, 1.0, 0.0]) / np.sqrt(2.0)
path = [simulation.nodes[head]]
for _ in range(8):
    ahead = flagrs.rollout(simulation, inputs=choices, until=simulation.time + 1.0).check()
    best = int(np.argmax(ahead.nodes[:, -1, head] @ towards))
    for motor, name in zip(simulation.motors, ("motors[0].speed", "motors[1].speed"), strict=True):
        motor.speed = choices[best][name]
    simulation.run(until=simulation.time + 0.5, save_every=0.5, path=False)
    path.append(simulation.nodes[head])
    speeds = " and ".join(f"{value / flagrs.rpm(1.0):+.0f}" for value in choices[best].values())
    print(
        f"t = {simulation.time:.1f} s: {speeds} rpm, {1e3 * (path[-1] - path[0]) @ towards:.3f} mm that way"
    )

moved = 1e3 * (np.array(path) - path[0])
figure, panel = plt.subplots(figsize=(4.5, 3.5), layout="constrained")
panel.plot(moved[:, 0], moved[:, 1], "o-")
panel.set_xlabel("x [mm]")
panel.set_ylabel("y [mm]")
panel.set_aspect("equal", adjustable="datalim")
figure.savefig("rollout.png", dpi=150)
