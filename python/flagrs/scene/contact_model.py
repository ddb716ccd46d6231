"""How edges that touch are kept apart."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import PlainValidator

from flagrs.errors import not_allowed
from flagrs.scene.part import Part
from flagrs.scene.values import Bounds, index, number, optional_number


def _count(value: Any) -> int:
    if index(value) == 0:
        raise not_allowed("", value, "an integer >= 1")
    return index(value)


class Contact(Part):
    """Contact between edges, of one rod or of several.

    Attributes
    ----------
    method : str
        ``spillmann-teschner``: penetrating pairs are moved apart until the deepest penetration is below the
        tolerance, and the displacement is turned into a force (supplementary text, equations 19 to 21).
    tolerance : float
        Penetration that may remain, as a fraction of the sum of the two radii.
    max_iterations : int
        How often the pairs of one step may be moved apart.
    exclusion_factor : float or None
        Pairs closer along the rest shape than this many times the sum of their radii never count as touching;
        None takes the default of the contact search.
    """

    method: Literal["spillmann-teschner"] = "spillmann-teschner"
    tolerance: Annotated[float, number(Bounds("1", above=0.0, below=1.0))] = 1e-2
    max_iterations: Annotated[int, PlainValidator(_count)] = 200
    exclusion_factor: Annotated[float | None, optional_number(Bounds("1", above=0.0))] = None
