//! What solves a step's equations: their memory, the fluid and contact at hand, factors, and what residuals are measured by.

use std::time::Instant;

use crate::Vec3;
use crate::contact::potential::SlipChange;
use crate::linear::LinearError;
#[cfg(test)]
use crate::linear::nearly_symmetric::NearlySymmetric;
use crate::model::Model;
use crate::nonlinear::equations::{Goal, Size};
use crate::rod::assembly::Assembly;
use crate::rod::term::TermError;
use crate::runtime::interrupt::Interrupt;
use crate::runtime::threads::Threads;
use crate::state::State;
use crate::step::contact::{Review, strategy};
use crate::step::evaluation::Evaluation;
use crate::step::flow::Flow;
use crate::step::given::Step;
use crate::step::ledger::Ledger;
use crate::step::problem::{Medium, Problem, Unbalanced};
use crate::step::saddle::{Coupling, Saddle};
use crate::step::scheme::Scheme;
use crate::step::statistics::Statistics;
use crate::step::system::SparseSystem;
use crate::step::targets::Targets;
use crate::step::unknowns::Unknowns;

/// What is still to be corrected of a trial solution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Remainder {
    /// Largest displacement, relative to the size of its filament.
    pub length: f64,
    /// Changes of sliding velocities.
    pub slip: SlipChange,
}

/// Workspace of a simulation's steps.
pub(crate) struct Solver {
    pub at: Evaluation,
    pub medium: Medium,
    pub ledger: Ledger,
    pub threads: Threads,
    pub interrupt: Interrupt,
    system: SparseSystem,
    saddle: Saddle,
    targets: Targets,
    /// Right-hand side of the force balance, and the displacement that answers it.
    rhs: Vec<f64>,
    moved: Vec<f64>,
    /// How far every node yields to a force within the step, relative to the size of its filament, 1/N.
    yielding: Vec<f64>,
    /// Why there is no residual at the last trial.
    unbalanced: Option<Unbalanced>,
}

impl Solver {
    /// The workspace of a model.
    pub fn new(model: &Model, threads: Threads) -> Result<Self, LinearError> {
        let flow = Flow::new(model)?;
        let immersed = flow.dofs().len();
        Ok(Self {
            at: Evaluation::new(model),
            ledger: Ledger::new(model),
            system: SparseSystem::new(&model.storage),
            saddle: Saddle::new(if flow.is_nonlocal() { 3 * immersed } else { 0 }),
            targets: Targets::new(model, immersed),
            rhs: vec![0.0; model.dof_count],
            moved: vec![0.0; model.dof_count],
            yielding: Vec::new(),
            unbalanced: None,
            medium: Medium { flow, contact: strategy(model), seconds_contact: 0.0 },
            threads,
            interrupt: Interrupt::default(),
        })
    }

    /// Components of the force density that a scheme needs.
    pub fn density_length(&self, scheme: Scheme) -> usize {
        let needed = self.medium.flow.is_nonlocal() && scheme.fluid_is_implicit();
        if needed { 3 * self.medium.flow.dofs().len() } else { 0 }
    }

    /// Moves the fluid to the geometry of a state.
    pub fn place_fluid(&mut self, positions: &[Vec3], statistics: &mut Statistics) -> Result<(), LinearError> {
        let start = Instant::now();
        let done = self.medium.flow.place(positions, self.threads.pool().as_deref());
        statistics.seconds_fluid += start.elapsed().as_secs_f64();
        done
    }

    /// Prepares a step: the fluid's force, if it is that of the last velocities, and what contact takes from its beginning.
    pub fn begin(&mut self, model: &Model, step: &Step, statistics: &mut Statistics) -> Result<(), LinearError> {
        let start = Instant::now();
        if self.medium.contact.is_some() {
            let mut stiffness = std::mem::take(&mut self.yielding);
            self.node_stiffness(model, step, &mut stiffness);
            if let Some(contact) = &mut self.medium.contact {
                contact.begin(step.state, &stiffness);
            }
            self.yielding = stiffness;
        }
        let done = self.medium.flow.begin(step, self.threads.pool().as_deref());
        statistics.seconds_fluid += start.elapsed().as_secs_f64();
        done
    }

