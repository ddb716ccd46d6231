"""Hypothesis strategies for whole scenes, and for ways of running them.

Sizes are drawn by decades, shapes from all kinds of networks, everything that may be left out is left out at
times. What is drawn is meant to be valid, but need not be: a scene may be refused.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from flagrs import (
    Clamp,
    Contact,
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
    Wall,
    inputs,
)
from hypothesis import strategies as st

Array = npt.NDArray[np.float64]
Draw = Callable[[st.SearchStrategy[Any]], Any]


def decades(least: float, most: float) -> st.SearchStrategy[float]:
    """Return numbers between two powers of ten, equally likely in each decade."""
    return st.floats(least, most).map(lambda exponent: float(f"{10.0**exponent:.4g}"))


def sometimes(strategy: st.SearchStrategy[Any], otherwise: Any = None) -> st.SearchStrategy[Any]:
    """Return what a strategy draws, or half of the time something else."""
    return st.one_of(st.just(otherwise), strategy)


def vectors(size: float) -> st.SearchStrategy[Array]:
    """Return vectors (3,) with components up to a size."""
    component = st.floats(-1.0, 1.0).map(lambda value: round(value, 3) * size)
    return st.tuples(component, component, component).map(np.array)


@st.composite
def materials(draw: Draw) -> Material:
    """Return materials from very soft to steel."""
    return Material(
        youngs_modulus=draw(decades(2.0, 11.5)),
        poisson_ratio=draw(st.sampled_from([0.5, 0.3, 0.0, -0.5])),
        density=draw(st.sampled_from([1.0, 1000.0, 1260.0, 2e4])),
    )


def straight(count: int, _: np.random.Generator) -> tuple[Array, Array | None]:
    """Return a straight chain of unit edges."""
    return np.arange(count + 1)[:, None] * np.array([1.0, 0.0, 0.0]), None


def helix(count: int, rng: np.random.Generator) -> tuple[Array, Array | None]:
    """Return a helix of edges near unit length."""
    turn = rng.uniform(0.1, 1.2) * np.arange(count + 1)
    return np.stack([0.4 * np.arange(count + 1), np.cos(turn), np.sin(turn)], axis=1), None


def wandering(count: int, rng: np.random.Generator) -> tuple[Array, Array | None]:
    """Return a chain that turns anywhere, with edges of very different lengths."""
    steps = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-1.0, 0.5, (count, 1))
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]), None


def ring(count: int, rng: np.random.Generator) -> tuple[Array, Array | None]:
    """Return a ring, not quite round or flat."""
    count = max(count, 3)
    angle = 2.0 * np.pi * np.arange(count) / count
    nodes = count / 6.0 * np.stack([np.cos(angle), np.sin(angle), 0.1 * rng.normal(size=count)], axis=1)
    return nodes, np.stack([np.arange(count), (np.arange(count) + 1) % count], axis=1)


def tree(count: int, rng: np.random.Generator) -> tuple[Array, Array | None]:
    """Return a tree: each node hangs on one before it."""
    nodes, edges = [np.zeros(3)], []
    for node in range(1, count + 1):
        parent = int(rng.integers(0, node))
        out = rng.normal(size=3)
        nodes.append(nodes[parent] + out / np.linalg.norm(out))
        edges.append([parent, node])
    return np.array(nodes), np.array(edges)


def web(count: int, rng: np.random.Generator) -> tuple[Array, Array | None]:
    """Return a tree with an edge more, which closes a ring where it can."""
    nodes, edges = tree(count, rng)
    assert edges is not None
    a, b = (int(node) for node in rng.integers(0, len(nodes), 2))
    joined = {tuple(sorted(pair)) for pair in edges.tolist()}
    if a != b and tuple(sorted((a, b))) not in joined:
        edges = np.concatenate([edges, [[a, b]]])
    return nodes, edges


SHAPES = (straight, helix, wandering, ring, tree, web)


@st.composite
def rods(draw: Draw, edge: float, place: Array) -> Rod:
    """Return rods of up to eight edges of about a length [m], somewhere near a place (3,) [m]."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    nodes, edges = draw(st.sampled_from(SHAPES))(draw(st.integers(1, 8)), rng)
    nodes = edge * nodes
    count = len(nodes) - 1 if edges is None else len(edges)
    rest = sometimes(st.sampled_from([0.01, 0.1, 0.3]), 0.0)
    strain = draw(rest)
    options: dict[str, Any] = {}
    if strain:
        options["rest_nodes"] = place + nodes + strain * edge * rng.normal(size=nodes.shape)
    if draw(st.booleans()):
        options["theta"] = rng.uniform(-3.0, 3.0, count)
    if draw(st.integers(0, 3)) == 0:
        options["immersed"] = rng.random(count) < 0.7
        options["colliding"] = rng.random(count) < 0.7
    radius = edge * draw(decades(-3.0, -0.7))
    material = draw(materials())
    stiffness = material.youngs_modulus * np.pi / 4.0 * radius**4
    if draw(st.integers(0, 3)) == 0:
        ratio = draw(decades(-2.0, 2.0))
        options["EI"] = stiffness * np.array([[1.0, 0.2 * min(1.0, ratio)], [0.2 * min(1.0, ratio), ratio]])
        options["GJ"] = stiffness * draw(decades(-2.0, 2.0))
    if draw(st.integers(0, 3)) == 0:
        options["natural_curvature"] = rng.normal(size=2)
        options["natural_twist"] = float(rng.normal())
    return Rod(nodes=place + nodes, edges=edges, radius=radius, material=material, **options)


