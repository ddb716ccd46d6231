//! The force balance of one step: residual, derivative, and the solution of its linear systems.
//!
//! The derivative is sparse but for the nonlocal fluid, whose action costs one dense back-substitution. Systems are solved by
//! GMRES with the sparse part plus every node's own resistance, factored, as preconditioner: exact for local models, where
//! GMRES stops after one iteration. Should GMRES fail, the matrix is formed and factored densely.

use std::sync::Arc;
use std::time::Instant;

use rayon::ThreadPool;

use super::model::Model;
use super::scheme::Scheme;
use super::state::State;
use super::statistics::Statistics;
use crate::elastic::motors::Drive;
use crate::fluid::FluidModel;
use crate::linear::LinearError;
use crate::linear::dense::DenseLu;
use crate::linear::krylov::{Gmres, LinearOperator};
use crate::linear::sparse::SparseLu;
use crate::rod::assembly::{Assembly, Increment, Term};
use crate::rod::configuration::{Configuration, ShaftAngle};
use crate::{Mat3, Vec3};

/// GMRES iterations before the dense fallback; far above what a good preconditioner needs.
const KRYLOV_LIMIT: usize = 120;

/// What is given for a step: its length, scheme, and what motors do by its end.
#[derive(Clone)]
pub(super) struct Step<'a> {
    pub scheme: Scheme,
    pub state: &'a State,
    pub dt: f64,
    /// Angles of speed-driven motors at the end of the step; entries of torque-driven ones are not read.
    pub motor_angles: Vec<f64>,
    /// Torques of torque-driven motors at the end of the step, N m.
    pub motor_torques: Vec<f64>,
}

/// Size of a residual and what it is to be compared with, both N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Size {
    /// Largest nodal force or, divided by the mean edge length, moment.
    pub norm: f64,
    /// Largest force that takes part in the balance.
    pub scale: f64,
    /// Root of the sum of squares, for the line search.
    pub merit: f64,
    /// Degree of freedom with the largest residual.
    pub worst: usize,
}

/// Workspace of the force balance; no step allocates.
pub(super) struct Balance {
    configuration: Configuration,
    shafts: Vec<ShaftAngle>,
    residual: Vec<f64>,
    elastic: Vec<f64>,
    jacobian: Vec<f64>,
    preconditioner: Vec<f64>,
    masked: Vec<usize>,
    diagonal: Vec<usize>,
    lu: SparseLu,
    gmres: Gmres,
    dense: Option<DenseLu>,
    fluid: Option<Box<dyn FluidModel>>,
    fluid_dofs: Vec<usize>,
    fluid_slots: Vec<[usize; 9]>,
    flow: Vec<f64>,
    constant: Vec<f64>,
    contact: Vec<f64>,
    rhs: Vec<f64>,
    pool: Option<Arc<ThreadPool>>,
}

