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
/// Factor on a step whose equations could not be solved; no step reaches its length again for a while.
const FAILED_FACTOR: f64 = 0.4;
const FAILED_CEILING: f64 = 0.8;
/// How fast that ceiling rises, by accepted step.
const CEILING_RISE: f64 = 1.05;

/// The ceiling that is none, s: a number, as states are saved to files of numbers.
pub const NO_CEILING: f64 = f64::MAX;

/// Size and order of the next step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// Length of the next step, s; zero before the first.
    pub dt: f64,
    /// Order of its backward difference.
    pub order: usize,
    /// No step is longer, s: it comes down below a step whose equations could not be solved, and rises from there;
    /// [`NO_CEILING`] where there is none.
    pub ceiling: f64,
    /// Whether the state stands at a jump that was found in what drives the scene.
    pub at_jump: bool,
}

impl Default for Control {
    fn default() -> Self {
        Self { dt: 0.0, order: 1, ceiling: NO_CEILING, at_jump: false }
    }
}

/// What is known of the error of a step that was tried.
#[derive(Debug, Clone, Copy)]
pub struct Estimate<'a> {
    /// How far the extrapolation of the past states by each order, from zero on, was from the result.
    pub prediction_errors: &'a [f64],
    /// How far inputs depart within the step from what their values at its ends suggest.
    pub input_error: f64,
    /// What the error may be, in the same unit.
    pub tolerance: f64,
    /// Highest order the scheme is stable with.
    pub highest_order: usize,
}

/// The error of a step of the given order made from times `past` (newest first) to `to`, if the extrapolation of the
/// same order through them was off by `prediction_error`.
///
/// It is the leading error of the backward difference's rate, times the step. The error of a position is that over the rate's
/// weight of it, and the result misses in the other direction than the extrapolation: on equal steps both together make
/// this 1.5, 1.8 and 2.1 times the error at orders 1, 2 and 3.
fn local_error(order: usize, past: &[f64], to: f64, prediction_error: f64) -> f64 {
    (to - past[0]) / (to - past[order]) * prediction_error
}

/// By how much a step may grow for an error of so many times the tolerance, if the error goes with that power of the step.
fn growth_for(error: f64, power: f64) -> f64 {
    SAFETY * error.max(1e-10).powf(-1.0 / power)
}

impl Control {
    /// What follows a step tried with this control from the states at `past` times to time `to`: the next control, and whether
    /// the step is accepted.
    pub fn judge(&self, past: &[f64], to: f64, estimate: &Estimate) -> (Self, bool) {
        let dt = to - past[0];
        let factor = |order: usize| -> Option<f64> {
            let prediction_error = *estimate.prediction_errors.get(order)?;
            let error = local_error(order, past, to, prediction_error) / estimate.tolerance;
            Some(growth_for(error, order as f64 + 1.0))
        };
        // What inputs hide shrinks with the step, at the second power where they jump.
        let hidden = growth_for(estimate.input_error / estimate.tolerance, 2.0);
        let extrapolated = factor(self.order);
        let own = extrapolated.unwrap_or(f64::INFINITY).min(hidden);
        if own < SAFETY {
            let order = self.order.min(2);
            return (Self { dt: dt * own.clamp(SMALLEST_FACTOR, 0.9), order, ..*self }, false);
        }
        let ceiling = (self.ceiling * CEILING_RISE).min(NO_CEILING);
        let Some(extrapolated) = extrapolated else {
            // The first of two steps whose error is told by the second.
            return (Self { dt: dt.min(ceiling), order: self.order, ceiling, at_jump: false }, true);
        };
        let mut best = (extrapolated, self.order);
        for order in [self.order.wrapping_sub(1), self.order + 1] {
            if (1..=estimate.highest_order).contains(&order) {
                // Slightly against change: the estimates of the orders beside the present one are rougher.
                if let Some(other) = factor(order).filter(|other| 0.9 * other > best.0) {
                    best = (0.9 * other, order);
                }
            }
        }
        let growth = best.0.min(hidden).min(LARGEST_GROWTH[best.1 - 1]);
        let growth = if (1.0..WORTHWHILE).contains(&growth) { 1.0 } else { growth };
        (Self { dt: (dt * growth).min(ceiling), order: best.1, ceiling, at_jump: false }, true)
    }

