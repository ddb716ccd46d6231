"""What a scene asks of the machine: sizes, active terms, memory, cost of a step, and what to beware of."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flagrs.memory import in_words
from flagrs.scene.plausibility import Scales, implausible, scales_of
from flagrs.scene.values import FloatArray
from flagrs.scene.wall_checks import wall_in_flow
from flagrs.step_choice import DEFAULT_RTOL

if TYPE_CHECKING:
    from flagrs.scene.scene import Scene
    from flagrs.scene.wall import Wall

#: Floating-point operations of one 3x6 pair of Stokeslet blocks (about 25 ns at 8 flop/ns).
PAIR_FLOPS = 200
#: Operations of one hinge's and one edge's energy gradient and Hessian, and of its share of the sparse solve.
HINGE_FLOPS = 6000
#: Operations of the fluid's products in a step per node, without a matrix: some thirty of about 10 us.
FAST_FLOPS = 2.4e6
#: Memory of a node's share of matrices, factors and histories, measured; vectors that GMRES keeps.
NODE_BYTES = 20_000
KRYLOV_VECTORS = 241
#: Newton iterations of a typical step, and products with the fluid matrix in each.
NEWTON_ITERATIONS = 2
PRODUCTS = 8


@dataclass(frozen=True)
class Plan:
    """What is simulated, what is left out, and what a step costs.

    Attributes
    ----------
    nodes, edges, hinges : int
        Size of the network.
    immersed_nodes : int
        Nodes on which the fluid acts.
    dofs : int
        Degrees of freedom: 3 per node, 1 per edge, 1 more per torque-driven motor.
    terms : tuple of str
        The active terms, in words.
    left_out : tuple of str
        Terms the scene does not have, which cost nothing.
    fluid_matrix : int
        Rows of the dense fluid matrix; 0 without one.
    far_field_error : float or None
        Relative error of fluid products made without a matrix; None where there are none.
    scales : Scales
        Extent, slenderness, Reynolds and sperm number.
    flops : float
        Estimated floating-point operations of a step, to a factor of two or three.
    warnings : tuple of str
        What may spoil the result, with numbers.
    """

    nodes: int
    edges: int
    hinges: int
    immersed_nodes: int
    dofs: int
    terms: tuple[str, ...]
    left_out: tuple[str, ...]
    fluid_matrix: int
    far_field_error: float | None
    scales: Scales
    flops: float
    warnings: tuple[str, ...]

    @property
    def fluid_bytes(self) -> int:
        """Memory of the dense fluid matrix [bytes]."""
        return 8 * self.fluid_matrix**2

    @property
    def memory(self) -> float:
        """Memory of a simulation [bytes], to a factor of two.

        The dense fluid matrix in double and single precision, the vectors of the Krylov method, and some
        `NODE_BYTES` a node for everything sparse.
        """
        vectors = (
            8.0
            * KRYLOV_VECTORS
            * (3 * self.immersed_nodes if self.fluid_matrix or self.far_field_error else 0)
        )
        return 1.5 * self.fluid_bytes + vectors + NODE_BYTES * self.nodes

    def _repr_html_(self) -> str:
        """Show it in a notebook."""
        from flagrs.notebook import plan_html  # it reads plans, so it is above this module

        return plan_html(self)

    def __str__(self) -> str:
        """Return the plan for a person to read."""
        lines = [
            f"{self.nodes} nodes, {self.edges} edges, {self.hinges} hinges: {self.dofs} degrees of freedom",
            "active:   " + "\n          ".join(self.terms),
            "left out: " + (", ".join(self.left_out) or "nothing"),
        ]
        if self.fluid_matrix:
            lines.append(
                f"fluid:    dense {self.fluid_matrix} x {self.fluid_matrix}, {in_words(self.fluid_bytes)}"
            )
        elif self.far_field_error is not None:
            lines.append(
                f"fluid:    products to {self.far_field_error:g} by fast multipoles, without a matrix"
            )
        lines.append(f"scales:   {self.scales}")
        lines.append(f"memory:   about {in_words(self.memory)}")
        lines.append(f"a step:   about {self.flops / 1e6:.3g} million floating-point operations")
        lines.append(f"steps:    adaptive, to rtol = {DEFAULT_RTOL:g}, unless dt or another rtol is given")
        return "\n".join([*lines, *(f"warning:  {warning}" for warning in self.warnings)])


def plan_of(scene: Scene) -> Plan:
    """Return the plan of a scene."""
    torque_motors = sum(motor.drive == "torque" for motor in scene.motors)
    immersed = _immersed_nodes(scene)
    fluid_model = "none" if scene.fluid is None else scene.fluid.model
    fast = scene.fluid is not None and fluid_model == "RSS" and immersed >= scene.fluid.crossover
    fast = fast and wall_in_flow(scene) is None
    dense = 3 * immersed if fluid_model == "RSS" and not fast else 0
    present, absent = _terms(scene)
    scales = scales_of(scene)
    return Plan(
        nodes=scene.node_count,
        edges=scene.edge_count,
        hinges=scene.hinge_count,
        immersed_nodes=immersed,
        dofs=3 * scene.node_count + scene.edge_count + torque_motors,
        terms=tuple(present),
        left_out=tuple(absent),
        fluid_matrix=dense,
        far_field_error=scene.fluid.far_field_error if scene.fluid is not None and fast else None,
        flops=_flops(scene, dense) + (FAST_FLOPS * immersed if fast else 0.0),
        scales=scales,
        warnings=(*_warnings(scene), *implausible(scene, scales)),
    )


def _immersed_nodes(scene: Scene) -> int:
    return sum(len(np.unique(rod.edge_array()[rod.immersed_array()])) for rod in scene.rods)


def _flops(scene: Scene, dense: int) -> float:
    elastic = NEWTON_ITERATIONS * HINGE_FLOPS * (scene.hinge_count + scene.edge_count)
    immersed_edges = sum(int(rod.immersed_array().sum()) for rod in scene.rods)
    assembly = PAIR_FLOPS * (dense / 3) * immersed_edges if dense else 0.0
    return float(elastic + assembly + NEWTON_ITERATIONS * PRODUCTS * 2.0 * dense**2)


def _terms(scene: Scene) -> tuple[list[str], list[str]]:
    """Return the active terms and the missing ones, in words."""
    fluid = scene.fluid
    flows = fluid is not None and fluid.model != "none"
    heavy = bool(scene.gravity.any())
    magnetic = any(rod.magnetization is not None for rod in scene.rods)
    turned = [motor.drive for motor in scene.motors]
    words = {
        "fluid": f"{fluid.model} fluid, viscosity {fluid.viscosity:g} Pa s" if fluid and flows else "",
        "twist drag": "twist drag" if fluid and flows and fluid.twist_drag else "",
        "head": f"head at node {scene.head.node} of rod {scene.head.rod}" if scene.head else "",
        "motors": f"{turned.count('speed')} speed and {turned.count('torque')} torque motors"
        if turned
        else "",
        "clamps": f"{len(scene.clamps)} clamps" if scene.clamps else "",
        "loads": f"{len(scene.loads)} loads" if scene.loads else "",
        "magnetism": "magnetism" if scene.magnetic_field and magnetic else "",
        "background flow": f"{len(fluid.background)} background flows" if fluid and fluid.background else "",
        "walls": ", ".join(_words(wall) for wall in scene.walls),
        "contact": f"contact ({scene.contact.method})" if scene.contact else "",
        "gravity": f"gravity {np.linalg.norm(scene.gravity):g} m/s^2" if heavy else "",
        "buoyancy": "buoyancy" if heavy and fluid and fluid.density_for_buoyancy > 0.0 else "",
    }
    elastic = "stretching, bending, twisting" if scene.hinge_count else "stretching"
    return [elastic, *filter(None, words.values())], [term for term, text in words.items() if not text]


def _words(wall: Wall) -> str:
    kind = {"no_slip": "no-slip wall", "free_surface": "free surface", "contact": "wall for contact alone"}
    x, y, z = wall.point
    return f"{kind[wall.kind]} through ({x:g}, {y:g}, {z:g}) m"


#: Edge length over regularization below which the force density at the ends changes sign, and from which it
#: is smooth (docs/validation/fluid.md); the condition number grows as 10 exp(pi epsilon / |e|).
SHORT_EDGE = 1.3
CURED_EDGE = 1.5


def _warnings(scene: Scene) -> list[str]:
    found = []
    fluid = scene.fluid
    if fluid is not None and fluid.model == "RSS":
        for number, rod in enumerate(scene.rods):
            ratio = rod.rest_lengths() / fluid.epsilon_array(rod.radius_array())
            found += _conditioning(number, ratio[rod.immersed_array()])
    if scene.head is not None and fluid is None:
        found.append("the head feels no drag, because the scene has no fluid")
    if scene.walls and scene.contact is None:
        found.append("nothing keeps rods from walls, because the scene has no contact: they may pass through")
    return found


def _conditioning(rod: int, ratio: FloatArray) -> list[str]:
    """Return the warning for edges too short for the regularization, where the force density oscillates."""
    short = int((ratio < SHORT_EDGE).sum())
    if short == 0:
        return []
    least = float(ratio.min())
    condition = 10.0 * math.exp(min(math.pi / least, 300.0))
    return [
        f"rods[{rod}]: {short} immersed edges are shorter than {SHORT_EDGE:g} times the regularization "
        f"(down to {least:.2g} of it): the fluid matrix is ill-conditioned (condition number about "
        f"{condition:.0e}) and the force density oscillates; use edges of at least {CURED_EDGE:g} epsilon, "
        "or a smaller epsilon"
    ]
