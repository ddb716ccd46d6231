//! Steps of adaptive size and order.

use std::time::Instant;

use crate::bdf::control::Control;
use crate::bdf::history::History;
use crate::inputs::over_step::first_jump;
use crate::nonlinear::equations::Goal;
use crate::nonlinear::newton::NewtonSettings;
use crate::simulation::Simulation;
use crate::simulation::failure::{StepError, TryError};

/// First adaptive step and smallest one, in steps of fixed size.
const FIRST_STEP: f64 = 1e-2;
const SMALLEST_STEP: f64 = 1e-13;
/// Longest adaptive step, in steps of fixed size: where nothing moves, nothing else bounds it.
pub(super) const LONGEST_STEP: f64 = 1e9;
/// Length of a step over which nothing but jumps happens, in steps of fixed size and in what is left of the run.
const INSTANT: f64 = 1e-9;
/// Rejections at a time before past states are given up.
const MOST_REJECTIONS: usize = 4;
/// First step after a corner of what drives the scene, in steps before it.
const STEP_AFTER_BREAK: f64 = 0.1;

/// Part of the local error that may be left to the solution of a step's equations.
const NEWTON_SHARE: f64 = 0.1;
/// Newton iterations after which an adaptive step is rather made shorter.
const MOST_ITERATIONS: usize = 12;

impl Simulation {
    /// Makes the local error of every step at most `tolerance` of the size of each filament by choosing its size and order; `None`
    /// goes back to steps of `dt`, first order.
    pub fn set_tolerance(&mut self, tolerance: Option<f64>) {
        self.tolerance = tolerance;
        self.settings = NewtonSettings::default();
        if let Some(error) = tolerance {
            self.settings =
                NewtonSettings { goal: Goal::Correction(NEWTON_SHARE * error), max_iterations: MOST_ITERATIONS };
        }
    }

    /// What the tolerance lets prescribed angles miss within a step, rad.
    pub(super) fn angle_tolerance(&self) -> f64 {
        let angles = self.model.network.edge_dofs().iter().map(|&dof| self.model.error_weight[dof]);
        let weight = angles.fold(0.0, f64::max);
        self.tolerance.filter(|_| weight > 0.0).map_or(f64::INFINITY, |error| error / weight)
    }

