"""The description of what is simulated: frozen, validated parts in SI units, kept in TOML."""

from flagrs.scene.body_shape import Capsule, Cylinder, Ellipsoid, Sphere
from flagrs.scene.clamp import Clamp, Rotation
from flagrs.scene.contact_model import Contact
from flagrs.scene.flow import FlowFunction, LinearFlow, PoiseuilleFlow
from flagrs.scene.fluid_model import Fluid
from flagrs.scene.head import Head
from flagrs.scene.load import LineLoad, PointLoad
from flagrs.scene.magnetic_field import MagneticField
from flagrs.scene.material import Material
from flagrs.scene.motor import Motor
from flagrs.scene.plan import Plan
from flagrs.scene.rod import Rod
from flagrs.scene.scene import Scene
from flagrs.scene.signal import Signal, Table, TimeFunction, signal_value
from flagrs.scene.vector_signal import VectorSignal
from flagrs.scene.wall import Wall

__all__ = [
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
    "Plan",
    "PointLoad",
    "PoiseuilleFlow",
    "Rod",
    "Rotation",
    "Scene",
    "Signal",
    "Sphere",
    "Table",
    "TimeFunction",
    "VectorSignal",
    "Wall",
    "signal_value",
]
