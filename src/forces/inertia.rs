//! Inertia of nodes and edges, lumped.

use crate::linear::pattern::Pattern;
use crate::rod::assembly::{Assembly, Element, Increment};
use crate::rod::configuration::Configuration;
use crate::rod::term::{External, Term, TermError};

/// Lumped inertia, implicit: mass times the backward difference of rates, `M (q - q_n - dt v_n) / dt^2` at first
/// order (equation 9).
pub struct Inertia {
    mass: Vec<f64>,
    elements: Vec<Element>,
}

impl Inertia {
    /// `mass` of every degree of freedom: kg for positions, kg m^2 for angles, zero for those without inertia.
    pub fn new(mass: Vec<f64>) -> Self {
        let elements = (0..mass.len()).map(|dof| Element::new(vec![dof])).collect();
        Self { mass, elements }
    }
}

impl Term for Inertia {
    fn name(&self) -> &'static str {
        "inertia"
    }

    fn stencils(&self) -> Vec<Vec<usize>> {
        Vec::new()
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.elements.iter_mut().for_each(|element| element.bind(pattern));
    }
}

impl External for Inertia {
    fn add(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) -> Result<(), TermError> {
        for (dof, (&mass, element)) in self.mass.iter().zip(&self.elements).enumerate() {
            let gain = increment.rate_of(dof, configuration.q()[dof]) - increment.velocity[dof];
            let acceleration = increment.rate * gain + increment.velocity_drift[dof];
            element.add(&[mass * acceleration], Some(&[mass * increment.rate * increment.rate]), out);
        }
        Ok(())
    }
}
