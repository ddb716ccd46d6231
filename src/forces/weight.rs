//! Forces that do not depend on the state: weight less buoyancy.

use crate::linear::pattern::Pattern;
use crate::rod::assembly::{Assembly, Increment};
use crate::rod::configuration::Configuration;
use crate::rod::term::{External, Purpose, Term, TermError};

/// Forces that do not depend on the state: weight less buoyancy.
pub struct Weight {
    forces: Vec<f64>,
}

impl Weight {
    /// Generalised force on every degree of freedom.
    pub fn new(forces: Vec<f64>) -> Self {
        Self { forces }
    }
}

impl Term for Weight {
    fn name(&self) -> &'static str {
        "weight"
    }

    fn stencils(&self) -> Vec<Vec<usize>> {
        Vec::new()
    }

    fn bind(&mut self, _: &Pattern) {}
}

impl External for Weight {
    fn purpose(&self) -> Purpose {
        Purpose::Gravity
    }

    fn add(&self, _: &Configuration, _: &Increment, out: &mut Assembly) -> Result<(), TermError> {
        for (residual, force) in out.residual.iter_mut().zip(&self.forces) {
            *residual -= force;
        }
        Ok(())
    }
}
