//! Forces that a caller gives at the beginning of every step, with or without their derivative.
//!
//! Forces `F` on nodes and torques on edges are those of the state at the beginning of the step, held through it. With a stiffness
//! `K = -dF/dx` of every node's force against its own displacement they follow the step, `F - K (x - x_n)`, so that stiff springs
//! do not limit the step.

use std::sync::Arc;

use crate::rod::configuration::{Configuration, node};
use crate::rod::network::Network;
use crate::signal::SignalError;
use crate::{Mat3, Vec3};

/// What a caller's function sees: the state at the beginning of a step.
#[derive(Debug, Clone)]
pub struct Surroundings {
    /// Time, s.
    pub time: f64,
    /// Positions of the nodes, m.
    pub nodes: Vec<Vec3>,
    /// Their velocities over the last step, m/s.
    pub velocities: Vec<Vec3>,
    /// Directors `m1, m2, t` of every edge.
    pub directors: Vec<[Vec3; 3]>,
}

/// What a caller's function gives.
#[derive(Debug, Clone, Default)]
pub struct Given {
    /// Force on every node, N.
    pub forces: Vec<Vec3>,
    /// Torque on every edge, N m; empty for none.
    pub torques: Vec<Vec3>,
    /// Minus the derivative of every node's force with respect to its own position, N/m; empty for none.
    pub stiffness: Vec<Mat3>,
}

/// A caller's function.
pub type ForceFunction = Arc<dyn Fn(&Surroundings) -> Result<Given, SignalError> + Send + Sync>;

/// Generalised forces of one step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OutsideForce {
    forces: Vec<f64>,
    stiffness: Vec<Mat3>,
}

impl OutsideForce {
    /// From what a caller gave at a configuration; numbers of rows are those of the network.
    ///
    /// # Errors
    /// If an array has the wrong length or holds what is not finite.
    pub fn new(network: &Network, configuration: &Configuration, given: &Given) -> Result<Self, SignalError> {
        let (nodes, edges) = (network.node_dofs().len(), network.edges().len());
        let expect = |what: &str, rows: usize, expected: usize, optional: bool| -> Result<(), SignalError> {
            if rows == expected || (optional && rows == 0) {
                Ok(())
            } else {
                Err(format!("{what}: {rows} rows; must have {expected}").into())
            }
        };
        expect("forces", given.forces.len(), nodes, false)?;
        expect("torques", given.torques.len(), edges, true)?;
        expect("stiffness", given.stiffness.len(), nodes, true)?;
        let vectors = given.forces.iter().chain(&given.torques).flat_map(|v| v.iter());
        if vectors.chain(given.stiffness.iter().flat_map(|m| m.iter())).any(|value| !value.is_finite()) {
            return Err("forces, torques or stiffness that are not finite".into());
        }
        let mut forces = vec![0.0; configuration.q().len()];
        let mut add = |dof: usize, force: Vec3| (0..3).for_each(|c| forces[dof + c] += force[c]);
        for (&dof, force) in network.node_dofs().iter().zip(&given.forces) {
            add(dof, *force);
        }
        for (edge, torque) in given.torques.iter().enumerate() {
            let [i, j] = network.edges()[edge].map(|node| network.node_dofs()[node]);
            let pair = torque.cross(&configuration.tangent(edge)) / configuration.length(edge);
            add(i, -pair);
            add(j, pair);
        }
        for (edge, torque) in given.torques.iter().enumerate() {
            forces[network.edge_dofs()[edge]] += torque.dot(&configuration.tangent(edge));
        }
        Ok(Self { forces, stiffness: given.stiffness.clone() })
    }

    /// Takes the forces at `q` from the residual, with `start` the degrees of freedom at the beginning of the step.
    pub fn add(&self, node_dofs: &[usize], start: &[f64], q: &[f64], residual: &mut [f64]) {
        residual.iter_mut().zip(&self.forces).for_each(|(residual, force)| *residual -= force);
        for (&dof, block) in node_dofs.iter().zip(&self.stiffness) {
            let back = block * (node(q, dof) - node(start, dof));
            (0..3).for_each(|c| residual[dof + c] += back[c]);
        }
    }

    /// Stiffness of every node; empty for none.
    pub fn stiffness(&self) -> &[Mat3] {
        &self.stiffness
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rod::reference::ReferenceFrames;

    fn bar() -> (Network, Configuration, Vec<f64>) {
        let nodes = [Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0)];
        let network = Network::new(2, &[[0, 1]], &[]).expect("one edge is a network");
        let frames = ReferenceFrames::of_shape(&network, &nodes, &|_| None);
        let mut q = vec![0.0; network.dof_count()];
        q[network.node_dofs()[1]] = 2.0;
        let mut configuration = Configuration::new(&network, q.len());
        assert!(configuration.update(&network, &q, &frames, &[]));
        (network, configuration, q)
    }

    #[test]
    fn a_torque_on_an_edge_is_a_pair_of_forces_and_a_moment() {
        let (network, configuration, q) = bar();
        let torque = Vec3::new(3.0, 0.0, 4.0);
        let given = Given { forces: vec![Vec3::zeros(); 2], torques: vec![torque], stiffness: vec![] };
        let outside = OutsideForce::new(&network, &configuration, &given).expect("the rows fit");
        let mut residual = vec![0.0; q.len()];
        outside.add(network.node_dofs(), &q, &q, &mut residual);
        let [i, j] = [network.node_dofs()[0], network.node_dofs()[1]];
        let total = node(&q, j).cross(&-node(&residual, j)) - Vec3::x() * residual[network.edge_dofs()[0]];
        assert_eq!(node(&residual, i), -node(&residual, j));
        assert!((total - torque).norm() < 1e-15, "{total}");
    }

    #[test]
    fn a_stiffness_pulls_back_what_moves() {
        let (network, configuration, q) = bar();
        let spring = Mat3::new(2.0, 0.5, 0.0, 0.5, 3.0, 0.0, 0.0, 0.0, 1.0);
        let given = Given { forces: vec![Vec3::zeros(); 2], torques: vec![], stiffness: vec![spring; 2] };
        let outside = OutsideForce::new(&network, &configuration, &given).expect("the rows fit");
        let mut moved = q.clone();
        moved[network.node_dofs()[1]] += 0.1;
        let mut residual = vec![0.0; q.len()];
        outside.add(network.node_dofs(), &q, &moved, &mut residual);
        let force = -node(&residual, network.node_dofs()[1]);
        assert!((force - Vec3::new(-0.2, -0.05, 0.0)).norm() < 1e-15, "{force}");
    }

    #[test]
    fn wrong_rows_and_numbers_are_named() {
        let (network, configuration, _) = bar();
        let given = Given { forces: vec![Vec3::zeros(); 3], ..Given::default() };
        let error = OutsideForce::new(&network, &configuration, &given).expect_err("three rows for two nodes");
        assert!(error.to_string().contains("forces: 3 rows; must have 2"), "{error}");
        let given = Given { forces: vec![Vec3::new(f64::NAN, 0.0, 0.0); 2], ..Given::default() };
        assert!(OutsideForce::new(&network, &configuration, &given).is_err());
    }
}
