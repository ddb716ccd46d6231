"""A filament shaken at one end, and the shape that linear theory gives it (Wiggins and Goldstein 1998)."""

import flagrs
import numpy as np
from matplotlib import pyplot as plt

LENGTH, AMPLITUDE, OMEGA = 0.1, 1e-3, 4.0  # m, m, rad/s
silicone = flagrs.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
rod = flagrs.Rod.straight(length=LENGTH, edge_count=40, radius=1e-3, material=silicone)
scene = flagrs.Scene(
    rods=rod,
    clamps=flagrs.Clamp(
        nodes=(0, 1), edges=(0,), displacement=lambda t: (0.0, AMPLITUDE * np.sin(OMEGA * t), 0.0)
    ),
    fluid=flagrs.Fluid(viscosity=1.0, model="RFT"),
)
simulation = flagrs.Simulation(scene, rtol=1e-4)
period = 2.0 * np.pi / OMEGA
trajectory = simulation.run(until=6.0 * period, save_every=period / 8.0, path=False)

# zeta y_t = -EI y_xxxx: y = Im sum of c_k exp(a_k x + i omega t) with a_k^4 = -i omega zeta / EI. The first
# edge is held, and half of it counts as free, since its hinge bends over the halves of both edges.
drag = simulation.resistance()[61, 61] / (LENGTH / 40)  # across, of an inner node, per length
free = LENGTH * 39.5 / 40
EI = float(rod.EI_array()[0, 0, 0])
a = (-1j * OMEGA * drag / EI) ** 0.25 * np.array([1.0, 1j, -1.0, -1j])
conditions = [np.ones(4), a, a**2 * np.exp(a * free), a**3 * np.exp(a * free)]
weights = np.linalg.solve(conditions, [AMPLITUDE, 0.0, 0.0, 0.0])
x = rod.nodes[:, 0] - 0.5 * LENGTH / 40

figure, panel = plt.subplots(figsize=(7.0, 3.5), layout="constrained")
worst = 0.0
for time, nodes in zip(trajectory.time[-8:], trajectory.nodes[-8:], strict=True):
    theory = np.imag(np.exp(1j * OMEGA * time) * (weights @ np.exp(np.outer(a, x))))
    worst = max(worst, np.abs(nodes[1:, 1] - theory[1:]).max() / AMPLITUDE)
    panel.plot(1e3 * x[1:], 1e3 * theory[1:], color="0.7", linewidth=4.0)
    panel.plot(1e3 * (nodes[1:, 0] - 0.5 * LENGTH / 40), 1e3 * nodes[1:, 1], color="C0")
panel.set_xlabel("along the filament [mm]")
panel.set_ylabel("deflection [mm]")
panel.set_title("eight phases: flagrs (thin) on linear theory (grey)", fontsize=10)
figure.savefig("oscillating_clamp.png", dpi=150)
print(f"largest difference from linear theory: {100.0 * worst:.1f} % of the amplitude")
