//! A simulation: steps a model's state, retries with smaller steps, and keeps the last good state.
//!
//! * `attempt`: one try at a step, and its acceptance; `adaptive`: steps of adaptive size and order; `between`, `output`: states between them.
//! * [`frame`]: what is told of an instant; `diagnostics`: motor torques, force densities, gaps.
//! * `outside`: forces that a caller's function gives; `progress`: whether work still moves the time on.
//! * [`failure`]: what can go wrong with a step.

mod adaptive;
mod attempt;
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
use crate::bdf::control::Control;
use crate::bdf::history::History;
use crate::forces::outside::{ForceFunction, OutsideForce};
use crate::inputs::Inputs;
use crate::model::specification::Specification;
use crate::model::{Model, ModelError};
use crate::nonlinear::newton::{NewtonSettings, NewtonWork};
use crate::runtime::interrupt::Hook;
use crate::runtime::threads::Threads;
use crate::simulation::failure::{StepError, TryError};
use crate::simulation::progress::Progress;
use crate::state::State;
use crate::state::account::Account;
use crate::step::scheme::Scheme;
use crate::step::solver::Solver;
use crate::step::statistics::Statistics;
use crate::step::unknowns::Unknowns;

/// How often a step may be halved.
const HALVINGS: u32 = 12;

/// A model, what drives it, its state, and the workspace that takes it forward.
pub struct Simulation {
    model: Arc<Model>,
    inputs: Inputs,
    state: State,
    solver: Solver,
    scheme: Scheme,
    dt: f64,
    settings: NewtonSettings,
    work: NewtonWork<Unknowns>,
    statistics: Statistics,
    fluid_step: Option<u64>,
    trial: Unknowns,
    extrapolated: Vec<f64>,
    tolerance: Option<f64>,
    force: Option<ForceFunction>,
    /// What the function gave for the step with this number: a step that is tried again sees the same.
    given: Option<(u64, Arc<OutsideForce>)>,
    positions: Vec<Vec3>,
    progress: Progress,
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
    fn forget_fluid(&mut self) {
        self.fluid_step = None;
    }

    /// Takes over a saved state of the same model.
    pub fn restore(&mut self, state: State) {
        self.go_back(state);
        self.progress = Progress::from(self.statistics.newton_iterations, self.state.time);
    }

    /// Goes back to a state from which steps were tried: the work that they took still counts.
    fn go_back(&mut self, state: State) {
        self.state = state;
        self.anchor_contact();
        self.fluid_step = None;
        self.given = None;
    }

    /// Lets contact list its near pairs where the state has them listed.
    pub(crate) fn anchor_contact(&mut self) {
        if let Some(contact) = &mut self.solver.medium.contact {
            contact.restore(&self.state);
        }
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

    fn convergence_error(
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
            reason: match self.coincidence().filter(|_| reason.contains("singular")) {
                Some([node, edge]) => format!(
                    "{reason}; node {node} stands on edge {edge}, where the fluid cannot tell their forces apart: move it away by a \
                     millionth of its filament's size or more, or join the two in one rod"
                ),
                None => format!("{reason}; {advice}"),
            },
        }
    }

    /// Sets what is asked every 50 ms of a step whether to give it up; `None` lets every step come to its end.
    pub fn set_interrupt(&mut self, hook: Option<Hook>) {
        self.solver.interrupt.set(hook);
    }
}
