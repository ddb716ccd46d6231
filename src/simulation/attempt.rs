//! One try at a step: what drives it, the solution of its equations, and what accepting it changes.

use std::sync::Arc;

use crate::Vec3;
use crate::bdf::control::{Control, Estimate};
use crate::bdf::history::Sample;
use crate::forces::outside::OutsideForce;
use crate::inputs::over_step::OverStep;
use crate::model::Model;
use crate::nonlinear::continuation;
use crate::nonlinear::equations::Goal;
use crate::nonlinear::newton::NewtonSettings;
use crate::simulation::Simulation;
use crate::simulation::adaptive::LONGEST_STEP;
use crate::simulation::failure::TryError;
use crate::step::contact::Review;
use crate::step::equations::StepEquations;
use crate::step::given::{Drives, Step};
use crate::step::ledger::Accepted;
use crate::step::problem::Problem;
use crate::step::unknowns::Unknowns;

/// Residual to which the force balance is solved between passes of the contact loop.
const ROUGH_TOLERANCE: f64 = 1e-4;

/// Coordinates over the size of a filament beyond which its strains are round-off.
const FARTHEST: f64 = 1e10;

/// Part of a fixed step below which one is an instant.
const INSTANT: f64 = 1e-3;

/// What motors, clamps, loads and a caller's function do over a step.
type Prepared = (OverStep, Option<Arc<OutsideForce>>);

impl Simulation {
    /// Tries one step of the given length and order; whether it was accepted.
    pub(super) fn try_step(&mut self, dt: f64, order: usize) -> Result<bool, TryError> {
        // Forces of a step's beginning are right to first order, and only the first order's estimate sees what they leave out.
        let order = if self.force.is_some() { 1 } else { order.min(self.state.history.past.len() + 1) };
        let (t0, t1) = (self.state.time, self.state.time + dt);
        self.solver.interrupt.begin();
        let mut trial = std::mem::take(&mut self.trial);
        self.open_account();
        let prepared = self.prepare(&mut trial, t0, t1);
        let solved = prepared.and_then(|(inputs, outside)| {
            let OverStep { angles, torques, loads, departure, impulses, load_impulses, .. } = inputs;
            let drives = Drives { motor_angles: angles, motor_torques: torques, inputs: loads, ambient: None, outside };
            let drives = self.solve(drives, dt, order, &mut trial)?;
            Ok((drives, departure, impulses, load_impulses))
        });
        self.trial = trial;
        if self.solver.interrupt.stopped() {
            return Err(self.interrupted());
        }
        let (drives, departure, impulses, load_impulses) = solved?;
        self.check_reach()?;
        let prediction_errors = self.state.history.prediction_errors(
            (t0, &self.state.q),
            (t1, &self.trial.q),
            &self.model.error_weight,
            &mut self.extrapolated,
        );
        let mut accepted = true;
        if let Some(tolerance) = self.tolerance {
            let times = self.state.history.times(t0, usize::MAX);
            let control = Control { order, ..self.state.control };
            let mut input_error = departure / self.angle_tolerance() * tolerance;
            for (dof, impulse) in impulses {
                input_error = input_error.max(self.solver.response(&self.model, dof)? * impulse / dt);
            }
            for (channel, impulse) in load_impulses {
                input_error = input_error.max(self.solver.response_to_load(&self.model, t1, channel)? * impulse / dt);
            }
            let highest_order = if self.force.is_some() { 1 } else { self.scheme.highest_order() };
            let estimate = Estimate { prediction_errors: &prediction_errors, input_error, tolerance, highest_order };
            (self.state.control, accepted) = control.judge(&times, t1, &estimate);
            self.state.control.dt = self.state.control.dt.min(LONGEST_STEP * self.dt);
        }
        if accepted {
            self.accept(drives, dt, order, &prediction_errors)?;
        }
        Ok(accepted)
    }

    /// Refuses a trial so far away that round-off of its coordinates is no longer small against its filament: unstable steps lead
    /// there.
    fn check_reach(&self) -> Result<(), TryError> {
        let Model { network, error_weight, .. } = &*self.model;
        let mut coordinates = network.node_dofs().iter().flat_map(|&dof| dof..dof + 3);
        match coordinates.find(|&dof| self.trial.q[dof].abs() * error_weight[dof] > FARTHEST) {
            None => Ok(()),
            Some(dof) => Err(TryError::Solve {
                residual: f64::NAN,
                iterations: 0,
                worst: Some(dof),
                reason: "nodes fly away, which steps too long for the scheme let them do".to_owned(),
            }),
        }
    }

    /// Back to the last good state, as if the step had not been tried.
    fn interrupted(&mut self) -> TryError {
        self.restore(self.state.clone());
        TryError::Interrupted
    }

    /// What drives the step; the guess, with the prescribed degrees of freedom set.
    fn prepare(&mut self, guess: &mut Unknowns, t0: f64, t1: f64) -> Result<Prepared, TryError> {
        let outside = self.outside_force()?;
        let over = OverStep::new(&self.model, &self.inputs, &self.state.motor_angles, (t0, t1))?;
        let state = &self.state;
        let order = state.history.guess_order();
        state.history.extrapolate(order, (t0, &state.q), |sample| &sample.q, t1, &mut guess.q);
        state.history.extrapolate(order, (t0, &state.density), |sample| &sample.density, t1, &mut guess.density);
        guess.tensions.copy_from_slice(&state.tensions);
        let motions = self.inputs.clamps().iter().zip(&over.turns);
        for (clamp, (motion, turn)) in self.model.clamps.iter().zip(motions) {
            clamp.advance(motion, (t0, &state.q), &state.frames, (t1, *turn), &mut guess.q)?;
        }
        Ok((over, outside))
    }

