"""What a run says of itself: energy budget, balances, and warnings when there is reason and only then."""

import re
import warnings

import flagrs
import numpy as np
import pytest
from flagrs.flow import immersed_edges
from flagrs.guards import notices

SOFT = flagrs.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)


def straight(count: int = 10, length: float = 0.1, radius: float = 1e-3, **options) -> flagrs.Rod:
    return flagrs.Rod.straight(length=length, edge_count=count, radius=radius, material=SOFT, **options)


def held(*nodes: int, **options) -> flagrs.Clamp:
    return flagrs.Clamp(nodes=nodes, edges=(0,) if nodes[0] == 0 else (), **options)


def test_energy_budget_of_the_robot_closes_and_agrees_with_its_read_outs():
    simulation = flagrs.Simulation(flagrs.scenarios.robot(contact=False), dt=0.02)
    trajectory = simulation.run(until=1.0, save_every=0.02, path=False)
    budget = trajectory.energy_budget()
    dt = np.diff(trajectory.time)
    # Work of constant speed over a step is exact, as is the dissipation of forces by the step's velocities.
    work = np.cumsum(trajectory.power()[1:] * dt)
    assert budget.sources["motors"][1:] == pytest.approx(work, rel=1e-9)
    edges, _ = immersed_edges(trajectory.scene)
    forces = [
        flagrs.fluid.hat_weights(x, edges, f) for x, f in zip(trajectory.nodes, trajectory.force_density)
    ]
    taken = np.cumsum([(f * v).sum() for f, v in zip(forces[1:], trajectory.velocities[1:])] * dt)
    # The step's weights are those of its first geometry.
    assert budget.sinks["fluid"][1:] == pytest.approx(taken, rel=5e-3)
    head, velocity = trajectory.scene.head, trajectory.velocities[1:, trajectory.scene.head.node]
    drag = head.C_t * 6.0 * np.pi * head.radius * (velocity**2).sum(axis=1)
    assert budget.sinks["head"][-1] > np.sum(drag * dt) > 0.0
    assert budget.stored["total"][1:] == pytest.approx(trajectory.energy[1:].sum(axis=1), abs=1e-15)
    assert abs(budget.relative_defect[-1]) < 2e-2
    assert budget.sinks["twist_drag"][-1] > 0.0 and budget.sources["clamps"][-1] == 0.0
    assert simulation.warnings == () == trajectory.warnings


def test_defect_of_the_budget_is_of_first_order_in_the_step():
    # An elastic rod straightens: nothing is given, so what it has stored is what is taken.
    defects = []
    for dt in (4e-2, 2e-2, 1e-2):
        simulation = flagrs.Simulation(flagrs.scenarios.relaxing_rod(), dt=dt)
        trajectory = simulation.run(until=0.8, save_every=0.4, path=False)
        budget = trajectory.energy_budget()
        assert sum(part[-1] for part in budget.sources.values()) == 0.0
        # The second half: the fastest modes of the start, shorter than any of these steps, are gone.
        defects.append(budget.defect[-1] - budget.defect[-2])
    assert defects[0] > defects[1] > defects[2] > 0.0
    assert defects[1] / defects[2] == pytest.approx(2.0, rel=0.3)


def test_clamps_give_what_a_turned_flagellum_takes():
    scene = flagrs.scenarios.clamped_flagella(count=1)
    simulation = flagrs.Simulation(scene)
    simulation.step(100)
    numbers = simulation.statistics
    assert numbers["energy_given"] > 0.0
    assert abs(numbers["energy_defect"]) < 2e-2
    # 0.16 m/s at 10 mm in a fluid ten times as viscous as water: this benchmark is not one of small inertia.
    assert [notice.kind for notice in simulation.warnings] == ["reynolds"]


def test_adaptive_steps_close_the_budget_more_tightly():
    defect = {}
    for rtol in (1e-2, 1e-4):
        simulation = flagrs.Simulation(flagrs.scenarios.robot(contact=False), rtol=rtol)
        simulation.run(until=1.0, save_every=0.5, path=False)
        defect[rtol] = abs(simulation.statistics["energy_defect"])
    assert defect[1e-4] < defect[1e-2] < 5e-2


