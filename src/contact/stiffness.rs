//! How stiff the contact of two bodies is: given, or from the forces that either typically bears.
//!
//! The force per length that a pair bears is what drives either body, or what bends the softer one: a stiff rod does not make
//! the contact of soft ones stiff. It is to hold centrelines at the sum `xi` of the radii, the middle of the range, where the barrier's slope is
//! `(ln 2 + 1/2) 2 delta xi`:
//!
//! ```text
//!   kappa = f / ((ln 2 + 1/2) 2 delta xi),     f = max(driven_a, driven_b, min(bent_a, bent_b))
//! ```

use std::f64::consts::LN_2;

/// The stiffness `kappa` of every pair.
#[derive(Clone, Debug, PartialEq)]
pub enum Stiffness {
    /// The same for all pairs, Pa.
    Uniform(f64),
    /// From typical forces per length of every body, N/m.
    Typical {
        /// Of what moves it: drag, weight, loads.
        driven: Vec<f64>,
        /// What bends it much, infinite for what is held everywhere; the smaller of two counts.
        bent: Vec<f64>,
    },
}

impl Stiffness {
    /// Stiffness of a pair (Pa) whose radii sum to `thickness` (m), with the tolerance `delta`.
    pub fn of(&self, [a, b]: [usize; 2], thickness: f64, delta: f64) -> f64 {
        match self {
            Self::Uniform(stiffness) => *stiffness,
            Self::Typical { driven, bent } => {
                let yielding = bent[a].min(bent[b]);
                let moved = driven[a].max(driven[b]);
                // Two bodies that are held everywhere never move: their stiffness does not matter.
                let force = if yielding.is_finite() { moved.max(yielding) } else { moved };
                force.max(f64::MIN_POSITIVE.sqrt()) / ((LN_2 + 0.5) * 2.0 * delta * thickness)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stiff_body_does_not_stiffen_the_contact_of_a_soft_one() {
        let bent = vec![1e6, 1.0, f64::INFINITY];
        let of = |pair| Stiffness::Typical { driven: vec![0.0, 0.0, 0.0], bent: bent.clone() }.of(pair, 2.0, 0.05);
        let soft = of([1, 1]);
        assert!((soft * (LN_2 + 0.5) * 0.2 - 1.0).abs() < 1e-14);
        assert_eq!([of([0, 1]), of([1, 2])], [soft, soft]);
        assert!((of([0, 0]) / soft - 1e6).abs() < 1e-6);
    }

    #[test]
    fn what_drives_either_body_is_borne_whatever_bends() {
        let law = Stiffness::Typical { driven: vec![0.0, 5.0], bent: vec![1.0, f64::INFINITY] };
        assert!((law.of([0, 1], 2.0, 0.05) * (LN_2 + 0.5) * 0.2 - 5.0).abs() < 1e-14);
    }
}
