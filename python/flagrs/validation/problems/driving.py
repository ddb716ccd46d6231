"""Rods driven from outside: shaken at one end, carried by a shear flow, turned by a magnetic field."""

from __future__ import annotations

import math

import numpy as np

from flagrs import Fluid, LinearFlow, MagneticField, Material, Rod, Scene, Simulation
from flagrs.scene.values import FloatArray
from flagrs.validation.clamped_rod import DRAG, EI, LENGTH, RADIUS, ClampedRod, edge_lengths
from flagrs.validation.problem import Check, Curve, Evidence, Panel, converging, errors_panel, problem

Complexes = np.ndarray[tuple[int], np.dtype[np.complex128]]

#: Amplitude of the shaken end over the length: linear theory errs by its square.
AMPLITUDE = 5e-3
#: Decay times, zeta L^4 / (12.36 EI) each, after which a start from rest has died away to 1e-5.
DECAYS = 12.0
#: Periods at most that a run from theory's shape takes before it is looked at.
PERIODS = 20
#: Drag per length along the rod.
DRAG_ALONG = 2.0 * math.pi / (math.log(2.0 * LENGTH / RADIUS) - 0.5)
#: Angle at which the rod in shear starts, and shear times time after which it is looked at.
START, SHEARED = math.radians(60.0), 2.0


def shaken_shape(sperm_number: float) -> tuple[Complexes, Complexes]:
    """Return weights (4,) and rates (4,) of the shape of a filament shaken at one end, linear theory.

    ``y = Im sum of c_k exp(a_k x + i t)`` with ``a_k^4 = -i Sp^4``, displaced and not tilted at x = 0, free
    at x = 1, over the amplitude of the shaking.
    """
    a = sperm_number * (-1j) ** 0.25 * np.array([1.0, 1j, -1.0, -1j])
    # Of the two that grow along x the values at the end are the unknowns, which stay of order one.
    scale = np.exp(-np.maximum(a.real, 0.0))
    end = scale * np.exp(a)
    conditions = np.array([scale, a * scale, a**2 * end, a**3 * end])
    weights = np.linalg.solve(conditions, np.array([1.0, 0.0, 0.0, 0.0]))
    return weights * scale, a


def shaken_tip(sperm_number: float) -> complex:
    """Return the amplitude of the free end of a filament over that of its clamped end, linear theory."""
    weights, a = shaken_shape(sperm_number)
    return complex(weights @ np.exp(a))


def shaken_thrust(sperm_number: float) -> float:
    """Return the mean force of the clamp along the filament, over (zeta - zeta_along) omega amplitude^2.

    Across it an element moves at ``y_t``, tilted by ``y_x``: the fluid pushes it along by
    ``(zeta - zeta_along) y_t y_x`` per length, whose mean is ``Re(i Y conj(Y_x)) / 2``; the clamp holds it.
    """
    weights, a = shaken_shape(sperm_number)
    # Integrals of products of exponentials over 0 < x < 1.
    rates = a[:, None] + np.conj(a)[None, :]
    small = np.abs(rates) < 1e-12
    integrals = np.where(small, 1.0, (np.exp(rates) - 1.0) / np.where(small, 1.0, rates))
    products = weights[:, None] * np.conj(weights * a)[None, :] * integrals
    return float(-0.5 * (1j * products.sum()).real)


def _shake(count: int, sperm_number: float) -> tuple[complex, float]:
    """Return tip and force, as `shaken_tip` and `shaken_thrust`, of a simulated rod."""
    unit = DRAG * LENGTH**4 / EI
    omega = sperm_number**4 / unit
    period = 2.0 * math.pi / omega
    rod = ClampedRod(count)
    scene = rod.scene()
    size = AMPLITUDE * LENGTH
    shaken = scene.clamps[0].replace(displacement=lambda t: (0.0, size * math.sin(omega * t), 0.0))
    simulation = Simulation(scene.replace(clamps=(shaken,)), rtol=1e-6, threads=1)
    # From the shape that theory gives: what is left of other modes dies away, or is still over a fast period.
    weights, a = shaken_shape(sperm_number)
    nodes = rod.nodes()
    along = np.maximum(nodes[:, 0], 0.0) / LENGTH
    nodes[2:, 1] = size * np.imag(np.exp(np.outer(along[2:], a)) @ weights)
    simulation.set_state(nodes)
    start = period * min(math.ceil(DECAYS / 12.36 * unit / period), PERIODS)
    simulation.run(until=start, save_every=start, path=False)
    trajectory = simulation.run(until=start + period, save_every=period / 16.0, path=False)
    times, tip = trajectory.time[1:], trajectory.nodes[1:, -1, 1]
    # The tip is sin(omega t) turned and scaled: its Fourier coefficient over that of the clamp.
    force = trajectory.reaction().force[1:, 0].mean() / ((DRAG - DRAG_ALONG) * omega * size**2)
    return complex(2j * np.mean(tip * np.exp(-1j * omega * times)) / size), float(force)


