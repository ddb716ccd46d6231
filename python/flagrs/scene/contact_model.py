"""How edges that touch are kept apart."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import PlainValidator, model_validator

from flagrs.errors import not_allowed
from flagrs.scene.part import Part
from flagrs.scene.values import Bounds, index, number, optional_number


def _count(value: Any) -> int:
    if index(value) == 0:
        raise not_allowed("", value, "an integer >= 1")
    return index(value)


#: Tolerance by method where none is given.
TOLERANCE = {"barrier": 0.05, "spillmann-teschner": 1e-2}

#: Largest tolerance of the barrier: edges of a straight rod that are not left out are pi/2 sums of radii
#: apart, and must not push each other.
WIDEST = 0.5


class Contact(Part):
    """Contact between edges, of one rod or of several, and between edges and the head.

    Attributes
    ----------
    method : str
        ``barrier``: a potential of the distance that no accepted state can overcome; ``spillmann-teschner``:
        penetrating pairs are pushed apart by passes around each step until the deepest penetration is below
        the tolerance (Lim et al., equations 19 to 21). docs/theory/contact.md says when either is
        right.
    tolerance : float or None
        ``barrier``: contact acts where centrelines are between ``1 - tolerance`` and ``1 + tolerance`` times
        the sum of the two radii apart, and no accepted step has them closer than the former (saved frames
        between adaptive steps are interpolated, to `rtol`). ``spillmann-teschner``:
        penetration that may remain, as a fraction of that sum. None: 0.05 and 0.01.
    friction : float
        Coefficient of Coulomb friction; ``barrier`` only.
    slip_velocity : float or None
        Relative velocity above which contacts slide with the whole force of friction, below they creep [m/s];
        None: a thousandth of the velocity that typical forces give the filaments.
    stiffness : float or None
        Stiffness of the barrier [Pa]; None: the one at which five times the scene's drag, weight or load per
        length, or a tenth of the force that bends rods as they are at rest, keeps centrelines just the sum of
        the radii apart.
    head_radius : float or None
        Radius of the head as a sphere that rods cannot enter [m]; ``barrier`` only. None: rods pass through
        the head, whose radius for drag need not be its shape.
    max_iterations : int
        How often the pairs of one step may be pushed apart; ``spillmann-teschner`` only.
    exclusion_factor : float or None
        Pairs closer along the rest shape than this many times the sum of their radii never count as touching;
        None takes the default of the contact search.
    """

    method: Literal["barrier", "spillmann-teschner"] = "barrier"
    tolerance: Annotated[float | None, optional_number(Bounds("1", above=0.0, below=1.0))] = None
    friction: Annotated[float, number(Bounds("1", at_least=0.0, at_most=10.0))] = 0.0
    slip_velocity: Annotated[float | None, optional_number(Bounds("m/s", above=0.0))] = None
    stiffness: Annotated[float | None, optional_number(Bounds("Pa", above=0.0))] = None
    head_radius: Annotated[float | None, optional_number(Bounds("m", above=0.0))] = None
    max_iterations: Annotated[int, PlainValidator(_count)] = 200
    exclusion_factor: Annotated[float | None, optional_number(Bounds("1", above=0.0))] = None

    @model_validator(mode="after")
    def _check(self) -> Contact:
        if self.method == "barrier":
            if self.tolerance_or_default() > WIDEST:
                raise not_allowed(
                    "tolerance", self.tolerance, f"at most {WIDEST:g} if the method is 'barrier'"
                )
            needed = 1.0 + self.tolerance_or_default()
            if self.exclusion_factor is not None and self.exclusion_factor < needed:
                allowed = f"at least 1 + tolerance = {needed:g}, or straight rods push themselves"
                raise not_allowed("exclusion_factor", self.exclusion_factor, allowed)
            return self
        if self.friction > 0.0:
            raise not_allowed("friction", self.friction, "0 unless the method is 'barrier'")
        for field in ("slip_velocity", "stiffness", "head_radius"):
            if getattr(self, field) is not None:
                raise not_allowed(field, getattr(self, field), "None unless the method is 'barrier'")
        return self

    def tolerance_or_default(self) -> float:
        """Return the tolerance, or that of the method."""
        return TOLERANCE[self.method] if self.tolerance is None else self.tolerance
