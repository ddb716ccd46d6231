//! The equations of a step against differences of themselves, for every term, scheme and method of contact, and against their solution.
//!
//! Everything is of order one: a sign flipped in any term is an error of order one.

#[path = "../../tests/common/mod.rs"]
mod common;

use std::sync::Arc;

use common::{Random, chain_edges, chain_hinges, scene};

use super::contact::Treatment;
use super::given::{Drives, Step};
use super::problem::Problem;
use super::scheme::Scheme::{self, Explicit, Implicit, Overdamped};
use super::solver::Solver;
use super::statistics::Statistics;
use super::unknowns::Unknowns;
use crate::contact::pair::Curvature;
use crate::contact::stiffness::Stiffness;
use crate::fluid::product::FarFieldChoice;
use crate::forces::outside::{Given, OutsideForce};
use crate::inputs::Inputs;
use crate::kinematics::clamp::Motion;
use crate::model::Model;
use crate::model::specification::*;
use crate::nonlinear::equations::Goal;
use crate::rod::configuration::Configuration;
use crate::runtime::threads::Threads;
use crate::signal::Signal;
use crate::state::State;
use crate::{Mat3, Vec3};

const NODES: usize = 6;

fn chain() -> Specification {
    let mut random = Random::new(5);
    let nodes = (0..NODES).map(|k| Vec3::new(k as f64, 0.0, 0.0) + random.vector(0.3)).collect();
    scene(nodes, chain_edges(NODES), chain_hinges(NODES))
}

fn fluid(model: FluidModelSpecification) -> FluidSpecification {
    let immersed = vec![true; NODES - 1];
    FluidSpecification { viscosity: 0.3, model, immersed, twist_drag: false, density: 0.0 }
}

fn local() -> Specification {
    let model = FluidModelSpecification::ResistiveForce { coefficients: vec![[0.7, 1.3]; NODES - 1] };
    Specification { fluid: Some(fluid(model)), ..chain() }
}

fn nonlocal() -> Specification {
    let (epsilon, far_field) = (vec![0.1; NODES - 1], FarFieldChoice::NEVER);
    let model = FluidModelSpecification::StokesletSegments { epsilon, far_field };
    Specification { fluid: Some(fluid(model)), ..chain() }
}

fn partly_wet() -> Specification {
    let mut scene = nonlocal();
    if let Some(fluid) = &mut scene.fluid {
        fluid.immersed[0] = false;
        fluid.immersed[1] = false;
    }
    scene
}

fn spinning() -> Specification {
    let mut scene = local();
    if let Some(fluid) = &mut scene.fluid {
        (fluid.twist_drag, fluid.viscosity) = (true, 30.0);
    }
    scene
}

fn with_head(scene: Specification) -> Specification {
    let head = HeadSpecification { node: 2, edges: vec![1, 2], translation: 1.7, rotation: 0.6, mass: 0.4 };
    Specification { head: Some(head), ..scene }
}

fn with_motors(by_torque: bool) -> Specification {
    let signal = Signal::Constant(0.3);
    let motor = |hinge, shaft_second| MotorSpecification { hinge, shaft_second, by_torque, signal: signal.clone() };
    Specification { motors: vec![motor(0, true), motor(2, false)], ..local() }
}

fn with_loads(frame: Frame) -> Specification {
    let signal = || [0.4, -0.3, 0.5].map(Signal::Constant);
    let kinds = [
        LoadKind::NodeForce { node: 3, edge: 2 },
        LoadKind::EdgeTorque { edge: 1 },
        LoadKind::ForcePerLength { edges: vec![0, 3] },
        LoadKind::TorquePerLength { edges: vec![2, 4] },
    ];
    let loads = kinds.map(|kind| LoadSpecification { kind, frame, signal: signal() });
    Specification { loads: loads.into(), ..local() }
}

fn magnetised() -> Specification {
    let moments = vec![(1, Vec3::new(0.5, -0.2, 0.8)), (3, Vec3::new(-0.1, 0.6, 0.3))];
    let gradient = Mat3::new(0.3, 0.1, -0.2, 0.1, -0.5, 0.4, -0.2, 0.4, 0.2);
    let magnetism = MagnetismSpecification { moments, field: [0.7, 0.2, -0.4].map(Signal::Constant), gradient };
    Specification { magnetism: Some(magnetism), gravity: Vec3::new(0.0, 0.3, -1.0), ..local() }
}

