"""The scenario of a cantilever at rest, shared by the tests and the validation page."""

from __future__ import annotations

import numpy as np
from flagrs import Scene, scenarios
from flagrs.validation.equilibria import settle
from flagrs.validation.problems.rings import critical_twist, lowest_eigenvalue, michell, ring

__all__ = [
    "cantilever_compliance",
    "cantilever_length",
    "cantilever_tip",
    "critical_twist",
    "lowest_eigenvalue",
    "michell",
    "ring",
    "settle",
]


def cantilever_tip(load: float, edge_count: int) -> np.ndarray:
    """Return vertical and horizontal tip deflection over the length, of ``scenarios.cantilever``."""
    scene = scenarios.cantilever(normalized_load=load, edge_count=edge_count)
    tip = settle(scene).nodes[-1] / cantilever_length(scene)
    return np.array([-tip[2], 1.0 - tip[0]])


def cantilever_length(scene: Scene) -> float:
    """Return the length from the wall at x = 0 to the tip of the unloaded cantilever [m]."""
    return float(scene.rods[0].rest_array()[-1, 0])


def cantilever_compliance(scene: Scene) -> float:
    """Return EI / (EA L^2)."""
    rod = scene.rods[0]
    return float(rod.EI_array()[0, 0, 0] / (rod.EA_array()[0] * cantilever_length(scene) ** 2))
