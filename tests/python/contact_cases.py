"""Scenes in which rods touch, with what theory says of them; shared by tests and the validation page."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from flagrs import Clamp, Contact, Fluid, PointLoad, Rod, Scene, Simulation, Table
from flagrs.contact import segment_distance
from flagrs.validation.problems.friction import Capstan, incline_velocity
from flagrs.validation.touching import GRAVITY, SILICONE, contact_forces, drag, held, unrolled, weight
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

__all__ = [
    "Capstan",
    "contact_forces",
    "drag",
    "held",
    "incline_velocity",
    "weight",
]

Array = npt.NDArray[np.float64]


def radii(scene: Scene) -> Array:
    """Return the radius (E,) of every edge [m]."""
    return np.concatenate([rod.radius_array() for rod in scene.rods])


def pairs_apart(scene: Scene) -> npt.NDArray[np.int64]:
    """Return all pairs (P, 2) of edges of chains that may touch, found without the library's own search."""
    chains, starts = [], []
    for index, rod in enumerate(scene.rods):
        ends = np.concatenate([[0.0], np.cumsum(rod.rest_lengths())])
        chains.append(np.full(len(ends) - 1, index))
        starts.append(np.stack([ends[:-1], ends[1:]], axis=1))
    chain, span, radius = np.concatenate(chains), np.concatenate(starts), radii(scene)
    a, b = np.triu_indices(len(chain), 1)
    along = span[b, 0] - span[a, 1]
    apart = (chain[a] != chain[b]) | (along >= np.pi / 2.0 * (radius[a] + radius[b]))
    return np.stack([a[apart], b[apart]], axis=1)


class Watch:
    """Measures how close edges come, pair by pair."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.edges = simulation.edges
        self.pairs = pairs_apart(simulation.scene)
        self.thickness = radii(simulation.scene)[self.pairs].sum(axis=1)
        self.least = np.inf

    def closest(self) -> float:
        """Return the smallest distance over the sum of radii, and remember it."""
        x = self.simulation.nodes
        (a, b) = self.edges[self.pairs[:, 0]], self.edges[self.pairs[:, 1]]
        distance = segment_distance(x[a[:, 0]], x[a[:, 1]], x[b[:, 0]], x[b[:, 1]])[0]
        now = float((distance / self.thickness).min())
        self.least = min(self.least, now)
        return now


def even(path: Array, edge_count: int) -> Array:
    """Return nodes (edge_count + 1, 3) at equal distances along a path (K, 3) [m]."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    places = np.linspace(0.0, along[-1], edge_count + 1)
    return np.stack([np.interp(places, along, path[:, c]) for c in range(3)], axis=1)


# --- a trefoil knot ----------------------------------------------------------------------------------------


class Knot:
    """A rod in an open trefoil knot, pulled at both ends."""

    RADIUS = 1e-3

    def __init__(
        self, loop: float = 0.03, edge_count: int = 120, friction: float = 0.0, speed: float = 1e-2
    ) -> None:
        t = np.linspace(-2.25, 2.25, 4001)
        path = loop / 3.0 * np.stack([t**3 - 3 * t, 0.55 * (t**4 - 4 * t**2), (t**5 - 10 * t) / 6], axis=1)
        self.along = (path[-1] - path[0]) / np.linalg.norm(path[-1] - path[0])
        tail = np.linspace(0.0, 0.06, 400)[1:, None] * self.along
        nodes = even(np.concatenate([(path[0] - tail)[::-1], path, path[-1] + tail]), edge_count)
        rod = Rod(nodes=nodes, rest_nodes=unrolled(nodes), radius=self.RADIUS, material=SILICONE)
        self.length, self.bending = float(rod.rest_lengths().sum()), float(rod.EI_array()[0, 0, 0])
        ends = ((0, 1), (edge_count - 1, edge_count))
        pulls = (-0.5 * speed * self.along, 0.5 * speed * self.along)
        clamps = tuple(Clamp(nodes=nodes, velocity=pull) for nodes, pull in zip(ends, pulls, strict=True))
        # Of the force per length of a rod bent to ten radii, as the tight knot is, over the barrier's range.
        stiffness = self.bending / (10.0 * self.RADIUS) ** 3 / (0.1 * 2.0 * self.RADIUS)
        contact = Contact(friction=friction, slip_velocity=1e-3 * speed, stiffness=stiffness)
        fluid = Fluid(viscosity=1e-3, model="RFT")
        self.scene = Scene(rods=(rod,), fluid=fluid, clamps=clamps, contact=contact)
        self.simulation = Simulation(self.scene, dt=1e-4 / speed, threads=1)
        self.watch = Watch(self.simulation)

    def force(self) -> float:
        """Return the pull on the ends [N]."""
        gradient, at = self.simulation.gradient(), self.simulation.dof_of_node
        last = len(at) - 1
        here = sum(gradient[at[node] : at[node] + 3] for node in (last - 1, last))
        there = sum(gradient[at[node] : at[node] + 3] for node in (0, 1))
        return float(0.5 * (here - there) @ self.along)

    def shortening(self) -> float:
        """Return the rod's length less the distance of its ends [m]."""
        nodes = self.simulation.nodes
        return self.length - float(np.linalg.norm(nodes[-1] - nodes[0]))

    def curvature(self) -> Array:
        """Return the curvature (N - 2,) at the inner nodes [1/m]."""
        edges = np.diff(self.simulation.nodes, axis=0)
        lengths = np.linalg.norm(edges, axis=1)
        tangents = edges / lengths[:, None]
        cosine = np.clip((tangents[1:] * tangents[:-1]).sum(axis=1), -1.0, 1.0)
        turn: Array = np.arccos(cosine) / (0.5 * (lengths[1:] + lengths[:-1]))
        return turn

    def loop_radius(self) -> float:
        """Return the radius of curvature at the top of the loop [m]."""
        middle = len(self.simulation.nodes) // 2
        return 1.0 / float(self.curvature()[middle - 3 : middle + 2].mean())