fn in_shear(scene: Specification) -> Specification {
    let flow = FlowSpecification::Linear {
        velocity: [0.2, 0.1, -0.3].map(Signal::Constant),
        gradient: Mat3::new(0.1, 0.6, 0.0, -0.2, 0.1, 0.3, 0.0, 0.4, -0.2),
        strength: Signal::Constant(1.5),
        center: Vec3::new(1.0, 0.0, 0.0),
    };
    Specification { flows: vec![flow], ..scene }
}

fn clamped(scene: Specification) -> Specification {
    let clamp = |nodes, edges, axes| ClampSpecification { nodes, edges, axes, motion: Motion::still() };
    Specification {
        clamps: vec![clamp(vec![0, 1], vec![0], [true; 3]), clamp(vec![4], vec![], [false, true, false])],
        ..scene
    }
}

/// Two rods that cross, within the range of contact and pressed together.
fn crossing(method: ContactMethodSpecification) -> Specification {
    let along = (0..3).map(|k| Vec3::new(k as f64 - 0.9, 0.05, 0.0));
    let across = (0..3).map(|k| Vec3::new(0.1, k as f64 - 1.1, 0.2));
    let nodes = along.chain(across).collect();
    let contact = ContactSpecification { method, exclusion: 1.0, colliding: vec![true; 4] };
    let bare = scene(nodes, vec![[0, 1], [1, 2], [3, 4], [4, 5]], vec![[0, 1], [2, 3]]);
    Specification { contact: Some(contact), ..bare }
}

fn barrier(friction: f64) -> Specification {
    crossing(ContactMethodSpecification::Barrier {
        tolerance: 0.05,
        stiffness: Stiffness::Uniform(300.0),
        friction,
        slip_velocities: vec![0.2; 4],
        spheres: vec![],
    })
}

fn passes() -> Specification {
    crossing(ContactMethodSpecification::SpillmannTeschner { tolerance: 0.01, max_iterations: 10 })
}

/// How a row of the table differs from the plain one.
#[derive(Clone, Copy, PartialEq)]
enum Trait {
    Plain,
    /// Edges do not spin: the derivative of twist drag leaves out what is torque times the curvature of the sphere.
    SpinFree,
    /// A caller's forces, with a stiffness.
    Outside,
    /// Small moves, within the range of contact.
    Small,
}

/// A step with everything about it.
struct Case {
    model: Model,
    state: State,
    trial: Unknowns,
    drives: Drives,
    scheme: Scheme,
    drift: [Vec<f64>; 2],
    spin_free: bool,
    /// Size of the moves of the step, which differences and directions go by.
    size: f64,
    random: Random,
}

const RATE: f64 = 3.0;

impl Case {
    fn new(specification: Specification, scheme: Scheme, kind: Trait) -> Self {
        let mut random = Random::new(11);
        let model = Model::new(specification).expect("a valid scene");
        let mut state = State::initial(&model).expect("a configuration");
        let size = if kind == Trait::Small { 1e-3 } else { 0.1 };
        let mut noise = |size: f64| (0..model.dof_count()).map(|_| size * random.uniform()).collect::<Vec<f64>>();
        let (moves, drift) = (noise(size), [noise(0.3), noise(0.3)]);
        state.velocity = noise(0.4);
        let q: Vec<f64> = state
            .q
            .iter()
            .zip(&moves)
            .zip(&model.prescribed)
            .map(|((q, d), held)| if *held { *q } else { q + d })
            .collect();
        let inputs = Inputs::of(&model);
        let positions = state.positions(model.network());
        let mut configuration = Configuration::new(model.network(), model.dof_count());
        assert!(configuration.update(model.network(), &state.q, &state.frames, &[]));
        let given = Given {
            forces: (0..NODES).map(|_| random.vector(1.0)).collect(),
            torques: (0..NODES - 1).map(|_| random.vector(1.0)).collect(),
            stiffness: (0..NODES).map(|_| Mat3::from_fn(|_, _| random.uniform())).collect(),
        };
        let outside = || OutsideForce::new(model.network(), &configuration, &given).expect("the rows fit");
        let drives = Drives {
            motor_angles: vec![0.4; model.motors.len()],
            motor_torques: vec![0.3; model.motors.len()],
            inputs: inputs.load_values(0.0).expect("constants"),
            ambient: inputs.ambient(model.network().edges(), &positions, 0.0).expect("a plain flow"),
            outside: (kind == Trait::Outside).then(|| Arc::new(outside())),
        };
        let trial = Unknowns { q, density: Vec::new(), tensions: vec![0.0; model.network().edges().len()] };
        let spin_free = kind == Trait::SpinFree;
        Self { model, state, trial, drives, scheme, drift, spin_free, size, random }
    }