impl Balance {
    pub fn new(model: &Model, pool: Option<Arc<ThreadPool>>) -> Result<Self, LinearError> {
        let n = model.dof_count;
        let pattern = &model.pattern;
        let fluid = model.fluid();
        let fluid_dofs: Vec<usize> = fluid.as_ref().map_or_else(Vec::new, |fluid| {
            fluid.immersed().iter().map(|&node| model.network.node_dofs()[node]).collect()
        });
        let slot =
            |row: usize, column: usize| pattern.slot(row, column).ok_or(LinearError::Singular { what: "sparse" });
        let fluid_slots = fluid_dofs
            .iter()
            .map(|&dof| {
                let mut slots = [0; 9];
                for column in 0..3 {
                    for row in 0..3 {
                        slots[row + 3 * column] = slot(dof + row, dof + column)?;
                    }
                }
                Ok(slots)
            })
            .collect::<Result<Vec<_>, LinearError>>()?;
        let mut masked = Vec::new();
        for column in 0..n {
            for k in pattern.column_starts()[column]..pattern.column_starts()[column + 1] {
                let row = pattern.row_indices()[k];
                if model.prescribed[row] || model.prescribed[column] {
                    masked.push(k);
                }
            }
        }
        let diagonal =
            (0..n).filter(|&dof| model.prescribed[dof]).map(|dof| slot(dof, dof)).collect::<Result<_, _>>()?;
        Ok(Self {
            configuration: Configuration::new(&model.network, n),
            shafts: Vec::new(),
            residual: vec![0.0; n],
            elastic: vec![0.0; n],
            jacobian: vec![0.0; pattern.entries()],
            preconditioner: vec![0.0; pattern.entries()],
            masked,
            diagonal,
            lu: SparseLu::new(pattern)?,
            gmres: Gmres::new(n, KRYLOV_LIMIT.min(n)),
            dense: None,
            flow: vec![0.0; 3 * fluid_dofs.len()],
            fluid,
            fluid_dofs,
            fluid_slots,
            constant: vec![0.0; n],
            contact: vec![0.0; n],
            rhs: vec![0.0; n],
            pool,
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

    /// Moves the fluid to the geometry of a state.
    pub fn place_fluid(&mut self, positions: &[Vec3], statistics: &mut Statistics) -> Result<(), LinearError> {
        let start = Instant::now();
        let done = match &mut self.fluid {
            Some(fluid) => fluid.update(positions, self.pool.as_deref()),
            None => Ok(()),
        };
        statistics.seconds_fluid += start.elapsed().as_secs_f64();
        done
    }

    /// Prepares a step: the fluid's force, if it is that of the last velocities, and no contact.
    pub fn begin(&mut self, step: &Step) -> Result<(), LinearError> {
        self.contact.fill(0.0);
        self.constant.fill(0.0);
        if !step.scheme.fluid_is_implicit() {
            if let Some(fluid) = &mut self.fluid {
                gather(&self.fluid_dofs, |dof| step.state.velocity[dof], &mut self.flow);
                fluid.resist(&mut self.flow)?;
                scatter(&self.fluid_dofs, &self.flow, &mut self.constant);
            }
        }
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
        let inertia = if step.scheme.has_inertia() { 1.0 / (step.dt * step.dt) } else { 0.0 };
        out.clear();
        out.extend(model.network.node_dofs().iter().map(|&dof| model.mass[dof] * inertia));
        let Some(fluid) = self.fluid.as_ref().filter(|_| step.scheme.fluid_is_implicit()) else {
            return;
        };
        let drag = |block: &Mat3| block.trace() / (3.0 * step.dt);
        let mean = fluid.local().iter().map(drag).sum::<f64>() / fluid.local().len() as f64;
        let mut immersed = vec![false; out.len()];
        for (&node, block) in fluid.immersed().iter().zip(fluid.local()) {
            out[node] += drag(block);
            immersed[node] = true;
        }
        // A dry node has no drag of its own; the mean of the others is as good a scale for its contacts as any.
        out.iter_mut().zip(&immersed).filter(|(_, wet)| !**wet).for_each(|(stiffness, _)| *stiffness += mean);
    }

    /// Residual at `q`; `None` if `q` is not a configuration.
    pub fn evaluate(&mut self, model: &Model, step: &Step, q: &[f64], statistics: &mut Statistics) -> Option<Size> {
        let start = Instant::now();
        let size = self.residual(model, step, q);
        statistics.seconds_assembly += start.elapsed().as_secs_f64();
        size
    }

    fn residual(&mut self, model: &Model, step: &Step, q: &[f64]) -> Option<Size> {
        self.shafts.clear();
        self.shafts.extend(model.motors.iter().zip(&step.motor_angles).map(|(motor, &angle)| motor.shaft(angle, q)));
        if !self.configuration.update(&model.network, q, &step.state.frames, &self.shafts) {
            return None;
        }
        let increment = Increment { dt: step.dt, previous: &step.state.q, velocity: &step.state.velocity };
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
        if let Some(fluid) = self.fluid.as_mut().filter(|_| step.scheme.fluid_is_implicit()) {
            gather(&self.fluid_dofs, |dof| (q[dof] - step.state.q[dof]) / step.dt, &mut self.flow);
            fluid.resist(&mut self.flow).ok()?;
            scatter(&self.fluid_dofs, &self.flow, &mut self.residual);
        }
        for (motor, torque) in model.motors.iter().zip(&step.motor_torques) {
            if let Drive::Torque { dof, .. } = motor.drive {
                self.residual[dof] -= torque;
            }
        }
        for (residual, contact) in self.residual.iter_mut().zip(&self.contact) {
            *residual -= contact;
        }
        let mut size = Size { norm: 0.0, scale: 0.0, merit: 0.0, worst: 0 };
        for dof in 0..model.dof_count {
            let weight = model.force_weight[dof];
            let total = self.residual[dof] + self.elastic[dof];
            size.scale = size.scale.max(self.elastic[dof].abs() * weight);
            self.residual[dof] = if model.prescribed[dof] { 0.0 } else { total };
            let force = self.residual[dof].abs() * weight;
            if force > size.norm {
                size.norm = force;
                size.worst = dof;
            }
            size.merit += force * force;
        }
        size.merit = size.merit.sqrt();
        size.merit.is_finite().then_some(size)
    }

    /// Newton direction `-J^-1 r` at the configuration of the last residual.
    pub fn direction(
        &mut self,
        model: &Model,
        step: &Step,
        tolerance: f64,
        out: &mut [f64],
        statistics: &mut Statistics,
    ) -> Result<(), LinearError> {
        let start = Instant::now();
        self.differentiate(model, step);
        let assembled = Instant::now();
        statistics.seconds_assembly += (assembled - start).as_secs_f64();
        let solved = self.solve(model, step, tolerance, out, statistics);
        statistics.seconds_linear += assembled.elapsed().as_secs_f64();
        solved
    }

    fn differentiate(&mut self, model: &Model, step: &Step) {
        let increment = Increment { dt: step.dt, previous: &step.state.q, velocity: &step.state.velocity };
        self.jacobian.fill(0.0);
        let mut out = Assembly { residual: &mut self.elastic, jacobian: Some(&mut self.jacobian) };
        model.stretching.add(&self.configuration, &increment, &mut out);
        model.hinges.add(&self.configuration, &increment, &mut out);
        if step.scheme.has_inertia() {
            model.inertia.add(&self.configuration, &increment, &mut out);
        }
        model.dissipative.iter().for_each(|term| term.add(&self.configuration, &increment, &mut out));
        let local = |values: &mut [f64], fluid: &dyn FluidModel| {
            for (slots, block) in self.fluid_slots.iter().zip(fluid.local()) {
                for (&slot, entry) in slots.iter().zip(block.as_slice()) {
                    values[slot] += entry / step.dt;
                }
            }
        };
        let fluid = self.fluid.as_deref().filter(|_| step.scheme.fluid_is_implicit());
        if let Some(fluid) = fluid.filter(|fluid| fluid.is_local()) {
            local(&mut self.jacobian, fluid);
        }
        self.masked.iter().for_each(|&slot| self.jacobian[slot] = 0.0);
        self.diagonal.iter().for_each(|&slot| self.jacobian[slot] = 1.0);
        self.preconditioner.copy_from_slice(&self.jacobian);
        if let Some(fluid) = fluid.filter(|fluid| !fluid.is_local()) {
            local(&mut self.preconditioner, fluid);
            self.masked.iter().for_each(|&slot| self.preconditioner[slot] = 0.0);
            self.diagonal.iter().for_each(|&slot| self.preconditioner[slot] = 1.0);
        }
    }

    fn solve(
        &mut self,
        model: &Model,
        step: &Step,
        tolerance: f64,
        out: &mut [f64],
        statistics: &mut Statistics,
    ) -> Result<(), LinearError> {
        for ((rhs, residual), weight) in self.rhs.iter_mut().zip(&self.residual).zip(&model.force_weight) {
            *rhs = -residual * weight;
        }
        let factored = self.lu.factor(&model.pattern, &self.preconditioner);
        let Self { jacobian, lu, gmres, dense, fluid, fluid_dofs, flow, rhs, .. } = self;
        let fluid = fluid.as_deref_mut().filter(|fluid| step.scheme.fluid_is_implicit() && !fluid.is_local());
        let mut operator = Operator { model, jacobian, lu, fluid, fluid_dofs, flow, rate: 1.0 / step.dt };
        let krylov = factored.and_then(|()| gmres.solve(&mut operator, rhs, out, tolerance));
        match krylov {
            Ok(iterations) => statistics.krylov_iterations += iterations as u64,
            Err(_) => {
                statistics.dense_solves += 1;
                let dense = dense.get_or_insert_with(|| DenseLu::new(rhs.len()));
                operator.fill(dense.matrix_mut())?;
                dense.factor()?;
                out.copy_from_slice(rhs);
                dense.solve(out)?;
            }
        }
        out.iter_mut()
            .zip(&model.prescribed)
            .filter(|(_, prescribed)| **prescribed)
            .for_each(|(value, _)| *value = 0.0);
        Ok(())
    }

    /// Elastic gradient and the values of the elastic Hessian at a state.
    pub fn elastic(&mut self, model: &Model, state: &State) -> (Vec<f64>, Vec<f64>) {
        let shafts = model.shafts(&state.motor_angles, &state.q);
        let (mut gradient, mut hessian) = (vec![0.0; model.dof_count], vec![0.0; model.pattern.entries()]);
        if self.configuration.update(&model.network, &state.q, &state.frames, &shafts) {
            let increment = Increment { dt: 1.0, previous: &state.q, velocity: &state.velocity };
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

fn gather(dofs: &[usize], value: impl Fn(usize) -> f64, out: &mut [f64]) {
    for (&dof, chunk) in dofs.iter().zip(out.chunks_exact_mut(3)) {
        (0..3).for_each(|c| chunk[c] = value(dof + c));
    }
}

fn scatter(dofs: &[usize], values: &[f64], out: &mut [f64]) {
    for (&dof, chunk) in dofs.iter().zip(values.chunks_exact(3)) {
        (0..3).for_each(|c| out[dof + c] += chunk[c]);
    }
}

/// The derivative as an operator; rows are weighted so that its residuals are forces.
struct Operator<'a> {
    model: &'a Model,
    jacobian: &'a [f64],
    lu: &'a mut SparseLu,
    fluid: Option<&'a mut (dyn FluidModel + 'static)>,
    fluid_dofs: &'a [usize],
    flow: &'a mut [f64],
    rate: f64,
}

impl Operator<'_> {
    fn fill(&mut self, matrix: &mut [f64]) -> Result<(), LinearError> {
        let n = self.model.dof_count;
        let mut unit = vec![0.0; n];
        for (column, out) in matrix.chunks_exact_mut(n).enumerate() {
            unit[column] = 1.0;
            self.apply(&unit, out)?;
            unit[column] = 0.0;
        }
        Ok(())
    }
}

impl LinearOperator for Operator<'_> {
    fn apply(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), LinearError> {
        out.fill(0.0);
        self.model.pattern.multiply_add(self.jacobian, x, out);
        let prescribed = &self.model.prescribed;
        if let Some(fluid) = self.fluid.as_deref_mut() {
            let rate = self.rate;
            gather(self.fluid_dofs, |dof| if prescribed[dof] { 0.0 } else { x[dof] * rate }, self.flow);
            fluid.resist(self.flow)?;
            for (&dof, chunk) in self.fluid_dofs.iter().zip(self.flow.chunks_exact(3)) {
                (0..3).filter(|&c| !prescribed[dof + c]).for_each(|c| out[dof + c] += chunk[c]);
            }
        }
        out.iter_mut().zip(&self.model.force_weight).for_each(|(value, weight)| *value *= weight);
        Ok(())
    }

    fn precondition(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        x.iter_mut().zip(&self.model.force_weight).for_each(|(value, weight)| *value /= weight);
        self.lu.solve(x)
    }
}
