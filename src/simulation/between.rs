//! States between adaptive steps: interpolated, then brought into the balance of forces that steps keep.

use crate::forces::motors::{Drive, Motor};
use crate::model::contact::ContactModel;
use crate::nonlinear::equations::{Equations, Goal};
use crate::signal::Signal;
use crate::simulation::Simulation;
use crate::simulation::failure::StepError;
use crate::state::State;
use crate::step::equations::StepEquations;
use crate::step::given::{Drives, Step};
use crate::step::problem::Problem;
use crate::step::statistics::Statistics;
use crate::step::unknowns::Unknowns;

/// Most corrections of an interpolated state, and the part of Newton's goal that the last one may have: it leaves its square.
const MOST_CORRECTIONS: usize = 10;
const SETTLED: f64 = 1e-2;
/// Relative residual that their linear systems may leave.
const LINEAR: f64 = 1e-3;
/// Part of the last step over which the interpolated velocity is differenced to an acceleration.
const DIFFERENCE: f64 = 1e-3;

impl Simulation {
    /// The state at a time within the last step: interpolated to the order of the past states, then corrected.
    ///
    /// Interpolated positions are as exact as steps, but strains of stiff rods are differences of them and far smaller: they are
    /// found from the balance of forces, with the interpolated rates. Material frames are continuous. Contact forces are those of
    /// the present state.
    ///
    /// # Errors
    /// [`StepError::Signal`] if a motor's function of time fails.
    pub fn state_at(&mut self, time: f64) -> Result<State, StepError> {
        let mut state = self.interpolated(time)?;
        if !state.history.past.is_empty() {
            let shafts = self.model.shafts(&state.motor_angles, &state.q);
            let configuration = &mut self.solver.at.configuration;
            if configuration.update(&self.model.network, &state.q, &state.frames, &shafts) {
                configuration.accept(&mut state.frames);
                self.settle(&mut state);
            }
        }
        Ok(state)
    }

    pub(super) fn interpolated(&self, time: f64) -> Result<State, StepError> {
        let mut state = self.state.clone();
        let (past, now) = (&self.state.history, self.state.time);
        let order = past.past.len().min(state.control.order + 1);
        past.extrapolate(order, (now, &self.state.q), |s| &s.q, time, &mut state.q);
        past.extrapolate(order, (now, &self.state.velocity), |s| &s.velocity, time, &mut state.velocity);
        past.extrapolate(order, (now, &self.state.density), |s| &s.density, time, &mut state.density);
        for (k, (motor, signal)) in self.model.motors.iter().zip(self.inputs.motors()).enumerate() {
            match &motor.drive {
                Drive::Speed => {
                    state.motor_angles[k] -= signal.integral(time, now).map_err(StepError::Signal)?;
                }
                Drive::Torque { dof } => state.motor_angles[k] = state.q[*dof],
            }
        }
        for (clamp, motion) in self.model.clamps.iter().zip(self.inputs.clamps()) {
            let mut back = || {
                let spin = if clamp.edges.is_empty() { 0.0 } else { -motion.spin.integral(time, now)? };
                clamp.advance(motion, (now, &self.state.q), &self.state.frames, (time, spin), &mut state.q)
            };
            back().map_err(StepError::Signal)?;
        }
        state.time = time;
        Ok(state)
    }

    /// Shows `look` the present state, brought into the balance of forces where steps of adaptive size have only found positions: its
    /// tensions, torques and forces on the fluid are then those of that balance. The state itself stays as it is.
    ///
    /// # Errors
    /// As [`Self::state_at`].
    pub fn balanced<R>(&mut self, look: impl FnOnce(&mut Self) -> R) -> Result<R, StepError> {
        if self.tolerance.is_none() {
            return Ok(look(self));
        }
        let state = self.state_at(self.state.time)?;
        Ok(self.look_at(state, look))
    }

    /// Shows `look` another state in place of the present one.
    pub fn look_at<R>(&mut self, state: State, look: impl FnOnce(&mut Self) -> R) -> R {
        let present = std::mem::replace(&mut self.state, state);
        self.anchor_contact();
        let seen = look(self);
        self.state = present;
        self.anchor_contact();
        seen
    }