    fn step(&self) -> Step<'_> {
        let [mut drift, velocity_drift] = self.drift.clone();
        if self.spin_free {
            for &dof in self.model.network().edge_dofs() {
                drift[dof] = -RATE * (self.trial.q[dof] - self.state.q[dof]);
            }
        }
        let (scheme, state, drives) = (self.scheme, &self.state, self.drives.clone());
        Step { scheme, state, end: 0.4, drives, rate: RATE, drift, velocity_drift }
    }

    /// A solver at the beginning of the step.
    fn solver(&mut self) -> Solver {
        let mut solver = Solver::new(&self.model, Threads(1)).expect("a solver");
        let density = solver.density_length(self.scheme);
        self.state.fit_density(density);
        self.trial.density = (0..density).map(|_| self.random.uniform()).collect();
        let mut counts = Statistics::default();
        solver.place_fluid(&self.state.positions(self.model.network()), &mut counts).expect("a geometry");
        solver.begin(&self.model, &self.step(), &mut counts).expect("a beginning");
        // Tensions as they are make the derivative that of the residual.
        assert!(Problem::new(&self.model, &self.step()).place(&self.trial.q, &mut solver.at));
        let (still, none) = (vec![0.0; self.trial.q.len()], vec![0.0; self.trial.tensions.len()]);
        let out = &mut self.trial.tensions;
        self.model.stretching.tension_changes(&solver.at.configuration, &still, &none, out);
        solver
    }

    /// A direction of the unknowns in which nothing prescribed moves.
    fn direction(&mut self) -> Unknowns {
        let size = self.size;
        let held = &self.model.prescribed;
        let q = held.iter().map(|&held| if held { 0.0 } else { size * self.random.uniform() }).collect();
        let density = self.trial.density.iter().map(|_| self.random.uniform()).collect();
        Unknowns { q, density, tensions: vec![0.0; self.trial.tensions.len()] }
    }
}

/// Residuals of both equations at a trial.
fn residual(solver: &mut Solver, problem: Problem, trial: &Unknowns) -> [Vec<f64>; 2] {
    let size = solver.evaluate(problem, trial, &mut Statistics::default());
    assert!(size.is_some(), "{:?}", solver.unbalanced());
    [solver.at.residual.clone(), solver.at.slip.clone()]
}

/// What the linearised equations make of a direction.
fn product(solver: &mut Solver, problem: Problem, direction: &Unknowns) -> [Vec<f64>; 2] {
    let Problem { model, step, .. } = problem;
    let mut force = vec![0.0; direction.q.len()];
    solver.sparse().multiply_add(&direction.q, &mut force);
    let mut slip = solver.at.slip.clone();
    if let Some((fluid, dofs)) = solver.medium.flow.implicit_nonlocal(step) {
        let local = fluid.local().to_vec();
        let mobility = fluid.nonlocal().expect("it is nonlocal");
        let mut weighed = vec![0.0; slip.len()];
        mobility.weigh(&direction.density, &mut weighed);
        mobility.apply(&direction.density, &mut slip, None).expect("a product");
        for ((&dof, block), k) in dofs.iter().zip(&local).zip((0..).step_by(3)) {
            let moved = Vec3::new(direction.q[dof], direction.q[dof + 1], direction.q[dof + 2]) * step.rate;
            let own = block * moved;
            for c in 0..3 {
                force[dof + c] += weighed[k + c] - own[c];
                slip[k + c] -= mobility.scale() * moved[c];
            }
        }
    }
    force.iter_mut().zip(&model.prescribed).filter(|(_, held)| **held).for_each(|(force, _)| *force = 0.0);
    [force, slip]
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, value| most.max(value.abs()))
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    largest(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>())
}

