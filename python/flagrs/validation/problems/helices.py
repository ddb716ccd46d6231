"""Rigid helices that move and turn along their axis: theory, experiment, and a motor that turns one."""

from __future__ import annotations

import math

import numpy as np

from flagrs import Simulation
from flagrs.scene import Clamp, Fluid, Material, Motor, Rod, Scene
from flagrs.validation.problem import Check, Curve, Evidence, Panel, problem
from flagrs.validation.rigid_helix import Helix, of_filament
from flagrs.validation.surface_solution import helix_tube, surface_solution

#: Thrust / (mu Omega R^2), torque / (mu Omega R^3) and drag / (mu U R) of helices by pitch / R, digitised
#: from Rodenborn et al. (2013), figure 2.
MEASURED = {
    2.226: (6.26, 131.9, 52.1),
    3.677: (9.60, 100.8, 47.0),
    6.509: (11.03, 81.9, 39.4),
    9.811: (9.57, 72.7, 35.3),
    15.241: (7.84, 68.1, 34.1),
}
#: The same by two slender-body theories at pitch / R = 9.811, as that paper computed them.
THEORIES = {"Lighthill": (9.251, 69.27, 34.13), "Johnson": (9.156, 66.43, 32.88)}
_QUANTITIES = ("thrust / $\\mu\\Omega R^2$", "torque / $\\mu\\Omega R^3$", "drag / $\\mu UR$")


def _normalized(pitch: float, edge_over_radius: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return thrust, torque and drag of the experiment's helix of a pitch, in units of the radius."""
    helix = Helix(radius=6.3e-3, pitch=6.3e-3 * pitch, axial_length=0.13, thickness=0.397e-3)
    count = math.ceil(helix.contour / (edge_over_radius * helix.thickness))
    found = of_filament(helix.filament(count), helix.twist_torque)
    r = helix.radius
    return np.array([found.thrust / r**2, found.torque / r**3, found.drag / r])


@problem(
    source="B. Rodenborn, C.-H. Chen, H. L. Swinney, B. Liu and H. P. Zhang, PNAS 110 (2013) E338",
    quick={"edge_over_radius": 4.0},
    full={"edge_over_radius": 2.0},
)
def helix_propulsion(edge_over_radius: float) -> Evidence:
    """Thrust, torque and drag of rigid helices, against an experiment and two slender-body theories."""
    found = {pitch: _normalized(pitch, edge_over_radius) for pitch in MEASURED}
    checks = []
    for pitch, measured in MEASURED.items():
        for k, name in enumerate(_QUANTITIES):
            checks.append(
                Check(
                    f"{name}, pitch / R = {pitch:g}, experiment",
                    float(found[pitch][k]),
                    measured[k],
                    0.12,
                    "digitising, and the experiment: 3 to 9 % above theories at pitch / R = 9.811",
                )
            )
    for (theory, values), tolerance in zip(THEORIES.items(), (0.015, 0.05), strict=True):
        for k, name in enumerate(_QUANTITIES):
            checks.append(
                Check(
                    f"{name}, pitch / R = 9.811, {theory}",
                    float(found[9.811][k]),
                    values[k],
                    tolerance,
                    "the mesh, 1 %; Johnson's theory differs from Lighthill's by 1 to 4 %",
                )
            )
    pitches = np.array(sorted(MEASURED))
    panels = tuple(
        Panel(
            name.split(" ")[0].capitalize(),
            "pitch / R",
            name,
            (
                Curve(pitches, np.array([found[p][k] for p in pitches]), "segments", "o-"),
                Curve(pitches, np.array([MEASURED[p][k] for p in pitches]), "experiment", "s"),
                *(
                    Curve(np.array([9.811]), np.array([v[k]]), t, m)
                    for (t, v), m in zip(THEORIES.items(), "^v", strict=True)
                ),
            ),
        )
        for k, name in enumerate(_QUANTITIES)
    )
    return Evidence(tuple(checks), panels)


@problem(
    source="method of fundamental solutions on the tube's surface, solved here",
    quick={"thicknesses": (1.6e-3,), "fit": (1.0, 6)},
    full={"thicknesses": (1.6e-3, 0.8e-3), "fit": (1.0, 8)},
)
def helix_surface(thicknesses: tuple[float, ...], fit: tuple[float, int]) -> Evidence:
    """Resistances of one turn of a thick helix, against a solution that assumes no slenderness."""
    checks = []
    for thickness in thicknesses:
        helix = Helix(axial_length=Helix.pitch, thickness=thickness)
        exact = surface_solution(helix_tube(helix), *fit)
        found = of_filament(
            helix.filament(int(helix.contour / (math.exp(0.5) * thickness))), helix.twist_torque
        )
        share = thickness / helix.radius
        for name, mine, theirs, tolerance in (
            ("drag", found.drag, exact.drag, 0.25),
            ("thrust", found.thrust, exact.thrust, 0.2),
            ("torque", found.torque, exact.torque, 1.0),
        ):
            checks.append(
                Check(
                    f"{name}, a/R = {share:.3f}",
                    mine,
                    theirs,
                    tolerance * share**2 + 5e-3,
                    "slender-body theory, of the order (a/R)^2, and 4e-3 of the fit",
                )
            )
    return Evidence(tuple(checks))


def _motor_torque(nodes: np.ndarray[tuple[int, int], np.dtype[np.float64]], dry: int, steps: int) -> float:
    """Return the torque [N m] that turns a stiff rod at 1 rad/s about its first edge, which is clamped."""
    rod = Rod(
        nodes=nodes,
        material=Material(youngs_modulus=1e10, density=1260.0),
        radius=1.6e-3,
        immersed=np.arange(len(nodes) - 1) >= dry,
    )
    scene = Scene(
        rods=(rod,),
        fluid=Fluid(viscosity=1.0),
        motors=(Motor(node=1, shaft=1, speed=1.0),),
        clamps=(Clamp(nodes=(0, 1), edges=(0,)),),
    )
    simulation = Simulation(scene, dt=1e-3, threads=1)
    simulation.step(steps)
    return float(simulation.frame()["motor_torque"][0])


@problem(
    source="4 pi mu a^2 L Omega of a straight shaft; the rigid helix' own resistance",
    quick={"steps": 30},
    full={"steps": 100},
)
def motor_torque(steps: int) -> Evidence:
    """Torque of a motor that turns a straight shaft, and a stiff helix, in a simulation."""
    straight = np.linspace(0.0, 0.12, 13)[:, None] * np.array([1.0, 0.0, 0.0])
    helix = Helix()
    flagellum = helix.filament(25)
    shaft = np.array([[-0.010, 0.0, 0.0], [-0.005, 0.0, 0.0], [0.0, 0.0, 0.0]])
    vectors = np.diff(flagellum.nodes, axis=0)
    along = vectors[:, 0] ** 2 / np.linalg.norm(vectors, axis=1)
    rigid = of_filament(flagellum, 4.0 * math.pi * helix.thickness**2 * float(along.sum()))
    checks = (
        Check(
            "torque of a straight shaft [N m]",
            _motor_torque(straight, 2, steps),
            4.0 * math.pi * 1.6e-3**2 * 0.10,
            1e-6,
            "the start, which decays within the first steps",
        ),
        Check(
            "torque of a stiff helix [N m]",
            _motor_torque(np.concatenate([shaft, flagellum.nodes]), 3, steps),
            rigid.torque,
            2e-4,
            "the fluid of a step is that at its start, 1 mrad behind; bending of the shaft",
        ),
    )
    return Evidence(checks)
