"""A force of one's own at every step: the end of a rod in an optical trap that moves."""

import flagrs
import numpy as np
from matplotlib import pyplot as plt

SPRING = 5e-3  # N/m
soft = flagrs.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
rod = flagrs.Rod.straight(length=0.05, edge_count=20, radius=0.5e-3, material=soft)
scene = flagrs.Scene(rods=rod, fluid=flagrs.Fluid(viscosity=0.1))


def trap(time, nodes, velocities, directors):
    """Pull the last node to a point that moves across; its stiffness makes the pull implicit."""
    forces, stiffness = np.zeros_like(nodes), np.zeros((len(nodes), 3, 3))
    forces[-1] = SPRING * (rod.nodes[-1] + [0.0, 2e-3 * time, 0.0] - nodes[-1])
    stiffness[-1] = SPRING * np.eye(3)
    return {"forces": forces, "stiffness": stiffness}


simulation = flagrs.Simulation(scene, force=trap)
trajectory = simulation.run(until=5.0, save_every=0.5, path=False)
behind = 2e-3 * 5.0 - (trajectory.nodes[-1, -1, 1] - rod.nodes[-1, 1])
print(f"the end follows the trap {1e3 * behind:.2f} mm behind it, pulled by {1e6 * SPRING * behind:.2f} uN")

figure, panel = plt.subplots(figsize=(7.0, 3.0), layout="constrained")
for time, nodes in zip(trajectory.time[::2], trajectory.nodes[::2], strict=True):
    panel.plot(1e3 * nodes[:, 0], 1e3 * nodes[:, 1], color="C0")
    panel.plot(1e3 * rod.nodes[-1, 0], 2.0 * time, "x", color="C3")
panel.set_xlabel("x [mm]")
panel.set_ylabel("y [mm]")
panel.set_title("the rod every second, and the trap (crosses)", fontsize=10)
figure.savefig("trap.png", dpi=150)
