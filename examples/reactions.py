"""What it takes to hold a turning flagellum: force, torque and power of its clamp over one turn."""

import flagrs
from matplotlib import pyplot as plt

SPEED = 2.4  # rad/s
scene = flagrs.scenarios.clamped_flagella(
    count=1, angular_velocity=SPEED, contact=False, fluid={"viscosity": 0.6, "model": "RFT"}
)
trajectory = flagrs.Simulation(scene, rtol=1e-4).run(until=6.0, save_every=0.1, path=False)
reaction = trajectory.reaction(
    0
)  # of the first clamp: force (T, 3), torque (T, 3) about its first node, power (T,)

held, thrust = reaction.force[-1, 0], trajectory.thrust()[-1, 0]
print(f"along its axis the clamp holds {1e3 * held:.3f} mN, and pushes the fluid with {1e3 * thrust:.3f} mN")
print(f"it turns with {1e6 * reaction.torque[-1, 0]:.1f} uN m, and spends {1e6 * reaction.power[-1]:.1f} uW")
spent = trajectory.powers()
print(f"of which the fluid takes {1e6 * (spent['fluid'] + spent['twist_drag'])[-1]:.1f} uW")

figure, (forces, torques) = plt.subplots(2, 1, figsize=(7.0, 4.5), sharex=True, layout="constrained")
for axis, name in enumerate("xyz"):
    forces.plot(trajectory.time[1:], 1e3 * reaction.force[1:, axis], label=name)
    torques.plot(trajectory.time[1:], 1e6 * reaction.torque[1:, axis])
forces.set_ylabel("force [mN]")
torques.set_ylabel("torque [uN m]")
torques.set_xlabel("time [s]")
forces.legend(frameon=False, ncols=3)
figure.savefig("reactions.png", dpi=150)
