//! Terms that are neither elastic nor contact: their derivatives against differences, and what their forces must do.

mod common;

use common::{Random, chain_edges, chain_hinges, scene};
use flagrs::Vec3;
use flagrs::fluid::twist_drag::TwistDrag;
use flagrs::forces::inertia::Inertia;
use flagrs::forces::weight::Weight;
use flagrs::linear::pattern::Pattern;
use flagrs::model::Model;
use flagrs::rod::assembly::{Assembly, Increment};
use flagrs::rod::configuration::{Configuration, node};
use flagrs::rod::network::Network;
use flagrs::rod::term::External;
use flagrs::state::State;

const NODES: usize = 5;

/// A chain in a random shape, at the end of a step from another.
struct Step {
    network: Network,
    start: State,
    before: Vec<f64>,
    after: Vec<f64>,
    drift: Vec<f64>,
    velocity: Vec<f64>,
}

impl Step {
    fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let shape: Vec<Vec3> = (0..NODES).map(|k| Vec3::new(k as f64, 0.0, 0.0) + random.vector(0.3)).collect();
        let model = Model::new(scene(shape, chain_edges(NODES), chain_hinges(NODES))).expect("a chain");
        let start = State::initial(&model).expect("a shape");
        let before = start.q.clone();
        let mut noise = |size: f64| (0..before.len()).map(|_| size * random.uniform()).collect::<Vec<f64>>();
        let (moves, drift, velocity) = (noise(0.2), noise(0.1), noise(0.4));
        let after = before.iter().zip(&moves).map(|(q, d)| q + d).collect();
        Self { network: model.network().clone(), start, before, after, drift, velocity }
    }

    fn increment(&self) -> Increment<'_> {
        Increment {
            time: 0.0,
            rate: 3.0,
            previous: &self.before,
            drift: &self.drift,
            velocity: &self.velocity,
            velocity_drift: &self.drift,
            inputs: &[],
            motor_torques: &[],
            background: None,
        }
    }

    fn configuration(&self, q: &[f64]) -> Configuration {
        let mut configuration = Configuration::new(&self.network, q.len());
        assert!(configuration.update(&self.network, q, &self.start.frames, &[]));
        configuration
    }

    fn residual(&self, term: &dyn External, q: &[f64]) -> Vec<f64> {
        let mut residual = vec![0.0; q.len()];
        let mut out = Assembly { residual: &mut residual, jacobian: None };
        term.add(&self.configuration(q), &self.increment(), &mut out).expect("there is a force");
        residual
    }

    /// Column-major dense derivative as the term hands it in, and the residual beside it.
    fn derivative(&self, term: &mut dyn External) -> (Vec<f64>, Vec<f64>) {
        let size = self.after.len();
        let diagonal: Vec<Vec<usize>> = (0..size).map(|dof| vec![dof]).collect();
        let stencils = term.stencils();
        let all = stencils.iter().chain(&diagonal).map(Vec::as_slice);
        let pattern = Pattern::from_stencils(size, all);
        term.bind(&pattern);
        let (mut residual, mut values) = (vec![0.0; size], vec![0.0; pattern.entries()]);
        let mut out = Assembly { residual: &mut residual, jacobian: Some(&mut values) };
        term.add(&self.configuration(&self.after), &self.increment(), &mut out).expect("there is a force");
        let mut dense = vec![0.0; size * size];
        for column in 0..size {
            for slot in pattern.column_starts()[column]..pattern.column_starts()[column + 1] {
                dense[pattern.row_indices()[slot] + size * column] = values[slot];
            }
        }
        (dense, residual)
    }

    /// Central difference of the residual by a degree of freedom.
    fn difference(&self, term: &dyn External, dof: usize) -> Vec<f64> {
        let h = 1e-5;
        let at = |shift: f64| {
            let mut q = self.after.clone();
            q[dof] += shift;
            self.residual(term, &q)
        };
        at(h).iter().zip(at(-h)).map(|(plus, minus)| (plus - minus) / (2.0 * h)).collect()
    }
}

fn assert_column(dense: &[f64], expected: &[f64], column: usize, size: f64) {
    for (row, value) in expected.iter().enumerate() {
        let found = dense[row + expected.len() * column];
        assert!((found - value).abs() < 1e-7 * size, "row {row}, column {column}: {found} instead of {value}");
    }
}

#[test]
fn inertia_has_the_derivative_of_its_residual() {
    let step = Step::new(1);
    let mass: Vec<f64> = (0..step.after.len()).map(|k| 0.5 + k as f64).collect();
    let mut inertia = Inertia::new(mass.clone());
    let (dense, residual) = step.derivative(&mut inertia);
    for column in 0..step.after.len() {
        assert_column(&dense, &step.difference(&inertia, column), column, 200.0);
    }
    assert_eq!(residual, step.residual(&inertia, &step.after));
}

