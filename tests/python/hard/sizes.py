"""Sizes and viscosities: the same motion in any unit, and edges that differ by a factor of a thousand."""

from __future__ import annotations

from functools import partial

import numpy as np
from flagrs import Clamp, Fluid, Rod, Scene, Simulation

from hard.case import add, hard
from hard.parts import SILICONE, apart, bow, cantilever, elapsed, settle

GROUP = "Sizes and viscosities"


def driven_helix(scale: float, viscosity: float = 1.0, model: str = "RSS") -> Scene:
    """Return a soft helix of ten edges of 5 mm times a scale, turned by a clamp at its root.

    With E / viscosity fixed the motion of a scene scaled in length is the same motion scaled.
    """
    rod = Rod.helix(
        helix_radius=6e-3 * scale,
        pitch=40e-3 * scale,
        axial_length=36.4e-3 * scale,
        radius=1e-3 * scale,
        edge_count=10,
        material=SILICONE.replace(youngs_modulus=1e5 * viscosity),
    )
    return Scene(
        rods=rod,
        fluid=Fluid(viscosity=viscosity, model=model),
        clamps=Clamp(nodes=(0, 1), edges=(0,), angular_velocity=2.0),
    )


def scaled_motion(scale: float, options: dict[str, float]) -> float:
    """Return how far the motion of a scaled helix is from the scaled motion, over its size."""
    reference = elapsed(Simulation(driven_helix(1.0), threads=1, **options), 1.0)
    found = elapsed(Simulation(driven_helix(scale), threads=1, **options), 1.0) / scale
    moved = np.abs(reference - driven_helix(1.0).node_array()).max()
    assert moved > 1e-3
    return apart(found, reference, 6e-3)


for scale, words in ((2e-6, "10 nm"), (2e-4, "1 um"), (0.02, "0.1 mm"), (20.0, "100 mm"), (200.0, "1 m")):
    # Round-off of coordinates and of Newton's last iteration; steps and orders must be chosen alike.
    add(
        GROUP,
        f"edges of {words}, fixed steps",
        partial(scaled_motion, scale, {"dt": 0.02}),
        against="edges of 5 mm: invariance to the unit of length",
        tolerance=1e-8,
    )
    add(
        GROUP,
        f"edges of {words}, rtol 1e-3",
        partial(scaled_motion, scale, {"rtol": 1e-3}),
        against="edges of 5 mm: invariance to the unit of length",
        tolerance=1e-3,
    )


def thick_or_thin(viscosity: float, factor: float) -> float:
    """Return how far the motion in another viscosity is from the same one at another pace."""
    scene = Scene(rods=bow(), fluid=Fluid(viscosity=1.0))
    reference = elapsed(Simulation(scene, dt=0.02, threads=1), 0.4)
    other = Scene(rods=bow(), fluid=Fluid(viscosity=viscosity))
    found = elapsed(Simulation(other, dt=0.02 * factor, threads=1), 0.4 * factor)
    assert np.abs(reference - scene.node_array()).max() > 1e-4
    return apart(found, reference, 0.02)


for viscosity in (1e-12, 1e-6, 1e-3, 1e4):
    add(
        GROUP,
        f"viscosity {viscosity:g} Pa s",
        partial(thick_or_thin, viscosity, viscosity),
        against="1 Pa s: without inertia viscosity is a unit of time",
        tolerance=1e-8,
    )

add(
    GROUP,
    "viscosity 1e6 Pa s",
    partial(thick_or_thin, 1e6, 1e6),
    against="the range allowed",
    tolerance=np.nan,
    refused=True,
)


def graded_cantilever(ratio: float) -> float:
    """Return the error of the deflection of a cantilever whose edges grow by a ratio, against virtual work.

    In the small the tip of a chain sinks by the sum over hinges of M^2 l / (P EI), with the moment
    M = P (L - x) and the mean length l of the two edges; exact for these hinges, whatever the mesh.
    """
    count = 30
    lengths = np.geomspace(1.0, ratio, count)
    lengths *= 0.1 / lengths.sum()
    nodes = np.concatenate([[0.0], np.cumsum(lengths)])[:, None] * [1.0, 0.0, 0.0]
    bending = 1e6 * np.pi * 1e-12 / 4.0
    force = 3e-3 * bending / 0.1**2
    scene = cantilever(nodes, np.array([0.0, 0.0, -force]))
    simulation = settle(scene)
    arms = nodes[-1, 0] - nodes[1:-1, 0]
    mean = 0.5 * (lengths[1:] + lengths[:-1])
    expected = force / bending * float((arms**2 * mean).sum())
    return float(-simulation.nodes[-1, 2] / expected - 1.0)


for ratio in (1e3, 1e-3):
    # The deflection is 1e-3 of the length: its square, 1e-6, is the error of the linear answer. The rest is
    # round-off: edges of 0.7 um in coordinates of 0.1 m have strains known to 2e-11, forces to 6e-11 N of the
    # load's 2e-7 N.
    add(
        GROUP,
        f"edges growing by a factor of {ratio:g} along a cantilever",
        partial(graded_cantilever, ratio),
        against="virtual work, hinge by hinge",
        tolerance=3e-4,
    )


@hard(
    GROUP,
    "a rod from 1 um to 1 mm edges, relaxing in a nonlocal fluid",
    against="the same rod scaled by a thousand",
    tolerance=1e-7,
)
def graded_rod_relaxes_alike() -> float:
    """Return the difference of the motion of a graded rod and of a larger copy of it."""

    def motion(scale: float) -> np.ndarray:
        lengths = np.geomspace(1e-6, 1e-3, 16)
        turn = np.linspace(0.0, 1.0, 16)
        edges = lengths[:, None] * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
        nodes = scale * np.concatenate([np.zeros((1, 3)), np.cumsum(edges, axis=0)])
        flat = scale * np.concatenate([[0.0], np.cumsum(lengths)])[:, None] * [1.0, 0.0, 0.0]
        fluid = Fluid(viscosity=1.0, epsilon=scale * 5e-5)
        rod = Rod(nodes=nodes, rest_nodes=flat, radius=scale * 3e-5, material=SILICONE)
        return elapsed(Simulation(Scene(rods=rod, fluid=fluid), dt=1e-4, threads=1), 2e-3) / scale

    small, large = motion(1.0), motion(1e3)
    return apart(small, large, 4e-3)
