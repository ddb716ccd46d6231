//! Resistance of a filament to spinning about its own centreline: `4 pi mu a^2` torque per length per angular velocity.
//!
//! Stokeslets give none; for Lim et al.'s flagella it adds about a tenth to the torque (docs/theory, "Twist drag").

use crate::linear::pattern::Pattern;
use crate::rod::assembly::{Assembly, Element, Increment};
use crate::rod::configuration::Configuration;
use crate::rod::network::Network;
use crate::rod::term::{External, Purpose, Term, TermError};

/// Twist drag of the immersed edges.
pub struct TwistDrag {
    edges: Vec<usize>,
    coefficients: Vec<f64>,
    elements: Vec<Element>,
}

impl TwistDrag {
    /// `coefficients` are torque per angular velocity of each listed edge, N m s.
    pub fn new(network: &Network, edges: Vec<usize>, coefficients: Vec<f64>) -> Self {
        let elements = edges
            .iter()
            .map(|&edge| {
                let [i, j] = network.edges()[edge].map(|node| network.node_dofs()[node]);
                Element::new(vec![i, i + 1, i + 2, network.edge_dofs()[edge], j, j + 1, j + 2])
            })
            .collect();
        Self { edges, coefficients, elements }
    }
}

impl Term for TwistDrag {
    fn name(&self) -> &'static str {
        "twist drag"
    }

    fn stencils(&self) -> Vec<Vec<usize>> {
        self.elements.iter().map(|element| element.dofs.clone()).collect()
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.elements.iter_mut().for_each(|element| element.bind(pattern));
    }
}

impl External for TwistDrag {
    fn purpose(&self) -> Purpose {
        Purpose::TwistDrag
    }

    fn add(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) -> Result<(), TermError> {
        for ((&edge, &coefficient), element) in self.edges.iter().zip(&self.coefficients).zip(&self.elements) {
            // Frames transported in time do not spin, so the material's spin in a step is the change of its angle.
            let dof = element.dofs[3];
            let rate = coefficient * increment.rate;
            let background = increment.background.map_or(0.0, |background| background.edge_spins[edge]);
            let torque = coefficient * (increment.rate_of(dof, configuration.q()[dof]) - background);
            // A torque about the tangent does work on the holonomy of the frame too; without its share on the nodes the total
            // torque would balance to second order in the step only.
            let spin = configuration.holonomy(edge).gradient;
            let slope = [-spin.x, -spin.y, -spin.z, 1.0, spin.x, spin.y, spin.z];
            let residual = slope.map(|component| component * torque);
            if out.jacobian.is_none() {
                element.add(&residual, None, out);
                continue;
            }
            // The derivative of the holonomy itself, torque times curvature of the sphere, is left out: far below the elastic
            // stiffness, it costs Newton nothing.
            let mut matrix = [0.0; 49];
            for row in 0..7 {
                matrix[row + 7 * 3] = slope[row] * rate;
            }
            element.add(&residual, Some(&matrix), out);
        }
        Ok(())
    }
}
