//! Steps of adaptive size and order, and output between them.

use std::time::Instant;

use super::control::Control;
use super::failure::{StepError, TryError};
use super::newton::{Goal, NewtonSettings};
use super::simulation::Simulation;
use super::state::State;
use crate::elastic::motors::Drive;

/// First adaptive step and smallest one, in steps of fixed size.
const FIRST_STEP: f64 = 1e-2;
const SMALLEST_STEP: f64 = 1e-9;

/// Factor on a step whose equations could not be solved.
const FAILED_FACTOR: f64 = 0.4;

/// Part of the local error that may be left to the solution of a step's equations.
const NEWTON_SHARE: f64 = 0.1;

impl Simulation {
    /// Makes the local error of every step at most `tolerance` metres by choosing its size and order; `None` goes back to
    /// steps of `dt`, first order.
    pub fn set_tolerance(&mut self, tolerance: Option<f64>) {
        self.tolerance = tolerance;
        self.settings = NewtonSettings::default();
        if let Some(length) = tolerance {
            self.settings.goal = Goal::Displacement(NEWTON_SHARE * length);
        }
    }

    /// Makes one adaptive step, not beyond `limit`.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn adaptive_step(&mut self, limit: f64) -> Result<(), StepError> {
        let start = Instant::now();
        let result = self.try_adaptively(limit);
        self.statistics.seconds_total += start.elapsed().as_secs_f64();
        result
    }

    fn try_adaptively(&mut self, limit: f64) -> Result<(), StepError> {
        // The first step is a small part of a fixed one: nothing is known yet of how fast things change.
        if self.state.control.dt == 0.0 {
            self.state.control = Control { dt: FIRST_STEP * self.dt, order: 1 };
        }
        let smallest = SMALLEST_STEP * self.dt;
        loop {
            self.check_progress()?;
            let wanted = self.state.control;
            let left = limit - self.state.time;
            // Two equal steps to the limit rather than a whole one and a sliver.
            let dt = if wanted.dt >= left {
                left
            } else if 2.0 * wanted.dt > left {
                0.5 * left
            } else {
                wanted.dt
            };
            match self.try_step(dt, wanted.order) {
                Ok(true) => {
                    if dt < 0.999 * wanted.dt {
                        // A step cut short by the limit says little against the wanted one.
                        self.state.control.dt = self.state.control.dt.max(wanted.dt);
                    }
                    return Ok(());
                }
                Ok(false) => self.statistics.rejected_steps += 1,
                Err(TryError::Signal(error)) => return Err(StepError::Signal(error)),
                Err(TryError::Solve { residual, iterations, worst, reason }) => {
                    self.statistics.rejected_steps += 1;
                    self.state.control = Control { dt: FAILED_FACTOR * dt, order: wanted.order.min(2) };
                    if self.state.control.dt < smallest {
                        return Err(self.convergence_error(dt, residual, iterations, worst, reason));
                    }
                }
            }
            if self.state.control.dt < smallest {
                let reason = "the step has become too small for the tolerance".to_owned();
                return Err(self.convergence_error(dt, f64::NAN, 0, 0, reason));
            }
        }
    }

    /// The state at a time within the last step, interpolated to the order of the past states.
    ///
    /// Frames are transported from those of the present state, so that material frames are continuous. Contact forces are
    /// those of the present state.
    ///
    /// # Errors
    /// [`StepError::Signal`] if a motor's function of time fails.
    pub fn state_at(&self, time: f64) -> Result<State, StepError> {
        let mut state = self.state.clone();
        let order = state.history.past.len().min(state.control.order + 1);
        let now = self.state.time;
        self.state.history.extrapolate(order, (now, &self.state.q), |s| &s.q, time, &mut state.q);
        self.state.history.extrapolate(order, (now, &self.state.velocity), |s| &s.velocity, time, &mut state.velocity);
        self.state.history.extrapolate(order, (now, &self.state.density), |s| &s.density, time, &mut state.density);
        for (k, motor) in self.model.motors.iter().enumerate() {
            if let Drive::Speed(signal) = &motor.drive {
                state.motor_angles[k] -= signal.integral(time, now).map_err(StepError::Signal)?;
            }
        }
        state.time = time;
        Ok(state)
    }
}
