//! A simulation: steps a model's state, retries with smaller steps, and keeps the last good state.
//!
//! * `adaptive`: steps of adaptive size and order; `between`, `output`: states between them.
//! * [`frame`]: what is told of an instant; `diagnostics`: motor torques, force densities, gaps.
//! * `outside`: forces that a caller's function gives; `progress`: whether work still moves the time on.
//! * [`failure`]: what can go wrong with a step.

mod adaptive;
mod between;
mod diagnostics;
pub mod failure;
pub mod frame;
mod output;
mod outside;
pub(crate) mod progress;

use std::sync::Arc;
use std::time::Instant;

use crate::Vec3;
use crate::bdf::control::{Control, Estimate};
use crate::bdf::history::{History, Sample};
use crate::forces::outside::{ForceFunction, OutsideForce};
use crate::inputs::Inputs;
use crate::inputs::over_step::OverStep;
use crate::model::specification::Specification;
use crate::model::{Model, ModelError};
use crate::nonlinear::continuation;
use crate::nonlinear::equations::Goal;
use crate::nonlinear::newton::{NewtonSettings, NewtonWork};
use crate::runtime::interrupt::Hook;
use crate::runtime::threads::Threads;
use crate::simulation::adaptive::LONGEST_STEP;
use crate::simulation::failure::{StepError, TryError};
use crate::simulation::progress::Progress;
use crate::state::State;
use crate::state::account::Account;
use crate::step::contact::Review;
use crate::step::equations::StepEquations;
use crate::step::given::{Drives, Step};
use crate::step::ledger::Accepted;
use crate::step::problem::Problem;
use crate::step::scheme::Scheme;
use crate::step::solver::Solver;
use crate::step::statistics::Statistics;
use crate::step::unknowns::Unknowns;

/// Residual to which the force balance is solved between passes of the contact loop.
const ROUGH_TOLERANCE: f64 = 1e-4;

/// Coordinates over the size of a filament beyond which its strains are round-off.
const FARTHEST: f64 = 1e10;

/// Part of a fixed step below which one is an instant.
const INSTANT: f64 = 1e-3;

/// How often a step may be halved.
const HALVINGS: u32 = 12;

/// What motors, clamps, loads and a caller's function do over a step.
type Prepared = (OverStep, Option<Arc<OutsideForce>>);

/// A model, what drives it, its state, and the workspace that takes it forward.
pub struct Simulation {
    pub(crate) model: Arc<Model>,
    pub(crate) inputs: Inputs,
    pub(crate) state: State,
    pub(crate) solver: Solver,
    pub(crate) scheme: Scheme,
    pub(crate) dt: f64,
    pub(crate) settings: NewtonSettings,
    pub(crate) work: NewtonWork<Unknowns>,
    pub(crate) statistics: Statistics,
    fluid_step: Option<u64>,
    trial: Unknowns,
    extrapolated: Vec<f64>,
    pub(crate) tolerance: Option<f64>,
    pub(crate) force: Option<ForceFunction>,
    /// What the function gave for the step with this number: a step that is tried again sees the same.
    pub(crate) given: Option<(u64, Arc<OutsideForce>)>,
    positions: Vec<Vec3>,
    pub(crate) progress: Progress,
}

impl Simulation {
    /// A simulation of a specification with steps of `dt` seconds.
    ///
    /// # Errors
    /// [`ModelError`] naming what is not valid.
    pub fn new(specification: Specification, scheme: Scheme, dt: f64, thread_count: usize) -> Result<Self, ModelError> {
        let model = Arc::new(Model::new(specification)?);
        let state = State::initial(&model)?;
        if let Some(overlap) = model.overlap(&state.positions(&model.network)) {
            return Err(ModelError::Overlap(overlap));
        }
        let inputs = Inputs::of(&model);
        Self::from_model(model, inputs, state, scheme, dt, thread_count)
    }

    /// A simulation of a model that others may share, from one of its states: nothing is analysed again.
    ///
    /// # Errors
    /// As [`Self::adopt`].
    pub fn from_model(
        model: Arc<Model>,
        inputs: Inputs,
        mut state: State,
        scheme: Scheme,
        dt: f64,
        thread_count: usize,
    ) -> Result<Self, ModelError> {
        let solver = Solver::new(&model, Threads(thread_count))?;
        state.fit_density(solver.density_length(scheme));
        state.check(&model, state.density.len())?;
        let trial = Unknowns { q: state.q.clone(), density: state.density.clone(), tensions: state.tensions.clone() };
        let mut simulation = Self {
            work: NewtonWork::new(&trial),
            trial,
            tolerance: None,
            force: None,
            given: None,
            extrapolated: state.q.clone(),
            positions: state.positions(&model.network),
            progress: Progress::default(),
            settings: NewtonSettings::default(),
            statistics: Statistics::default(),
            fluid_step: None,
            model,
            inputs,
            state: state.clone(),
            solver,
            scheme,
            dt,
        };
        simulation.adopt(state)?;
        Ok(simulation)
    }

