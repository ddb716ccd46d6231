"""The exact large deflection of a clamped rod: the elastica, with or without weight and axial stiffness."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from flagrs.scene.values import FloatArray


def tip_deflection(
    load: float, compliance: float = 0.0, weight: float = 0.0, shear: float = 0.0
) -> FloatArray:
    """Return vertical and horizontal deflection of the tip of a horizontal cantilever over its length L.

    With ``F(s) = load + weight (1 - s)``, the force that a section carries, the angle theta of its normal
    below the horizontal obeys ``theta'' = -F x'``, where ``x' = (1 + e) cos(theta) - g sin(theta)``, with the
    strain ``e = F compliance sin(theta)`` and the shear ``g = F shear cos(theta)``, ``theta(0) = 0``,
    ``theta'(1) = 0``, in the arc length of the unstretched rod over L (Antman; Reissner 1972).

    Parameters
    ----------
    load
        P L^2 / EI of a force P on the tip.
    compliance
        EI / (EA L^2); 0 is the inextensible rod of Bisshopp and Drucker (1945).
    weight
        w L^3 / EI of a weight w per unit of the rod's length.
    shear
        EI / (k GA L^2), with the shear stiffness k GA; 0 is a rod whose sections stay normal to it.
    """

    def slopes(from_tip: float, y: FloatArray) -> list[float]:
        force = load + weight * from_tip
        cosine, sine = np.cos(y[0]), np.sin(y[0])
        stretch, slide = 1.0 + force * compliance * sine, force * shear * cosine
        along, down = stretch * cosine - slide * sine, stretch * sine + slide * cosine
        # Along 1 - s: angle, its slope towards the wall, and how far the tip is across and below.
        return [y[1], -force * along, along, down]

    def at_wall(angle: float) -> FloatArray:
        # From the free tip, where theta' = 0, to the wall.
        end = solve_ivp(slopes, (0.0, 1.0), [angle, 0.0, 0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-13)
        return np.asarray(end.y[:, -1], dtype=np.float64)

    angle = brentq(lambda angle: float(at_wall(angle)[0]), 0.0, np.pi / 2.0, xtol=1e-13)
    _, _, across, down = at_wall(float(angle))
    return np.array([down, 1.0 - across])
