"""Soft helical filaments swimming at low Reynolds number: discrete elastic rods in Stokes flow."""

from flagrs import contact, fluid, scenarios
from flagrs.errors import ConvergenceError, FlagrsError, SceneError
from flagrs.scene import (
    Clamp,
    Contact,
    FlowFunction,
    Fluid,
    Head,
    LinearFlow,
    LineLoad,
    MagneticField,
    Material,
    Motor,
    PointLoad,
    PoiseuilleFlow,
    Rod,
    Rotation,
    Scene,
    Table,
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
    "FlowFunction",
    "Fluid",
    "Head",
    "LineLoad",
    "LinearFlow",
    "MagneticField",
    "Material",
    "Motor",
    "PointLoad",
    "PoiseuilleFlow",
    "Rod",
    "Rotation",
    "Scene",
    "SceneError",
    "Simulation",
    "Suggestion",
    "Table",
    "Trajectory",
    "contact",
    "fluid",
    "rpm",
    "scenarios",
    "suggest",
]