    /// What drives the scene.
    pub fn inputs(&self) -> &Inputs {
        &self.inputs
    }

    /// Drives the scene by other inputs from here on; rates may jump, so that past states foretell nothing any more.
    pub fn set_inputs(&mut self, inputs: Inputs) {
        self.inputs = inputs;
        self.state.control.at_jump = true;
    }

    /// Local error of adaptive steps; none for fixed steps.
    pub fn tolerance(&self) -> Option<f64> {
        self.tolerance
    }

    /// The constant part, to be shared.
    pub fn shared_model(&self) -> Arc<Model> {
        Arc::clone(&self.model)
    }

    /// The constant part.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The last good state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The scheme.
    pub fn scheme(&self) -> Scheme {
        self.scheme
    }

    /// Length of a step, s.
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Changes the length of a step, s.
    pub fn set_dt(&mut self, dt: f64) {
        self.dt = dt;
    }

    /// Counts and times.
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// The fluid no longer stands where the next step needs it.
    pub(crate) fn forget_fluid(&mut self) {
        self.fluid_step = None;
    }

    /// Takes over a saved state of the same model.
    pub fn restore(&mut self, state: State) {
        self.go_back(state);
        self.progress = Progress::from(self.statistics.newton_iterations, self.state.time);
    }

    /// Goes back to a state from which steps were tried: the work that they took still counts.
    pub(crate) fn go_back(&mut self, state: State) {
        if let Some(contact) = &mut self.solver.medium.contact {
            contact.restore(&state);
        }
        self.state = state;
        self.fluid_step = None;
        self.given = None;
    }

    /// As [`Self::restore`], for a state from elsewhere.
    ///
    /// # Errors
    /// As [`State::check`]; [`ModelError::Shape`] if it is not a configuration; [`ModelError::Overlap`] if barrier contact
    /// cannot go on from there. The present state is then kept.
    pub fn adopt(&mut self, mut state: State) -> Result<(), ModelError> {
        let flow = self.state.density.len();
        state.fit_density(flow);
        state.check(&self.model, flow)?;
        let energies = self.energies_of(&state);
        if energies.is_empty() || energies.iter().any(|(_, energy)| !energy.is_finite()) {
            return Err(ModelError::Shape { shape: "nodes" });
        }
        if let Some(overlap) =
            self.model.overlap(&state.positions(&self.model.network)).filter(|_| self.model.barrier().is_some())
        {
            return Err(ModelError::Overlap(overlap));
        }
        self.restore(state);
        Ok(())
    }

    /// Moves nodes and, if given, edge angles; at rest. Frames are transported from those of the last accepted state, so
    /// that the result depends on the positions alone and not on a path to them.
    ///
    /// # Errors
    /// [`ModelError::Shape`] if the positions are not a configuration, and as [`Self::adopt`]; the state is unchanged.
    pub fn place(&mut self, nodes: &[Vec3], theta: Option<&[f64]>) -> Result<(), ModelError> {
        let mut state = self.state.clone();
        let network = &self.model.network;
        for (node, &dof) in nodes.iter().zip(network.node_dofs()) {
            state.q[dof..dof + 3].copy_from_slice(node.as_slice());
        }
        for (&angle, &dof) in theta.unwrap_or_default().iter().zip(network.edge_dofs()) {
            state.q[dof] = angle;
        }
        state.velocity.fill(0.0);
        state.history = History::default();
        state.density.fill(0.0);
        state.tensions.fill(0.0);
        state.contact_anchor.clear();
        state.fluid_nodes.clear();
        state.contacts.clear();
        state.control = Control::default();
        state.account = Account::default();
        state.frames.follow_turned_over(network, nodes);
        self.adopt(state)
    }

    /// Advances by one step: of `dt`, in as many smaller ones as it takes, or of the size the tolerance asks for.
    ///
    /// # Errors
    /// [`StepError`]; the state is that of the last accepted (smaller) step.
    pub fn step(&mut self) -> Result<(), StepError> {
        match self.tolerance {
            None => self.advance(self.dt),
            Some(_) => self.adaptive_step(f64::INFINITY),
        }
    }

