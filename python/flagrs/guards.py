"""Guards: what a run warns of, each once, with time, place, number and what to do about it."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flagrs.budget import budget_of, energy_passed, given_by_drag
from flagrs.contact_scales import suitable_stiffness
from flagrs.scene import Scene
from flagrs.scene.values import FloatArray
from flagrs.time_step import fastest_rate


class FlagrsWarning(UserWarning):
    """Base class of every warning flagrs gives: the result may not be what it seems."""


class EnergyWarning(FlagrsWarning):
    """Energy that grows without input, or that the steps lose."""


class MeshWarning(FlagrsWarning):
    """Hinges folded beyond what the mesh carries, or edges below the regularization."""


class StrainWarning(FlagrsWarning):
    """Edges stretched beyond what linear elasticity describes."""


class StabilityWarning(FlagrsWarning):
    """Steps of the explicit scheme that are longer than it is known to be stable with."""


class StepWarning(FlagrsWarning):
    """Steps too long for what turns the scene."""


class ContactWarning(FlagrsWarning):
    """A stiffness of contact far from what the scene's contacts have to bear."""


class ReynoldsWarning(FlagrsWarning):
    """Motion too fast for a fluid without inertia."""


class StationarityWarning(FlagrsWarning):
    """A mean over time of what has not become steady."""


#: Share of the energy that has passed which steps may lose, or make.
MOST_LOST, MOST_MADE = 0.2, 0.05
#: Energy that is round-off, over that of doubling every edge's length: strains of 1e-10.
ROUND_OFF = 1e-20
#: Bending beyond the natural shape [rad] from which a hinge overstates the energy of the arc it stands for by
#: more than a fifth: (2 tan(phi/2))^2 over phi^2 is 1.22 at 60 degrees, and 1.62 at 90.
MOST_BENDING = np.pi / 3.0
#: Strain beyond which linear elasticity is another material.
MOST_STRAIN = 0.2
#: Regularization over the length of an edge.
MOST_REGULARIZATION = 1.0
#: Given stiffness of contact over the suitable one, or the inverse.
MOST_UNSUITABLE = 100.0
#: Turn of a motor or clamp within a step [rad]: the tips of two clamped flagella are then off by a tenth of
#: their radius, ten times less with default steps, and by more than the radius at 1.5 rad.
MOST_TURN = 0.5
#: Reynolds number.
MOST_REYNOLDS = 1.0


@dataclass(frozen=True)
class Notice:
    """One warning of a run.

    Attributes
    ----------
    kind : str
        ``energy made``, ``energy lost``, ``bending``, ``strain``, ``regularization`` or ``reynolds``.
    time : float
        Simulated time [s] of the worst value so far.
    value : float
        The value: a share, an angle [rad], a strain or a ratio.
    message : str
        What it means and what to do.
    """

    kind: str
    time: float
    value: float
    message: str


CLASSES = {
    "energy made": EnergyWarning,
    "energy lost": EnergyWarning,
    "bending": MeshWarning,
    "strain": StrainWarning,
    "regularization": MeshWarning,
    "reynolds": ReynoldsWarning,
}


