//! The linear systems of Newton's method: sparse where everything is local, a Krylov method on the fluid's equation where
//! it is not.
//!
//! Let `K` be the sparse derivative of the force balance with every node's own resistance `R` in place of the nonlocal
//! one, and `s = 8 pi mu`. For any right-hand side `b` of the fluid's equation the pair
//!
//! ```text
//!   dq = K^-1 (-r1 - R b / s),       df = W^-1 R (b / s + a dq)
//! ```
//!
//! satisfies the linearised force balance exactly, `a` being the rate of the backward difference. GMRES seeks the `b` for
//! which the fluid's equation `A df - s a dq = -r2` holds too: with local resistance alone it would be `-r2` itself, so
//! that the method needs only a few products with `A`. Should it fail, its matrix is formed and factored, unless the scene is
//! so large that `A` itself is never formed.

use std::time::Instant;

use rayon::ThreadPool;

use crate::contact::potential::SlipChange;
use crate::fluid::FluidModel;
use crate::linear::LinearError;
use crate::linear::dense::DenseLu;
use crate::linear::krylov::LinearOperator;
use crate::linear::nearly_symmetric::NearlySymmetric;
use crate::model::Model;
use crate::rod::assembly::{Assembly, Increment};
use crate::runtime::interrupt::Interrupt;
use crate::step::problem::{Balance, Step, Unknowns};
use crate::step::statistics::Statistics;
use crate::{Mat3, Vec3};

/// Relative residual of a linear system from which on products of single precision are exact enough.
const SINGLE_PRECISION: f64 = 1e-4;

/// Vectors of the linear solves.
pub(crate) struct Work {
    rhs: Vec<f64>,
    seek: Vec<f64>,
    target: Vec<f64>,
    image: Vec<f64>,
    moved: Vec<f64>,
    density: Vec<f64>,
    unweighted: Vec<f64>,
    /// How far every node yields to a force within the step, relative to the size of its filament, 1/N.
    yielding: Vec<f64>,
}

/// What is still to be corrected of a trial solution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Remainder {
    /// Largest displacement, relative to the size of its filament.
    pub length: f64,
    /// Changes of sliding velocities.
    pub slip: SlipChange,
}

impl Work {
    pub fn new(dofs: usize, flow: usize) -> Self {
        Self {
            rhs: vec![0.0; dofs],
            seek: vec![0.0; flow],
            target: vec![0.0; flow],
            image: vec![0.0; flow],
            moved: vec![0.0; dofs],
            density: vec![0.0; flow],
            unweighted: Vec::with_capacity(flow),
            yielding: Vec::new(),
        }
    }
}

impl Balance {
    /// Linearises the balance at the configuration of the last residual and the given tensions of edges, and factors its
    /// sparse part.
    pub fn linearize(
        &mut self,
        model: &Model,
        step: &Step,
        tensions: &[f64],
        statistics: &mut Statistics,
    ) -> Result<(), LinearError> {
        let start = Instant::now();
        self.differentiate(model, step, tensions);
        let assembled = Instant::now();
        statistics.seconds_assembly += (assembled - start).as_secs_f64();
        let factored = self.fill_system(model, step.rate).and_then(|symmetric| self.system.factor(symmetric));
        statistics.seconds_linear += assembled.elapsed().as_secs_f64();
        factored
    }

    /// The matrix of the linear system: the model's, and contact's, whose pattern changes; whether it is nearly symmetric.
    fn fill_system(&mut self, model: &Model, rate: f64) -> Result<bool, LinearError> {
        let contact = model.barrier().zip(self.barrier.as_mut());
        if let Some((_, barrier)) = contact.filter(|(_, barrier)| !barrier.is_bound()) {
            let node_dofs = model.network.node_dofs();
            let blocks = barrier.blocks(node_dofs);
            let (pattern, embedding) = model.storage.pattern.extended(blocks.iter().map(Vec::as_slice));
            barrier.bind(node_dofs, &pattern);
            self.system = NearlySymmetric::new(pattern)?;
            self.embedding = embedding;
        }
        let values = self.system.values_mut();
        values.fill(0.0);
        self.embedding.iter().zip(&self.jacobian).for_each(|(&slot, value)| values[slot as usize] = *value);
        let (Some(law), Some(barrier)) = (model.barrier(), &self.barrier) else { return Ok(true) };
        barrier.add_matrix(law, rate, &model.prescribed, values);
        Ok(barrier.is_symmetric(law))
    }

