"""The flow that a scene's immersed edges drive."""

from __future__ import annotations

from typing import Any

import numpy as np

from flagrs.errors import FlagrsError
from flagrs.fluid import velocity
from flagrs.scene import Scene
from flagrs.scene.values import BoolArray, FloatArray, IntArray
from flagrs.scene.wall_checks import wall_in_flow


def immersed_edges(scene: Scene) -> tuple[IntArray, FloatArray]:
    """Return start and end node (W, 2) of the immersed edges, and their regularization (W,) [m]."""
    fluid = scene.fluid
    if fluid is None or fluid.model == "none":
        return np.zeros((0, 2), dtype=np.int64), np.zeros(0)
    parts = [(scene.node_offset(k), rod, rod.immersed_array()) for k, rod in enumerate(scene.rods)]
    edges = [offset + rod.edge_array()[wet] for offset, rod, wet in parts]
    widths = [fluid.epsilon_array(rod.radius_array())[wet] for _, rod, wet in parts]
    return np.concatenate(edges), np.concatenate(widths)


def in_fluid(scene: Scene, points: FloatArray) -> BoolArray:
    """Return which of the points (M, 3) [m] are on the fluid's side of a wall in the flow."""
    wall = wall_in_flow(scene)
    heights = np.zeros(len(points)) if wall is None else wall.heights(points)
    inside: BoolArray = heights >= 0.0
    return inside


def flow_of(
    scene: Scene, nodes: FloatArray, density: FloatArray, points: Any, threads: int | None
) -> FloatArray:
    """Return the velocity (M, 3) at points (M, 3) of the flow of a force density at the nodes [m/s]."""
    fluid = scene.fluid
    if fluid is None or fluid.model != "RSS":
        raise FlagrsError("a flow needs a fluid of regularized Stokeslet segments, Fluid(model='RSS')")
    # A dry edge beside an immersed one would carry half a hat of their common node's density.
    edges, widths = immersed_edges(scene)
    wall = wall_in_flow(scene)
    return velocity(points, nodes, edges, density, fluid.viscosity, widths, threads, wall)
