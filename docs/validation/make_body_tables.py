"""Prints the tables of bodies.md: resistance of spheres, spheroids and cylinders against closed forms.

Run with ``python docs/validation/make_body_tables.py`` (four minutes on one core).
"""

from __future__ import annotations

import numpy as np
from flagrs import Cylinder, Ellipsoid, Sphere
from flagrs.fluid import BodySurface
from flagrs.validation.drag_references import spheroid_drag

DRAG, TORQUE = 6.0 * np.pi, 8.0 * np.pi


def main() -> None:
    """Print the three tables."""
    print("| sphere: asked | sources | estimated | drag | torque |\n|---|---|---|---|---|")
    for accuracy in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        surface = BodySurface(Sphere(radius=1.0), accuracy)
        diagonal = np.diag(surface.resistance(1.0))
        drag, torque = np.abs(diagonal[:3] / DRAG - 1.0).max(), np.abs(diagonal[3:] / TORQUE - 1.0).max()
        print(
            f"| {accuracy:.0e} | {len(surface.sources)} | {surface.error:.1e} | {drag:.1e} | {torque:.1e} |"
        )
    print("\n| spheroid: aspect | asked | sources | estimated | along | across |\n|---|---|---|---|---|---|")
    for aspect in (2.0, 5.0):
        for accuracy in (1e-2, 1e-3, 1e-4):
            surface = BodySurface(Ellipsoid(semi_axes=[1.0, 1.0, aspect]), accuracy)
            found = np.diag(surface.resistance(1.0))
            along = abs(found[2] / spheroid_drag(aspect, 0) - 1.0)
            across = abs(found[0] / spheroid_drag(aspect, 1) - 1.0)
            print(
                f"| {aspect:g} | {accuracy:.0e} | {len(surface.sources)} | {surface.error:.1e} "
                f"| {along:.1e} | {across:.1e} |"
            )
    print("\n| length over radius | C_t along | C_t across | C_r spin | C_r tumble | error |")
    print("|---|---|---|---|---|---|")
    for length, accuracy in ((1.0, 2e-2), (2.0, 5e-3), (3.0, 5e-3)):
        surface = BodySurface(Cylinder(radius=1.0, length=length), accuracy)
        found = np.diag(surface.resistance(1.0))
        along, across, spin, tumble = found[2] / DRAG, found[0] / DRAG, found[5] / TORQUE, found[3] / TORQUE
        print(
            f"| {length:g} | {along:.4f} | {across:.4f} | {spin:.4f} | {tumble:.4f} | {surface.error:.1e} |"
        )


if __name__ == "__main__":
    main()
