"""The flow a turning helix drives, in the plane through its axis, from the forces of the last frame."""

import flagrs
import numpy as np
from matplotlib import pyplot as plt

# Slow and in a thick fluid: the published 15 rad/s in 0.1 Pa s is a Reynolds number of 25: a run warns of it.
scene = flagrs.scenarios.clamped_flagella(count=1, angular_velocity=2.4, fluid={"viscosity": 0.6})
simulation = flagrs.Simulation(scene)
trajectory = simulation.run(until=3.0, save_every=0.6, path=False)

along = np.linspace(-0.05, 0.25, 61)
across = np.linspace(-0.06, 0.06, 25)
x, y = np.meshgrid(along, across)
points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
velocity = trajectory.flow(points).reshape(*x.shape, 3)

speed = np.linalg.norm(velocity, axis=2)
print(
    f"fastest flow {1e3 * speed.max():.1f} mm/s, on average {1e3 * velocity[:, :, 0].mean():.1f} mm/s along x"
)

figure, panel = plt.subplots(figsize=(8.0, 4.0), layout="constrained")
colours = panel.pcolormesh(1e3 * x, 1e3 * y, 1e3 * speed, cmap="viridis", shading="gouraud")
panel.quiver(
    1e3 * x[::2, ::2],
    1e3 * y[::2, ::2],
    velocity[::2, ::2, 0],
    velocity[::2, ::2, 1],
    color="white",
    width=1.5e-3,
)
panel.plot(*(1e3 * trajectory.nodes[-1, :, :2].T), color="black", linewidth=2.0)
figure.colorbar(colours, label="speed [mm/s]", shrink=0.7)
panel.set_aspect("equal")
panel.set_xlabel("x [mm]")
panel.set_ylabel("y [mm]")
figure.savefig("flow_field.png", dpi=130)