    /// Makes the tensions of a direction those that its displacement, to first order, gives the edges beyond the given ones.
    pub fn tension_changes(&self, model: &Model, tensions: &[f64], out: &mut Unknowns) {
        model.stretching.tension_changes(&self.configuration, &out.q, tensions, &mut out.tensions);
    }

    /// How the last residual would be corrected were the fluid's resistance local, with the factors of the last linearisation;
    /// displacements below `tolerance`, relative to the size of a filament, do not matter.
    pub fn correction(
        &mut self,
        model: &Model,
        step: &Step,
        tolerance: f64,
        statistics: &mut Statistics,
    ) -> Result<Remainder, LinearError> {
        let start = Instant::now();
        self.work.rhs.iter_mut().zip(&self.residual).for_each(|(rhs, residual)| *rhs = -residual);
        let Self { system, fluid, fluid_dofs, slip, work, .. } = self;
        let Work { rhs, seek, moved, .. } = work;
        if let Some(fluid) = implicit_nonlocal(fluid, step) {
            seek.iter_mut().zip(slip.iter()).for_each(|(seek, slip)| *seek = -slip);
            let scale = fluid.nonlocal().map_or(1.0, |mobility| mobility.scale());
            resist_locally(model, fluid, fluid_dofs, scale, seek, rhs);
        }
        let solved = system.solve_roughly(rhs, moved);
        let relative = moved.iter().zip(&model.error_weight).map(|(moved, weight)| moved.abs() * weight);
        let length = relative.fold(0.0, f64::max);
        let slip = self.slip_change(model, step, tolerance);
        statistics.seconds_linear += start.elapsed().as_secs_f64();
        solved.map(|()| Remainder { length, slip })
    }

    /// What the displacement at hand means for contacts with friction.
    fn slip_change(&mut self, model: &Model, step: &Step, tolerance: f64) -> SlipChange {
        let contact = model.barrier().zip(self.barrier.as_ref());
        if !contact.is_some_and(|(law, barrier)| barrier.slides(law)) {
            return SlipChange::default();
        }
        let dofs = model.network.node_dofs();
        let mut yielding = std::mem::take(&mut self.work.yielding);
        self.node_stiffness(model, step, &mut yielding);
        for (stiffness, &dof) in yielding.iter_mut().zip(dofs) {
            // Relative to the size of the node's filament, as the tolerance is.
            *stiffness = if model.prescribed[dof] { 0.0 } else { model.error_weight[dof] / *stiffness };
        }
        let (law, barrier) = (model.barrier(), self.barrier.as_mut());
        let change = law.zip(barrier).map_or_else(SlipChange::default, |(law, barrier)| {
            barrier.slip_change(law, dofs, (&self.work.moved, step.rate), &yielding, tolerance)
        });
        self.work.yielding = yielding;
        change
    }

    /// The correction that [`Self::correction`] has measured, as a direction from the given tensions of edges.
    pub fn last_correction(
        &mut self,
        model: &Model,
        step: &Step,
        tensions: &[f64],
        out: &mut Unknowns,
    ) -> Result<(), LinearError> {
        out.q.copy_from_slice(&self.work.moved);
        model.stretching.tension_changes(&self.configuration, &out.q, tensions, &mut out.tensions);
        let Self { system, fluid, fluid_dofs, work, targets, interrupt, .. } = self;
        let Some(fluid) = implicit_nonlocal(fluid, step) else { return Ok(()) };
        let mut pair = FluidSystem {
            model,
            rate: step.rate,
            sparse: system,
            fluid,
            fluid_dofs,
            rhs: None,
            moved: &mut work.moved,
            density: &mut out.density,
            pool: None,
            interrupt,
            roughly: true,
            weights: &targets.slip_weight,
            unweighted: &mut work.unweighted,
        };
        pair.complete(&work.seek)
    }

    /// Largest displacement, relative to the size of a filament, that a unit of force on one degree of freedom makes within the
    /// step, with the factors of the last linearisation.
    pub fn response(&mut self, model: &Model, dof: usize) -> Result<f64, LinearError> {
        let Work { rhs, moved, .. } = &mut self.work;
        rhs.fill(0.0);
        rhs[dof] = 1.0;
        self.system.solve_roughly(rhs, moved)?;
        Ok(moved.iter().zip(&model.error_weight).map(|(moved, weight)| moved.abs() * weight).fold(0.0, f64::max))
    }