    /// What follows a step of length `dt` whose equations could not be solved: the longest such step is remembered.
    pub fn failed(&self, dt: f64) -> Self {
        let ceiling =
            if dt < 0.9 * self.ceiling && self.ceiling < NO_CEILING { self.ceiling } else { FAILED_CEILING * dt };
        Self { dt: FAILED_FACTOR * dt, order: self.order.min(2), ceiling, at_jump: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bdf::history::{History, Sample, derivative_weights};

    fn estimate(missed: &[f64], tolerance: f64) -> Estimate<'_> {
        Estimate { prediction_errors: missed, input_error: 0.0, tolerance, highest_order: HIGHEST_ORDER }
    }

    /// One backward difference of the given order for `y' = rate (y - exact) + exact'`, from exact past values: its error,
    /// and how the same past values were missed by extrapolation.
    fn one_step(order: usize, times: &[f64], to: f64) -> (f64, f64, f64) {
        let (exact, slope) = (f64::exp, f64::exp);
        let present = [exact(times[0])];
        let past = times[1..].iter().map(|&time| Sample { time, q: vec![exact(time)], ..Sample::default() }).collect();
        let history = History { past, order: 0 };
        let mut guess = [0.0];
        history.extrapolate(order, (times[0], &present), |sample| &sample.q, to, &mut guess);
        let all: Vec<f64> = std::iter::once(to).chain(times[..order].iter().copied()).collect();
        let weights = derivative_weights(&all);
        let known: f64 = weights[1..].iter().zip(&times[..order]).map(|(weight, &time)| weight * exact(time)).sum();
        let found = (slope(to) - known) / weights[0];
        (found - exact(to), guess[0] - found, weights[0])
    }

    #[test]
    fn the_error_of_a_step_is_estimated_to_leading_order_on_uneven_steps() {
        for order in 1..=3 {
            let found: Vec<[f64; 2]> = [0.02, 0.01]
                .iter()
                .map(|h| {
                    let times: Vec<f64> = [0.0, 0.8, 2.1, 2.9, 4.2].iter().map(|t| 1.0 - h * t).collect();
                    let to = 1.0 + 1.1 * h;
                    let (error, missed, weight) = one_step(order, &times, to);
                    let ratio = (to - times[0]) / (to - times[order]);
                    [local_error(order, &times, to, missed.abs()) / error.abs(), weight * (to - times[0]) + ratio]
                })
                .collect();
            // Off by terms of one order more in the step: half as far with half the step.
            let (limit, expected) = (2.0 * found[1][0] - found[0][0], found[1][1]);
            assert!((limit - expected).abs() < 0.01, "order {order}: {found:?}");
        }
    }

    #[test]
    fn a_step_is_accepted_just_when_its_estimate_is_within_the_tolerance() {
        let (past, to) = ([0.0, -1.0, -2.0], 1.0);
        let control = Control { dt: 1.0, order: 1, ..Control::default() };
        // On equal steps the error of first order is half of what the extrapolation missed.
        for (missed, expected) in [(1.99, true), (2.01, false)] {
            let (next, accepted) = control.judge(&past, to, &estimate(&[9.0, missed, 9.0], 1.0));
            assert_eq!(accepted, expected);
            assert!(next.dt < 1.0);
        }
    }

    #[test]
    fn the_next_step_is_the_one_whose_error_would_be_the_tolerance() {
        let (past, to) = ([0.0, -1.0, -2.0, -3.0], 1.0);
        for order in 1..=3 {
            let control = Control { dt: 1.0, order, ..Control::default() };
            let mut missed = [1e9; 4];
            // An error of a part of the tolerance that allows 1.2 times the step, with the factor of safety.
            missed[order] = (order as f64 + 1.0) * (SAFETY / 1.2_f64).powi(order as i32 + 1);
            let (next, accepted) = control.judge(&past, to, &estimate(&missed, 1.0));
            assert!(accepted && (next.dt - 1.2).abs() < 1e-12 && next.order == order, "{next:?}");
        }
    }

    #[test]
    fn an_order_is_taken_where_it_promises_more_but_none_that_is_not_stable() {
        let (past, to) = ([0.0, -1.0, -2.0, -3.0], 1.0);
        let control = Control { dt: 1.0, order: 2, ..Control::default() };
        let missed = [1e9, 1e9, 2.0, 1e-6];
        assert_eq!(control.judge(&past, to, &estimate(&missed, 1.0)).0.order, 3);
        let limited = Estimate { highest_order: 2, ..estimate(&missed, 1.0) };
        assert_eq!(control.judge(&past, to, &limited).0.order, 2);
    }

    #[test]
    fn what_inputs_hide_counts_like_an_error() {
        let (past, to) = ([0.0, -1.0], 1.0);
        let control = Control { dt: 1.0, order: 1, ..Control::default() };
        let missed = [0.0, 0.0];
        let hidden = Estimate { input_error: 1.1, ..estimate(&missed, 1.0) };
        assert!(!control.judge(&past, to, &hidden).1);
        // Also in a first step, which nothing else tells of.
        assert!(!control.judge(&past[..1], to, &Estimate { prediction_errors: &missed[..1], ..hidden }).1);
    }

    #[test]
    fn a_step_that_could_not_be_solved_is_not_tried_again_at_once() {
        let (past, to) = ([0.0, -1.0], 1.0);
        let mut control = Control { dt: 1.0, order: 3, ..Control::default() }.failed(1.0);
        assert_eq!((control.dt, control.order), (FAILED_FACTOR, 2));
        let mut accepted = 0;
        while control.dt < 0.95 {
            control.order = 1;
            control = control.judge(&past, to, &estimate(&[0.0, 0.0], 1.0)).0;
            accepted += 1;
        }
        assert!((3..20).contains(&accepted), "{accepted}");
    }

    #[test]
    fn steps_that_nothing_bounds_stay_numbers() {
        let mut control = Control { dt: 1.0, ..Control::default() };
        for _ in 0..3000 {
            let (past, to) = ([0.0, -control.dt], control.dt);
            control = control.judge(&past, to, &estimate(&[0.0, 0.0], 1.0)).0;
            assert!(control.dt.is_finite() && control.ceiling.is_finite());
        }
    }
}
