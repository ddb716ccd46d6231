//! What can go wrong with a step: as a user sees it, and as one try does.

use crate::elastic::signal::SignalError;
use crate::linear::LinearError;

/// A step was not possible; the simulation stands at its last good state.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// The equations of a step could not be solved, however small the step.
    #[error(
        "no convergence at t = {time} s (step {step}): {reason}; residual {residual:.3e} N after {iterations} iterations with \
         dt = {dt:.3e} s, worst at node {worst_node}"
    )]
    Convergence {
        /// Time of the last good state, s.
        time: f64,
        /// Number of the step.
        step: u64,
        /// Smallest step tried, s.
        dt: f64,
        /// Residual force, N.
        residual: f64,
        /// Newton iterations of the last try.
        iterations: usize,
        /// Smallest gap between surfaces at the last good state, m.
        smallest_gap: f64,
        /// Node with the largest residual.
        worst_node: usize,
        /// What went wrong.
        reason: String,
    },
    /// The caller's hook asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// A motor's or clamp's function of time failed.
    #[error("a function of time failed: {0}")]
    Signal(SignalError),
}

/// Why one try at a step failed.
pub(super) enum TryError {
    Interrupted,
    Signal(SignalError),
    Solve { residual: f64, iterations: usize, worst: usize, reason: String },
}

impl From<LinearError> for TryError {
    fn from(error: LinearError) -> Self {
        Self::Solve { residual: f64::NAN, iterations: 0, worst: 0, reason: error.to_string() }
    }
}

impl From<SignalError> for TryError {
    fn from(error: SignalError) -> Self {
        Self::Signal(error)
    }
}