    /// Brings an interpolated state into balance, with the fluid's equation at its own geometry: nothing that earlier steps have left
    /// behind may matter, or runs that go on from a file would show other frames. Without success it stays as it is.
    fn settle(&mut self, state: &mut State) {
        let Goal::Correction(goal) = self.settings.goal else { return };
        if self.force.is_some() {
            // What a caller's function would give between steps is not known.
            return;
        }
        let spillmann = self.model.contact.as_ref().and_then(ContactModel::spillmann).is_some();
        let Some(motor_torques) = self.torques_at(state.time).filter(|_| !spillmann || state.contacts.is_empty())
        else {
            return;
        };
        let Ok(inputs) = self.inputs.load_values(state.time) else { return };
        let Ok(ambient) =
            self.inputs.ambient(self.model.network.edges(), &state.positions(&self.model.network), state.time)
        else {
            return;
        };
        let base = state.clone();
        let step = Step {
            scheme: self.scheme,
            state: &base,
            end: state.time,
            drives: Drives { motor_angles: base.motor_angles.clone(), motor_torques, inputs, ambient, outside: None },
            rate: 1.0 / (self.state.time - self.state.history.past[0].time),
            drift: base.velocity.clone(),
            velocity_drift: self.acceleration_at(state.time),
        };
        let mut found = Unknowns { q: base.q.clone(), density: base.density.clone(), tensions: base.tensions.clone() };
        if self.correct(&step, &mut found, goal).is_some() {
            let rates = state.velocity.iter_mut().zip(found.q.iter().zip(&base.q));
            rates.for_each(|(velocity, (new, old))| *velocity += step.rate * (new - old));
            if !self.model.clamps.is_empty()
                && self.solver.evaluate(Problem::new(&self.model, &step), &found, &mut Statistics::default()).is_some()
            {
                state.reactions = self.solver.reactions(&self.model, &found.q, &state.velocity);
            }
            (state.q, state.density, state.tensions) = (found.q, found.density, found.tensions);
            self.solver.at.configuration.accept(&mut state.frames);
        }
    }

    /// Newton's method on the balance of forces.
    fn correct(&mut self, step: &Step, found: &mut Unknowns, goal: f64) -> Option<()> {
        self.fluid_step = None;
        let Self { model, solver, .. } = self;
        let mut uncounted = Statistics::default();
        solver.place_fluid(&step.state.positions(&model.network), &mut uncounted).ok()?;
        solver.begin(model, step, &mut uncounted).ok()?;
        let problem = Problem::new(model, step);
        let mut equations = StepEquations { problem, solver, statistics: &mut uncounted };
        equations.aim(Goal::Correction(goal), found);
        let mut direction = found.clone();
        for _ in 0..MOST_CORRECTIONS {
            equations.evaluate(found)?;
            equations.weigh();
            equations.linearize(found).ok()?;
            // What friction still has to slide does not count: a contact that sticks shows the stresses that it has.
            let left = equations.solver.correction(problem, goal, equations.statistics).ok()?.length;
            equations.direction(found, LINEAR, &mut direction).ok()?;
            let from = found.clone();
            equations.advance(&from, &direction, 1.0, found);
            if equations.longest_step(&from, found) < 1.0 {
                return None;
            }
            if left <= SETTLED * goal {
                return equations.place(found).then_some(());
            }
        }
        None
    }

    /// Torques of torque-driven motors, N m, unless one of their functions fails.
    fn torques_at(&self, time: f64) -> Option<Vec<f64>> {
        let torque = |(motor, signal): (&Motor, &Signal)| match motor.drive {
            Drive::Torque { .. } => signal.value(time).ok(),
            Drive::Speed => Some(0.0),
        };
        self.model.motors.iter().zip(self.inputs.motors()).map(torque).collect()
    }

    /// Rates of the interpolated rates.
    fn acceleration_at(&self, time: f64) -> Vec<f64> {
        let (past, now) = (&self.state.history, self.state.time);
        let mut ends = [vec![0.0; self.state.q.len()], vec![0.0; self.state.q.len()]];
        let apart = DIFFERENCE * (now - past.past[0].time);
        let order = past.past.len().min(self.state.control.order + 1);
        for (at, values) in [time - apart, time + apart].into_iter().zip(&mut ends) {
            past.extrapolate(order, (now, &self.state.velocity), |s| &s.velocity, at, values);
        }
        let [before, after] = ends;
        after.iter().zip(&before).map(|(after, before)| (after - before) / (2.0 * apart)).collect()
    }
}
