//! The hinges' term: bending and twisting of every hinge, added in one pass over its strains.

use super::bending::Bending;
use super::twisting::Twisting;
use crate::linear::pattern::Pattern;
use crate::rod::assembly::{Assembly, HingeElement};
use crate::rod::configuration::Configuration;
use crate::rod::strain::{Gradient8, Hessian8};
use crate::rod::term::{Conservative, Term, TermError};

/// Bending and twisting of every hinge of a network.
pub struct Hinges {
    elements: Vec<HingeElement>,
    bending: Vec<Bending>,
    twisting: Vec<Twisting>,
}

impl Hinges {
    /// One element, bending and twisting law per hinge.
    pub fn new(elements: Vec<HingeElement>, bending: Vec<Bending>, twisting: Vec<Twisting>) -> Self {
        Self { elements, bending, twisting }
    }

    /// Bending energy, J.
    pub fn bending_energy(&self, configuration: &Configuration) -> f64 {
        self.bending.iter().enumerate().map(|(k, law)| law.energy(configuration.strain(k))).sum()
    }

    /// Twisting energy, J.
    pub fn twisting_energy(&self, configuration: &Configuration) -> f64 {
        self.twisting.iter().enumerate().map(|(k, law)| law.energy(configuration.strain(k))).sum()
    }

    /// Angle by which a straight hinge would be bent to have the curvature that this one has beyond its natural one, rad.
    pub fn bend(&self, hinge: usize, configuration: &Configuration) -> f64 {
        let (kappa, natural) = (configuration.strain(hinge).kappa, self.bending[hinge].natural);
        2.0 * (0.5 * (kappa[0] - natural[0]).hypot(kappa[1] - natural[1])).atan()
    }

    /// Size of the integrated curvature of a hinge without moment.
    pub fn natural_curvature(&self, hinge: usize) -> f64 {
        let natural = self.bending[hinge].natural;
        natural[0].hypot(natural[1])
    }

    /// Twist of a hinge without moment, rad.
    pub fn natural_twist(&self, hinge: usize) -> f64 {
        self.twisting[hinge].natural
    }

    /// Derivative of a hinge's energy with respect to the angles of its first and second edge, N m.
    pub fn moments(&self, hinge: usize, configuration: &Configuration) -> [f64; 2] {
        let mut gradient = Gradient8::zeros();
        let strain = configuration.strain(hinge);
        self.bending[hinge].add(strain, &mut gradient, None);
        self.twisting[hinge].add(strain, &mut gradient, None);
        [gradient[crate::rod::strain::THETA_E], gradient[crate::rod::strain::THETA_F]]
    }
}

impl Term for Hinges {
    fn name(&self) -> &'static str {
        "bending and twisting"
    }

    fn stencils(&self) -> Vec<Vec<usize>> {
        self.elements.iter().map(|element| element.dofs().to_vec()).collect()
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.elements.iter_mut().for_each(|element| element.bind(pattern));
    }
}

impl Conservative for Hinges {
    fn energies(&self, configuration: &Configuration, count: &mut dyn FnMut(&'static str, f64)) {
        count("bending", self.bending_energy(configuration));
        count("twisting", self.twisting_energy(configuration));
    }

    fn add(&self, configuration: &Configuration, _: f64, out: &mut Assembly) -> Result<(), TermError> {
        for (k, element) in self.elements.iter().enumerate() {
            let strain = configuration.strain(k);
            let mut gradient = Gradient8::zeros();
            let mut hessian = out.jacobian.is_some().then(Hessian8::zeros);
            self.bending[k].add(strain, &mut gradient, hessian.as_mut());
            self.twisting[k].add(strain, &mut gradient, hessian.as_mut());
            element.add(configuration, gradient, hessian, out);
        }
        Ok(())
    }
}