@pytest.mark.parametrize(
    "options, warned", [({"dt": 0.1}, True), ({"dt": 0.03}, False), ({"rtol": 1e-2}, False), ({}, False)]
)
def test_steps_in_which_flagella_turn_too_far_are_warned_of(options: dict[str, float], warned: bool):
    # 15 rad/s: at 1.5 rad a step the two flagella never meet.
    scene = flagrs.scenarios.clamped_flagella(count=2)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        simulation = flagrs.Simulation(scene, **options)
    assert [w.category for w in caught] == [flagrs.StepWarning] * warned
    if warned:
        assert re.search(r"a turn of 1\.5 rad a step.*below 0\.033 s", str(caught[0].message))
        with pytest.warns(flagrs.StepWarning, match="a turn of 3 rad"):
            simulation.dt = 0.2


def test_outer_forces_and_torques_of_a_free_robot_vanish():
    simulation = flagrs.Simulation(flagrs.scenarios.robot(contact=False), dt=0.02)
    simulation.step(20)
    numbers = simulation.statistics
    # The force balance is solved to 1e-8 of the largest force.
    assert 0.0 < numbers["force_imbalance"] < 1e-6
    assert 0.0 < numbers["torque_imbalance"] < 1e-6


def test_steps_far_too_long_for_what_happens_warn_of_lost_energy():
    simulation = flagrs.Simulation(flagrs.scenarios.relaxing_rod(), dt=100.0)
    with pytest.warns(flagrs.EnergyWarning, match=r"have lost .* use rtol, or a smaller dt"):
        simulation.run(until=200.0, save_every=100.0, path=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation.run(until=400.0, save_every=100.0, path=False)  # each kind once
    assert [notice.kind for notice in simulation.warnings] == ["energy lost"]
    assert simulation.statistics["warnings"] == 1


@pytest.mark.parametrize("stored, warned", [(0.4, False), (0.6, True)])
def test_energy_from_nowhere_is_warned_of(stored: float, warned: bool):
    # Motors give one joule, the fluid takes half of it: what is stored beyond the other half is from nowhere.
    account = np.zeros(42)
    account[1], account[5], account[19], account[23], account[24] = 1.0, 0.5, stored, 1.0, stored
    found = [notice.kind for notice in notices(account, flagrs.scenarios.robot())]
    assert found == ["energy made"] * warned


@pytest.mark.parametrize("share, warned", [(0.9, False), (1.05, True)])
def test_explicit_steps_above_their_limit_make_energy_and_warn_of_it(share: float, warned: bool):
    nodes = np.array([[0.0, 0.0, 0.0], [5e-3, 0.0, 1e-3], [1e-2, 0.0, 1e-3], [1.5e-2, 0.0, 0.0]])
    material = flagrs.Material(youngs_modulus=1e5, density=2e4)
    rod = flagrs.Rod(nodes=nodes, rest_nodes=nodes * [1.0, 1.0, 0.0], radius=5e-4, material=material)
    fluid = flagrs.Fluid(viscosity=1.0, model="RFT", twist_drag=False, density=0.0)
    scene = flagrs.Scene(rods=rod, fluid=fluid)
    limit = flagrs.Simulation(scene, scheme="explicit", dt=1e-6).stable_step()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        simulation = flagrs.Simulation(scene, scheme="explicit", dt=share * limit)
        simulation.step(400)
    assert [w.category for w in caught if w.category is flagrs.EnergyWarning] == [
        flagrs.EnergyWarning
    ] * warned
    assert ("energy made" in [notice.kind for notice in simulation.warnings]) == warned


def test_drag_that_gives_is_energy_from_nowhere():
    account = np.zeros(42)
    account[1], account[5], account[19], account[23] = 1.0, -0.04, 1.04, 1.0
    assert not list(notices(account, flagrs.scenarios.robot()))
    # The twist drag: no other sink makes up for it.
    account[5], account[6], account[19] = 0.96, -0.06, 0.1
    assert [notice.kind for notice in notices(account, flagrs.scenarios.robot())] == ["energy made"]
    # Contact may give what it has stored.
    account[5], account[6], account[8], account[19] = 1.0, 0.0, -0.06, 0.06
    assert not list(notices(account, flagrs.scenarios.robot()))


@pytest.mark.parametrize("stretch, warned", [(0.15, False), (0.25, True)])
def test_strain_beyond_a_fifth_warns(stretch: float, warned: bool):
    clamps = (held(0), held(10, velocity=(0.1 * stretch, 0.0, 0.0)))
    scene = flagrs.Scene(rods=straight(), clamps=clamps, fluid=flagrs.Fluid(viscosity=1.0))
    simulation = flagrs.Simulation(scene, dt=0.05)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        trajectory = simulation.run(until=1.0, save_every=0.5, path=False)
    assert [w.category for w in caught if "strained" in str(w.message)] == [flagrs.StrainWarning] * warned
    assert ("strain" in [notice.kind for notice in trajectory.warnings]) == warned


@pytest.mark.parametrize("edges, warned", [(20, False), (3, True)])
def test_a_rod_bent_into_a_hook_warns_on_a_mesh_too_coarse_for_it(edges: int, warned: bool):
    # A load at the tip turns a held rod by more than a right angle: all at one hinge, or spread over twenty.
    load = flagrs.PointLoad(node=edges, force=(-2e-3, 1e-3, 0.0))
    scene = flagrs.Scene(
        rods=straight(edges, radius=0.7e-3), clamps=held(0, 1), loads=load, fluid=flagrs.Fluid(viscosity=1.0)
    )
    simulation = flagrs.Simulation(scene, dt=0.05)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        simulation.run(until=5.0, save_every=1.0, path=False)
    found = [w for w in caught if w.category is flagrs.MeshWarning]
    assert len(found) == warned
    if warned:
        assert "degrees beyond its natural shape" in str(found[0].message)


@pytest.mark.parametrize("epsilon, warned", [(5e-3, False), (15e-3, True)])
def test_edges_below_the_regularization_warn(epsilon: float, warned: bool):
    fluid = flagrs.Fluid(viscosity=1.0, epsilon=epsilon, density=0.0)
    load = flagrs.PointLoad(node=5, force=(0.0, 0.0, 1e-5))
    simulation = flagrs.Simulation(flagrs.Scene(rods=straight(), fluid=fluid, loads=load), dt=1e-3)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        simulation.step()
    assert ["regularization" in str(w.message) for w in caught] == [True] * warned


@pytest.mark.parametrize(
    "viscosity, density, warned", [(1.0, None, False), (1e-3, None, True), (1e-3, 0.0, False)]
)
def test_reynolds_number_above_one_warns(viscosity: float, density: float | None, warned: bool):
    # A rod of 0.1 m, size 5 mm, towed at 10 mm/s: Re = 1000 * 0.01 * 0.005 / viscosity.
    fluid = flagrs.Fluid(viscosity=viscosity, density=density)
    clamp = flagrs.Clamp(nodes=tuple(range(11)), velocity=(0.0, 0.0, 0.01))
    simulation = flagrs.Simulation(flagrs.Scene(rods=straight(), fluid=fluid, clamps=clamp), dt=1e-3)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        simulation.step()
    assert [w.category for w in caught] == [flagrs.ReynoldsWarning] * warned
    if warned:
        assert simulation.warnings[0].value == pytest.approx(50.0, rel=1e-6)


def test_flow_at_the_immersed_nodes_is_their_velocity_and_dry_edges_have_no_part_in_it():
    scene = flagrs.scenarios.robot(contact=False)
    simulation = flagrs.Simulation(scene, dt=1e-3)
    simulation.run(until=0.05, save_every=0.05, path=False)
    wet = np.unique(simulation.immersed_edges)
    flow = simulation.flow(simulation.nodes[wet])
    speed = np.linalg.norm(simulation.velocities[wet], axis=1).max()
    # No slip, but for the fluid's geometry, which is that of the step's beginning.
    assert flow == pytest.approx(simulation.velocities[wet], abs=5e-3 * speed)
    # A dry edge would carry half a hat of the density of the node that it shares with an immersed one.
    density = simulation.frame()["force_density"]
    naive = flagrs.fluid.velocity(
        simulation.nodes[wet], simulation.nodes, simulation.edges, np.array(density), 1.0, 1.65e-3
    )
    assert np.abs(naive - simulation.velocities[wet]).max() > 0.05 * speed


def test_a_force_density_is_refused_on_dry_edges():
    simulation = flagrs.Simulation(flagrs.scenarios.robot(contact=False), dt=1e-3)
    trajectory = simulation.run(until=0.002, save_every=1e-3, path=False)
    nodes, edges, wet = simulation.nodes, simulation.edges, simulation.immersed_edges
    assert len(wet) < len(edges)
    fast = flagrs.fluid.FastMobility(nodes, edges, 1e-3)
    for density in (
        simulation.frame()["force_density"],
        trajectory.force_density[-1],
        *trajectory.force_density,
    ):
        for use in (
            lambda density=density: flagrs.fluid.velocity(nodes[:1], nodes, edges, density, 1.0, 1e-3),
            lambda density=density: flagrs.fluid.hat_weights(nodes, edges, density),
            lambda density=density: fast.apply(density),
        ):
            with pytest.raises(flagrs.SceneError, match=r"edges: edge \d+ from node .* immersed_edges"):
                use()
        # The immersed ones, in whatever direction, and plain arrays, which know no edges.
        flagrs.fluid.velocity(nodes[:1], nodes, wet[:, ::-1], density, 1.0, 1e-3)
        flagrs.fluid.hat_weights(nodes, edges, 1.0 * density)
    assert type(2.0 * trajectory.force_density) is np.ndarray
    assert isinstance(trajectory.force_density.max(), float)
    assert trajectory.force_density[:, :3].edges is None


def test_thrust_of_the_robot_is_the_drag_of_its_head():
    simulation = flagrs.Simulation(flagrs.scenarios.robot(contact=False), dt=1e-3)
    trajectory = simulation.run(until=0.05, save_every=0.05, path=False)
    head = trajectory.scene.head
    drag = head.C_t * 6.0 * np.pi * head.radius * trajectory.velocities[-1, head.node]
    assert trajectory.thrust()[-1] == pytest.approx(-drag, abs=1e-3 * np.linalg.norm(drag))


def test_gravity_in_a_fluid_of_unknown_density_is_refused():
    with pytest.raises(flagrs.SceneError, match=r"fluid\.density: None.*1000 for water, 0 to leave"):
        flagrs.Scene(rods=straight(), fluid=flagrs.Fluid(viscosity=1.0), gravity=(0.0, 0.0, -9.81))
    for density in (0.0, 1000.0):
        fluid = flagrs.Fluid(viscosity=1.0, density=density)
        flagrs.Scene(rods=straight(), fluid=fluid, gravity=(0.0, 0.0, -9.81))


def test_held_filaments_have_no_swimming_speed():
    simulation = flagrs.Simulation(flagrs.scenarios.clamped_flagella(count=1))
    trajectory = simulation.run(until=0.05, save_every=0.01, path=False)
    with pytest.raises(flagrs.FlagrsError, match="no swimming speed: clamps hold"):
        trajectory.swimming_speed()


def test_plan_tells_the_scales_and_asks_about_units():
    plan = flagrs.scenarios.robot().plan()
    assert plan.scales.extent == pytest.approx(0.105, rel=0.05)
    assert 0.0 < plan.scales.reynolds < 1.0 and plan.scales.sperm_number > 0.5
    assert not any("?" in warning for warning in plan.warnings) and "sperm number" in str(plan)
    fluid = flagrs.Fluid(viscosity=1000.0, density=0.0)
    rod = flagrs.Rod.straight(length=6.0, edge_count=4, radius=1.0, material=SOFT)
    text = str(flagrs.Scene(rods=rod, fluid=fluid, gravity=(0.0, 0.0, -9810.0)).plan())
    for question in ("millimetres?", "mPa s?", "mm/s^2?", "another unit?"):
        assert question in text


def test_explicit_steps_far_too_long_end_in_words_and_leave_a_state_of_numbers():
    nodes = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    bent = nodes + np.array([[0.0, 0.0, 0.06], [0.0, 0.0, -0.05], [0.1, 0.1, 0.0]])
    material = flagrs.Material(youngs_modulus=1e3, density=1000.0)
    rod = flagrs.Rod(nodes=nodes, rest_nodes=bent, radius=0.01, material=material)
    fluid = flagrs.Fluid(viscosity=1.0, twist_drag=False, density=0.0)
    simulation = flagrs.Simulation(flagrs.Scene(rods=rod, fluid=fluid), scheme="explicit")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        simulation.dt *= 100.0
        with pytest.raises(flagrs.ConvergenceError, match="nodes fly away, which steps too long"):
            simulation.step(50)
    # 1e10 times its size away a filament would be no more than round-off of its coordinates.
    assert np.abs(simulation.nodes).max() < 1e10 * 2.0
    for name, value in simulation.frame().items():
        assert np.isfinite(value).all() or name == "minimum_gap", name


def test_energies_that_are_no_numbers_end_a_step_in_words():
    # Nothing but its energy is too large: both nodes are held, and no node goes too far.
    material = flagrs.Material(youngs_modulus=1e3, density=1000.0)
    rod = flagrs.Rod(nodes=[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], radius=0.01, material=material, EA=1e300)
    clamps = (flagrs.Clamp(nodes=(0,)), flagrs.Clamp(nodes=(1,), velocity=(1e6, 0.0, 0.0)))
    fluid = flagrs.Fluid(viscosity=1.0, model="RFT", density=0.0)
    simulation = flagrs.Simulation(flagrs.Scene(rods=rod, fluid=fluid, clamps=clamps), dt=1.0)
    with pytest.raises(flagrs.ConvergenceError, match="energies grow beyond all bounds"):
        simulation.step()
    assert all(np.isfinite(value).all() for value in simulation.state().values())


def test_velocities_of_an_instant_are_no_reynolds_number():
    x = np.linspace(0.0, 0.1, 21)
    kinked = np.stack([x, 0.0 * x, 0.2 * np.abs(x - 0.05)], axis=1)
    material = flagrs.Material(youngs_modulus=1e6, density=1000.0)
    rod = flagrs.Rod(nodes=kinked, rest_nodes=kinked * [1.0, 1.0, 0.0], radius=1e-3, material=material)
    scene = flagrs.Scene(rods=rod, fluid=flagrs.Fluid(viscosity=1.0, model="RFT"))
    still = flagrs.Simulation(scene)
    rows = (still.dof_of_node[:, None] + np.arange(3)).ravel()
    at_once = np.linalg.solve(still.resistance(), -still.gradient()[rows]).reshape(-1, 3)
    # A thousandth of a fixed step later, by small steps; the size is a twentieth of the length.
    short = flagrs.Simulation(scene, dt=1e-5 * still.dt)
    short.step(100)
    scale = 1000.0 * 0.1 / 20.0
    soon = scale * np.linalg.norm(short.velocities, axis=1).max()
    assert scale * np.linalg.norm(at_once, axis=1).max() > 2.0 * soon
    simulation = flagrs.Simulation(scene, rtol=1e-2)
    with pytest.warns(flagrs.ReynoldsWarning):
        simulation.step(10)
    (notice,) = [notice for notice in simulation.warnings if notice.kind == "reynolds"]
    assert 0.3 * soon < notice.value < soon


def test_a_scene_at_rest_makes_and_loses_no_energy_to_speak_of():
    scene = flagrs.scenarios.straight_rod().replace(fluid=None)
    simulation = flagrs.Simulation(scene, scheme="implicit", rtol=1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation.step(3)


def test_a_rod_that_sinks_under_adaptive_steps_is_in_balance_from_the_first_step() -> None:
    rod = flagrs.Rod.straight(
        length=0.1,
        edge_count=20,
        radius=1e-3,
        material=flagrs.Material(youngs_modulus=1e6, density=2000.0),
    )
    scene = flagrs.Scene(
        rods=rod, fluid=flagrs.Fluid(viscosity=1.0, density=1000.0), gravity=np.array([0.0, 0.0, -9.81])
    )
    simulation = flagrs.Simulation(scene, rtol=1e-3)
    simulation.step(3)
    # Round-off, as all moves alike; 0.44 where the first instant counted.
    assert simulation.statistics["force_imbalance"] < 1e-12
