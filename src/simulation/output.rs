//! States between adaptive steps that contact allows.
//!
//! Interpolation is right to the error that was asked for, and may show rods deeper in each other than contact ever lets them. Where it does, the
//! state at that time is found by a step of its own from the beginning of the last one: it then is what every accepted
//! state is. The steps of the simulation do not depend on it.

use crate::simulation::Simulation;
use crate::simulation::failure::StepError;
use crate::state::State;

/// Steps a state between two accepted ones may take.
const MOST_STEPS: u64 = 32;

impl Simulation {
    /// The state at a time within the last adaptive step: interpolated, or, where rods would overlap by more than barrier contact allows, reached by
    /// a step that ends there.
    ///
    /// # Errors
    /// [`StepError::Signal`] if a motor's function of time fails.
    pub fn frame_state(&mut self, time: f64) -> Result<State, StepError> {
        let between = self.state_at(time)?;
        let positions = between.positions(&self.model.network);
        if self.model.barrier().is_none_or(|law| law.first_overlap(&positions).is_none()) {
            return Ok(between);
        }
        let Some(first) = self.state.history.past.first().map(|sample| sample.time).filter(|first| *first < time)
        else {
            return Ok(between);
        };
        let mut start = self.interpolated(first)?;
        let replaced = start.history.past.remove(0);
        (start.velocity, start.density) = (replaced.velocity, replaced.density);
        let (now, statistics) = (self.state.clone(), self.statistics);
        self.restore(start.clone());
        let made = self.reach(time);
        let reached = std::mem::replace(&mut self.state, now.clone());
        self.restore(now);
        // The work counts, the steps do not: they are not part of the motion.
        (self.statistics.steps, self.statistics.rejected_steps) = (statistics.steps, statistics.rejected_steps);
        Ok(if made { reached } else { self.shortened(&start, between) })
    }

    /// Steps to a time; whether that was possible in a few steps.
    fn reach(&mut self, time: f64) -> bool {
        let last = self.state.steps + MOST_STEPS;
        while self.state.time < time && self.state.steps < last {
            if self.adaptive_step(time).is_err() {
                return false;
            }
        }
        self.state.time >= time
    }

    /// The interpolated state drawn back towards the beginning of its step as far as contact needs it.
    fn shortened(&mut self, start: &State, mut between: State) -> State {
        let part = self.solver.step_limit(&start.q, &between.q, &mut self.statistics);
        between.q.iter_mut().zip(&start.q).for_each(|(q, start)| *q = start + part * (*q - start));
        between
    }
}
