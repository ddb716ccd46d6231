"""Drag and torque of rigid bodies."""

from __future__ import annotations

import math

import numpy as np

from flagrs import fluid
from flagrs.scene import Ellipsoid, Sphere
from flagrs.validation.drag_references import spheroid_drag
from flagrs.validation.problem import Check, Curve, Evidence, Panel, problem

_REASON = "the accuracy that was asked for"


@problem(
    source="G. G. Stokes (1851); A. T. Chwang and T. Y.-T. Wu, J. Fluid Mech. 67 (1975) 787",
    quick={"accuracies": (1e-2, 1e-3, 1e-4), "finest": 1e-6, "aspects": (2.0,)},
    full={"accuracies": (1e-2, 1e-3, 1e-4), "finest": 1e-6, "aspects": (2.0, 3.0, 5.0)},
)
def rigid_bodies(accuracies: tuple[float, ...], finest: float, aspects: tuple[float, ...]) -> Evidence:
    """Drag and torque of a sphere and of prolate spheroids, by point forces inside them."""
    checks: list[Check] = []
    sphere = fluid.BodySurface(Sphere(radius=1.0), finest)
    resistance = sphere.resistance(1.0)
    for row, exact, name in ((0, 6.0 * math.pi, "drag"), (5, 8.0 * math.pi, "torque")):
        checks.append(
            Check(
                f"{name} of a sphere",
                float(resistance[row, row]),
                exact,
                finest,
                _REASON,
                resolution=f"{len(sphere.sources)} sources",
            )
        )
    curves: list[Curve] = []
    for aspect in aspects:
        errors, counts = [], []
        for accuracy in accuracies:
            surface = fluid.BodySurface(Ellipsoid(semi_axes=np.array([1.0, 1.0, aspect])), accuracy)
            found = np.diag(surface.resistance(1.0))
            counts.append(float(len(surface.sources)))
            worst = 0.0
            for row, axis, name in ((2, 0, "along"), (0, 1, "across")):
                exact = spheroid_drag(aspect, axis)
                worst = max(worst, abs(float(found[row]) / exact - 1.0))
                checks.append(
                    Check(
                        f"drag {name}, aspect {aspect:g}, over $6\\pi\\mu bU$",
                        float(found[row]) / (6.0 * math.pi),
                        exact / (6.0 * math.pi),
                        accuracy,
                        _REASON,
                        resolution=f"{len(surface.sources)} sources",
                    )
                )
            errors.append(worst)
        curves.append(Curve(np.array(counts), np.array(errors), f"spheroid, aspect {aspect:g}"))
        curves.append(Curve(np.array(counts), np.array(accuracies), "asked for", "--"))
    panel = Panel("Error of the drag", "sources", "relative error", tuple(curves), "log", "log")
    return Evidence(tuple(checks), (panel,))