def notices(account: FloatArray, scene: Scene) -> Iterator[Notice]:
    """Yield what there is to warn of in a native account (42,) of a scene."""
    time = float(account[0])
    defect = float(budget_of(account[None]).relative_defect[0])
    made = max(-defect, given_by_drag(account))
    if max(made, defect) > MOST_MADE and _is_round_off(account, scene):
        pass
    elif made > MOST_MADE:
        text = f"by t = {time:g} s {made:.2g} of all energy came from nowhere: the steps are unstable; "
        yield Notice("energy made", time, made, text + "use a smaller dt, or rtol")
    elif defect > MOST_LOST:
        text = f"by t = {time:g} s the steps have lost {defect:.2g} of all energy: they are too long; "
        yield Notice("energy lost", time, defect, text + "use rtol, or a smaller dt")
    bending, strain, width, reynolds = account[29:41].reshape(4, 3)
    if bending[0] > MOST_BENDING:
        yield _notice(
            "bending",
            bending,
            f"hinge {bending[1]:.0f} is bent by {np.degrees(bending[0]):.0f} degrees beyond its natural "
            f"shape, where its energy is {_overstated(bending[0]):.2g} times that of an arc; use shorter "
            "edges",
        )
    if strain[0] > MOST_STRAIN:
        yield _notice(
            "strain",
            strain,
            f"edge {strain[1]:.0f} is strained by {100.0 * strain[0]:.0f} %: Hooke's law holds for small "
            "strains; use a stiffer material or smaller forces",
        )
    if width[0] > MOST_REGULARIZATION:
        yield _notice(
            "regularization",
            width,
            f"immersed edge {width[1]:.0f} is shorter than the regularization (a factor of {width[0]:.3g}): "
            "the force density oscillates; use longer edges or a smaller epsilon",
        )
    if reynolds[0] > MOST_REYNOLDS:
        density = 0.0 if scene.fluid is None else scene.fluid.density_for_inertia
        yield _notice(
            "reynolds",
            reynolds,
            f"the Reynolds number at node {reynolds[1]:.0f} is {reynolds[0]:.3g} (a density of {density:g} "
            "kg/m^3): the fluid's inertia, which is left out, is no longer small",
        )


def _is_round_off(account: FloatArray, scene: Scene) -> bool:
    """Return whether no more energy has passed than a scene at rest has by the round-off of its strains."""
    stretched = 0.5 * sum(float((rod.EA_array() * rod.rest_lengths()).sum()) for rod in scene.rods)
    return energy_passed(account) <= ROUND_OFF * stretched


def _notice(kind: str, extreme: FloatArray, text: str) -> Notice:
    return Notice(kind, float(extreme[2]), float(extreme[0]), f"at t = {extreme[2]:g} s {text}")


def _overstated(angle: float) -> float:
    return float((2.0 * np.tan(angle / 2.0) / angle) ** 2)


def check_contact(scene: Scene) -> None:
    """Warn of a given stiffness of contact that is far from the suitable one: steps may become very short."""
    contact = scene.contact
    if contact is None or contact.stiffness is None or contact.method != "barrier":
        return
    least, largest = suitable_stiffness(scene)
    given = float(contact.stiffness)
    factor, side = max((least / given, "below"), (given / largest, "above"))
    if factor > MOST_UNSUITABLE:
        fits = f"{least:.1e} Pa" if largest < 1.1 * least else f"{least:.1e} to {largest:.1e} Pa"
        warnings.warn(
            f"contact.stiffness: {given:g} Pa is {factor:.1e} times {side} what the scene's contacts have to "
            f"bear ({fits}): filaments rest at the end of the range of contact, and steps may become too "
            "short for the run to end in time; None takes the stiffness from the scene",
            ContactWarning,
            stacklevel=4,
        )


def check_turn(scene: Scene, dt: float) -> None:
    """Warn of steps of a fixed length [s] in which a motor, clamp or flow turns too far to follow."""
    rate = fastest_rate(scene)
    if rate * dt > MOST_TURN:
        warnings.warn(
            f"dt: {dt:g} s is a turn of {rate * dt:.2g} rad a step: bodies that turn are not followed, and "
            f"may pass through each other unseen; take dt below {MOST_TURN / rate:.2g} s, or rtol",
            StepWarning,
            stacklevel=3,
        )


class Guards:
    """The guards of one run: each kind warns once."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._found: dict[str, Notice] = {}

    def look(self, account: FloatArray, end: bool = False) -> None:
        """Warn of what is new in an account; of lost energy at the end of a run only.

        A start from rest may lose much of the little energy that has passed by then.
        """
        for notice in notices(account, self._scene):
            if notice.kind == "energy lost" and not end:
                continue
            new = notice.kind not in self._found
            self._found[notice.kind] = notice
            if new:
                warnings.warn(notice.message, CLASSES[notice.kind], stacklevel=3)

    @property
    def found(self) -> tuple[Notice, ...]:
        """Everything warned of so far, with the worst value each."""
        return tuple(self._found.values())
