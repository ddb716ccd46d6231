//! Whether the work of Newton's method still moves the time on, and what to say where contact has stalled.
//!
//! Contact far too soft or far too stiff for the forces it bears, or of a tolerance far too fine, lets a step be solved only where it is
//! minute: the run would not fail, and not end either.

use crate::contact::potential::{BarrierLaw, ContactForce};
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
    pub(crate) fn check_progress(&mut self) -> Result<(), StepError> {
        let Some(law) = self.model.barrier() else { return Ok(()) };
        let (iterations, time) = (self.statistics.newton_iterations, self.state.time);
        let Some(advanced) = self.progress.stalled(iterations, time, self.dt) else { return Ok(()) };
        let dofs = self.model.network.node_dofs();
        let pushing = self.balance.barrier.as_mut().map(|barrier| barrier.forces(law, dofs, &self.state.q));
        let size = |force: &ContactForce| force.contact.force;
        let strongest = pushing.unwrap_or_default().into_iter().max_by(|a, b| size(a).total_cmp(&size(b)));
        let Some(strongest) = strongest else { return Ok(()) };
        let reason = stall(law, &strongest, advanced);
        let worst = dofs[strongest.contact.nodes[0]];
        Err(self.convergence_error(self.dt, f64::NAN, WINDOW as usize, Some(worst), reason))
    }
}

/// What to say of a stall whose strongest contact is this.
fn stall(law: &BarrierLaw, strongest: &ContactForce, advanced: f64) -> String {
    let [a, b] = strongest.bodies;
    let pair = strongest.indices(law).map(|body| body as usize);
    let (force, stiffness) = (strongest.contact.force, law.stiffness(pair));
    let friction = if law.has_friction() { ", a larger slip_velocity" } else { "" };
    let suitable = law.stiffness_to_hold(pair, force);
    let (factor, side) =
        if suitable > stiffness { (suitable / stiffness, "less") } else { (stiffness / suitable, "more") };
    let held = format!(
        "{a} and {b} press with {force:.2e} N, which about {suitable:.1e} Pa would hold at the sum of their radii"
    );
    let advice = "give another Contact.stiffness (None takes it from the scene), a larger Contact.tolerance than";
    format!(
        "contact has stalled: {WINDOW} Newton iterations moved the time on by {advanced:.1e} s; {held}; its stiffness, \
         {stiffness:.1e} Pa, is {factor:.1e} times {side}; {advice} {}{friction}, or smaller loads",
        law.delta(),
    )
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