    /// The same of a unit of a load's signal.
    pub fn response_to_load(&mut self, model: &Model, channel: usize) -> Result<f64, LinearError> {
        let mut unit = vec![0.0; model.load_channels];
        let zero = vec![0.0; model.dof_count];
        self.work.rhs.fill(0.0);
        for value in [0.0, 1.0] {
            self.work.rhs.iter_mut().for_each(|rhs| *rhs = -*rhs);
            unit[channel] = value;
            let increment = Increment {
                rate: 0.0,
                previous: &zero,
                drift: &zero,
                velocity: &zero,
                velocity_drift: &zero,
                inputs: &unit,
                background: None,
            };
            let mut out = Assembly { residual: &mut self.work.rhs, jacobian: None };
            model.dissipative.iter().for_each(|term| term.add(&self.configuration, &increment, &mut out));
        }
        let held = self.work.rhs.iter_mut().zip(&model.prescribed).filter(|(_, held)| **held);
        held.for_each(|(rhs, _)| *rhs = 0.0);
        let Work { rhs, moved, .. } = &mut self.work;
        self.system.solve_roughly(rhs, moved)?;
        Ok(moved.iter().zip(&model.error_weight).map(|(moved, weight)| moved.abs() * weight).fold(0.0, f64::max))
    }

    /// Newton's direction for the last residual, but for its tensions; `tolerance` is the relative residual of the linear system.
    pub fn solve(
        &mut self,
        model: &Model,
        step: &Step,
        tolerance: f64,
        out: &mut Unknowns,
        statistics: &mut Statistics,
    ) -> Result<(), LinearError> {
        self.work.rhs.iter_mut().zip(&self.residual).for_each(|(rhs, residual)| *rhs = -residual);
        let Self { system, gmres, fluid, fluid_dofs, slip, work, threads, interrupt, targets, .. } = self;
        let Some(fluid) = implicit_nonlocal(fluid, step) else {
            return system.solve_refined(&work.rhs, &mut out.q);
        };
        let pool = threads.pool();
        let Work { rhs, seek, target, image, moved, density, unweighted, .. } = work;
        // The image of b = 0 carries the force balance's own right-hand side.
        system.solve_checked(rhs, moved)?;
        let mut fluid_system = FluidSystem {
            model,
            rate: step.rate,
            sparse: system,
            fluid,
            fluid_dofs,
            rhs: Some(rhs),
            moved,
            density,
            pool: pool.as_deref(),
            interrupt,
            roughly: false,
            weights: &targets.slip_weight,
            unweighted,
        };
        seek.fill(0.0);
        fluid_system.complete(seek)?;
        fluid_system.product(image)?;
        fluid_system.rhs = None;
        fluid_system.roughly = tolerance >= SINGLE_PRECISION;
        target.iter_mut().zip(slip.iter()).zip(image.iter()).for_each(|((t, slip), image)| *t = -slip - image);
        let weights = fluid_system.weights;
        target.iter_mut().zip(weights).for_each(|(t, weight)| *t *= weight);
        match gmres.solve(&mut fluid_system, target, seek, tolerance) {
            Ok(iterations) => statistics.krylov_iterations += iterations as u64,
            Err(error) if fluid_system.is_matrix_free() || error == LinearError::Interrupted => return Err(error),
            Err(_) => {
                statistics.dense_solves += 1;
                fluid_system.roughly = false;
                fluid_system.solve_densely(target, seek)?;
            }
        }
        seek.iter_mut().zip(weights).for_each(|(b, weight)| *b /= weight);
        fluid_system.rhs = Some(rhs);
        fluid_system.pair(seek)?;
        out.q.copy_from_slice(fluid_system.moved);
        out.density.copy_from_slice(fluid_system.density);
        Ok(())
    }
}

/// The fluid, if its equation is one of the unknowns'.
fn implicit_nonlocal<'a>(
    fluid: &'a mut Option<Box<dyn FluidModel>>,
    step: &Step,
) -> Option<&'a mut (dyn FluidModel + 'static)> {
    let implicit = step.scheme.fluid_is_implicit();
    fluid.as_deref_mut().filter(|fluid| implicit && !fluid.is_local())
}

/// `out -= R b / s` at the nodes that are free to move.
fn resist_locally(model: &Model, fluid: &dyn FluidModel, dofs: &[usize], scale: f64, b: &[f64], out: &mut [f64]) {
    for ((&dof, block), b) in dofs.iter().zip(fluid.local()).zip(b.chunks_exact(3)) {
        let force = block * Vec3::new(b[0], b[1], b[2]) / scale;
        (0..3).filter(|&c| !model.prescribed[dof + c]).for_each(|c| out[dof + c] -= force[c]);
    }
}

