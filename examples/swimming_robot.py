"""The robot swims for 10 s, is saved, goes on for 5 s more from the file, and is drawn."""

import flagrs
from flagrs import plot

scene = flagrs.scenarios.robot(rpm=20.0)
print(scene.plan())

simulation = flagrs.Simulation(scene)
simulation.run(until=10.0, save_every=0.1, path="robot.h5", overwrite=True)

# As another program might, on another day: the file holds scene, settings and the last state, to the bit.
later = flagrs.Simulation.restore("robot.h5")
trajectory = later.run(until=15.0, save_every=0.1, path="robot.h5")

window = {"start": 6.0, "end": 15.0}  # three turns of the motors
print(f"speed      {1e3 * trajectory.swimming_speed(**window):.3f} mm/s")
print(f"head rate  {trajectory.head_rate(**window) / flagrs.rpm(1.0):.3f} rpm")
print(f"power      {1e6 * trajectory.mean_power(**window):.1f} uW")

plot.summary(trajectory).savefig("robot.png")