# --- a plectoneme ------------------------------------------------------------------------------------------


class Plectoneme:
    """A slack rod held at both ends, one of which turns until the rod wraps around itself."""

    def __init__(
        self, edge_count: int = 250, turns: int = 16, length: float = 0.8, slack: float = 0.35
    ) -> None:
        path = np.linspace(0.0, 1.0, 4001)

        def arch(height: float) -> Array:
            rise, lean = np.sin(np.pi * path) ** 2, 0.15 * np.sin(2.0 * np.pi * path)
            return np.stack([path * length * (1.0 - slack), height * rise, height * lean], axis=1)

        def excess(height: float) -> float:
            return float(np.linalg.norm(np.diff(arch(height), axis=0), axis=1).sum()) - length

        nodes = even(arch(float(brentq(excess, 0.0, length))), edge_count)
        nodes[1, 1:], nodes[-2, 1:] = nodes[0, 1:], nodes[-1, 1:]
        rod = Rod(nodes=nodes, rest_nodes=unrolled(nodes), radius=1e-3, material=SILICONE)
        self.turns, self.rod = turns, rod
        hold = Table(times=[0.0, turns, turns + 0.01], values=[2.0 * np.pi, 2.0 * np.pi, 0.0])
        last = edge_count - 1
        self.scene = Scene(
            rods=(rod,),
            fluid=Fluid(viscosity=1.0, model="RFT", twist_drag=False),
            clamps=(
                Clamp(nodes=(0, 1), edges=(0,)),
                Clamp(nodes=(last, last + 1), edges=(last,), angular_velocity=hold),
            ),
            # Under the pressure in the ply its strands are then a diameter apart, as theory has them.
            contact=Contact(stiffness=1.7e3),
        )
        self.simulation = Simulation(self.scene, dt=0.02, threads=1)
        self.watch = Watch(self.simulation)

    def wind(self) -> None:
        """Turn the end, then wait until nothing moves."""
        simulation = self.simulation
        while simulation.time < self.turns + 300.0:
            if simulation.time > self.turns:
                simulation.dt = min(1.1 * simulation.dt, 10.0)
            simulation.step(10)
            self.watch.closest()

    def measured(self) -> dict[str, float]:
        """Return tension [N], torque [N m], and ply angle [rad], radius [m] and pressure [N/m] of the ply."""
        simulation, x = self.simulation, self.simulation.nodes
        gradient, at = simulation.gradient(), simulation.dof_of_node
        length, twisting = self.rod.rest_lengths().sum(), float(self.rod.GJ_array()[0])
        pairs, _, sizes = contact_forces(simulation)
        edges = np.diff(x, axis=0)
        lengths = np.linalg.norm(edges, axis=1)
        first, last = np.percentile(pairs[:, 0], [25, 75])
        inner = (pairs[:, 0] >= first) & (pairs[:, 0] <= last)
        strand = np.unique(pairs[inner, 0])
        angles, half = [], []
        for a in strand:
            others = np.arange(a + 8, len(edges))
            middle = np.tile(0.5 * (x[a] + x[a + 1]), (len(others), 1))
            distance = segment_distance(middle, middle + 1e-9 * edges[a], x[others], x[others + 1])[0]
            b = others[int(np.argmin(distance))]
            half.append(distance.min() / 2.0)
            angles.append(0.5 * np.arccos(-edges[a] @ edges[b] / (lengths[a] * lengths[b])))
        return {
            "tension": -float(sum(gradient[at[node]] for node in (0, 1))),
            "torque": float(np.sqrt(2.0 * twisting * simulation.energy()["twisting"] / length)),
            "angle": float(np.mean(angles)),
            "spread": float(np.std(angles)),
            "radius": float(np.mean(half)),
            "pressure": float(sizes[inner].sum() / lengths[strand[0] : strand[-1] + 1].sum()),
        }

    def theory(self, torque: float, radius: float) -> dict[str, float]:
        """Return ply angle, tension and pressure of a uniform ply with this torque and radius.

        They make the energy of bending and twist least at a given rotation of the ends (Clauvelin, Audoly and
        Neukirch 2008; Thompson, van der Heijden and Neukirch 2002 for the pressure).
        """
        bending = float(self.rod.EI_array()[0, 0, 0])

        def excess(a: float) -> float:
            return float(2.0 * bending * np.sin(a) ** 3 * np.cos(a) / (radius * np.cos(2.0 * a)) - torque)

        angle = float(brentq(excess, 1e-3, 0.78))
        fourth, double = np.sin(angle) ** 4, np.cos(2.0 * angle)
        return {
            "angle": angle,
            "tension": float(bending * fourth / radius**2 * (0.5 + 1.0 / double)),
            "pressure": float(bending * fourth / (radius**3 * double)),
        }


