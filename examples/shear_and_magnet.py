"""A stiff rod that tumbles in shear, and one that follows a rotating magnetic field until it steps out."""

import flagrs
import numpy as np
from matplotlib import pyplot as plt

stiff = flagrs.Material(youngs_modulus=1e9, poisson_ratio=0.5, density=1000.0)
rod = flagrs.Rod.straight(
    length=20e-3, edge_count=20, radius=0.5e-3, material=stiff, direction=(0.0, 1.0, 0.0)
)
oil = flagrs.Fluid(viscosity=1.0, model="RFT")


def angle(trajectory):
    """Return the angle of the rod in the plane over time [rad]."""
    along = trajectory.nodes[:, -1] - trajectory.nodes[:, 0]
    return np.unwrap(np.arctan2(along[:, 1], along[:, 0]))


# In a shear of rate g a slender rod across the flow turns as cot(angle) = g t.
shear = flagrs.Scene(rods=rod, fluid=oil.replace(background=flagrs.LinearFlow.shear(rate=2.0)))
turned = angle(flagrs.Simulation(shear, rtol=1e-4).run(until=1.0, save_every=0.1, path=False))
print(f"angle after 1 s in shear: {turned[-1]:.4f} rad; of a slender rod: {np.arctan2(1.0, 2.0):.4f} rad")

# A moment m in a rotating field B lags by sin(lag) = drag omega / (m B); it steps out where that is one.
magnetic = rod.replace(magnetization=(0.0, 0.0, 1e4))
center = rod.nodes - rod.nodes.mean(axis=0)
spin = np.cross([0.0, 0.0, 1.0], center).ravel()
drag = spin @ flagrs.Simulation(flagrs.Scene(rods=rod, fluid=oil)).resistance() @ spin
limit = 1e4 * np.pi * 0.5e-3**2 * 20e-3 * 1e-3 / drag
figure, panel = plt.subplots(figsize=(7.0, 3.5), layout="constrained")
for share in (0.8, 1.2):
    omega = share * limit

    def field(time, omega=omega):
        """Return the rotating field [T]."""
        return (-1e-3 * np.sin(omega * time), 1e-3 * np.cos(omega * time), 0.0)

    scene = flagrs.Scene(rods=magnetic, fluid=oil, magnetic_field=flagrs.MagneticField(field=field))
    trajectory = flagrs.Simulation(scene).run(until=200.0 / omega, save_every=0.2 / omega, path=False)
    turns = angle(trajectory)
    rate = (turns[-1] - turns[0]) / (200.0 / omega)
    expected = omega if share < 1.0 else omega - np.sqrt(omega**2 - limit**2)
    found, theory = rate / omega, expected / omega
    print(f"field at {share:.1f} of step-out: the rod turns at {found:.3f} of its speed; theory {theory:.3f}")
    panel.plot(
        omega * trajectory.time / (2.0 * np.pi), turns / (2.0 * np.pi), label=f"{share:.1f} of step-out"
    )

panel.set_xlabel("turns of the field")
panel.set_ylabel("turns of the rod")
panel.legend(frameon=False)
figure.savefig("shear_and_magnet.png", dpi=150)
