//! The force balance of one step: residual and derivative.
//!
//! The unknowns are the degrees of freedom `q` and, if the fluid is nonlocal and implicit, the force density `f` on it at the
//! immersed nodes. The balance has two parts,
//!
//! ```text
//!   r1 = dE/dq + W f + dissipation - loads - contact,        r2 = A f - 8 pi mu dx/dt,
//! ```
//!
//! so that no dense matrix is ever factored. How the linear systems are solved is told in `solve.rs`.

use std::sync::Arc;
use std::time::Instant;

use crate::bdf::history::derivative_weights;
use crate::fluid::FluidModel;
use crate::fluid::ambient::Ambient;
use crate::forces::motors::Drive;
use crate::forces::outside::OutsideForce;
use crate::linear::LinearError;
use crate::linear::krylov::Gmres;
use crate::linear::nearly_symmetric::NearlySymmetric;
use crate::model::Model;
use crate::nonlinear::equations::{Goal, Size};
use crate::rod::assembly::{Assembly, Increment, Term};
use crate::rod::configuration::{Configuration, ShaftAngle};
use crate::runtime::interrupt::Interrupt;
use crate::runtime::threads::Threads;
use crate::state::State;
use crate::step::contact::barrier::BarrierTerm;
use crate::step::scheme::Scheme;
use crate::step::statistics::Statistics;
use crate::step::targets::Targets;
use crate::{Mat3, Vec3};

/// GMRES iterations before the dense fallback; far above what a good preconditioner needs.
const KRYLOV_LIMIT: usize = 120;

/// What drives a step, at its end.
#[derive(Debug, Clone, Default)]
pub(crate) struct Drives {
    /// Angles of speed-driven motors, rad.
    pub motor_angles: Vec<f64>,
    /// Torques of torque-driven motors, N m.
    pub motor_torques: Vec<f64>,
    /// Values of the loads' signals.
    pub inputs: Vec<f64>,
    /// The background flow, where the fluid's geometry is taken.
    pub ambient: Option<Ambient>,
    /// What a caller's function gave at the beginning of the step.
    pub outside: Option<Arc<OutsideForce>>,
}

/// What is given for a step: its length, scheme, and what motors do by its end.
pub(crate) struct Step<'a> {
    pub scheme: Scheme,
    pub state: &'a State,
    /// Angles of speed-driven motors at the end of the step; entries of torque-driven ones are not read.
    pub motor_angles: Vec<f64>,
    /// Torques of torque-driven motors at the end of the step, N m.
    pub motor_torques: Vec<f64>,
    /// Backward difference: rates are `rate (q - q_n) + drift`.
    pub rate: f64,
    pub drift: Vec<f64>,
    pub velocity_drift: Vec<f64>,
    /// Values of the loads' signals at the end of the step.
    pub inputs: Vec<f64>,
    /// The background flow at the end of the step, where the fluid's geometry is taken.
    pub ambient: Option<Ambient>,
    /// What a caller's function gave at the beginning of the step.
    pub outside: Option<Arc<OutsideForce>>,
}

impl<'a> Step<'a> {
    /// A step of the given order, which at most is one more than there are past states.
    pub fn new(scheme: Scheme, state: &'a State, dt: f64, order: usize, drives: Drives) -> Self {
        let Drives { motor_angles, motor_torques, inputs, ambient, outside } = drives;
        let past = &state.history.past;
        let times: Vec<f64> = std::iter::once(state.time + dt).chain(state.history.times(state.time, order)).collect();
        let weights = derivative_weights(&times);
        let difference = |present: &[f64], part: &dyn Fn(usize) -> &'a [f64]| {
            let mut drift = vec![0.0; present.len()];
            for (k, weight) in weights[2..].iter().enumerate() {
                drift.iter_mut().zip(part(k)).zip(present).for_each(|((d, old), now)| *d += weight * (old - now));
            }
            drift
        };
        Self {
            scheme,
            state,
            motor_angles,
            motor_torques,
            rate: weights[0],
            drift: difference(&state.q, &|k| &past[k].q),
            velocity_drift: difference(&state.velocity, &|k| &past[k].velocity),
            inputs,
            ambient,
            outside,
        }
    }

    /// What drives it.
    pub fn into_drives(self) -> Drives {
        let Self { motor_angles, motor_torques, inputs, ambient, outside, .. } = self;
        Drives { motor_angles, motor_torques, inputs, ambient, outside }
    }

    pub fn increment(&self) -> Increment<'_> {
        Increment {
            inputs: &self.inputs,
            background: self.ambient.as_ref().map(Ambient::background),
            rate: self.rate,
            previous: &self.state.q,
            drift: &self.drift,
            velocity: &self.state.velocity,
            velocity_drift: &self.velocity_drift,
        }
    }
}

