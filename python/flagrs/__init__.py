"""Soft helical filaments swimming at low Reynolds number: discrete elastic rods in Stokes flow."""

from flagrs import contact, fluid, scenarios
from flagrs.errors import ConvergenceError, FlagrsError, SceneError, StabilityWarning
from flagrs.scene import (
    Clamp,
    Contact,
    Fluid,
    Head,
    Material,
    Motor,
    PointLoad,
    Rod,
    Scene,
    Table,
    TimeFunction,
)
from flagrs.simulation import Simulation
from flagrs.suggest import Suggestion, suggest
from flagrs.trajectory import Trajectory
from flagrs.units import rpm

__all__ = [
    "Clamp",
    "Contact",
    "ConvergenceError",
    "FlagrsError",
    "Fluid",
    "Head",
    "Material",
    "Motor",
    "PointLoad",
    "Rod",
    "Scene",
    "SceneError",
    "Simulation",
    "StabilityWarning",
    "Suggestion",
    "Table",
    "TimeFunction",
    "Trajectory",
    "contact",
    "fluid",
    "rpm",
    "scenarios",
    "suggest",
]
