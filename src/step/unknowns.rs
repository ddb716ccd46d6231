//! The unknowns of a step.

use crate::kinematics::manifold::{Manifold, VectorSpace};

/// A trial solution: degrees of freedom, the force density on the fluid if that is nonlocal and implicit, and the tensions of edges as
/// Newton's method sees them, linear from iterate to iterate.
#[derive(Debug, Clone, Default)]
pub struct Unknowns {
    /// Degrees of freedom.
    pub q: Vec<f64>,
    /// Force density at the immersed nodes, N/m.
    pub density: Vec<f64>,
    /// Tensions, N.
    pub tensions: Vec<f64>,
}

impl Unknowns {
    /// Sets these to what is `part` of the way from others along a direction.
    pub fn advance(&mut self, from: &Self, direction: &Self, part: f64) {
        space(&self.q).retract(&from.q, &direction.q, part, &mut self.q);
        space(&self.density).retract(&from.density, &direction.density, part, &mut self.density);
        space(&self.tensions).retract(&from.tensions, &direction.tensions, part, &mut self.tensions);
    }

    /// Sets these to the direction that leads from one to another.
    pub fn difference(&mut self, from: &Self, to: &Self) {
        space(&self.q).difference(&from.q, &to.q, &mut self.q);
        space(&self.density).difference(&from.density, &to.density, &mut self.density);
        space(&self.tensions).difference(&from.tensions, &to.tensions, &mut self.tensions);
    }
}

/// The space of these unknowns: every degree of freedom of today is a number.
fn space(values: &[f64]) -> VectorSpace {
    VectorSpace(values.len())
}