/// A trial solution: degrees of freedom and force density, and the tensions of edges as Newton's method sees them, linear
/// from iterate to iterate.
#[derive(Debug, Clone, Default)]
pub(crate) struct Unknowns {
    pub q: Vec<f64>,
    pub density: Vec<f64>,
    pub tensions: Vec<f64>,
}

/// Workspace of the force balance; no evaluation allocates.
pub(crate) struct Balance {
    pub(crate) configuration: Configuration,
    shafts: Vec<ShaftAngle>,
    pub(crate) residual: Vec<f64>,
    /// Residual of the fluid's equation, Pa m s / m.
    pub(crate) slip: Vec<f64>,
    elastic: Vec<f64>,
    pub(crate) jacobian: Vec<f64>,
    pub(crate) system: NearlySymmetric,
    /// Where the system stores the entries of the model's pattern; it may have more.
    pub(crate) embedding: Vec<u32>,
    pub(crate) barrier: Option<BarrierTerm>,
    pub(crate) gmres: Gmres,
    pub(crate) fluid: Option<Box<dyn FluidModel>>,
    /// Positions of the nodes, m, at which the fluid's geometry is.
    placed: Vec<Vec3>,
    pub(crate) fluid_dofs: Vec<usize>,
    pub(crate) flow: Vec<f64>,
    pub(crate) work: crate::step::saddle::Work,
    pub(crate) targets: Targets,
    pub(crate) constant: Vec<f64>,
    pub(crate) contact: Vec<f64>,
    /// What holds the prescribed degrees of freedom at the last residual, N or N m; zero elsewhere.
    pub(crate) reaction: Vec<f64>,
    /// Outer forces of an accepted step, and a term's share in them.
    pub(crate) outer: Vec<f64>,
    pub(crate) share: Vec<f64>,
    /// Rates that a background flow would give.
    pub(crate) carried: Vec<f64>,
    pub(crate) threads: Threads,
    pub(crate) interrupt: Interrupt,
}

impl Balance {
    pub fn new(model: &Model, threads: Threads) -> Result<Self, LinearError> {
        let n = model.dof_count;
        let storage = &model.storage;
        let fluid = model.fluid()?;
        let flow = 3 * storage.fluid_dofs.len();
        // The Krylov method works on the fluid's equation where there is one, else on the force balance.
        let size = if fluid.as_ref().is_some_and(|fluid| !fluid.is_local()) { flow } else { n };
        Ok(Self {
            configuration: Configuration::new(&model.network, n),
            shafts: Vec::new(),
            residual: vec![0.0; n],
            elastic: vec![0.0; n],
            jacobian: vec![0.0; storage.pattern.entries()],
            system: NearlySymmetric::of(Arc::clone(&storage.pattern), Arc::clone(&storage.analysis)),
            embedding: (0..storage.pattern.entries() as u32).collect(),
            barrier: model.barrier().map(BarrierTerm::new),
            gmres: Gmres::new(size, KRYLOV_LIMIT.min(size)),
            work: crate::step::saddle::Work::new(n, flow),
            targets: Targets::new(model, storage.fluid_dofs.len()),
            slip: vec![0.0; flow],
            flow: vec![0.0; flow],
            fluid,
            placed: Vec::new(),
            fluid_dofs: storage.fluid_dofs.clone(),
            constant: vec![0.0; n],
            contact: vec![0.0; n],
            reaction: vec![0.0; n],
            outer: vec![0.0; n],
            share: vec![0.0; n],
            carried: vec![0.0; n],
            threads,
            interrupt: Interrupt::default(),
        })
    }

