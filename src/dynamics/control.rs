//! The size and order of adaptive steps, from the errors with which past states predicted the last one.

/// Highest order of the backward differences: those above the third lose stability for motions that rotate.
pub const HIGHEST_ORDER: usize = 3;

/// Largest growth of a step, by order: backward differences on growing steps are stable below 2.41 (order 2) and 1.53 (3).
const LARGEST_GROWTH: [f64; HIGHEST_ORDER] = [2.0, 1.8, 1.4];
/// Smallest factor after a rejection, and the safety factor on every estimate.
const SMALLEST_FACTOR: f64 = 0.2;
const SAFETY: f64 = 0.85;
/// A step is left as it is unless it may grow by this much.
const WORTHWHILE: f64 = 1.1;

/// Size and order of the next step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// Length of the next step, s; zero before the first.
    pub dt: f64,
    /// Order of its backward difference.
    pub order: usize,
}

impl Default for Control {
    fn default() -> Self {
        Self { dt: 0.0, order: 1 }
    }
}

/// The error of a step of the given order made from times `past` (newest first) to `to`, if the extrapolation of the
/// same order through them missed the result by `missed`: the leading terms of the two errors have this ratio.
fn local_error(order: usize, past: &[f64], to: f64, missed: f64) -> f64 {
    (to - past[0]) / (to - past[order]) * missed
}

impl Control {
    /// What follows a step tried with this control from the states at `past` times to time `to`, given by how much each
    /// order's extrapolation missed it and the tolerance: the next control, and whether the step is accepted.
    pub fn judge(&self, past: &[f64], to: f64, missed: &[f64], tolerance: f64) -> (Self, bool) {
        let dt = to - past[0];
        let factor = |order: usize| -> Option<f64> {
            let missed = *missed.get(order)?;
            let error = local_error(order, past, to, missed) / tolerance;
            Some(SAFETY * error.max(1e-10).powf(-1.0 / (order as f64 + 1.0)))
        };
        let Some(own) = factor(self.order) else {
            // Too few past states to estimate: the very first step, small by choice.
            return (Self { dt, order: self.order }, true);
        };
        if own < SAFETY {
            let order = self.order.min(2);
            return (Self { dt: dt * own.clamp(SMALLEST_FACTOR, 0.9), order }, false);
        }
        let mut best = (own, self.order);
        for order in [self.order.wrapping_sub(1), self.order + 1] {
            if (1..=HIGHEST_ORDER).contains(&order) {
                // Slightly against change: the estimates of the orders beside the present one are rougher.
                if let Some(other) = factor(order).filter(|other| 0.9 * other > best.0) {
                    best = (0.9 * other, order);
                }
            }
        }
        let growth = best.0.min(LARGEST_GROWTH[best.1 - 1]);
        let growth = if (1.0..WORTHWHILE).contains(&growth) { 1.0 } else { growth };
        (Self { dt: dt * growth, order: best.1 }, true)
    }
}
