"""What accuracy costs a swimming bacterium: steps and work against the relative error asked for."""

import flagrs
import numpy as np
from matplotlib import pyplot as plt

# A cell body of 2 um with a filament of three turns behind it, micrometres and milliseconds.
stiff = flagrs.Material(youngs_modulus=1e8, poisson_ratio=0.5, density=1100.0)
turn = np.linspace(0.0, 6.0 * np.pi, 49)
grow = 1.0 - np.exp(-((turn / 3.0) ** 2))
helix = np.stack([0.35e-6 * turn, 0.2e-6 * grow * np.cos(turn), 0.2e-6 * grow * np.sin(turn)], axis=1)
body = np.stack([np.linspace(-2.3e-6, -0.3e-6, 6), np.zeros(6), np.zeros(6)], axis=1)
nodes = np.concatenate([body, helix])
radius = np.where(np.arange(len(nodes) - 1) < 5, 0.4e-6, 20e-9)
rod = flagrs.Rod.from_nodes(nodes, radius=radius, material=stiff)
motor = flagrs.Motor(node=5, shaft=5, speed=flagrs.rpm(6000.0))
water = flagrs.Fluid(viscosity=1e-3, model="RFT", wavelength=2.2e-6)
scene = flagrs.Scene(rods=rod, motors=motor, fluid=water, name="bacterium")


def swim(rtol):
    """Return where the nodes are after 20 ms, and the counts of the run."""
    simulation = flagrs.Simulation(scene, rtol=rtol)
    simulation.run(until=0.02, save_every=0.02, path=False)
    return simulation.nodes, simulation.statistics


exact, _ = swim(1e-7)
asked, found, steps, work = (0.1, 1e-2, 1e-3, 1e-4, 1e-5), [], [], []
for rtol in asked:
    nodes, counts = swim(rtol)
    found.append(np.linalg.norm(nodes - exact, axis=1).max() / 0.2e-6)
    steps.append(counts["steps"])
    work.append(counts["newton_iterations"])
    print(
        f"rtol {rtol:.0e}: error {found[-1]:.1e} of the helix radius, {steps[-1]:.0f} steps, "
        f"{work[-1]:.0f} Newton iterations, {counts['rejected_steps']:.0f} rejected"
    )

figure, (left, right) = plt.subplots(1, 2, figsize=(8.0, 3.2), layout="constrained")
left.loglog(asked, found, "o-")
left.loglog(asked, asked, "--", color="0.6", label="as asked")
left.set_xlabel("rtol")
left.set_ylabel("error / helix radius")
left.legend(frameon=False)
right.loglog(asked, steps, "o-", label="steps")
right.loglog(asked, work, "s-", label="Newton iterations")
right.set_xlabel("rtol")
right.legend(frameon=False)
figure.savefig("cost_against_error.png", dpi=150)
