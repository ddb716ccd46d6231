//! Forces and torques whose directions are fixed in the material frame of an edge and turn with it.

use super::channels::{VectorChannels, vector};
use super::edge_vector::{ANGLE, EdgeVector, Hessian7, LAST, edge_dofs, spin_derivative, spread};
use crate::Vec3;
use crate::linear::pattern::Pattern;
use crate::rod::assembly::{Assembly, Element, Increment};
use crate::rod::configuration::Configuration;
use crate::rod::network::Network;
use crate::rod::term::{External, Purpose, Term, TermError};

/// Forces on the nodes of edges, with components on `m1, m2, t` that follow a signal.
pub struct FollowerForce {
    edges: Vec<(usize, [f64; 2])>,
    force: VectorChannels,
    elements: Vec<Element>,
}

impl FollowerForce {
    /// `edges` come with the factors on the signal at their first and last node: 1 for a force in N, a length for a force per length.
    pub fn new(network: &Network, edges: Vec<(usize, [f64; 2])>, force: VectorChannels) -> Self {
        let elements = edges.iter().map(|&(edge, _)| Element::new(edge_dofs(network, edge))).collect();
        Self { edges, force, elements }
    }
}

impl Term for FollowerForce {
    fn name(&self) -> &'static str {
        "follower forces"
    }

    fn stencils(&self) -> Vec<Vec<usize>> {
        self.elements.iter().map(|element| element.dofs.clone()).collect()
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.elements.iter_mut().for_each(|element| element.bind(pattern));
    }
}

impl External for FollowerForce {
    fn purpose(&self) -> Purpose {
        Purpose::Load
    }

    fn add(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) -> Result<(), TermError> {
        let components = vector(self.force, increment.inputs);
        for (&(edge, weights), element) in self.edges.iter().zip(&self.elements) {
            let force = EdgeVector::new(configuration, edge, components);
            let rows = [(0, weights[0]), (LAST, weights[1])];
            let mut residual = [0.0; 7];
            for (row, weight) in rows {
                (0..3).for_each(|c| residual[row + c] = -weight * force.value[c]);
            }
            if out.jacobian.is_none() {
                element.add(&residual, None, out);
                continue;
            }
            let (by_edge, by_angle) = (force.by_edge(), force.by_angle());
            let mut matrix = Hessian7::zeros();
            for (row, weight) in rows {
                matrix.fixed_view_mut::<3, 3>(row, 0).copy_from(&(by_edge * weight));
                matrix.fixed_view_mut::<3, 3>(row, LAST).copy_from(&(by_edge * -weight));
                matrix.fixed_view_mut::<3, 1>(row, ANGLE).copy_from(&(by_angle * -weight));
            }
            element.add(&residual, Some(matrix.as_slice()), out);
        }
        Ok(())
    }
}

/// Torques on edges, with components on `m1, m2, t` that follow a signal.
pub struct FollowerTorque {
    edges: Vec<(usize, f64)>,
    torque: VectorChannels,
    elements: Vec<Element>,
}

impl FollowerTorque {
    /// `edges` come with the factor on the signal: 1 for a torque in N m, a length for a torque per length.
    pub fn new(network: &Network, edges: Vec<(usize, f64)>, torque: VectorChannels) -> Self {
        let elements = edges.iter().map(|&(edge, _)| Element::new(edge_dofs(network, edge))).collect();
        Self { edges, torque, elements }
    }
}

impl Term for FollowerTorque {
    fn name(&self) -> &'static str {
        "follower torques"
    }

    fn stencils(&self) -> Vec<Vec<usize>> {
        self.elements.iter().map(|element| element.dofs.clone()).collect()
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.elements.iter_mut().for_each(|element| element.bind(pattern));
    }
}

impl External for FollowerTorque {
    fn purpose(&self) -> Purpose {
        Purpose::Load
    }

    fn add(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) -> Result<(), TermError> {
        let components = vector(self.torque, increment.inputs);
        for (&(edge, factor), element) in self.edges.iter().zip(&self.elements) {
            let torque = components * factor;
            let (t, length, holonomy) =
                (configuration.tangent(edge), configuration.length(edge), configuration.holonomy(edge));
            // T x t, which is fixed in the material frame as T is.
            let lever = EdgeVector::new(configuration, edge, Vec3::new(torque.y, -torque.x, 0.0));
            let force = spread(&(lever.value / length + holonomy.gradient * torque.z), torque.z);
            if out.jacobian.is_none() {
                element.add((-force).as_slice(), None, out);
                continue;
            }
            let by_edge = (lever.by_edge() - lever.value * t.transpose() / length) / length
                + spin_derivative(configuration, edge) * torque.z;
            let by_angle = lever.by_angle() / length;
            let mut matrix = Hessian7::zeros();
            for (row, sign) in [(0, -1.0), (LAST, 1.0)] {
                matrix.fixed_view_mut::<3, 3>(row, 0).copy_from(&(by_edge * sign));
                matrix.fixed_view_mut::<3, 3>(row, LAST).copy_from(&(by_edge * -sign));
                matrix.fixed_view_mut::<3, 1>(row, ANGLE).copy_from(&(by_angle * -sign));
            }
            element.add((-force).as_slice(), Some(matrix.as_slice()), out);
        }
        Ok(())
    }
}
