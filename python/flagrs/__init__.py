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
    StationarityWarning,
    StepWarning,
    StrainWarning,
)
from flagrs.reactions import Reaction
from flagrs.rollout import Rollout, rollout
from flagrs.scene import (
    Capsule,
    Clamp,
    Contact,
    Cylinder,
    Ellipsoid,
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
    Sphere,
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
    "Capsule",
    "Clamp",
    "Contact",
    "ContactWarning",
    "ConvergenceError",
    "Cylinder",
    "Ellipsoid",
    "EnergyWarning",
    "FileError",
    "FlagrsError",
    "FlagrsWarning",
    "FlowFunction",
    "Fluid",
    "Head",
    "LineLoad",
    "LinearFlow",
    "MagneticField",
    "Material",
    "MeshWarning",
    "Motor",
    "PointLoad",
    "PoiseuilleFlow",
    "Reaction",
    "ReynoldsWarning",
    "Rod",
    "Rollout",
    "Rotation",
    "Scene",
    "SceneError",
    "Simulation",
    "Sphere",
    "StabilityWarning",
    "StationarityWarning",
    "StepWarning",
    "StrainWarning",
    "Suggestion",
    "Table",
    "TimeFunction",
    "Trajectory",
    "__version__",
    "contact",
    "fluid",
    "rollout",
    "rpm",
    "scenarios",
    "suggest",
]
