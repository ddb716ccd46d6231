//! Residuals and derivatives of loads: against central differences, and against the work of forces and torques.

mod common;

use common::Random;
use flagrs::forces::channels::{Channels, VectorChannels};
use flagrs::forces::edge_vector::{EdgeVector, edge_dofs};
use flagrs::forces::follower::{FollowerForce, FollowerTorque};
use flagrs::forces::laboratory::{EdgeTorque, NodeForce};
use flagrs::forces::magnetic::Magnetism;
use flagrs::linear::pattern::Pattern;
use flagrs::rod::assembly::{Assembly, Increment};
use flagrs::rod::configuration::Configuration;
use flagrs::rod::network::Network;
use flagrs::rod::reference::ReferenceFrames;
use flagrs::rod::term::External;
use flagrs::{Mat3, Vec3};

/// Two edges, frames of a reference shape, and degrees of freedom away from it.
struct Case {
    network: Network,
    frames: ReferenceFrames,
    q: Vec<f64>,
    inputs: Vec<f64>,
}

const FORCE: [f64; 3] = [0.7, -0.4, 1.1];

impl Case {
    fn new(random: &mut Random, displacement: f64) -> Self {
        let nodes: Vec<Vec3> = (0..3).map(|k| Vec3::new(k as f64, 0.0, 0.0) + random.vector(0.4)).collect();
        let network = Network::new(3, &[[0, 1], [1, 2]], &[[0, 1]]).unwrap();
        let frames = ReferenceFrames::of_shape(&network, &nodes, &|_| None);
        let mut q = vec![0.0; network.dof_count()];
        for (node, &dof) in nodes.iter().zip(network.node_dofs()) {
            (0..3).for_each(|c| q[dof + c] = node[c] + displacement * random.uniform());
        }
        network.edge_dofs().iter().for_each(|&dof| q[dof] = 2.0 * random.uniform());
        Self { network, frames, q, inputs: FORCE.to_vec() }
    }

    fn channels() -> VectorChannels {
        Channels::default().take_vector()
    }

    fn configuration(&self, q: &[f64]) -> Configuration {
        let mut configuration = Configuration::new(&self.network, q.len());
        assert!(configuration.update(&self.network, q, &self.frames, &[]));
        configuration
    }

    fn evaluate(&self, term: &dyn External, q: &[f64], jacobian: Option<&mut [f64]>) -> Vec<f64> {
        let zero = vec![0.0; q.len()];
        let increment = Increment {
            time: 0.0,
            rate: 1.0,
            previous: &zero,
            drift: &zero,
            velocity: &zero,
            velocity_drift: &zero,
            inputs: &self.inputs,
            motor_torques: &[],
            background: None,
        };
        let mut residual = vec![0.0; q.len()];
        term.add(&self.configuration(q), &increment, &mut Assembly { residual: &mut residual, jacobian })
            .expect("there is a force");
        residual
    }
}

/// Fourth-order central differences of a vector function.
fn difference(q: &[f64], dof: usize, value: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let h = 2e-3;
    let at = |shift: f64| {
        let mut moved = q.to_vec();
        moved[dof] += shift;
        value(&moved)
    };
    let (a, b, c, d) = (at(h), at(-h), at(0.5 * h), at(-0.5 * h));
    (0..a.len()).map(|k| (4.0 * (c[k] - d[k]) / h - (a[k] - b[k]) / (2.0 * h)) / 3.0).collect()
}

fn check_derivative(case: &Case, term: &mut dyn External) {
    let stencils = term.stencils();
    let pattern = Pattern::from_stencils(case.q.len(), stencils.iter().map(Vec::as_slice));
    term.bind(&pattern);
    let mut values = vec![0.0; pattern.entries()];
    case.evaluate(term, &case.q, Some(&mut values));
    for column in 0..case.q.len() {
        let expected = difference(&case.q, column, &|q| case.evaluate(term, q, None));
        for (row, expected) in expected.iter().enumerate() {
            let found = pattern.slot(row, column).map_or(0.0, |slot| values[slot]);
            // The differences' own error is some 1e-9.
            assert!((found - expected).abs() < 1e-8, "{} ({row}, {column}): {found} {expected}", term.name());
        }
    }
}

