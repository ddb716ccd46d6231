"""Calls that work, so that type checkers must let them pass; checked by `test_types.py`, never run."""

import math

import flagrs
import numpy as np

SILICONE = flagrs.Material(youngs_modulus=1.2e6, poisson_ratio=0.5, density=1260)
NODES = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.02, 0.0, 0.0]]

rod = flagrs.Rod(nodes=NODES, radius=1e-3, material=SILICONE, edges=[[0, 1], [1, 2]], immersed=[True, False])
other = flagrs.Rod(
    nodes=np.array(NODES) + 0.1, radius=[1e-3, 2e-3], material=SILICONE, EI=1e-6, director=(0, 1, 0)
)
held = flagrs.Clamp(nodes=[0, 1], edges=[0], angular_velocity=flagrs.rpm(30))
shaken = flagrs.Clamp(rod=1, nodes=range(2), displacement=lambda t: (0.0, 1e-3 * math.sin(t), 0.0))
turned = flagrs.Clamp(rod=1, nodes=(0,), rotation=flagrs.Rotation(axis=[0, 0, 1], rate=2))
pushed = flagrs.PointLoad(node=2, force=[0.0, 0.0, 1e-3])
heavy = flagrs.LineLoad(force=(0.0, lambda t: 1e-3 * t, 0.0), edges=[0, 1])
field = flagrs.MagneticField(field=[0.0, 0.0, 1e-3], gradient=[[1, 0, 0], [0, -1, 0], [0, 0, 0]])

water = flagrs.Fluid(viscosity=1, density=1000)
one = flagrs.Scene(rods=rod, clamps=held, fluid=water, gravity=[0.0, 0.0, -9.81])
several = flagrs.Scene(rods=[rod, other], clamps=[held, shaken], loads=[pushed, heavy], magnetic_field=field)
changed = one.replace(rods=[rod])
first: flagrs.Rod = several.rods[0]

trajectory = flagrs.Simulation(one, rtol=1e-3).run(until=1, save_every=0.1, path=False, progress=True)
speed: float = trajectory.readouts()["speed"].value
flow = trajectory.flow([[0.0, 0.0, 0.1]])
trajectory.view(colour="force").save("run.html")
flagrs.plot.shape(trajectory)
