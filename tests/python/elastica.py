"""The cantilever's exact large deflection: the elastica, with or without an axial stiffness."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


def tip_deflection(load: float, compliance: float = 0.0) -> np.ndarray:
    """Return vertical and horizontal deflection of the tip over the length L.

    The angle theta of the tangent below the horizontal obeys ``theta'' = -load (1 + e) cos(theta)`` with the
    strain ``e = load compliance sin(theta)``, ``theta(0) = 0``, ``theta'(1) = 0``, in the arc length of the
    unstretched rod over L.

    Parameters
    ----------
    load
        P L^2 / EI.
    compliance
        EI / (EA L^2); 0 is the inextensible rod of Bisshopp and Drucker (1945).
    """

    def slopes(_: float, y: np.ndarray) -> list[float]:
        stretch = 1.0 + load * compliance * np.sin(y[0])
        return [y[1], -load * stretch * np.cos(y[0]), stretch * np.cos(y[0]), stretch * np.sin(y[0])]

    def from_tip(angle: float) -> np.ndarray:
        # From the tip backwards, where a free end asks for theta' = 0; the equations are even in s.
        end = solve_ivp(slopes, (0.0, 1.0), [angle, 0.0, 0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-13)
        return np.asarray(end.y[:, -1])

    angle = brentq(lambda angle: from_tip(angle)[0], 0.0, np.pi / 2.0, xtol=1e-13)
    _, _, across, down = from_tip(angle)
    return np.array([down, 1.0 - across])
