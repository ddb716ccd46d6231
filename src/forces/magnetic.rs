//! Magnetised edges in a magnetic field: energy `-m . B` at their midpoints.
//!
//! The moment `m` of an edge is fixed in its material frame; the field is `B(x, t) = B0(t) + G x`. The torque is `m x B`, the
//! force `G^T m`.

use super::channels::{VectorChannels, vector};
use super::edge_vector::{ANGLE, EdgeVector, Gradient7, Hessian7, LAST, edge_dofs};
use crate::linear::pattern::Pattern;
use crate::rod::assembly::{Assembly, Element, Increment};
use crate::rod::configuration::{Configuration, node};
use crate::rod::network::Network;
use crate::rod::term::{External, Purpose, Term, TermError};
use crate::{Mat3, Vec3};

/// The magnetic energy of a scene's magnetised edges.
pub struct Magnetism {
    moments: Vec<(usize, Vec3)>,
    field: VectorChannels,
    gradient: Mat3,
    elements: Vec<Element>,
}

impl Magnetism {
    /// `moments` are edges with their moments on `m1, m2, t`, A m^2; `field` is that at the origin, T; `gradient` is `dB_i/dx_j`, T/m.
    pub fn new(network: &Network, moments: Vec<(usize, Vec3)>, field: VectorChannels, gradient: Mat3) -> Self {
        let elements = moments.iter().map(|&(edge, _)| Element::new(edge_dofs(network, edge))).collect();
        Self { moments, field, gradient, elements }
    }

    fn field_at(&self, configuration: &Configuration, element: &Element, inputs: &[f64]) -> Vec3 {
        let (first, last) = (node(configuration.q(), element.dofs[0]), node(configuration.q(), element.dofs[LAST]));
        vector(self.field, inputs) + self.gradient * (first + last) * 0.5
    }

    /// Energy in the field, J.
    pub fn energy(&self, configuration: &Configuration, inputs: &[f64]) -> f64 {
        let own = |((edge, moment), element): (&(usize, Vec3), &Element)| {
            let moment = EdgeVector::new(configuration, *edge, *moment).value;
            -moment.dot(&self.field_at(configuration, element, inputs))
        };
        self.moments.iter().zip(&self.elements).map(own).sum()
    }
}

impl Term for Magnetism {
    fn name(&self) -> &'static str {
        "magnetism"
    }

    fn stencils(&self) -> Vec<Vec<usize>> {
        self.elements.iter().map(|element| element.dofs.clone()).collect()
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.elements.iter_mut().for_each(|element| element.bind(pattern));
    }
}

impl External for Magnetism {
    fn purpose(&self) -> Purpose {
        Purpose::Load
    }

    fn add(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) -> Result<(), TermError> {
        for (&(edge, components), element) in self.moments.iter().zip(&self.elements) {
            let moment = EdgeVector::new(configuration, edge, components);
            let field = self.field_at(configuration, element, increment.inputs);
            let pull = self.gradient.transpose() * moment.value * 0.5;
            let mut gradient: Gradient7 = -moment.gradient(&field);
            for row in [0, LAST] {
                let mut rows = gradient.fixed_rows_mut::<3>(row);
                rows -= pull;
            }
            if out.jacobian.is_none() {
                element.add(gradient.as_slice(), None, out);
                continue;
            }
            let mut hessian: Hessian7 = -moment.hessian(&field);
            // The field at the midpoint changes with both nodes: symmetric mixed terms.
            let by_edge = self.gradient.transpose() * moment.by_edge() * 0.5;
            let by_angle = self.gradient.transpose() * moment.by_angle() * 0.5;
            for row in [0, LAST] {
                for (column, sign) in [(0, -1.0), (LAST, 1.0)] {
                    let mut block = hessian.fixed_view_mut::<3, 3>(row, column);
                    block -= by_edge * sign;
                    let mut block = hessian.fixed_view_mut::<3, 3>(column, row);
                    block -= by_edge.transpose() * sign;
                }
                let mut block = hessian.fixed_view_mut::<3, 1>(row, ANGLE);
                block -= by_angle;
                let mut block = hessian.fixed_view_mut::<1, 3>(ANGLE, row);
                block -= by_angle.transpose();
            }
            element.add(gradient.as_slice(), Some(hessian.as_slice()), out);
        }
        Ok(())
    }
}