    /// Each node's stiffness against displacement within the step: mass over dt squared plus own drag over dt, N/m.
    fn node_stiffness(&self, model: &Model, step: &Step, out: &mut Vec<f64>) {
        let inertia = if step.scheme.has_inertia() { step.rate * step.rate } else { 0.0 };
        out.clear();
        out.extend(model.network.node_dofs().iter().map(|&dof| model.mass[dof] * inertia));
        self.medium.flow.add_node_stiffness(step, out);
    }

    /// How far friction can change sliding velocities within the step, over its smoothing velocity; contacts are those at the
    /// configuration of the last residual.
    pub fn friction_reach(&self, model: &Model, step: &Step) -> f64 {
        let Some(contact) = &self.medium.contact else { return 0.0 };
        let mut mobility = Vec::new();
        self.node_stiffness(model, step, &mut mobility);
        for (stiffness, &dof) in mobility.iter_mut().zip(model.network.node_dofs()) {
            *stiffness = if model.prescribed[dof] { 0.0 } else { step.rate / *stiffness };
        }
        contact.friction_reach(&mobility)
    }

    /// Part of the way between two sets of degrees of freedom over which contact lets the nodes go.
    pub fn step_limit(&mut self, from: &[f64], to: &[f64], statistics: &mut Statistics) -> f64 {
        let start = Instant::now();
        let limit = self.medium.contact.as_mut().map_or(1.0, |contact| contact.step_limit(from, to));
        statistics.seconds_contact += start.elapsed().as_secs_f64();
        limit
    }

    /// Shortens the way from the beginning of a step to the guess at its end to what contact allows; false if what is prescribed goes
    /// farther than that.
    pub fn keep_apart(&mut self, model: &Model, from: &[f64], guess: &mut [f64], statistics: &mut Statistics) -> bool {
        if self.medium.contact.is_none() {
            return true;
        }
        let mut start = from.to_vec();
        let prescribed = model.prescribed.iter().zip(start.iter_mut().zip(&*guess));
        prescribed.filter(|(held, _)| **held).for_each(|(_, (start, end))| *start = *end);
        if self.step_limit(from, &start, statistics) < 1.0 {
            return false;
        }
        let limit = self.step_limit(&start, guess, statistics);
        if limit < 1.0 {
            guess.iter_mut().zip(&start).for_each(|(guess, start)| *guess = start + limit * (*guess - start));
        }
        true
    }

    /// Lets contact look at a solution.
    pub fn review_contact(&mut self, q: &[f64], statistics: &mut Statistics) -> Review {
        let Some(contact) = &mut self.medium.contact else { return Review::Settled };
        let start = Instant::now();
        let review = contact.review(q, &mut statistics.contact_iterations);
        statistics.seconds_contact += start.elapsed().as_secs_f64();
        review
    }

    /// Sets what residuals are measured by in the solve of a step from the degrees of freedom `q`.
    pub fn aim(&mut self, problem: Problem, goal: Goal, q: &[f64]) {
        let fluid = self.medium.flow.implicit(problem.step);
        self.targets.aim(problem.model, problem.step, goal, fluid, q);
    }

    /// Weights merits and linear systems by what the last residual still lacks where; its merit in these weights.
    pub fn weigh(&mut self, model: &Model) -> f64 {
        self.targets.weigh(model, self.medium.flow.dofs());
        self.size(model).merit
    }

    fn size(&self, model: &Model) -> Size {
        self.targets.size(model, &self.at.residual, &self.at.slip, self.medium.flow.dofs())
    }

    /// Residual at a trial; `None` if there is none, for the reason that [`Self::unbalanced`] tells.
    pub fn evaluate(&mut self, problem: Problem, trial: &Unknowns, statistics: &mut Statistics) -> Option<Size> {
        let start = Instant::now();
        let size = self.residual(problem, trial);
        let contact = std::mem::take(&mut self.medium.seconds_contact);
        statistics.seconds_contact += contact;
        statistics.seconds_assembly += start.elapsed().as_secs_f64() - contact;
        self.unbalanced = size.as_ref().err().cloned();
        size.ok()
    }

    fn residual(&mut self, problem: Problem, trial: &Unknowns) -> Result<Size, Unbalanced> {
        if self.medium.flow.implicit(problem.step).is_some() && self.interrupt.requested() {
            return Err(Unbalanced { place: None, reason: "interrupted".to_owned() });
        }
        problem.evaluate(trial, &mut self.medium, self.threads.pool().as_deref(), &mut self.at)?;
        self.targets.measure(problem.model, &self.at.residual);
        self.at.combine(&problem.model.prescribed);
        Some(self.size(problem.model)).filter(|size| size.merit.is_finite()).ok_or_else(|| problem.fault(&trial.q))
    }

