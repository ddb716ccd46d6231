"""The description of what is simulated: frozen, validated parts in SI units, kept in TOML."""

from flagrs.scene.clamp import Clamp
from flagrs.scene.contact_model import Contact
from flagrs.scene.fluid_model import Fluid
from flagrs.scene.head import Head
from flagrs.scene.load import PointLoad
from flagrs.scene.material import Material
from flagrs.scene.motor import Motor
from flagrs.scene.plan import Plan
from flagrs.scene.rod import Rod
from flagrs.scene.scene import Scene
from flagrs.scene.signal import Signal, Table, TimeFunction, signal_value

__all__ = [
    "Clamp",
    "Contact",
    "Fluid",
    "Head",
    "Material",
    "Motor",
    "Plan",
    "PointLoad",
    "Rod",
    "Scene",
    "Signal",
    "Table",
    "TimeFunction",
    "signal_value",
]
