//! Bending of a hinge: `1/2 (kappa - kappa0) . EI (kappa - kappa0) / lbar` with a 2x2 stiffness (equation 7).

use crate::rod::strain::{Gradient8, Hessian8, HingeStrain};

/// Bending stiffness and natural curvature of one hinge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bending {
    /// `EI / lbar`, symmetric, in the material directors, N m.
    pub stiffness: [[f64; 2]; 2],
    /// Integrated natural curvature.
    pub natural: [f64; 2],
}

impl Bending {
    fn moments(&self, strain: &HingeStrain) -> [f64; 2] {
        let d = [strain.kappa[0] - self.natural[0], strain.kappa[1] - self.natural[1]];
        self.stiffness.map(|row| row[0] * d[0] + row[1] * d[1])
    }

    /// Energy, J.
    pub fn energy(&self, strain: &HingeStrain) -> f64 {
        let moments = self.moments(strain);
        0.5 * (0..2).map(|a| moments[a] * (strain.kappa[a] - self.natural[a])).sum::<f64>()
    }

    /// Adds gradient and, if wanted, Hessian in the hinge's variables.
    #[inline]
    pub fn add(&self, strain: &HingeStrain, gradient: &mut Gradient8, hessian: Option<&mut Hessian8>) {
        let moments = self.moments(strain);
        let slopes = strain.curvature_gradients();
        *gradient += slopes[0] * moments[0] + slopes[1] * moments[1];
        let Some(hessian) = hessian else { return };
        // K is symmetric: sum_ab K_ab g_a g_b^T with K g_b taken first.
        for a in 0..2 {
            let weighted = slopes[0] * self.stiffness[a][0] + slopes[1] * self.stiffness[a][1];
            hessian.ger(1.0, &slopes[a], &weighted, 1.0);
        }
        strain.add_curvature_hessian(moments, &slopes, hessian);
    }
}