    /// Why the last trial has no residual.
    pub fn unbalanced(&self) -> Option<&Unbalanced> {
        self.unbalanced.as_ref()
    }

    /// Linearises the balance at the configuration of the last residual and the given tensions of edges, and factors its
    /// sparse part.
    pub fn linearize(
        &mut self,
        problem: Problem,
        tensions: &[f64],
        statistics: &mut Statistics,
    ) -> Result<(), LinearError> {
        let start = Instant::now();
        problem
            .differentiate(tensions, &self.medium.flow, &mut self.at)
            .map_err(|error| LinearError::Product(error.to_string()))?;
        let assembled = Instant::now();
        statistics.seconds_assembly += (assembled - start).as_secs_f64();
        let contact = self.medium.contact.as_deref_mut();
        let how = (problem.step.rate, problem.treatment);
        let factored = self.system.factor(problem.model, &self.at.jacobian, contact, how);
        statistics.seconds_linear += assembled.elapsed().as_secs_f64();
        factored
    }

    /// Newton's direction for the last residual, from the given tensions of edges; `tolerance` is the relative residual of the linear
    /// system.
    pub fn direction(
        &mut self,
        problem: Problem,
        (tensions, tolerance): (&[f64], f64),
        out: &mut Unknowns,
        statistics: &mut Statistics,
    ) -> Result<(), LinearError> {
        let start = Instant::now();
        let solved = self.solve(problem, tolerance, out, statistics);
        problem.model.stretching.tension_changes(&self.at.configuration, &out.q, tensions, &mut out.tensions);
        statistics.seconds_linear += start.elapsed().as_secs_f64();
        solved
    }

    fn solve(
        &mut self,
        problem: Problem,
        tolerance: f64,
        out: &mut Unknowns,
        statistics: &mut Statistics,
    ) -> Result<(), LinearError> {
        self.rhs.iter_mut().zip(&self.at.residual).for_each(|(rhs, residual)| *rhs = -residual);
        let Self { medium, system, saddle, targets, interrupt, at, rhs, threads, .. } = self;
        let pool = threads.pool();
        let Some(mut coupling) = couple(problem, &mut medium.flow, targets, interrupt, pool.as_deref()) else {
            return system.factors().solve_refined(rhs, &mut out.q);
        };
        let solution = (&mut out.q[..], &mut out.density[..]);
        let effort = saddle.solve(system.factors(), &mut coupling, (rhs, &at.slip), tolerance, solution)?;
        statistics.krylov_iterations += effort.krylov_iterations;
        statistics.dense_solves += effort.dense_solves;
        Ok(())
    }

    /// How the last residual would be corrected were the fluid's resistance local, with the factors of the last linearisation;
    /// displacements below `tolerance`, relative to the size of a filament, do not matter.
    pub fn correction(
        &mut self,
        problem: Problem,
        tolerance: f64,
        statistics: &mut Statistics,
    ) -> Result<Remainder, LinearError> {
        let start = Instant::now();
        self.rhs.iter_mut().zip(&self.at.residual).for_each(|(rhs, residual)| *rhs = -residual);
        let Self { medium, system, saddle, targets, interrupt, at, rhs, moved, .. } = self;
        if let Some(mut coupling) = couple(problem, &mut medium.flow, targets, interrupt, None) {
            saddle.assume_local(&mut coupling, &at.slip, rhs);
        }
        let solved = system.factors().solve_roughly(rhs, moved);
        let length = problem.model.relative_size(moved);
        let slip = self.slip_change(problem, tolerance);
        statistics.seconds_linear += start.elapsed().as_secs_f64();
        solved.map(|()| Remainder { length, slip })
    }

    /// What the displacement at hand means for contacts with friction.
    fn slip_change(&mut self, Problem { model, step, .. }: Problem, tolerance: f64) -> SlipChange {
        if !self.medium.contact.as_ref().is_some_and(|contact| contact.slides()) {
            return SlipChange::default();
        }
        let mut yielding = std::mem::take(&mut self.yielding);
        self.node_stiffness(model, step, &mut yielding);
        for (stiffness, &dof) in yielding.iter_mut().zip(model.network.node_dofs()) {
            // Relative to the size of the node's filament, as the tolerance is.
            *stiffness = if model.prescribed[dof] { 0.0 } else { model.error_weight[dof] / *stiffness };
        }
        let contact = self.medium.contact.as_mut();
        let change = contact.map_or_else(SlipChange::default, |contact| {
            contact.slip_change(&self.moved, step.rate, &yielding, tolerance)
        });
        self.yielding = yielding;
        change
    }