/// Name, scene, scheme and kind of every row.
fn table() -> Vec<(&'static str, Specification, Scheme, Trait)> {
    use Trait::{Outside, Plain, Small, SpinFree};
    vec![
        ("elasticity", chain(), Overdamped, Plain),
        ("inertia", chain(), Implicit, Plain),
        ("explicit fluid", local(), Explicit, Plain),
        ("explicit nonlocal fluid", in_shear(nonlocal()), Explicit, Plain),
        ("local fluid", local(), Overdamped, Plain),
        ("local fluid and inertia", local(), Implicit, Plain),
        ("nonlocal fluid", nonlocal(), Overdamped, Plain),
        ("nonlocal fluid and inertia", nonlocal(), Implicit, Plain),
        ("partly immersed", partly_wet(), Overdamped, Plain),
        ("twist drag", spinning(), Overdamped, SpinFree),
        ("head", with_head(local()), Overdamped, Plain),
        ("head in a nonlocal fluid", with_head(nonlocal()), Implicit, Plain),
        ("motors by speed", with_motors(false), Overdamped, Plain),
        ("motors by torque", with_motors(true), Overdamped, Plain),
        ("loads", with_loads(Frame::Laboratory), Overdamped, Plain),
        ("follower loads", with_loads(Frame::Material), Overdamped, Plain),
        ("magnetism and weight", magnetised(), Overdamped, Plain),
        ("local fluid in shear", in_shear(local()), Overdamped, Plain),
        ("nonlocal fluid in shear", in_shear(nonlocal()), Overdamped, Plain),
        ("head in shear", in_shear(with_head(local())), Overdamped, Plain),
        ("outside forces", local(), Overdamped, Outside),
        ("clamps", clamped(nonlocal()), Overdamped, Plain),
        ("clamps and a local fluid", clamped(with_motors(true)), Overdamped, Plain),
        ("barrier", barrier(0.0), Implicit, Small),
        ("barrier with friction", barrier(0.5), Implicit, Small),
        ("passes", passes(), Implicit, Small),
    ]
}

#[test]
fn the_derivative_of_the_whole_step_is_that_of_its_residual() {
    for (name, specification, scheme, kind) in table() {
        let mut case = Case::new(specification, scheme, kind);
        let mut solver = case.solver();
        let direction = case.direction();
        let step = case.step();
        let problem = Problem::new(&case.model, &step);
        residual(&mut solver, problem, &case.trial);
        solver.linearize(problem, &case.trial.tensions, &mut Statistics::default()).expect("it is regular");
        let found = product(&mut solver, problem, &direction);
        let mut at = |part: f64| {
            let mut trial = case.trial.clone();
            trial.advance(&case.trial, &direction, part);
            residual(&mut solver, problem, &trial)
        };
        let h = 0.02;
        let (far, near) = ([at(h), at(-h)], [at(0.5 * h), at(-0.5 * h)]);
        for equation in 0..2 {
            let difference = |k: usize| {
                let by = |[a, b]: &[[Vec<f64>; 2]; 2]| a[equation][k] - b[equation][k];
                (4.0 * by(&near) / h - by(&far) / (2.0 * h)) / 3.0
            };
            let expected: Vec<f64> = (0..found[equation].len()).map(difference).collect();
            let (error, scale) = (distance(&found[equation], &expected), largest(&expected));
            // Fourth-order differences over a fiftieth of moves of order one.
            assert!(error <= 1e-5 * scale, "{name}, equation {equation}: off by {error:e} of {scale:e}");
        }
    }
}

#[test]
fn the_direction_of_newton_solves_the_linearised_equations() {
    // Nothing resists a rigid motion of the first row.
    for (name, specification, scheme, kind) in table().into_iter().skip(1) {
        let mut case = Case::new(specification, scheme, kind);
        let mut solver = case.solver();
        let step = case.step();
        let problem = Problem::new(&case.model, &step);
        let mut counts = Statistics::default();
        solver.aim(problem, Goal::Residual(1e-10), &case.trial.q);
        let wanted = residual(&mut solver, problem, &case.trial);
        solver.weigh(&case.model);
        solver.linearize(problem, &case.trial.tensions, &mut counts).expect("it is regular");
        let mut direction = case.trial.clone();
        solver.direction(problem, (&case.trial.tensions, 1e-10), &mut direction, &mut counts).expect("a solution");
        let found = product(&mut solver, problem, &direction);
        for equation in 0..2 {
            let left: Vec<f64> = found[equation].iter().zip(&wanted[equation]).map(|(a, b)| a + b).collect();
            let scale = largest(&wanted[equation]);
            // What is not symmetric in the force balance is solved to the thousandth that a factorization without pivoting is trusted
            // to, and the flow that goes with it.
            assert!(largest(&left) <= 2e-3 * scale, "{name}, equation {equation}: {:e} of {scale:e}", largest(&left));
        }
        // To first order, tensions change with the lengths of their edges.
        let h = 1e-5 / largest(&direction.q);
        let mut moved = case.trial.clone();
        moved.advance(&case.trial, &direction, h);
        assert!(problem.place(&moved.q, &mut solver.at));
        let mut change = vec![0.0; direction.tensions.len()];
        let still = vec![0.0; direction.q.len()];
        case.model.stretching.tension_changes(&solver.at.configuration, &still, &case.trial.tensions, &mut change);
        change.iter_mut().for_each(|change| *change /= h);
        let error = distance(&change, &direction.tensions);
        assert!(error <= 1e-3 * largest(&change), "{name}: tensions {error:e}");
    }
}