def signals(rate: float) -> st.SearchStrategy[Any]:
    """Return numbers and tables up to a rate; steps, pulses and reversals among them."""
    numbers = st.sampled_from([0.0, rate, -rate])
    times = st.just([0.0, 0.5 / rate, 0.5 / rate * (1.0 + 1e-6), 2.0 / rate])
    tables = st.tuples(times, st.lists(st.sampled_from([0.0, rate, -rate]), min_size=4, max_size=4))
    return st.one_of(numbers, tables.map(lambda pair: Table(times=pair[0], values=pair[1])))


def hinge_nodes(rod: Rod) -> list[int]:
    """Return the nodes at which exactly one hinge sits."""
    nodes, counts = np.unique(rod.hinge_nodes(), return_counts=True)
    return [int(node) for node in nodes[counts == 1]]


@st.composite
def scenes(draw: Draw, fluid: bool = False, free: bool = False, quiet: bool = False) -> Scene:
    """Return scenes of one to three rods.

    Parameters
    ----------
    fluid
        Whether there always is one that resists, with all edges immersed.
    free
        Whether nothing holds the rods: no clamps.
    quiet
        Whether there is no contact and nothing that jumps.
    """
    edge = draw(decades(-5.0, 0.0))
    spacing = draw(st.sampled_from([3.0, 10.0, 100.0])) * edge
    some = [draw(rods(edge, spacing * np.array([0.3, 1.0, 0.7]) * k)) for k in range(draw(st.integers(1, 3)))]
    if fluid:
        some = [rod.replace(immersed=True) for rod in some]
    viscosity = draw(decades(-4.0, 2.0))
    force = max(rod.material.youngs_modulus * float(np.max(rod.radius)) ** 4 / edge**2 for rod in some)
    # The rate at which rods of this stiffness relax, so that what drives them is neither nothing nor all.
    rate = float(f"{force / (viscosity * edge**2):.3g}")
    parts: dict[str, Any] = {"rods": some}
    models = ["RSS", "RFT"] if fluid else ["RSS", "RSS", "RSS", "RFT", "RFT", "none"]
    if fluid or draw(st.integers(0, 9)):
        parts["fluid"] = Fluid(
            viscosity=viscosity,
            model=draw(st.sampled_from(models)),
            epsilon=draw(sometimes(decades(-2.0, 0.5).map(lambda ratio: ratio * edge), "slender")),
            coefficients=draw(st.sampled_from(["gray-hancock", "lighthill"])),
            twist_drag=draw(st.booleans()),
            far_field_nodes=draw(st.sampled_from([None, None, None, 0])),
            density=draw(st.sampled_from([0.0, 1000.0])),
        )
    parts["gravity"] = draw(sometimes(vectors(9.81), np.zeros(3)))
    which = draw(st.integers(0, len(some) - 1))
    rod = some[which]
    count, last = len(rod.edge_array()), len(rod.nodes) - 1
    if not free and draw(st.booleans()):
        moves = draw(sometimes(vectors(rate * edge), np.zeros(3)))
        turns = draw(signals(rate))
        parts["clamps"] = Clamp(
            rod=which,
            nodes=draw(st.sampled_from([(0,), (0, 1), (last,), tuple(range(last + 1))])),
            edges=(0,),
            velocity=moves,
            angular_velocity=turns,
        )
    places = hinge_nodes(rod)
    if places and draw(st.booleans()):
        node = draw(st.sampled_from(places))
        hinge = int(np.flatnonzero(rod.hinge_nodes() == node)[0])
        drive = draw(st.sampled_from(["speed", "torque"]))
        size = rate if drive == "speed" else force * edge
        parts["motors"] = Motor(
            rod=which,
            node=node,
            shaft=int(rod.hinge_array()[hinge, draw(st.integers(0, 1))]),
            **{drive: size if quiet else draw(signals(size))},
        )
    if draw(st.booleans()):
        parts["loads"] = PointLoad(rod=which, node=draw(st.integers(0, last)), force=draw(vectors(force)))
    if count >= 2 and rod.edges is None and not free and draw(st.integers(0, 3)) == 0:
        parts["head"] = Head(
            rod=which,
            node=draw(st.integers(1, last - 1)),
            radius=edge * draw(decades(-1.0, 0.5)),
            C_t=draw(st.sampled_from([0.0, 1.0, 4.0])),
            C_r=draw(st.sampled_from([0.0, 1.0, 0.2])),
            mass=draw(st.sampled_from([0.0, 1e-3])),
        )
    if not quiet and draw(st.booleans()):
        method = draw(st.sampled_from(["barrier", "barrier", "spillmann-teschner"]))
        friction = draw(st.sampled_from([0.0, 0.3, 2.0])) if method == "barrier" else 0.0
        parts["contact"] = Contact(
            method=method, friction=friction, tolerance=draw(st.sampled_from([None, 1e-2, 0.3]))
        )
    # Without contact rods may end up behind a wall, from where nothing goes on but an error.
    kept_apart = "contact" in parts and parts["contact"].method == "barrier"
    if kept_apart and not free and draw(st.integers(0, 3)) == 0:
        parts["walls"] = draw(floors(edge, some))
    return Scene(**parts)