    /// The configuration of the last residual.
    pub fn configuration(&self) -> &Configuration {
        &self.configuration
    }

    /// The fluid at the geometry of the last [`Self::place_fluid`].
    pub fn fluid_mut(&mut self) -> Option<&mut (dyn FluidModel + 'static)> {
        self.fluid.as_deref_mut()
    }

    /// Degrees of freedom of the immersed nodes.
    pub fn fluid_dofs(&self) -> &[usize] {
        &self.fluid_dofs
    }

    /// A vanishing force density, of the length the scheme needs.
    pub fn zero_density(&self, scheme: Scheme) -> Vec<f64> {
        let nonlocal = self.fluid.as_ref().is_some_and(|fluid| !fluid.is_local() && scheme.fluid_is_implicit());
        vec![0.0; if nonlocal { 3 * self.fluid_dofs.len() } else { 0 }]
    }

    /// Moves the fluid to the geometry of a state.
    pub fn place_fluid(&mut self, positions: &[Vec3], statistics: &mut Statistics) -> Result<(), LinearError> {
        let start = Instant::now();
        let done = match &mut self.fluid {
            Some(fluid) => fluid.update(positions, self.threads.pool().as_deref()),
            None => Ok(()),
        };
        self.placed.clear();
        if done.is_ok() {
            self.placed.extend_from_slice(positions);
        }
        statistics.seconds_fluid += start.elapsed().as_secs_f64();
        done
    }

    /// Moves a nonlocal fluid to where it was in a step, unless it stands there.
    pub fn return_fluid(&mut self, positions: &[Vec3], statistics: &mut Statistics) -> Result<(), LinearError> {
        let nonlocal = self.fluid.as_ref().is_some_and(|fluid| !fluid.is_local());
        if nonlocal && !positions.is_empty() && self.placed != positions {
            return self.place_fluid(positions, statistics);
        }
        Ok(())
    }

    /// Writes down where a nonlocal fluid stands.
    pub fn keep_fluid_nodes(&self, out: &mut Vec<Vec3>) {
        out.clear();
        if self.fluid.as_ref().is_some_and(|fluid| !fluid.is_local()) {
            out.extend_from_slice(&self.placed);
        }
    }

