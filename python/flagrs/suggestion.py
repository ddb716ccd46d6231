"""Settings for a scene and the error that is wanted, from what each source of error is worth in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flagrs.assemble import rest_lengths_of
from flagrs.errors import not_allowed
from flagrs.scene import Fluid, Scene
from flagrs.scene.plan import CURED_EDGE
from flagrs.scene.scene import check_scene
from flagrs.scene.shapes import number
from flagrs.scene.values import Bounds
from flagrs.stiff_filaments import Body, immersed_body, rft_response, rss_response

#: Error of a run over the relative error its steps keep to, at most: 4.9, of four problems from 1e-2 to 1e-6
#: (docs/performance.md, "rtol holds").
ACHIEVED_OVER_ASKED = 5.0

#: Immersed nodes up to which a scene is judged, by dense matrices of twice as many.
MOST_NODES = 2000

#: Part of the error that the mesh may be worth; time steps get the other half.
MESH_SHARE = 0.5


@dataclass(frozen=True)
class Suggestion:
    """Settings that keep the error of a scene below the one asked for, and what they cannot cure.

    Attributes
    ----------
    error : float
        The relative error asked for.
    rtol : float
        For `Simulation(scene, rtol=...)`.
    edge_length : float
        For the builder of the scene: mean length of immersed edges that makes the mesh's error small enough
        [m].
    errors : dict
        What each source of error is worth in the scene as it is, relative: ``time step`` with the suggested
        `rtol`, ``mesh``, ``regularization`` (Lim et al.'s against that of slender-body
        theory), ``fluid model`` (resistive force theory against nonlocal drag).
    dominant : str
        The largest of them.
    notes : tuple of str
        What to do or to beware of.
    """

    error: float
    rtol: float
    edge_length: float
    errors: dict[str, float]
    dominant: str
    notes: tuple[str, ...]

    def __str__(self) -> str:
        """Return the suggestion for a person to read."""
        lines = [
            f"for a relative error of {self.error:.1g}:",
            f"  rtol = {self.rtol:.1e}, immersed edges of {1e3 * self.edge_length:.3g} mm",
            "what each source of error is worth in the scene as it is:",
        ]
        for name, worth in sorted(self.errors.items(), key=lambda item: -item[1]):
            lines.append(f"  {name:<15} {100.0 * worth:8.2g} %")
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])


def suggest(scene: Scene, error: float = 1e-2) -> Suggestion:
    """Return settings with which a scene is simulated to a relative error.

    Time steps are judged by the study of docs/performance.md, everything else on the scene itself: drag of
    its immersed part at rest, and torque and thrust as its filaments turn about their own axes, are computed
    with the edges as they are and halved, with either regularization and with either fluid model. Their
    errors are what errors of speeds and torques come from; blunt ends make that of the mesh first order in
    the edge. What bends or is attached elsewhere on another mesh is not seen: repeat a result that matters on
    a second mesh.

    Parameters
    ----------
    scene
        The scene.
    error
        Relative error wanted of positions, speeds and torques, 1e-6 to 0.3.

    Raises
    ------
    SceneError
        If the error is out of range, or the scene too large.

    Examples
    --------
    >>> import flagrs
    >>> found = flagrs.suggest(flagrs.scenarios.robot(), error=0.05)
    >>> found.dominant
    'fluid model'
    """
    check_scene(scene)
    wanted = number("error", error, Bounds("1", at_least=1e-6, at_most=0.3))
    rtol = float(np.clip((1.0 - MESH_SHARE) * wanted / ACHIEVED_OVER_ASKED, 1e-8, 0.1))
    errors = {"time step": ACHIEVED_OVER_ASKED * rtol}
    fluid, body = scene.fluid, immersed_body(scene)
    if len(body.nodes) > MOST_NODES:
        raise not_allowed(
            "scene", f"{len(body.nodes)} immersed nodes", f"at most {MOST_NODES}: judge a part of it"
        )
    if fluid is None or fluid.model == "none" or len(body.edges) == 0:
        length = float(np.mean(rest_lengths_of(scene)))
        return Suggestion(
            wanted, rtol, length, errors, "time step", ("there is no fluid to judge the mesh by",)
        )
    errors |= fluid_errors(scene, fluid, body)
    present = _mean_edge(body)
    excess = errors["mesh"] / (MESH_SHARE * wanted)
    needed = present / max(1.0, excess)
    return Suggestion(
        error=wanted,
        rtol=rtol,
        edge_length=needed,
        errors=errors,
        dominant=max(errors, key=lambda name: errors[name]),
        notes=tuple(_notes(fluid, body, errors, wanted, needed)),
    )


def fluid_errors(scene: Scene, fluid: Fluid, body: Body) -> dict[str, float]:
    """Return what mesh, regularization and fluid model are worth in drag, torque and thrust, relative."""
    nonlocal_fluid = fluid.model_copy(update={"model": "RSS"})
    halved = body.halved()
    coarse, fine = rss_response(body, nonlocal_fluid), rss_response(halved, nonlocal_fluid)
    local = rft_response(scene, body, fluid)
    close, slender = (
        rss_response(body, fluid.model_copy(update={"epsilon": name})) for name in ("lim-et-al", "slender")
    )
    if fluid.model == "RFT":
        coarse, fine = local, rft_response(scene, halved, fluid)
    # First order in the edge: half of the error is gone with half of the edge.
    return {
        "mesh": 2.0 * coarse.difference(fine),
        "regularization": close.difference(slender) if fluid.model == "RSS" else 0.0,
        "fluid model": local.difference(rss_response(body, nonlocal_fluid)),
    }


def _mean_edge(body: Body) -> float:
    ends = body.nodes[body.edges]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean())


def _notes(fluid: Fluid, body: Body, errors: dict[str, float], wanted: float, needed: float) -> list[str]:
    notes = []
    widest = float(fluid.epsilon_array(body.radius).max())
    if fluid.model == "RSS" and needed < CURED_EDGE * widest:
        notes.append(
            f"edges of {1e3 * needed:.3g} mm are shorter than {CURED_EDGE:g} regularizations of "
            f"{1e3 * widest:.3g} mm, where the fluid matrix is ill-conditioned: extrapolate from two coarser "
            "meshes instead"
        )
    if fluid.model == "RSS" and errors["regularization"] > wanted:
        notes.append(
            f"the choice of epsilon is worth {100.0 * errors['regularization']:.0f} %; "
            "no mesh or step cures that"
        )
    if fluid.model == "RFT" and errors["fluid model"] > wanted:
        notes.append(
            f"the local fluid model is off by {100.0 * errors['fluid model']:.0f} % of nonlocal drag; "
            "use model='RSS'"
        )
    return notes
