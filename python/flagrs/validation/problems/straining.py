"""A free fibre that an extensional flow compresses: straight below a threshold of the flow, buckled above."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre, leggauss
from scipy.linalg import eig
from scipy.optimize import brentq

from flagrs import Fluid, LinearFlow, Rod, Scene, Simulation
from flagrs.scene.values import FloatArray
from flagrs.validation.clamped_rod import DRAG, EA, EI, GJ, LENGTH, MATERIAL, RADIUS, STIFFENING
from flagrs.validation.problem import Check, Curve, Evidence, Panel, converging, problem

#: Drag along the fibre over drag across it, by Gray and Hancock with the wavelength L.
ANISOTROPY = 2.0 * np.pi / (np.log(2.0 * LENGTH / RADIUS) - 0.5) / DRAG
#: Bend of the middle over the length at the start: linear theory errs by its square.
AMPLITUDE = 1e-3
#: Times, in zeta L^4 / EI, between which growth is looked at: later than the other modes live, earlier than
#: the round-off of rotations, which grow by exp(2 E t), is seen.
FROM, TO = 2e-3, 1.2e-2
#: Flows next to the threshold at which the sign of the growth rate is looked at.
SIDES = (0.95, 1.05)


def linear_buckling(
    flow: float, anisotropy: float, terms: int = 16
) -> tuple[float, Callable[[FloatArray], FloatArray]]:
    """Return the growth rate, in EI / (zeta L^4), of the first bend of a fibre along the compressed axis.

    ``y_t = flow (y + s y' + anisotropy / 2 (s^2 - 1/4) y'') - y''''`` for -1/2 < s < 1/2 with free ends, by
    Galerkin's method on even Legendre polynomials. The second part of the answer is the bend's shape.

    Parameters
    ----------
    flow
        zeta E L^4 / EI, with the drag zeta across the fibre and the rate E of the extension; in slender-body
        theory zeta is 8 pi mu / c, c = -ln(e a^2 / L^2).
    anisotropy
        Drag along the fibre over drag across it.
    terms
        Number of polynomials.
    """
    abscissa, weight = leggauss(4 * terms + 8)
    s, weight = 0.5 * abscissa, 0.5 * weight
    basis = [Legendre.basis(2 * k, domain=[-0.5, 0.5]).convert(kind=Polynomial) for k in range(terms)]
    values, slopes, bends = (np.array([f.deriv(n)(s) if n else f(s) for f in basis]) for n in (0, 1, 2))
    mass = (values * weight) @ values.T
    carried = values + s * slopes + 0.5 * anisotropy * (s**2 - 0.25) * bends
    operator = flow * (values * weight) @ carried.T - (bends * weight) @ bends.T
    rates, vectors = eig(operator, mass)
    # The fastest is that of a fibre carried away by the flow without a bend, at the rate of the flow itself.
    bent = np.abs(rates.real - flow) > 1e-6 * flow
    first = int(np.flatnonzero(bent)[np.argmax(rates.real[bent])])
    shape = sum((float(c) * f for c, f in zip(vectors[:, first].real, basis, strict=True)), Polynomial([0.0]))
    return float(rates[first].real), (1.0 / (shape(0.0) - shape(0.5))) * shape


def threshold(anisotropy: float) -> float:
    """Return zeta E L^4 / EI at which a fibre buckles: 153.202 for a ratio of drags of one half."""
    return float(brentq(lambda flow: linear_buckling(flow, anisotropy)[0], 100.0, 220.0, xtol=1e-10))


def _growth(count: int, flow: float, rtol: float) -> float:
    """Return the growth rate, in EI / (zeta L^4), of a small bend of a simulated fibre."""
    unit = DRAG * LENGTH**4 / EI
    along = np.linspace(-0.5, 0.5, count + 1)
    across = linear_buckling(flow, ANISOTROPY)[1](along)
    straight = np.outer(along, [LENGTH, 0.0, 0.0])
    rod = Rod(nodes=straight, radius=RADIUS, material=MATERIAL, EI=EI, GJ=GJ, EA=EA * STIFFENING)
    background = LinearFlow.extension(rate=flow / unit, direction=(0, 1, 0), across=(1, 0, 0))
    fluid = Fluid(viscosity=1.0, model="RFT", wavelength=LENGTH, density=0.0, background=background)
    simulation = Simulation(Scene(rods=(rod,), fluid=fluid), rtol=rtol, threads=1)
    simulation.set_state(straight + np.outer(AMPLITUDE * LENGTH * across, [0.0, 1.0, 0.0]))
    trajectory = simulation.run(until=TO * unit, save_every=0.1 * TO * unit, path=False)
    seen = trajectory.time >= 0.999 * FROM * unit
    y = trajectory.nodes[seen][:, :, 1]
    bend = y[:, count // 2] - 0.5 * (y[:, 0] + y[:, -1])
    return float(np.polyfit(trajectory.time[seen] / unit, np.log(np.abs(bend)), 1)[0])


def _found(count: int, rtol: float) -> float:
    """Return the flow at which growth is zero, by a parabola through three flows."""
    flows = np.array([0.95, 1.0, 1.05]) * threshold(ANISOTROPY)
    rates = np.array([_growth(count, flow, rtol) for flow in flows])
    return float(np.polyfit(rates, flows, 2)[-1])


@problem(
    source="Y.-N. Young and M. J. Shelley, Phys. Rev. Lett. 99 (2007) 058303, by local slender-body theory; "
    "solved here by Galerkin's method at the ratio of drags that is simulated",
    quick={"edge_counts": (10, 20, 40), "rtol": 1e-6},
    full={"edge_counts": (10, 20, 40, 80), "rtol": 1e-6},
)
def buckling_in_extension(edge_counts: tuple[int, ...], rtol: float) -> Evidence:
    """Strength of an extensional flow at which a free fibre along its compressed axis buckles."""
    exact = threshold(ANISOTROPY)
    sizes = 1.0 / np.array(edge_counts, dtype=float)
    found = np.array([_found(count, rtol) for count in edge_counts])
    checks = [
        converging(
            "critical $\\zeta\\dot\\epsilon L^4/EI$",
            sizes,
            found,
            exact,
            tolerance=1e-3,
            reason="fourth order of the mesh error, and interpolation of the growth rate",
            order_tolerance=0.3,
            resolution=f"{', '.join(map(str, edge_counts))} edges, rtol {rtol:g}",
        )
    ]
    marks = np.array(SIDES) * exact
    growth = np.array([_growth(edge_counts[-1], flow, rtol) for flow in marks])
    for share, flow, rate in zip(SIDES, marks, growth, strict=True):
        checks.append(
            Check(
                f"growth rate at {share:g} of it, $\\cdot\\,\\zeta L^4/EI$",
                float(rate),
                linear_buckling(float(flow), ANISOTROPY)[0],
                0.1,
                "the threshold's own mesh error, 3e-3 of it on 40 edges, over 0.05: the sign is right",
                resolution=f"{edge_counts[-1]} edges, rtol {rtol:g}",
            )
        )
    flows = np.linspace(0.8, 1.2, 11) * exact
    theory = np.array([linear_buckling(float(flow), ANISOTROPY)[0] for flow in flows])
    panel = Panel(
        "Growth of a small bend",
        "flow over its threshold",
        "growth rate $\\cdot\\,\\zeta L^4/EI$",
        (
            Curve(flows / exact, theory, "linear theory", "-"),
            Curve(np.array(SIDES), growth, f"{edge_counts[-1]} edges", "o"),
        ),
    )
    return Evidence(tuple(checks), (panel,))