    /// Advances by the given time in one step or, where that does not converge, in several.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn advance(&mut self, duration: f64) -> Result<(), StepError> {
        let start = Instant::now();
        let (mut left, mut part) = (duration, duration);
        let smallest = duration * 0.5_f64.powi(HALVINGS as i32);
        let result = loop {
            if left <= 0.5 * smallest {
                break Ok(());
            }
            if let Err(stalled) = self.check_progress() {
                break Err(stalled);
            }
            let dt = part.min(left);
            match self.try_step(dt, 1) {
                Ok(_) => left -= dt,
                Err(TryError::Interrupted) => break Err(StepError::Interrupted),
                Err(TryError::Signal(error)) => break Err(StepError::Signal(error)),
                Err(TryError::Solve { residual, iterations, worst, reason }) => {
                    self.statistics.rejected_steps += 1;
                    // A bad guess is cured by a worse but safer one before the step is made smaller.
                    if std::mem::take(&mut self.state.history.order) > 0 {
                        continue;
                    }
                    part = 0.5 * dt;
                    if part < smallest {
                        break Err(self.convergence_error(dt, residual, iterations, worst, reason));
                    }
                }
            }
        };
        self.statistics.seconds_total += start.elapsed().as_secs_f64();
        result
    }

    pub(crate) fn convergence_error(
        &mut self,
        dt: f64,
        residual: f64,
        iterations: usize,
        worst: Option<usize>,
        reason: String,
    ) -> StepError {
        let smallest_gap = self.smallest_gap().unwrap_or(f64::INFINITY);
        let dofs = self.model.network.node_dofs();
        let advice = match self.tolerance {
            None => "a smaller dt, or rtol in its place, may help",
            Some(_) => "a finer mesh there, a slower drive or a smaller rtol may help",
        };
        StepError::Convergence {
            time: self.state.time,
            step: self.state.steps,
            dt,
            residual: Some(residual).filter(|residual| residual.is_finite()),
            iterations,
            smallest_gap,
            worst_node: worst.map(|worst| dofs.partition_point(|&dof| dof <= worst).saturating_sub(1)),
            reason: format!("{reason}; {advice}"),
        }
    }

    /// Tries one step of the given length and order; whether it was accepted.
    pub(crate) fn try_step(&mut self, dt: f64, order: usize) -> Result<bool, TryError> {
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
        let missed = self.state.history.prediction_errors(
            (t0, &self.state.q),
            (t1, &self.trial.q),
            &self.model.error_weight,
            &mut self.extrapolated,
        );
        let mut accepted = true;
        if let Some(tolerance) = self.tolerance {
            let times = self.state.history.times(t0, usize::MAX);
            let control = Control { order, ..self.state.control };
            let mut unseen = departure / self.angle_tolerance() * tolerance;
            for (dof, impulse) in impulses {
                unseen = unseen.max(self.solver.response(&self.model, dof)? * impulse / dt);
            }
            for (channel, impulse) in load_impulses {
                unseen = unseen.max(self.solver.response_to_load(&self.model, t1, channel)? * impulse / dt);
            }
            let highest_order = if self.force.is_some() { 1 } else { self.scheme.highest_order() };
            let estimate = Estimate { missed: &missed, unseen, tolerance, highest_order };
            (self.state.control, accepted) = control.judge(&times, t1, &estimate);
            self.state.control.dt = self.state.control.dt.min(LONGEST_STEP * self.dt);
        }
        if accepted {
            self.accept(drives, dt, order, &missed)?;
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

    /// Sets what is asked every 50 ms of a step whether to give it up; `None` lets every step come to its end.
    pub fn set_interrupt(&mut self, hook: Option<Hook>) {
        self.solver.interrupt.set(hook);
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

    fn accept(&mut self, drives: Drives, dt: f64, order: usize, missed: &[f64]) -> Result<(), TryError> {
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
        self.solver.keep_fluid_nodes(&mut state.fluid_nodes);
        let replaced = Sample {
            time: state.time,
            q: std::mem::replace(&mut state.q, self.trial.q.clone()),
            velocity: std::mem::replace(&mut state.velocity, velocity),
            density: std::mem::replace(&mut state.density, self.trial.density.clone()),
        };
        state.tensions.copy_from_slice(&self.trial.tensions);
        state.history.accept(replaced, missed);
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
