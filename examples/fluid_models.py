"""How much the model of the fluid matters: speed and torque of the robot under three of them."""

import flagrs
from matplotlib import pyplot as plt

PITCH, TURN = 44.5e-3, 59.8e-3  # one turn of a flagellum, along its axis and along its contour [m]

MODELS = {
    "RSS, flagella feel each other": {"model": "RSS"},
    "RFT, Gray and Hancock": {"model": "RFT", "coefficients": "gray-hancock", "wavelength": PITCH},
    "RFT, Lighthill": {"model": "RFT", "coefficients": "lighthill", "wavelength": TURN},
}

figure, panel = plt.subplots(figsize=(7.0, 3.5), layout="constrained")
for name, options in MODELS.items():
    scene = flagrs.scenarios.robot(rpm=20.0, fluid=options)
    trajectory = flagrs.Simulation(scene).run(until=9.0, save_every=0.05, path=False)
    moved = trajectory.position() - trajectory.position()[0]
    panel.plot(trajectory.time, -1e3 * moved[:, 0], label=name)
    speed, torque = trajectory.swimming_speed(), trajectory.torque()[-60:].mean()
    print(f"{name:<32} {1e3 * speed:.3f} mm/s   {1e6 * torque:.1f} uN m a motor")

panel.set_xlabel("time [s]")
panel.set_ylabel("way of the head along -x [mm]")
panel.legend(frameon=False)
figure.savefig("fluid_models.png", dpi=150)