@st.composite
def driven_scenes(draw: Draw) -> Scene:
    """Return scenes with more of what drives from outside: loads, magnets, flows, clamps that turn."""
    scene: Scene = draw(scenes(fluid=True, free=True))
    rod = scene.rods[0]
    edge = float(rod.rest_lengths().mean())
    fluid = scene.fluid
    assert fluid is not None
    force = rod.material.youngs_modulus * float(np.max(rod.radius)) ** 4 / edge**2
    rate = force / (fluid.viscosity * edge**2)
    frame = draw(st.sampled_from(["laboratory", "material"]))
    flow = draw(
        st.sampled_from([LinearFlow.shear(rate=rate), PoiseuilleFlow(speed=rate * edge, radius=3.0 * edge)])
    )
    turning = Rotation(axis=draw(vectors(1.0).filter(lambda axis: axis.any())), rate=draw(signals(rate)))
    loads: list[Any] = [LineLoad(force=draw(vectors(force / edge)), frame=frame)]
    if len(rod.nodes) == len(rod.edge_array()) + 1 and rod.edges is None:
        loads.append(PointLoad(edge=0, torque=draw(vectors(force * edge)), frame=frame))
    moment = math.pi * float(np.max(rod.radius)) ** 2 * edge
    return scene.replace(
        rods=(rod.replace(magnetization=np.array([0.0, 0.0, force * edge / moment])), *scene.rods[1:]),
        fluid=fluid.replace(background=(flow,)),
        loads=loads,
        clamps=(Clamp(rod=0, nodes=(0, 1), edges=(0,), rotation=turning),) if draw(st.booleans()) else (),
        magnetic_field=MagneticField(field=draw(vectors(1.0))),
        head=None,
        motors=(),
    )


@st.composite
def changes(draw: Draw, scene: Scene) -> dict[str, Any]:
    """Return other values for some of what may be set between steps, by path."""
    found: dict[str, Any] = {}
    for place, part in inputs.parts_of(scene).items():
        for name in inputs.CHANGEABLE[type(part)]:
            value = getattr(part, name)
            if draw(st.booleans()) and isinstance(value, float | np.ndarray):
                found[f"{place}.{name}"] = -0.5 * value
    return found


@st.composite
def floors(draw: Draw, edge: float, some: list[Rod]) -> Wall:
    """Return walls of every kind below rods of edges of about a length [m]."""
    normal = draw(st.sampled_from([(0.0, 0.0, 1.0), (1.0, -2.0, 2.0)]))
    wall = Wall(normal=normal, kind=draw(st.sampled_from(["no_slip", "free_surface", "contact"])))
    lowest = min(float(wall.heights(rod.nodes).min()) for rod in some)
    return wall.replace(point=wall.normal * (lowest - edge * draw(decades(-0.5, 1.0))))


@st.composite
def settings(draw: Draw) -> dict[str, Any]:
    """Return ways of running: schemes, steps of the default length times a factor, tolerances."""
    scheme = draw(st.sampled_from(["overdamped", "overdamped", "implicit", "explicit"]))
    if scheme != "explicit" and draw(st.booleans()):
        return {"scheme": scheme, "rtol": draw(st.sampled_from([1e-1, 1e-2, 1e-3, 1e-5, 1e-8]))}
    return {"scheme": scheme, "factor": draw(st.sampled_from([1.0, 1e-3, 10.0, 100.0]))}
