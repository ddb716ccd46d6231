//! Whether the work of Newton's method still moves the time on; where contact has stalled, it does not.

use crate::simulation::Simulation;
use crate::simulation::failure::StepError;

/// Newton iterations after which progress is looked at.
const WINDOW: u64 = 2000;
/// Least progress of an iteration, in steps of fixed size: a run of a thousand such steps would take 10^8 iterations.
const LEAST: f64 = 1e-5;
/// Growth of the progress from one window to the next that tells of steps about to become long: those of a rod that leaps off
/// another one begin in nanoseconds.
const GROWTH: f64 = 2.0;

/// Work and time when progress was last looked at, and the progress (s) of the window before.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Progress {
    iterations: u64,
    time: f64,
    advanced: Option<f64>,
}

impl Progress {
    /// Starts anew at this number of iterations and this time (s).
    pub fn from(iterations: u64, time: f64) -> Self {
        Self { iterations, time, advanced: None }
    }

    /// By how much the time (s) has moved on where that is too little for the iterations made, given the size `dt` of a fixed step
    /// (s), and grows no more.
    pub fn stalled(&mut self, iterations: u64, time: f64, dt: f64) -> Option<f64> {
        if iterations < self.iterations + WINDOW {
            return None;
        }
        let advanced = time - self.time;
        let most = (iterations - self.iterations) as f64 * LEAST * dt;
        let steady = self.advanced.is_some_and(|before| advanced < GROWTH * before || advanced == 0.0);
        *self = Self { iterations, time, advanced: Some(advanced) };
        (advanced < most && steady).then_some(advanced)
    }
}

impl Simulation {
    /// An error if contact has stalled.
    pub(super) fn check_progress(&mut self) -> Result<(), StepError> {
        let Some(contact) = self.solver.medium.contact.as_deref_mut().filter(|_| self.model.barrier().is_some()) else {
            return Ok(());
        };
        let (iterations, time) = (self.statistics.newton_iterations, self.state.time);
        let Some(advanced) = self.progress.stalled(iterations, time, self.dt) else { return Ok(()) };
        let Some(stall) = contact.stall(&self.state.q, WINDOW, advanced) else { return Ok(()) };
        let worst = self.model.network.node_dofs()[stall.node];
        Err(self.convergence_error(self.dt, f64::NAN, WINDOW as usize, Some(worst), stall.reason))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_without_progress_is_a_stall_and_slow_progress_is_not() {
        let mut progress = Progress::from(10, 1.0);
        let least = WINDOW as f64 * LEAST * 0.1;
        assert_eq!(progress.stalled(10 + WINDOW - 1, 1.0, 0.1), None);
        // The first window tells nothing of growth; the second, as slow, is a stall.
        assert_eq!(progress.stalled(10 + WINDOW, 1.0 + 0.4 * least, 0.1), None);
        assert!(progress.stalled(10 + 2 * WINDOW, 1.0 + 0.8 * least, 0.1).is_some());
        assert_eq!(progress.stalled(10 + 3 * WINDOW, 1.0 + 2.0 * least, 0.1), None);
        // Nothing at all is a stall whatever was before.
        assert_eq!(progress.stalled(10 + 4 * WINDOW, 1.0 + 2.0 * least, 0.1), Some(0.0));
    }

    #[test]
    fn steps_that_grow_from_nothing_are_no_stall() {
        let mut progress = Progress::from(0, 0.0);
        let least = WINDOW as f64 * LEAST * 0.1;
        let mut time = 0.0;
        for window in 1..=10 {
            time += least * 0.0005 * f64::from(1 << window) * 1.1_f64.powi(window);
            assert_eq!(progress.stalled(window as u64 * WINDOW, time, 0.1), None, "{window}");
        }
    }
}