    /// Prepares a step: the fluid's force, if it is that of the last velocities, and what contact takes from its beginning.
    pub fn begin(&mut self, model: &Model, step: &Step, statistics: &mut Statistics) -> Result<(), LinearError> {
        let start = Instant::now();
        self.contact.fill(0.0);
        if let (Some(law), Some(barrier)) = (model.barrier(), &mut self.barrier) {
            barrier.begin(law, model.network.node_dofs(), &step.state.q);
        }
        self.constant.fill(0.0);
        if let Some(fluid) = self.fluid.as_mut().filter(|_| !step.scheme.fluid_is_implicit()) {
            gather(&self.fluid_dofs, |dof| step.state.velocity[dof], &mut self.flow);
            subtract_background(step, fluid.immersed(), &mut self.flow);
            fluid.resist(&mut self.flow, self.threads.pool().as_deref())?;
            scatter(&self.fluid_dofs, &self.flow, &mut self.constant);
        }
        statistics.seconds_fluid += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Sets the contact forces, N, by node.
    pub fn set_contact(&mut self, fill: impl FnOnce(&mut dyn FnMut(usize, Vec3)), node_dofs: &[usize]) {
        self.contact.fill(0.0);
        let contact = &mut self.contact;
        fill(&mut |node, force| (0..3).for_each(|c| contact[node_dofs[node] + c] += force[c]));
    }

    /// Each node's stiffness against displacement within the step: mass over dt squared plus own drag over dt, N/m.
    pub fn node_stiffness(&self, model: &Model, step: &Step, out: &mut Vec<f64>) {
        let inertia = if step.scheme.has_inertia() { step.rate * step.rate } else { 0.0 };
        out.clear();
        out.extend(model.network.node_dofs().iter().map(|&dof| model.mass[dof] * inertia));
        let Some(fluid) = self.fluid.as_ref().filter(|_| step.scheme.fluid_is_implicit()) else {
            return;
        };
        let drag = |block: &Mat3| block.trace() * step.rate / 3.0;
        let mean = fluid.local().iter().map(drag).sum::<f64>() / fluid.local().len() as f64;
        let mut immersed = vec![false; out.len()];
        for (&node, block) in fluid.immersed().iter().zip(fluid.local()) {
            out[node] += drag(block);
            immersed[node] = true;
        }
        // A dry node has no drag of its own; the mean of the others is as good a scale for its contacts as any.
        out.iter_mut().zip(&immersed).filter(|(_, wet)| !**wet).for_each(|(stiffness, _)| *stiffness += mean);
    }

    /// From here to the end of the step, contact's matrix is its positive semidefinite part; whether that is new.
    pub fn define_contact(&mut self) -> bool {
        self.barrier.as_mut().is_some_and(BarrierTerm::define)
    }

    /// How far friction can change sliding velocities within the step, over its smoothing velocity; contacts are those at the
    /// configuration of the last residual.
    pub fn friction_reach(&self, model: &Model, step: &Step) -> f64 {
        let Some((law, barrier)) = model.barrier().zip(self.barrier.as_ref()) else { return 0.0 };
        let dofs = model.network.node_dofs();
        let mut mobility = Vec::new();
        self.node_stiffness(model, step, &mut mobility);
        for (stiffness, &dof) in mobility.iter_mut().zip(dofs) {
            *stiffness = if model.prescribed[dof] { 0.0 } else { step.rate / *stiffness };
        }
        barrier.friction_reach(law, &mobility)
    }

    /// Multiplies the smoothing velocity of friction by a factor, and takes the exact matrix of contact again.
    pub fn widen_friction(&mut self, factor: f64) {
        if let Some(barrier) = &mut self.barrier {
            barrier.widen_friction(factor);
        }
    }

    /// Part of the way between two sets of degrees of freedom over which contact lets the nodes go.
    pub fn step_limit(&mut self, model: &Model, from: &[f64], to: &[f64], statistics: &mut Statistics) -> f64 {
        let start = Instant::now();
        let limit = match (model.barrier(), &mut self.barrier) {
            (Some(law), Some(barrier)) => barrier.step_limit(law, model.network.node_dofs(), from, to),
            _ => 1.0,
        };
        statistics.seconds_contact += start.elapsed().as_secs_f64();
        limit
    }

    /// Sets what residuals are measured by in the solve of a step from the degrees of freedom `q`.
    pub fn aim(&mut self, model: &Model, step: &Step, goal: Goal, q: &[f64]) {
        self.targets.aim(model, step, goal, (self.fluid.as_deref_mut(), &self.fluid_dofs), q);
    }

    /// Weights merits and linear systems by what the last residual still lacks where; its merit in these weights.
    pub fn weigh(&mut self, model: &Model) -> f64 {
        self.targets.weigh(model, &self.fluid_dofs);
        self.targets.size(model, &self.residual, &self.slip, &self.fluid_dofs).merit
    }

    /// Moves the configuration alone to given degrees of freedom; whether they are one.
    pub fn place(&mut self, model: &Model, step: &Step, q: &[f64]) -> bool {
        self.shafts.clear();
        self.shafts.extend(model.motors.iter().zip(&step.motor_angles).map(|(motor, &angle)| motor.shaft(angle, q)));
        self.configuration.update(&model.network, q, &step.state.frames, &self.shafts)
    }

    /// Takes the fluid's equation for solved.
    pub fn forget_slip(&mut self) {
        self.slip.fill(0.0);
    }

    /// Residual at a trial; `None` if it is not a configuration.
    pub fn evaluate(
        &mut self,
        model: &Model,
        step: &Step,
        trial: &Unknowns,
        statistics: &mut Statistics,
    ) -> Option<Size> {
        let (start, contact) = (Instant::now(), statistics.seconds_contact);
        let size = self.residual(model, step, trial, statistics);
        statistics.seconds_assembly += start.elapsed().as_secs_f64() - (statistics.seconds_contact - contact);
        size
    }

    fn residual(&mut self, model: &Model, step: &Step, trial: &Unknowns, statistics: &mut Statistics) -> Option<Size> {
        let q = &trial.q;
        if !self.place(model, step, q) {
            return None;
        }
        let increment = step.increment();
        self.elastic.fill(0.0);
        let mut out = Assembly { residual: &mut self.elastic, jacobian: None };
        model.stretching.add(&self.configuration, &increment, &mut out);
        model.hinges.add(&self.configuration, &increment, &mut out);
        self.residual.copy_from_slice(&self.constant);
        let mut out = Assembly { residual: &mut self.residual, jacobian: None };
        if step.scheme.has_inertia() {
            model.inertia.add(&self.configuration, &increment, &mut out);
        }
        model.dissipative.iter().for_each(|term| term.add(&self.configuration, &increment, &mut out));
        if let (Some(law), Some(barrier)) = (model.barrier(), &mut self.barrier) {
            let dofs = model.network.node_dofs();
            let start = Instant::now();
            barrier.add_forces(law, dofs, q, &increment, &mut self.elastic, &mut self.residual);
            statistics.seconds_contact += start.elapsed().as_secs_f64();
        }
        if let Some(outside) = &step.outside {
            outside.add(model.network.node_dofs(), &step.state.q, q, &mut self.residual);
        }
        self.add_fluid(step, trial)?;
        for (motor, torque) in model.motors.iter().zip(&step.motor_torques) {
            if let Drive::Torque { dof } = motor.drive {
                self.residual[dof] -= torque;
            }
        }
        for (residual, contact) in self.residual.iter_mut().zip(&self.contact) {
            *residual -= contact;
        }
        Some(self.size(model)).filter(|size| size.merit.is_finite())
    }

    fn add_fluid(&mut self, step: &Step, trial: &Unknowns) -> Option<()> {
        let Some(fluid) = self.fluid.as_mut().filter(|_| step.scheme.fluid_is_implicit()) else { return Some(()) };
        if self.interrupt.requested() {
            return None;
        }
        let (increment, pool) = (step.increment(), self.threads.pool());
        gather(&self.fluid_dofs, |dof| increment.rate_of(dof, trial.q[dof]), &mut self.flow);
        subtract_background(step, fluid.immersed(), &mut self.flow);
        match fluid.nonlocal() {
            None => fluid.resist(&mut self.flow, pool.as_deref()).ok()?,
            Some(mobility) => {
                mobility.apply(&trial.density, &mut self.slip, pool.as_deref()).ok()?;
                let scale = mobility.scale();
                self.slip.iter_mut().zip(&self.flow).for_each(|(slip, velocity)| *slip -= scale * velocity);
                mobility.weigh(&trial.density, &mut self.flow);
            }
        }
        scatter(&self.fluid_dofs, &self.flow, &mut self.residual);
        Some(())
    }

    fn size(&mut self, model: &Model) -> Size {
        self.targets.measure(model, &self.residual);
        for dof in 0..model.dof_count {
            let total = self.residual[dof] + self.elastic[dof];
            (self.residual[dof], self.reaction[dof]) = if model.prescribed[dof] { (0.0, total) } else { (total, 0.0) };
        }
        self.targets.size(model, &self.residual, &self.slip, &self.fluid_dofs)
    }

    /// Derivative of the force balance at the configuration of the last residual and the given tensions of edges, with every
    /// node's own resistance in place of the nonlocal one.
    pub(crate) fn differentiate(&mut self, model: &Model, step: &Step, tensions: &[f64]) {
        let increment = step.increment();
        self.jacobian.fill(0.0);
        let mut out = Assembly { residual: &mut self.elastic, jacobian: Some(&mut self.jacobian) };
        model.stretching.add_with_tensions(&self.configuration, tensions, &mut out);
        model.hinges.add(&self.configuration, &increment, &mut out);
        if step.scheme.has_inertia() {
            model.inertia.add(&self.configuration, &increment, &mut out);
        }
        model.dissipative.iter().for_each(|term| term.add(&self.configuration, &increment, &mut out));
        if let Some(fluid) = self.fluid.as_deref().filter(|_| step.scheme.fluid_is_implicit()) {
            for (slots, block) in model.storage.fluid_blocks.iter().zip(fluid.local()) {
                for (&slot, entry) in slots.iter().zip(block.as_slice()) {
                    self.jacobian[slot] += entry * step.rate;
                }
            }
        }
        if let Some(outside) = &step.outside {
            for (slots, block) in model.storage.node_blocks.iter().zip(outside.stiffness()) {
                for (&slot, entry) in slots.iter().zip(block.as_slice()) {
                    self.jacobian[slot] += entry;
                }
            }
        }
        model.storage.held.iter().for_each(|&slot| self.jacobian[slot] = 0.0);
        model.storage.held_diagonal.iter().for_each(|&slot| self.jacobian[slot] = 1.0);
    }

    /// Elastic gradient and the values of the elastic Hessian at a state.
    pub fn elastic(&mut self, model: &Model, state: &State) -> (Vec<f64>, Vec<f64>) {
        let shafts = model.shafts(&state.motor_angles, &state.q);
        let (mut gradient, mut hessian) = (vec![0.0; model.dof_count], vec![0.0; model.storage.pattern.entries()]);
        if self.configuration.update(&model.network, &state.q, &state.frames, &shafts) {
            let increment = Increment {
                rate: 0.0,
                previous: &state.q,
                drift: &state.velocity,
                velocity: &state.velocity,
                velocity_drift: &state.velocity,
                inputs: &[],
                background: None,
            };
            let mut out = Assembly { residual: &mut gradient, jacobian: Some(&mut hessian) };
            model.stretching.add(&self.configuration, &increment, &mut out);
            model.hinges.add(&self.configuration, &increment, &mut out);
        }
        (gradient, hessian)
    }

    /// Energies of stretching, bending and twisting at a state, J.
    pub fn energies(&mut self, model: &Model, state: &State) -> Option<[f64; 3]> {
        let shafts = model.shafts(&state.motor_angles, &state.q);
        let placed = self.configuration.update(&model.network, &state.q, &state.frames, &shafts);
        placed.then(|| {
            [
                model.stretching.energy(&self.configuration),
                model.hinges.bending_energy(&self.configuration),
                model.hinges.twisting_energy(&self.configuration),
            ]
        })
    }
}

/// Makes velocities of immersed nodes those relative to the background flow.
pub(crate) fn subtract_background(step: &Step, immersed: &[usize], flow: &mut [f64]) {
    let Some(ambient) = &step.ambient else { return };
    let velocities = ambient.background().node_velocities;
    for (&node, flow) in immersed.iter().zip(flow.chunks_exact_mut(3)) {
        (0..3).for_each(|c| flow[c] -= velocities[node][c]);
    }
}

pub(crate) fn gather(dofs: &[usize], value: impl Fn(usize) -> f64, out: &mut [f64]) {
    for (&dof, chunk) in dofs.iter().zip(out.chunks_exact_mut(3)) {
        (0..3).for_each(|c| chunk[c] = value(dof + c));
    }
}

pub(crate) fn scatter(dofs: &[usize], values: &[f64], out: &mut [f64]) {
    for (&dof, chunk) in dofs.iter().zip(values.chunks_exact(3)) {
        (0..3).for_each(|c| out[dof + c] += chunk[c]);
    }
}
