//! The barrier: what a contact costs as a function of the distance of two centrelines.
//!
//! Contact acts over distances `D` from `D_max = (1 + delta) xi` down to `D_min = (1 - delta) xi`, `xi` the sum of the radii,
//! where it grows without bound. With `g = D - D_min` and the range `d = D_max - D_min = 2 delta xi`, the energy per
//! stiffness and length is the clamped logarithm
//!
//! ```text
//!   b = -(g - d)^2 ln(g / d)      0 < g < d,      0 beyond,
//! ```
//!
//! twice continuously differentiable. Written with the remaining range `e = d - g` and `y = e / g`, so that
//! `-ln(g / d) = ln(1 + y)`,
//!
//! ```text
//!   b = e^2 ln(1 + y),    b' = -e (2 ln(1 + y) + y),    b'' = 2 ln(1 + y) + 4 y + y^2:
//! ```
//!
//! sums of terms of one sign, which lose no digits at either end. Source: Li et al., Incremental Potential Contact (2020),
//! equation 6, with the thickness of Li, Kaufman and Jiang, Codimensional IPC (2021); on the distance itself, not its square.

/// The distances between which a pair of given thickness pushes, and how hard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Barrier {
    least: f64,
    most: f64,
}

/// The barrier and its derivatives at one distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarrierValue {
    /// `b`, m^2: an energy per stiffness (Pa) and length (m).
    pub value: f64,
    /// `b'`, m; never positive, since the barrier repels.
    pub slope: f64,
    /// `b''`, dimensionless; never negative.
    pub curvature: f64,
}

impl Barrier {
    /// The barrier of two bodies whose radii sum to `thickness` (m), with the tolerance `0 < delta < 1`.
    pub fn new(thickness: f64, delta: f64) -> Self {
        Self { least: (1.0 - delta) * thickness, most: (1.0 + delta) * thickness }
    }

    /// The distance that is never reached, m.
    pub fn least(&self) -> f64 {
        self.least
    }

    /// The distance from which on nothing acts, m.
    pub fn most(&self) -> f64 {
        self.most
    }

    /// Value and derivatives at a distance (m); infinite value and slope at [`Self::least`] and below.
    ///
    /// ```
    /// use flagrs::contact::barrier::Barrier;
    /// let at = Barrier::new(2.0, 0.5).at(2.0); // halfway: g = 1, d = 2
    /// assert!((at.value - 2f64.ln()).abs() < 1e-15 && (at.slope + 2.0 * 2f64.ln() + 1.0).abs() < 1e-15);
    /// ```
    #[inline]
    pub fn at(&self, distance: f64) -> BarrierValue {
        let room = self.most - distance;
        if room <= 0.0 {
            return BarrierValue { value: 0.0, slope: 0.0, curvature: 0.0 };
        }
        let gap = distance - self.least;
        if gap <= 0.0 {
            return BarrierValue { value: f64::INFINITY, slope: f64::NEG_INFINITY, curvature: f64::INFINITY };
        }
        let y = room / gap;
        let log = y.ln_1p();
        BarrierValue { value: room * room * log, slope: -room * (2.0 * log + y), curvature: 2.0 * log + y * (4.0 + y) }
    }
}