    /// Makes one adaptive step, not beyond `limit`; at the start, and after a corner of what drives the scene, two.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn adaptive_step(&mut self, limit: f64) -> Result<(), StepError> {
        let start = Instant::now();
        let before = self.state.clone();
        self.begin_anew_at_a_break();
        let result = if self.state.history.past.is_empty() { self.start(limit) } else { self.go_on(limit) };
        if matches!(result, Err(StepError::Interrupted)) {
            // Tries that were rejected have left their mark: what goes on from here must not know of them.
            self.restore(before);
        }
        self.statistics.seconds_total += start.elapsed().as_secs_f64();
        result
    }

    /// At a corner or jump of what drives the scene, past states tell nothing of the next ones.
    fn begin_anew_at_a_break(&mut self) {
        let Control { dt, at_jump, .. } = self.state.control;
        if dt == 0.0 {
            // Nothing is known yet of how fast things change.
            self.state.control.dt = FIRST_STEP * self.dt;
        } else if !self.state.history.past.is_empty()
            && (at_jump || self.inputs.breaks().at(self.state.time, dt, self.angle_tolerance()))
        {
            self.begin_anew();
        }
    }

    /// Forgets past states, and begins with a short step.
    pub(super) fn begin_anew(&mut self) {
        let Control { dt, ceiling, .. } = self.state.control;
        self.state.history = History::default();
        self.state.control = Control { dt: STEP_AFTER_BREAK * dt, order: 1, ceiling, at_jump: false };
    }

    /// Where a step of the wanted length ends: before the limit and the next break, or exactly there.
    fn end_of_step(&self, wanted: f64, limit: f64) -> f64 {
        let now = self.state.time;
        let stop =
            self.inputs.breaks().next(now, 2.0 * wanted, self.angle_tolerance()).map_or(limit, |at| at.min(limit));
        let left = stop - now;
        // Two equal steps to there rather than a whole one and a sliver.
        if wanted >= left {
            stop
        } else if 2.0 * wanted > left {
            now + 0.5 * left
        } else {
            now + wanted
        }
    }

    /// The same, and whether a jump that a function of time makes on the way ends the step there.
    fn end_before_jump(&self, wanted: f64, limit: f64) -> Result<(f64, bool), StepError> {
        let end = self.end_of_step(wanted, limit);
        let jump = first_jump(&self.model, &self.inputs, (self.state.time, end)).map_err(StepError::Signal)?;
        Ok((jump.unwrap_or(end), jump.is_some()))
    }

    /// One step from states that predict it.
    fn go_on(&mut self, limit: f64) -> Result<(), StepError> {
        for _ in 0..MOST_REJECTIONS {
            self.check_progress()?;
            let wanted = self.state.control;
            let (end, at_jump) = self.end_before_jump(wanted.dt, limit)?;
            let dt = end - self.state.time;
            match self.try_step(dt, wanted.order) {
                Ok(true) => {
                    self.state.time = end;
                    if dt < 0.999 * wanted.dt {
                        // A step cut short by the limit says little against the wanted one.
                        self.state.control.dt = self.state.control.dt.max(wanted.dt);
                    }
                    self.state.control.at_jump = at_jump;
                    return Ok(());
                }
                other => self.shrink(other.map(|_| ()), dt, limit)?,
            }
        }
        // Whatever happens here, the past has not foretold it.
        self.state.history = History::default();
        self.state.control.order = 1;
        self.start(limit)
    }

    /// Two equal steps of first order, from a state without a past: the second tells the error of both, and both are made again
    /// if it is too large.
    fn start(&mut self, limit: f64) -> Result<(), StepError> {
        self.let_jump(limit)?;
        let wanted = self.state.control.dt;
        let mut closing_in = true;
        loop {
            self.check_progress()?;
            let before = self.state.clone();
            let accepted = self.statistics.steps;
            let (end, at_jump) = self.end_before_jump(2.0 * self.state.control.dt, limit)?;
            let dt = 0.5 * (end - self.state.time);
            let first = self.try_step(dt, 1);
            let both = if matches!(first, Ok(true)) { self.try_step(end - self.state.time, 1) } else { first };
            if matches!(both, Ok(true)) {
                self.state.time = end;
                self.state.control.at_jump = at_jump;
                return Ok(());
            }
            let control = self.state.control;
            self.go_back(before);
            self.state.control = control;
            self.statistics.steps = accepted;
            self.shrink(both.map(|_| ()), dt, limit)?;
            if closing_in && self.state.control.dt < INSTANT * self.scale(limit) {
                // The steps close in on a jump that nothing has told of.
                closing_in = false;
                self.let_jump(limit)?;
                self.state.control.dt = wanted;
            }
        }
    }

    /// A step of no length to speak of: what nothing resists, such as the angle of a motor whose torque has been switched on,
    /// jumps at once, and no step is short enough to follow.
    fn let_jump(&mut self, limit: f64) -> Result<(), StepError> {
        let before = self.state.clone();
        let instant = (INSTANT * self.scale(limit)).max(SMALLEST_STEP * before.time);
        if self.state.time + instant >= limit {
            return Ok(());
        }
        // Nothing is asked of it: there is no shorter one.
        let tolerance = self.tolerance.take();
        let jumped = self.try_step(instant, 1);
        self.tolerance = tolerance;
        match jumped {
            Ok(true) => {
                if self.scheme.has_inertia() {
                    // Masses do not jump.
                    self.state.velocity.clone_from(&before.velocity);
                }
                // Nor is a jump over that time a velocity.
                self.state.account.extremes = before.account.extremes;
                self.state.history = History::default();
            }
            Err(TryError::Interrupted) => return Err(StepError::Interrupted),
            Err(TryError::Signal(error)) => return Err(StepError::Signal(error)),
            Ok(false) | Err(TryError::Solve { .. }) => self.go_back(before.clone()),
        }
        self.state.control = before.control;
        Ok(())
    }

    /// The time, s, in parts of which the shortest steps are counted: a fixed step, or what is left of the run.
    fn scale(&self, limit: f64) -> f64 {
        self.dt.min(limit - self.state.time)
    }

    /// What follows a step of length `dt`, on the way to `limit`, that was not accepted.
    fn shrink(&mut self, outcome: Result<(), TryError>, dt: f64, limit: f64) -> Result<(), StepError> {
        let smallest = SMALLEST_STEP * self.scale(limit).max(self.state.time.abs());
        self.statistics.rejected_steps += 1;
        match outcome {
            Ok(()) if self.state.control.dt < smallest => {
                let reason =
                    "no step is short enough for the tolerance: something jumps, or moves ever faster".to_owned();
                Err(self.convergence_error(dt, f64::NAN, 0, None, reason))
            }
            Ok(()) => Ok(()),
            Err(TryError::Interrupted) => Err(StepError::Interrupted),
            Err(TryError::Signal(error)) => Err(StepError::Signal(error)),
            Err(TryError::Solve { residual, iterations, worst, reason }) => {
                self.state.control = self.state.control.failed(dt);
                if self.state.control.dt < smallest {
                    return Err(self.convergence_error(dt, residual, iterations, worst, reason));
                }
                Ok(())
            }
        }
    }
}