    /// The correction that [`Self::correction`] has measured, as a direction from the given tensions of edges.
    pub fn last_correction(
        &mut self,
        problem: Problem,
        tensions: &[f64],
        out: &mut Unknowns,
    ) -> Result<(), LinearError> {
        let Self { medium, saddle, targets, interrupt, at, moved, .. } = self;
        out.q.copy_from_slice(moved);
        problem.model.stretching.tension_changes(&at.configuration, &out.q, tensions, &mut out.tensions);
        match couple(problem, &mut medium.flow, targets, interrupt, None) {
            Some(mut coupling) => saddle.complete(&mut coupling, moved, &mut out.density),
            None => Ok(()),
        }
    }

    /// Largest displacement, relative to the size of a filament, that a unit of force on one degree of freedom makes within the
    /// step, with the factors of the last linearisation.
    pub fn response(&mut self, model: &Model, dof: usize) -> Result<f64, LinearError> {
        self.rhs.fill(0.0);
        self.rhs[dof] = 1.0;
        self.answer(model)
    }

    /// The same of a unit of a load's signal at a time.
    pub fn response_to_load(&mut self, model: &Model, time: f64, channel: usize) -> Result<f64, LinearError> {
        let mut unit = vec![0.0; model.load_channels];
        self.rhs.fill(0.0);
        for value in [0.0, 1.0] {
            self.rhs.iter_mut().for_each(|rhs| *rhs = -*rhs);
            unit[channel] = value;
            model
                .add_at_rest(time, &unit, &self.at.configuration, &mut self.rhs)
                .map_err(|error| LinearError::Product(error.to_string()))?;
        }
        let held = self.rhs.iter_mut().zip(&model.prescribed).filter(|(_, held)| **held);
        held.for_each(|(rhs, _)| *rhs = 0.0);
        self.answer(model)
    }

    /// Size of the displacement that answers the right-hand side at hand.
    fn answer(&mut self, model: &Model) -> Result<f64, LinearError> {
        self.system.factors().solve_roughly(&self.rhs, &mut self.moved)?;
        Ok(model.relative_size(&self.moved))
    }

    /// The matrix of the last linearisation and its factors.
    #[cfg(test)]
    pub fn sparse(&mut self) -> &mut NearlySymmetric {
        self.system.factors()
    }

    /// Elastic gradient and the values of the elastic Hessian at a state.
    pub fn elastic(&mut self, model: &Model, state: &State) -> Result<(Vec<f64>, Vec<f64>), TermError> {
        let shafts = model.shafts(&state.motor_angles, &state.q);
        let (mut gradient, mut hessian) = (vec![0.0; model.dof_count], vec![0.0; model.storage.pattern.entries()]);
        if self.at.configuration.update(&model.network, &state.q, &state.frames, &shafts) {
            let mut out = Assembly { residual: &mut gradient, jacobian: Some(&mut hessian) };
            model.conservative().try_for_each(|term| term.add(&self.at.configuration, state.time, &mut out))?;
        }
        Ok((gradient, hessian))
    }

    /// Moves the configuration to a state; whether it is one.
    pub fn place_state(&mut self, model: &Model, state: &State) -> bool {
        let shafts = model.shafts(&state.motor_angles, &state.q);
        self.at.configuration.update(&model.network, &state.q, &state.frames, &shafts)
    }
}

/// The coupling of forces and flow, if the fluid's equation is one of the unknowns'.
fn couple<'a>(
    problem: Problem<'a>,
    flow: &'a mut Flow,
    targets: &'a Targets,
    interrupt: &'a mut Interrupt,
    pool: Option<&'a rayon::ThreadPool>,
) -> Option<Coupling<'a>> {
    let (fluid, dofs) = flow.implicit_nonlocal(problem.step)?;
    let (prescribed, rate, weights) = (&problem.model.prescribed[..], problem.step.rate, &targets.slip_weight[..]);
    Some(Coupling { fluid, dofs, prescribed, rate, weights, pool, interrupt })
}
