"""Scenes with a name: the robot, the bundling benchmark, and single rods with a known answer."""

from flagrs.scenarios.clamped_flagella import clamped_flagella
from flagrs.scenarios.registry import build, parameters
from flagrs.scenarios.registry import summaries as list
from flagrs.scenarios.robot import robot
from flagrs.scenarios.single_rods import cantilever, relaxing_rod, straight_rod, twisted_ring

__all__ = [
    "build",
    "cantilever",
    "clamped_flagella",
    "list",
    "parameters",
    "relaxing_rod",
    "robot",
    "straight_rod",
    "twisted_ring",
]