#[test]
fn the_residual_depends_on_what_is_given_and_on_the_trial_alone() {
    for (name, specification, scheme, kind) in table() {
        let mut case = Case::new(specification, scheme, kind);
        let mut solver = case.solver();
        let direction = case.direction();
        let step = case.step();
        let problem = Problem::new(&case.model, &step);
        let first = residual(&mut solver, problem, &case.trial);
        // Elsewhere, with wider friction and the definite matrix of contact, and back.
        let treatment = Treatment { widening: 100.0, curvature: Curvature::Definite };
        let mut elsewhere = case.trial.clone();
        elsewhere.advance(&case.trial, &direction, 0.1);
        residual(&mut solver, Problem { treatment, ..problem }, &elsewhere);
        solver
            .linearize(Problem { treatment, ..problem }, &elsewhere.tensions, &mut Statistics::default())
            .expect("a matrix");
        assert_eq!(residual(&mut solver, problem, &case.trial), first, "{name}");
    }
}

#[test]
fn wider_friction_and_definite_contact_are_what_they_say() {
    let mut case = Case::new(barrier(0.5), Implicit, Trait::Small);
    let mut solver = case.solver();
    let step = case.step();
    let problem = Problem::new(&case.model, &step);
    let smooth = Problem { treatment: Treatment { widening: 1e9, ..problem.treatment }, ..problem };
    let dry = Case::new(barrier(0.0), Implicit, Trait::Small);
    let mut frictionless = Case { trial: case.trial.clone(), ..dry };
    let mut other = frictionless.solver();
    let dry_step = frictionless.step();
    let [none, _] = residual(&mut other, Problem::new(&frictionless.model, &dry_step), &case.trial);
    let [with, _] = residual(&mut solver, problem, &case.trial);
    let [wide, _] = residual(&mut solver, smooth, &case.trial);
    // Friction that needs a billion times the velocity to turn over does nothing to speak of.
    assert!(distance(&with, &none) > 1e-3 && distance(&wide, &none) < 1e-6 * distance(&with, &none));
}

#[test]
fn contact_does_what_its_method_says() {
    let mut case = Case::new(barrier(0.5), Implicit, Trait::Small);
    let mut solver = case.solver();
    let step = case.step();
    residual(&mut solver, Problem::new(&case.model, &step), &case.trial);
    let contact = solver.medium.contact.as_ref().expect("a barrier");
    assert!(contact.slides() && contact.may_be_indefinite() && contact.has_friction() && contact.dissipates());
    let mut case = Case::new(passes(), Implicit, Trait::Small);
    // Two crossing edges press on each other from the beginning.
    case.state.contacts = vec![([0, 3], 0.7)];
    let mut solver = case.solver();
    let step = case.step();
    let [pressed, _] = residual(&mut solver, Problem::new(&case.model, &step), &case.trial);
    case.state.contacts.clear();
    let mut solver = case.solver();
    let step = case.step();
    let [free, _] = residual(&mut solver, Problem::new(&case.model, &step), &case.trial);
    let force: Vec<f64> = free.iter().zip(&pressed).map(|(free, pressed)| free - pressed).collect();
    let dofs = case.model.network().node_dofs();
    let on = |nodes: [usize; 3]| {
        nodes.map(|k| Vec3::new(force[dofs[k]], force[dofs[k] + 1], force[dofs[k] + 2])).iter().sum::<Vec3>()
    };
    let (below, above) = (on([0, 1, 2]), on([3, 4, 5]));
    assert!((below + Vec3::z() * 0.7).norm() < 1e-12 && (below + above).norm() < 1e-12, "{below} {above}");
}
