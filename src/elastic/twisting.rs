//! Twisting of a hinge: `1/2 GJ (tau - tau0)^2 / lbar` (equation 8).

use crate::rod::strain::{Gradient8, Hessian8, HingeStrain};

/// Twisting stiffness and natural twist of one hinge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twisting {
    /// `GJ / lbar`, N m.
    pub stiffness: f64,
    /// Natural twist, rad.
    pub natural: f64,
}

impl Twisting {
    /// Twisting moment, N m: what the second edge's side must be held with.
    pub fn moment(&self, strain: &HingeStrain) -> f64 {
        self.stiffness * (strain.tau - self.natural)
    }

    /// Energy, J.
    pub fn energy(&self, strain: &HingeStrain) -> f64 {
        0.5 * self.moment(strain) * (strain.tau - self.natural)
    }

    /// Adds gradient and, if wanted, Hessian in the hinge's variables.
    #[inline]
    pub fn add(&self, strain: &HingeStrain, gradient: &mut Gradient8, hessian: Option<&mut Hessian8>) {
        let moment = self.moment(strain);
        let slope = strain.twist_gradient();
        *gradient += slope * moment;
        let Some(hessian) = hessian else { return };
        hessian.ger(self.stiffness, &slope, &slope, 1.0);
        strain.add_twist_hessian(moment, hessian);
    }
}