    /// Solves the step from the guess, contact included; what has driven it.
    fn solve(&mut self, mut drives: Drives, dt: f64, order: usize, trial: &mut Unknowns) -> Result<Drives, TryError> {
        let Self { model, inputs, state, solver, scheme, settings, work, statistics, positions, .. } = self;
        let dofs = model.network.node_dofs();
        let place = |q: &[f64], positions: &mut [Vec3]| {
            positions.iter_mut().zip(dofs).for_each(|(x, &dof)| *x = crate::rod::configuration::node(q, dof));
        };
        if order > 1 {
            // A higher order needs the fluid's geometry at the end of the step: that of the extrapolation will do.
            let now = (state.time, &state.q[..]);
            let reach = state.history.past.len().min(order);
            state.history.extrapolate(reach, now, |sample| &sample.q, state.time + dt, &mut self.extrapolated);
            place(&self.extrapolated, positions);
            self.fluid_step = None;
            solver.place_fluid(positions, statistics)?;
        } else if self.fluid_step != Some(state.steps) {
            place(&state.q, positions);
            self.fluid_step = None;
            solver.place_fluid(positions, statistics)?;
            self.fluid_step = Some(state.steps);
        }
        if order == 1 && !inputs.flows().is_empty() {
            place(&state.q, positions);
        }
        drives.ambient = inputs.ambient(model.network.edges(), positions, state.time + dt)?;
        let step = Step::new(*scheme, state, dt, order, drives);
        solver.begin(model, &step, statistics)?;
        let failed = |reason: &str| TryError::Solve {
            residual: f64::NAN,
            iterations: 0,
            worst: None,
            reason: reason.to_owned(),
        };
        if !solver.keep_apart(model, &state.q, &mut trial.q, statistics) {
            return Err(failed("what is prescribed moves filaments into each other"));
        }
        let rough = match settings.goal {
            Goal::Residual(tolerance) => Goal::Residual(tolerance.max(ROUGH_TOLERANCE)),
            goal @ Goal::Correction(_) => goal,
        };
        let rough = NewtonSettings { goal: rough, ..*settings };
        loop {
            // While contact forces are being found, the balance between passes need not be solved to the last digit.
            let is_rough = solver.medium.contact.as_ref().is_some_and(|contact| contact.is_rough());
            let wanted = if is_rough { rough } else { *settings };
            let mut equations = StepEquations { problem: Problem::new(model, &step), solver, statistics };
            continuation::solve(&mut equations, &wanted, work, trial)?;
            match solver.review_contact(&trial.q, statistics) {
                Review::Settled => return Ok(step.drives),
                Review::Again => {}
                Review::Failed(reason) => return Err(failed(&reason)),
            }
        }
    }

    /// Begins the account of energies at the present state, if none has begun.
    fn open_account(&mut self) {
        let Self { state, solver, model, scheme, .. } = self;
        if state.account.start.is_none() && solver.place_state(model, state) {
            let stored = solver.stored(model, &state.q, &state.velocity, scheme.has_inertia());
            state.account.begin(state.time, stored);
        }
    }

    fn accept(&mut self, drives: Drives, dt: f64, order: usize, prediction_errors: &[f64]) -> Result<(), TryError> {
        let step = Step::new(self.scheme, &self.state, dt, order, drives);
        let increment = step.increment();
        let velocity: Vec<f64> =
            self.trial.q.iter().enumerate().map(|(dof, &value)| increment.rate_of(dof, value)).collect();
        let account = self.solver.account(&Accepted {
            model: &self.model,
            step: &step,
            q: &self.trial.q,
            velocity: &velocity,
            density: &self.trial.density,
            motor_angles: &step.drives.motor_angles,
            dt,
            order,
            shortest_lasting: INSTANT * self.dt,
        })?;
        let reactions = self.solver.reactions(&self.model, &self.trial.q, &velocity);
        let angles = step.drives.motor_angles;
        if !account.is_finite() {
            return Err(TryError::Solve {
                residual: f64::NAN,
                iterations: 0,
                worst: None,
                reason: "energies grow beyond all bounds, which steps too long for the scheme let them do".to_owned(),
            });
        }
        let state = &mut self.state;
        state.account = account;
        state.reactions = reactions;
        let replaced = Sample {
            time: state.time,
            q: std::mem::replace(&mut state.q, self.trial.q.clone()),
            velocity: std::mem::replace(&mut state.velocity, velocity),
            density: std::mem::replace(&mut state.density, self.trial.density.clone()),
        };
        state.tensions.copy_from_slice(&self.trial.tensions);
        state.history.accept(replaced, prediction_errors);
        self.solver.at.configuration.accept(&mut state.frames);
        state.time += dt;
        state.steps += 1;
        for (k, motor) in self.model.motors.iter().enumerate() {
            state.motor_angles[k] = motor.shaft(angles[k], &state.q).angle;
        }
        if let Some(contact) = &mut self.solver.medium.contact {
            contact.record(state);
            self.statistics.contact_searches = contact.searches();
        }
        self.statistics.steps += 1;
        Ok(())
    }
}