/// The fluid's equation with the force balance eliminated.
struct FluidSystem<'a> {
    model: &'a Model,
    rate: f64,
    sparse: &'a mut NearlySymmetric,
    fluid: &'a mut (dyn FluidModel + 'static),
    fluid_dofs: &'a [usize],
    /// Right-hand side of the force balance; none in the homogeneous system.
    rhs: Option<&'a [f64]>,
    moved: &'a mut [f64],
    density: &'a mut [f64],
    pool: Option<&'a ThreadPool>,
    interrupt: &'a mut Interrupt,
    /// Whether single precision will do.
    roughly: bool,
    /// Weights of the equation's rows, and of the unknowns: no filament's is then hidden behind another's.
    weights: &'a [f64],
    unweighted: &'a mut Vec<f64>,
}

impl FluidSystem<'_> {
    /// The pair that belongs to `b`, and its image `A df - s a dq`.
    fn image(&mut self, b: &[f64], image: &mut [f64]) -> Result<(), LinearError> {
        self.pair(b)?;
        self.product(image)
    }

    /// The pair that belongs to `b`.
    fn pair(&mut self, b: &[f64]) -> Result<(), LinearError> {
        match self.rhs {
            Some(rhs) => self.moved.copy_from_slice(rhs),
            None => self.moved.fill(0.0),
        }
        let scale = self.fluid.nonlocal().map_or(1.0, |mobility| mobility.scale());
        resist_locally(self.model, self.fluid, self.fluid_dofs, scale, b, self.moved);
        self.sparse.solve(self.moved)?;
        self.complete(b)
    }

    /// The force density that belongs to `b` and the displacement at hand.
    fn complete(&mut self, b: &[f64]) -> Result<(), LinearError> {
        let scale = self.fluid.nonlocal().map_or(1.0, |mobility| mobility.scale());
        let free = |dof: usize| if self.model.prescribed[dof] { 0.0 } else { self.moved[dof] };
        for (k, (block, &dof)) in self.fluid.local().iter().zip(self.fluid_dofs).enumerate() {
            let block: &Mat3 = block;
            let velocity = Vec3::from_fn(|c, _| b[3 * k + c] / scale + self.rate * free(dof + c));
            self.density[3 * k..3 * k + 3].copy_from_slice((block * velocity).as_slice());
        }
        self.fluid.nonlocal().map_or(Ok(()), |mobility| mobility.unweigh(self.density))
    }

    fn product(&mut self, image: &mut [f64]) -> Result<(), LinearError> {
        if self.interrupt.requested() {
            return Err(LinearError::Interrupted);
        }
        let Some(mobility) = self.fluid.nonlocal() else { return Ok(()) };
        if self.roughly {
            mobility.apply_roughly(self.density, image, self.pool)?;
        } else {
            mobility.apply(self.density, image, self.pool)?;
        }
        let factor = mobility.scale() * self.rate;
        for (&dof, value) in self.fluid_dofs.iter().zip(image.chunks_exact_mut(3)) {
            (0..3).filter(|&c| !self.model.prescribed[dof + c]).for_each(|c| value[c] -= factor * self.moved[dof + c]);
        }
        Ok(())
    }

    fn is_matrix_free(&mut self) -> bool {
        self.fluid.nonlocal().is_some_and(|mobility| mobility.is_matrix_free())
    }

    fn solve_densely(&mut self, target: &[f64], seek: &mut [f64]) -> Result<(), LinearError> {
        let mut dense = DenseLu::new(target.len());
        let mut unit = vec![0.0; target.len()];
        for (k, column) in dense.matrix_mut().chunks_exact_mut(target.len()).enumerate() {
            unit[k] = 1.0;
            self.apply(&unit, column)?;
            unit[k] = 0.0;
        }
        dense.factor()?;
        seek.copy_from_slice(target);
        dense.solve(seek)
    }
}

impl LinearOperator for FluidSystem<'_> {
    fn apply(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), LinearError> {
        let mut b = std::mem::take(self.unweighted);
        b.clear();
        b.extend(x.iter().zip(self.weights).map(|(x, weight)| x / weight));
        let applied = self.image(&b, out);
        *self.unweighted = b;
        out.iter_mut().zip(self.weights).for_each(|(out, weight)| *out *= weight);
        applied
    }

    fn precondition(&mut self, _: &mut [f64]) -> Result<(), LinearError> {
        Ok(())
    }
}
