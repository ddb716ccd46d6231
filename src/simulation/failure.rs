//! What can go wrong with a step: as a user sees it, and as one try does.

use crate::linear::LinearError;
use crate::nonlinear::newton::NewtonFailure;
use crate::rod::term::TermError;
use crate::signal::SignalError;

/// A step was not possible; the simulation stands at its last good state.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// The equations of a step could not be solved, however small the step.
    #[error("{}", told(*time, *dt, *residual, *worst_node, reason))]
    Convergence {
        /// Time of the last good state, s.
        time: f64,
        /// Number of the step.
        step: u64,
        /// Smallest step tried, s.
        dt: f64,
        /// Residual force, N, if it could be computed.
        residual: Option<f64>,
        /// Newton iterations of the last try.
        iterations: usize,
        /// Smallest gap between surfaces at the last good state, m.
        smallest_gap: f64,
        /// Node with the largest residual, or with what cannot be.
        worst_node: Option<usize>,
        /// What went wrong, and what may help.
        reason: String,
    },
    /// The caller's hook asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// A motor's or clamp's function of time failed.
    #[error("a function of time failed: {0}")]
    Signal(SignalError),
}

/// Cause, place and what may help, in one sentence.
fn told(time: f64, dt: f64, residual: Option<f64>, node: Option<usize>, reason: &str) -> String {
    let place = node.map_or_else(String::new, |node| format!(" (worst at node {node})"));
    let left = residual.map_or_else(String::new, |residual| format!("; a force of {residual:.3e} N is left over"));
    format!("no convergence at t = {time} s with steps down to {dt:.3e} s{place}: {reason}{left}")
}

/// Why one try at a step failed.
pub(crate) enum TryError {
    Interrupted,
    Signal(SignalError),
    Solve { residual: f64, iterations: usize, worst: Option<usize>, reason: String },
}

impl From<LinearError> for TryError {
    fn from(error: LinearError) -> Self {
        Self::Solve { residual: f64::NAN, iterations: 0, worst: None, reason: error.to_string() }
    }
}

impl From<TermError> for TryError {
    fn from(error: TermError) -> Self {
        Self::Solve { residual: f64::NAN, iterations: 0, worst: None, reason: error.to_string() }
    }
}

impl From<NewtonFailure> for TryError {
    fn from(NewtonFailure { residual, iterations, worst, reason }: NewtonFailure) -> Self {
        Self::Solve { residual, iterations, worst, reason }
    }
}

impl From<SignalError> for TryError {
    fn from(error: SignalError) -> Self {
        Self::Signal(error)
    }
}