# --- a heap, pressed rods, crossing rods, rings ------------------------------------------------------------


def heap(count: int = 10, friction: float = 0.0, seed: int = 1) -> Scene:
    """Return rods above a trough of fixed rails, which they fall into."""
    rng = np.random.default_rng(seed)
    side = [
        (9.0, 0.0),
        (18.0, 0.0),
        (21.3, 1.2),
        (23.5, 4.0),
        (24.5, 7.3),
        (25.0, 10.7),
        (25.3, 14.1),
        (25.5, 17.5),
    ]
    places = [(0.0, 0.0), *((sign * 1e-3 * y, 1e-3 * z) for sign in (1.0, -1.0) for y, z in side)]
    rails = [
        Rod.straight(length=0.02, edge_count=4, radius=1e-3, material=SILICONE, start=(-0.01, y, z))
        for y, z in places
    ]
    rails += [
        Rod.straight(
            length=0.06,
            edge_count=4,
            radius=1e-3,
            material=SILICONE,
            start=(x, -0.03, z),
            direction=(0.0, 1.0, 0.0),
        )
        for x in (-0.0135, 0.0135)
        for z in np.arange(0.003, 0.03, 0.003)
    ]
    rods = []
    for k in range(count):
        yaw = rng.uniform(-0.25, 0.25)
        direction = np.array([np.sin(yaw), np.cos(yaw), 0.0])
        middle = np.array([rng.uniform(-0.004, 0.004), rng.uniform(-0.002, 0.002), 0.014 + 0.004 * k])
        start = tuple(middle - 0.018 * direction)
        rods.append(
            Rod.straight(
                length=0.036,
                edge_count=6,
                radius=1e-3,
                material=SILICONE,
                start=start,
                direction=tuple(direction),
            )
        )
    return Scene(
        rods=(*rods, *rails),
        fluid=Fluid(viscosity=1.0, model="RFT", density=0.0),
        clamps=tuple(held(count + k, 4) for k in range(len(rails))),
        contact=Contact(friction=friction),
        gravity=np.array([0.0, 0.0, -GRAVITY]),
    )


def settled_heap(scene: Scene) -> tuple[Simulation, Watch]:
    """Return the heap after 30 s, at rest, and what was watched at every step."""
    simulation = Simulation(scene, dt=2e-3, threads=1)
    watch = Watch(simulation)
    while simulation.time < 30.0:
        simulation.step()
        if simulation.time > 1.0:
            simulation.dt = min(1.05 * simulation.dt, 0.5)
        watch.closest()
    return simulation, watch


def pressed(scale: float = 1.0, radius: float = 1e-3, viscosity: float = 0.1) -> Scene:
    """Return a rod held at one end whose other end a force presses across a rod that is held at both ends."""
    gap = scale * (1e-3 + radius) * 1.2
    below = Rod.straight(
        length=0.06 * scale,
        edge_count=7,
        radius=1e-3 * scale,
        material=SILICONE,
        start=(-0.027 * scale, 0.0, 0.0),
    )
    direction = np.array([0.6, 0.8, 0.0])
    above = Rod.straight(
        length=0.05 * scale,
        edge_count=6,
        radius=radius * scale,
        material=SILICONE,
        start=tuple(-0.0273 * scale * direction + np.array([0.0, 0.0, gap])),
        direction=tuple(direction),
    )
    return Scene(
        rods=(below, above),
        fluid=Fluid(viscosity=viscosity, model="RFT"),
        clamps=(Clamp(nodes=(0, 1, 6, 7), edges=(0, 6)), Clamp(rod=1, nodes=(0, 1), edges=(0,))),
        loads=(PointLoad(rod=1, node=6, force=np.array([0.0, 0.0, -1e-3]) * scale**2),),
        contact=Contact(),
    )


