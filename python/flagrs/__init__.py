"""Soft helical filaments swimming at low Reynolds number: discrete elastic rods in Stokes flow."""

from flagrs import contact, fluid, scenarios
from flagrs.errors import ConvergenceError, FileError, FlagrsError, SceneError
from flagrs.guards import (
    ContactWarning,
    EnergyWarning,
    FlagrsWarning,
    MeshWarning,
    ReynoldsWarning,
    StabilityWarning,
    StrainWarning,
)
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
from flagrs.version import installed_version

__version__ = installed_version()

__all__ = [
    "Clamp",
    "Contact",
    "ContactWarning",
    "ConvergenceError",
    "EnergyWarning",
    "FileError",
    "FlagrsError",
    "FlagrsWarning",
    "Fluid",
    "Head",
    "Material",
    "MeshWarning",
    "Motor",
    "PointLoad",
    "ReynoldsWarning",
    "Rod",
    "Scene",
    "SceneError",
    "Simulation",
    "StabilityWarning",
    "StrainWarning",
    "Suggestion",
    "Table",
    "TimeFunction",
    "Trajectory",
    "__version__",
    "contact",
    "fluid",
    "rpm",
    "scenarios",
    "suggest",
]