@problem(
    source="C. H. Wiggins and R. E. Goldstein, Phys. Rev. Lett. 80, 3879 (1998), with a clamped end",
    quick={"edge_counts": (8, 16, 32), "sperm_numbers": (2.0,)},
    full={"edge_counts": (10, 20, 40, 80), "sperm_numbers": (1.0, 2.0, 4.0, 6.0, 8.0)},
)
def shaken_filament(edge_counts: tuple[int, ...], sperm_numbers: tuple[float, ...]) -> Evidence:
    """Amplitude and phase of the free end of a filament shaken at the other, and its propulsive force."""
    checks: list[Check] = []
    errors: dict[str, tuple[FloatArray, FloatArray]] = {}
    sizes = edge_lengths(edge_counts)
    for sperm_number in sperm_numbers:
        expected = shaken_tip(sperm_number)
        shaken = [_shake(count, sperm_number) for count in edge_counts]
        found = np.array([tip for tip, _ in shaken]) / expected
        forces = np.array([force for _, force in shaken]) / shaken_thrust(sperm_number)
        for what, values, limit in (
            ("amplitude over", np.abs(found), 1.0),
            ("phase less", np.angle(found), 0.0),
            ("propulsive force over", forces, 1.0),
        ):
            checks.append(
                converging(
                    f"{what} theory's, sperm number {sperm_number:g}",
                    sizes,
                    values,
                    limit,
                    tolerance=1e-3,
                    reason="(amplitude / L)^2 and rtol, 1e-4; fourth order of the mesh error",
                    resolution=f"{', '.join(map(str, edge_counts))} edges, rtol 1e-6",
                    order_tolerance=0.3,
                    absolute=limit == 0.0,
                )
            )
            errors[f"{what} theory's, {sperm_number:g}"] = (sizes, values - limit)
    panel = errors_panel("Error against the mesh", "edge length / L", "error", errors)
    return Evidence(tuple(checks), (panel,))


def _stiff_rod(direction: tuple[float, float, float], edge_count: int) -> Rod:
    stiff = Material(youngs_modulus=1e10, poisson_ratio=0.5, density=1000.0)
    start = tuple(-0.5 * LENGTH * component for component in direction)
    return Rod.straight(
        length=LENGTH, edge_count=edge_count, radius=1e-3, material=stiff, direction=direction, start=start
    )


def _angle(nodes: FloatArray) -> FloatArray:
    along = nodes[..., -1, :] - nodes[..., 0, :]
    return np.unwrap(np.arctan2(along[..., 1], along[..., 0]))


@problem(
    source="G. B. Jeffery, Proc. R. Soc. A 102, 161 (1922), in the limit of a slender body",
    quick={"edge_count": 20},
    full={"edge_count": 40},
)
def rod_in_shear(edge_count: int) -> Evidence:
    """Angle of a slender rod that a shear flow has turned: its cotangent grows by shear rate times time."""
    rod = _stiff_rod((math.cos(START), math.sin(START), 0.0), edge_count)
    fluid = Fluid(viscosity=1.0, model="RFT", density=0.0, background=(LinearFlow.shear(rate=1.0),))
    simulation = Simulation(Scene(rods=(rod,), fluid=fluid), rtol=1e-5, threads=1)
    trajectory = simulation.run(until=SHEARED, save_every=SHEARED / 20.0, path=False)
    found = _angle(trajectory.nodes)
    theory = np.arctan2(1.0, 1.0 / math.tan(START) + trajectory.time)
    check = Check(
        "angle [rad]",
        float(found[-1]),
        float(theory[-1]),
        1e-4,
        "ten times rtol; a rod of E = 1e10 Pa bends by less",
        resolution=f"{edge_count} edges, rtol 1e-5",
    )
    curves = (Curve(trajectory.time, found, "flagrs", "o"), Curve(trajectory.time, theory, "theory", "-"))
    return Evidence((check,), (Panel("A slender rod in shear", "shear rate x time", "angle [rad]", curves),))


@problem(
    source="overdamped dipole, d(lag)/dt = omega - omega_c sin(lag)",
    quick={"shares": (0.8, 1.25), "turns": 5},
    full={"shares": (0.5, 0.8, 0.95, 1.05, 1.25, 2.0), "turns": 100},
)
def step_out(shares: tuple[float, ...], turns: int) -> Evidence:
    """How fast a magnetised rod turns in a rotating field, below and above where it steps out."""
    rod = _stiff_rod((1.0, 0.0, 0.0), 10).replace(magnetization=(0.0, 0.0, 1e4))
    fluid = Fluid(viscosity=1.0, model="RFT", density=0.0)
    spin = np.cross([0.0, 0.0, 1.0], rod.nodes).ravel()
    drag = float(spin @ Simulation(Scene(rods=(rod,), fluid=fluid), threads=1).resistance() @ spin)
    field = 1e-2
    critical = 1e4 * math.pi * 1e-6 * LENGTH * field / drag
    checks = []
    for share in shares:
        omega = share * critical

        def rotating(time: float, omega: float = omega) -> tuple[float, float, float]:
            return field * math.cos(omega * time), field * math.sin(omega * time), 0.0

        scene = Scene(rods=(rod,), fluid=fluid, magnetic_field=MagneticField(field=rotating))
        # Below: after the lag has settled. Above: over whole slips.
        if share < 1.0:
            begin, until, theory = 10.0 / critical, 10.0 / critical + 2.0 * math.pi * turns / omega, 1.0
        else:
            slip = 2.0 * math.pi / math.sqrt(omega**2 - critical**2)
            count = max(1, round(2.0 * math.pi * turns / omega / slip))
            begin, until, theory = slip, (1 + count) * slip, 1.0 - math.sqrt(1.0 - 1.0 / share**2)
        simulation = Simulation(scene, rtol=1e-4, threads=1)
        trajectory = simulation.run(until=until, save_every=0.2 / omega, path=False)
        angles = np.interp([begin, until], trajectory.time, _angle(trajectory.nodes))
        checks.append(
            Check(
                f"mean rate over the field's, at {share:g} of step-out",
                float(angles[1] - angles[0]) / (omega * (until - begin)),
                theory,
                2e-3,
                "rtol 1e-4 over many slips, and the interpolation of frames 0.2 rad apart",
                resolution="10 edges, rtol 1e-4",
            )
        )
    return Evidence(tuple(checks))