fn terms(network: &Network) -> Vec<Box<dyn External>> {
    let channels = Case::channels();
    let gradient = Mat3::new(0.3, 0.2, -0.5, 0.2, 0.4, 0.1, -0.5, 0.1, -0.7);
    let moments = vec![(0, Vec3::new(0.5, -0.3, 0.8)), (1, Vec3::new(-0.2, 0.6, 0.4))];
    vec![
        Box::new(NodeForce::new(network, &[(0, 1.0), (2, 0.5)], channels)),
        Box::new(EdgeTorque::new(network, vec![(0, 1.0), (1, 0.4)], channels)),
        Box::new(FollowerForce::new(network, vec![(0, [1.0, 0.0]), (1, [0.3, 0.8])], channels)),
        Box::new(FollowerTorque::new(network, vec![(0, 0.6), (1, 1.0)], channels)),
        Box::new(Magnetism::new(network, moments, channels, gradient)),
    ]
}

#[test]
fn derivatives_of_loads_agree_with_differences() {
    let mut random = Random::new(11);
    for displacement in [0.0, 0.3] {
        for _ in 0..3 {
            let case = Case::new(&mut random, displacement);
            for mut term in terms(&case.network) {
                check_derivative(&case, &mut *term);
            }
        }
    }
}

#[test]
fn magnetic_residual_is_the_gradient_of_the_energy() {
    let mut random = Random::new(12);
    let case = Case::new(&mut random, 0.3);
    let channels = Case::channels();
    let gradient = Mat3::new(0.3, 0.2, -0.5, 0.2, 0.4, 0.1, -0.5, 0.1, -0.7);
    let magnetism = Magnetism::new(&case.network, vec![(1, Vec3::new(0.5, -0.3, 0.8))], channels, gradient);
    let residual = case.evaluate(&magnetism, &case.q, None);
    for (dof, found) in residual.iter().enumerate() {
        let energy = |q: &[f64]| vec![magnetism.energy(&case.configuration(q), &case.inputs)];
        let expected = difference(&case.q, dof, &energy)[0];
        assert!((found - expected).abs() < 1e-9, "dof {dof}: {found} {expected}");
    }
}

/// The torque of generalised forces about the origin: lever arms of the nodal forces, and moments about tangents.
fn total_torque(case: &Case, residual: &[f64]) -> Vec3 {
    let configuration = case.configuration(&case.q);
    let nodes = case.network.node_dofs().iter().map(|&dof| {
        let at = |values: &[f64]| Vec3::new(values[dof], values[dof + 1], values[dof + 2]);
        at(&case.q).cross(&-at(residual))
    });
    let spins = (0..2).map(|edge| configuration.tangent(edge) * -residual[case.network.edge_dofs()[edge]]);
    nodes.chain(spins).sum()
}

#[test]
fn torques_on_edges_add_up_to_what_was_asked_for() {
    let mut random = Random::new(13);
    // At the reference frames, where no holonomy blurs the angle's own torque.
    let case = Case::new(&mut random, 0.0);
    let channels = Case::channels();
    let torque = EdgeTorque::new(&case.network, vec![(1, 2.0)], channels);
    let found = total_torque(&case, &case.evaluate(&torque, &case.q, None));
    assert!((found - Vec3::from(FORCE) * 2.0).norm() < 1e-13, "{found}");
    let follower = FollowerTorque::new(&case.network, vec![(0, 1.0)], channels);
    let configuration = case.configuration(&case.q);
    let expected = EdgeVector::new(&configuration, 0, Vec3::from(FORCE)).value;
    let found = total_torque(&case, &case.evaluate(&follower, &case.q, None));
    assert!((found - expected).norm() < 1e-13, "{found} {expected}");
}

#[test]
fn magnetic_torque_is_moment_cross_field() {
    let mut random = Random::new(14);
    let case = Case::new(&mut random, 0.0);
    let channels = Case::channels();
    let components = Vec3::new(0.5, -0.3, 0.8);
    let magnetism = Magnetism::new(&case.network, vec![(0, components)], channels, Mat3::zeros());
    let moment = EdgeVector::new(&case.configuration(&case.q), 0, components).value;
    let found = total_torque(&case, &case.evaluate(&magnetism, &case.q, None));
    assert!((found - moment.cross(&Vec3::from(FORCE))).norm() < 1e-13, "{found}");
}

#[test]
fn edge_has_its_nodes_around_its_angle() {
    let network = Network::new(2, &[[0, 1]], &[]).unwrap();
    let dofs = edge_dofs(&network, 0);
    assert_eq!(dofs[3], network.edge_dofs()[0]);
    assert_eq!([dofs[0], dofs[4]], [network.node_dofs()[0], network.node_dofs()[1]]);
}