#[test]
fn inertia_is_mass_times_the_second_difference_of_positions() {
    // Backward Euler over equal steps: (q2 - 2 q1 + q0) / dt^2.
    let mut step = Step::new(2);
    let dt = 1.0 / step.increment().rate;
    step.drift.iter_mut().for_each(|drift| *drift = 0.0);
    let earlier: Vec<f64> = step.before.iter().zip(&step.velocity).map(|(q, v)| q - dt * v).collect();
    let residual = step.residual(&Inertia::new(vec![2.0; step.after.len()]), &step.after);
    for (dof, found) in residual.iter().enumerate() {
        let expected = 2.0 * (step.after[dof] - 2.0 * step.before[dof] + earlier[dof]) / (dt * dt);
        assert!((found - expected).abs() < 1e-10 * expected.abs().max(1.0));
    }
}

#[test]
fn loads_push_the_way_they_point() {
    let step = Step::new(3);
    let forces: Vec<f64> = (0..step.after.len()).map(|k| k as f64 - 4.0).collect();
    // The residual is what the other terms must balance: minus the force.
    let residual = step.residual(&Weight::new(forces.clone()), &step.after);
    assert!(residual.iter().zip(&forces).all(|(residual, force)| *residual == -force));
}

fn twist_drag(step: &Step) -> TwistDrag {
    TwistDrag::new(&step.network, vec![0, 2, 3], vec![0.7, 1.3, 0.4])
}

#[test]
fn twist_drag_has_the_derivative_by_angles_of_its_residual() {
    let step = Step::new(4);
    let mut drag = twist_drag(&step);
    let (dense, residual) = step.derivative(&mut drag);
    let size = residual.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    assert!(size > 0.1);
    for &column in step.network.edge_dofs() {
        assert_column(&dense, &step.difference(&drag, column), column, 3.0 * size);
    }
    // What is left out by positions is the derivative of the holonomy alone, smaller than the drag's own.
    let rows = step.after.len();
    for &column in step.network.node_dofs() {
        assert!(dense[rows * column..rows * (column + 1)].iter().all(|value| *value == 0.0));
    }
}

#[test]
fn twist_drag_takes_power_from_every_spin() {
    let mut step = Step::new(5);
    step.drift.iter_mut().for_each(|drift| *drift = 0.0);
    let residual = step.residual(&twist_drag(&step), &step.after);
    for (edge, coefficient) in [(0, 0.7), (2, 1.3), (3, 0.4)] {
        let dof = step.network.edge_dofs()[edge];
        let rate = step.increment().rate * (step.after[dof] - step.before[dof]);
        assert!((residual[dof] - coefficient * rate).abs() < 1e-12);
    }
    assert_eq!(residual[step.network.edge_dofs()[1]], 0.0);
}

/// Parallel transport of a vector from one unit tangent to another, by the rotation that takes one into the other.
fn transported(vector: Vec3, from: Vec3, to: Vec3) -> Vec3 {
    let axis = from.cross(&to);
    let cosine = from.dot(&to);
    vector * cosine + axis.cross(&vector) + axis * (axis.dot(&vector) / (1.0 + cosine))
}

/// Angle of the material director of an edge against its transported reference when everything is turned as a rigid body.
fn angle_after_turn(step: &Step, edge: usize, axis: Vec3, angle: f64) -> f64 {
    let configuration = step.configuration(&step.after);
    let turn = nalgebra::Rotation3::from_scaled_axis(axis * angle);
    let tangent = turn * configuration.tangent(edge);
    let material = turn * configuration.material(edge)[0];
    let reference = transported(step.start.frames.directors[edge], step.start.frames.tangents[edge], tangent);
    reference.cross(&material).dot(&tangent).atan2(reference.dot(&material))
}

#[test]
fn twist_drag_exerts_its_torques_about_the_tangents_and_no_others() {
    // The work of its residual on a rigid turn about any axis is that of its torques about the tangents.
    let step = Step::new(6);
    let residual = step.residual(&twist_drag(&step), &step.after);
    let configuration = step.configuration(&step.after);
    for axis in [Vec3::x(), Vec3::y(), Vec3::z(), Vec3::new(0.3, -0.5, 0.8)] {
        let mut work = 0.0;
        for &dof in step.network.node_dofs() {
            let turned = axis.cross(&node(&step.after, dof));
            work += (0..3).map(|c| residual[dof + c] * turned[c]).sum::<f64>();
        }
        let (mut expected, mut total) = (0.0, 0.0);
        for edge in [0, 2, 3] {
            let torque = residual[step.network.edge_dofs()[edge]];
            let h = 1e-5;
            let rate = (angle_after_turn(&step, edge, axis, h) - angle_after_turn(&step, edge, axis, -h)) / (2.0 * h);
            work += torque * rate;
            expected += torque * axis.dot(&configuration.tangent(edge));
            total += torque.abs();
        }
        assert!((work - expected).abs() < 1e-8 * total, "{work} instead of {expected}");
    }
}