def crossing(speed: float, angle: float) -> Scene:
    """Return two rods held at their ends, the upper one driven straight through the lower one."""
    direction = np.array([np.cos(angle), np.sin(angle), 0.0])
    below = Rod.straight(length=0.1, edge_count=5, radius=1e-3, material=SILICONE, start=(-0.05, 0.0, 0.0))
    above = Rod.straight(
        length=0.1,
        edge_count=5,
        radius=1e-3,
        material=SILICONE,
        start=tuple(np.array([0.0, 0.0, 0.01]) - 0.05 * direction),
        direction=tuple(direction),
    )
    return Scene(
        rods=(below, above),
        fluid=Fluid(viscosity=1.0, model="RFT"),
        clamps=(Clamp(nodes=(0, 5)), Clamp(rod=1, nodes=(0, 5), velocity=np.array([0.0, 0.0, -speed]))),
        contact=Contact(),
    )


RING_EDGES = 16


def ring_pairs(count: int, seed: int, load: float) -> Scene:
    """Return pairs of rings in random places, some linked, that are pulled through each other.

    A ring has no end to slip off: whether two are linked cannot change unless one passes through the other.
    """
    rng = np.random.default_rng(seed)
    angle = 2.0 * np.pi * np.arange(RING_EDGES) / RING_EDGES
    flat = 0.02 * np.stack([np.cos(angle), np.sin(angle), np.zeros(RING_EDGES)], axis=1)
    edges = np.stack([np.arange(RING_EDGES), np.roll(np.arange(RING_EDGES), -1)], axis=1)
    rods, loads = [], []
    while len(rods) < 2 * count:
        turned = [flat @ Rotation.random(random_state=rng).as_matrix().T for _ in range(2)]
        offset = rng.uniform(-0.03, 0.03, 3)
        pair = [turned[0], turned[1] + offset]
        a, b = np.repeat(edges, RING_EDGES, axis=0), np.tile(edges, (RING_EDGES, 1))
        near = segment_distance(pair[0][a[:, 0]], pair[0][a[:, 1]], pair[1][b[:, 0]], pair[1][b[:, 1]])[0]
        if near.min() < 2.2e-3:
            continue
        middle = np.array([0.5 * (len(rods) // 2), 0.0, 0.0])
        for ring, sign in zip(pair, (1.0, -1.0), strict=True):
            force = sign * load * offset / np.linalg.norm(offset)
            # Towards each other, so that they meet, and on, so that they would pass.
            loads += [PointLoad(rod=len(rods), node=node, force=force) for node in range(0, RING_EDGES, 2)]
            rods.append(Rod(nodes=ring + middle, edges=edges, radius=1e-3, material=SILICONE))
    return Scene(
        rods=tuple(rods), fluid=Fluid(viscosity=1.0, model="RFT"), loads=tuple(loads), contact=Contact()
    )


def linking_numbers(nodes: Array) -> Array:
    """Return the linking numbers (P,) of pairs of rings, nodes (2 P * RING_EDGES, 3), by Gauss's integral."""
    rings = nodes.reshape(-1, 2, RING_EDGES, 3)
    nexts = np.roll(rings, -1, axis=2)
    corners = [
        rings[:, 0, :, None] - rings[:, 1, None],
        rings[:, 0, :, None] - nexts[:, 1, None],
        nexts[:, 0, :, None] - nexts[:, 1, None],
        nexts[:, 0, :, None] - rings[:, 1, None],
    ]
    unit = [corner / np.linalg.norm(corner, axis=-1, keepdims=True) for corner in corners]

    def solid_angle(a: Array, b: Array, c: Array) -> Array:
        triple = (a * np.cross(b, c)).sum(axis=-1)
        angle: Array = 2.0 * np.arctan2(triple, 1.0 + (a * b).sum(-1) + (b * c).sum(-1) + (c * a).sum(-1))
        return angle

    total = solid_angle(unit[0], unit[1], unit[2]) + solid_angle(unit[0], unit[2], unit[3])
    linked: Array = total.sum(axis=(1, 2)) / (4.0 * np.pi)
    return linked
