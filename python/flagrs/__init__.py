"""Soft helical filaments swimming at low Reynolds number: discrete elastic rods in Stokes flow."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from flagrs.version import installed_version

if TYPE_CHECKING:
    from flagrs import contact, fluid, plot, scenarios
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
    from flagrs.rollouts import Rollout, rollout
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
        Wall,
    )
    from flagrs.simulation import Simulation
    from flagrs.suggestion import Suggestion, suggest
    from flagrs.trajectory import Trajectory
    from flagrs.units import rpm

__version__ = installed_version()

#: Where the public names are, which are imported when they are first used: a program that wants one need not
#: wait for all. Modules are among them.
_PLACES = {
    "": (
        "contact",
        "fluid",
        "plot",
        "scenarios",
    ),
    "flagrs.errors": (
        "ConvergenceError",
        "FileError",
        "FlagrsError",
        "SceneError",
    ),
    "flagrs.guards": (
        "ContactWarning",
        "EnergyWarning",
        "FlagrsWarning",
        "MeshWarning",
        "ReynoldsWarning",
        "StabilityWarning",
        "StationarityWarning",
        "StepWarning",
        "StrainWarning",
    ),
    "flagrs.reactions": ("Reaction",),
    "flagrs.rollouts": (
        "Rollout",
        "rollout",
    ),
    "flagrs.scene": (
        "Capsule",
        "Clamp",
        "Contact",
        "Cylinder",
        "Ellipsoid",
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
        "Sphere",
        "Table",
        "TimeFunction",
        "Wall",
    ),
    "flagrs.simulation": ("Simulation",),
    "flagrs.suggestion": (
        "Suggestion",
        "suggest",
    ),
    "flagrs.trajectory": ("Trajectory",),
    "flagrs.units": ("rpm",),
}
_PLACE_OF = {name: place for place, names in _PLACES.items() for name in names}

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
    "Wall",
    "__version__",
    "contact",
    "fluid",
    "plot",
    "rollout",
    "rpm",
    "scenarios",
    "suggest",
]


def __getattr__(name: str) -> Any:
    """Return a public name, imported on first use."""
    if name not in _PLACE_OF:
        raise AttributeError(f"module 'flagrs' has no attribute {name!r}")
    place = _PLACE_OF[name]
    found = getattr(import_module(place), name) if place else import_module(f"flagrs.{name}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted(__all__)
