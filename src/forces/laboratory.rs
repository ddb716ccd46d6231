//! Forces on nodes and torques on edges whose directions are fixed in the laboratory.
//!
//! A torque `T` on an edge does work on its rotation `t x de/l + (d theta + d beta) t`: its generalised force is `T x t / l` on the
//! edge vector and `T . t` on the angle, and on the edge vector again through the holonomy `beta`.

use super::channels::{VectorChannels, vector};
use super::edge_vector::{ANGLE, Gradient7, Hessian7, LAST, edge_dofs, spin_derivative, spread};
use crate::linear::pattern::Pattern;
use crate::rod::assembly::{Assembly, Element, Increment};
use crate::rod::configuration::Configuration;
use crate::rod::network::Network;
use crate::rod::term::{External, Purpose, Term, TermError};
use crate::{Mat3, Vec3};

/// A force that follows a signal, shared by nodes with weights.
pub struct NodeForce {
    dofs: Vec<(usize, f64)>,
    force: VectorChannels,
}

impl NodeForce {
    /// `nodes` come with the factor on the signal: 1 for a force in N, a length for a force per length.
    pub fn new(network: &Network, nodes: &[(usize, f64)], force: VectorChannels) -> Self {
        Self { dofs: nodes.iter().map(|&(node, weight)| (network.node_dofs()[node], weight)).collect(), force }
    }
}

impl Term for NodeForce {
    fn name(&self) -> &'static str {
        "forces"
    }

    fn stencils(&self) -> Vec<Vec<usize>> {
        Vec::new()
    }

    fn bind(&mut self, _: &Pattern) {}
}

impl External for NodeForce {
    fn purpose(&self) -> Purpose {
        Purpose::Load
    }

    fn add(&self, _: &Configuration, increment: &Increment, out: &mut Assembly) -> Result<(), TermError> {
        let force = vector(self.force, increment.inputs);
        for &(dof, weight) in &self.dofs {
            (0..3).for_each(|c| out.residual[dof + c] -= weight * force[c]);
        }
        Ok(())
    }
}

/// A torque that follows a signal, on edges with factors.
pub struct EdgeTorque {
    edges: Vec<(usize, f64)>,
    torque: VectorChannels,
    elements: Vec<Element>,
}

impl EdgeTorque {
    /// `edges` come with the factor on the signal: 1 for a torque in N m, a length for a torque per length.
    pub fn new(network: &Network, edges: Vec<(usize, f64)>, torque: VectorChannels) -> Self {
        let elements = edges.iter().map(|&(edge, _)| Element::new(edge_dofs(network, edge))).collect();
        Self { edges, torque, elements }
    }
}

/// Generalised force of a torque on an edge.
fn generalised(configuration: &Configuration, edge: usize, torque: &Vec3) -> Gradient7 {
    let (t, length) = (configuration.tangent(edge), configuration.length(edge));
    let spin = torque.dot(&t);
    spread(&(torque.cross(&t) / length + configuration.holonomy(edge).gradient * spin), spin)
}

/// Derivative of [`generalised`].
fn derivative(configuration: &Configuration, edge: usize, torque: &Vec3) -> Hessian7 {
    let (t, length) = (configuration.tangent(edge), configuration.length(edge));
    let holonomy = configuration.holonomy(edge);
    let spin = torque.dot(&t);
    let lever = torque.cross(&t);
    let spin_by_edge = (torque - t * spin) / length;
    let by_edge: Mat3 = (torque.cross_matrix() - lever * t.transpose() * 2.0) / (length * length)
        + holonomy.gradient * spin_by_edge.transpose()
        + spin_derivative(configuration, edge) * spin;
    let mut matrix = Hessian7::zeros();
    for (column, sign) in [(0, -1.0), (LAST, 1.0)] {
        matrix.fixed_view_mut::<3, 3>(0, column).copy_from(&(by_edge * -sign));
        matrix.fixed_view_mut::<3, 3>(LAST, column).copy_from(&(by_edge * sign));
        matrix.fixed_view_mut::<1, 3>(ANGLE, column).copy_from(&(spin_by_edge.transpose() * sign));
    }
    matrix
}

impl Term for EdgeTorque {
    fn name(&self) -> &'static str {
        "torques"
    }

    fn stencils(&self) -> Vec<Vec<usize>> {
        self.elements.iter().map(|element| element.dofs.clone()).collect()
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.elements.iter_mut().for_each(|element| element.bind(pattern));
    }
}

impl External for EdgeTorque {
    fn purpose(&self) -> Purpose {
        Purpose::Load
    }

    fn add(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) -> Result<(), TermError> {
        let torque = vector(self.torque, increment.inputs);
        for (&(edge, factor), element) in self.edges.iter().zip(&self.elements) {
            let torque = torque * factor;
            let force = -generalised(configuration, edge, &torque);
            if out.jacobian.is_none() {
                element.add(force.as_slice(), None, out);
                continue;
            }
            let matrix = -derivative(configuration, edge, &torque);
            element.add(force.as_slice(), Some(matrix.as_slice()), out);
        }
        Ok(())
    }
}
