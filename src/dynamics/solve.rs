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

use super::balance::{Balance, Step, gather};
use super::model::Model;
use super::statistics::Statistics;
use crate::fluid::FluidModel;
use crate::linear::LinearError;
use crate::linear::dense::DenseLu;
use crate::linear::krylov::LinearOperator;
use crate::linear::ldlt::SparseLdlt;
use crate::linear::pattern::Pattern;
use crate::linear::sparse::SparseLu;
use crate::{Mat3, Vec3};

/// Relative residual above which a factorization without pivoting is not trusted.
const TRUSTED: f64 = 1e-3;

/// Vectors of the linear solves.
pub(super) struct Work {
    rhs: Vec<f64>,
    check: Vec<f64>,
    seek: Vec<f64>,
    target: Vec<f64>,
    image: Vec<f64>,
    moved: Vec<f64>,
    density: Vec<f64>,
}

impl Work {
    pub fn new(dofs: usize, flow: usize) -> Self {
        Self {
            rhs: vec![0.0; dofs],
            check: vec![0.0; dofs],
            seek: vec![0.0; flow],
            target: vec![0.0; flow],
            image: vec![0.0; flow],
            moved: vec![0.0; dofs],
            density: vec![0.0; flow],
        }
    }
}

impl Balance {
    /// Newton direction at the configuration of the last residual, in degrees of freedom and force density; `tolerance` is the
    /// relative residual of the linear system.
    pub fn direction(
        &mut self,
        model: &Model,
        step: &Step,
        tolerance: f64,
        (moved, density): (&mut [f64], &mut [f64]),
        statistics: &mut Statistics,
    ) -> Result<(), LinearError> {
        let start = Instant::now();
        self.differentiate(model, step);
        let assembled = Instant::now();
        statistics.seconds_assembly += (assembled - start).as_secs_f64();
        let solved = self.solve(model, step, tolerance, (moved, density), statistics);
        statistics.seconds_linear += assembled.elapsed().as_secs_f64();
        solved
    }

    fn solve(
        &mut self,
        model: &Model,
        step: &Step,
        tolerance: f64,
        (moved, density): (&mut [f64], &mut [f64]),
        statistics: &mut Statistics,
    ) -> Result<(), LinearError> {
        self.work.rhs.iter_mut().zip(&self.residual).for_each(|(rhs, residual)| *rhs = -residual);
        let Self { jacobian, ldlt, lu, gmres, fluid, fluid_dofs, slip, work, pool, .. } = self;
        let mut sparse = Sparse { ldlt, lu, pivoted: false };
        sparse.factor(&model.pattern, jacobian, &work.rhs, &mut work.check)?;
        let implicit = step.scheme.fluid_is_implicit();
        let Some(fluid) = fluid.as_deref_mut().filter(|fluid| implicit && !fluid.is_local()) else {
            moved.copy_from_slice(&work.rhs);
            sparse.solve(moved)?;
            return sparse.refine(&model.pattern, jacobian, &work.rhs, moved, &mut work.check);
        };
        let Work { rhs, seek, target, image, moved: trial, density: density_trial, .. } = work;
        let mut system = FluidSystem {
            model,
            rate: step.rate,
            sparse,
            fluid,
            fluid_dofs,
            rhs: None,
            moved: trial,
            density: density_trial,
            pool: pool.as_deref(),
        };
        // The image of b = 0 carries the force balance's own right-hand side.
        system.rhs = Some(rhs);
        seek.fill(0.0);
        system.image(seek, image)?;
        system.rhs = None;
        target.iter_mut().zip(slip.iter()).zip(image.iter()).for_each(|((t, slip), image)| *t = -slip - image);
        match gmres.solve(&mut system, target, seek, tolerance) {
            Ok(iterations) => statistics.krylov_iterations += iterations as u64,
            Err(error) if system.is_matrix_free() => return Err(error),
            Err(_) => {
                statistics.dense_solves += 1;
                system.solve_densely(target, seek)?;
            }
        }
        system.rhs = Some(rhs);
        system.image(seek, image)?;
        moved.copy_from_slice(system.moved);
        density.copy_from_slice(system.density);
        Ok(())
    }
}

/// The sparse matrix, factored without pivoting as long as that can be trusted.
struct Sparse<'a> {
    ldlt: &'a mut SparseLdlt,
    lu: &'a mut SparseLu,
    pivoted: bool,
}

impl Sparse<'_> {
    fn factor(&mut self, pattern: &Pattern, values: &[f64], rhs: &[f64], check: &mut [f64]) -> Result<(), LinearError> {
        let trusted = self.ldlt.factor(pattern, values).is_ok() && self.is_trusted(pattern, values, rhs, check);
        if !trusted {
            self.pivoted = true;
            self.lu.factor(pattern, values)?;
        }
        Ok(())
    }

    /// The matrix is symmetric but for the head's couple; what matters is that its factors reproduce a solution.
    fn is_trusted(&mut self, pattern: &Pattern, values: &[f64], rhs: &[f64], check: &mut [f64]) -> bool {
        let mut x = rhs.to_vec();
        if self.ldlt.solve(&mut x).is_err() {
            return false;
        }
        check.iter_mut().zip(rhs).for_each(|(check, rhs)| *check = -rhs);
        pattern.multiply_add(values, &x, check);
        let size = |v: &[f64]| v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        size(check) <= TRUSTED * size(rhs)
    }

    fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        if self.pivoted { self.lu.solve(x) } else { self.ldlt.solve(x) }
    }

    /// One step of iterative refinement, for the part of the matrix that is not symmetric.
    fn refine(
        &mut self,
        pattern: &Pattern,
        values: &[f64],
        rhs: &[f64],
        x: &mut [f64],
        check: &mut [f64],
    ) -> Result<(), LinearError> {
        let minus: Vec<f64> = x.iter().map(|value| -value).collect();
        check.copy_from_slice(rhs);
        pattern.multiply_add(values, &minus, check);
        self.solve(check)?;
        x.iter_mut().zip(check.iter()).for_each(|(value, change)| *value += change);
        Ok(())
    }
}

/// The fluid's equation with the force balance eliminated.
struct FluidSystem<'a> {
    model: &'a Model,
    rate: f64,
    sparse: Sparse<'a>,
    fluid: &'a mut (dyn FluidModel + 'static),
    fluid_dofs: &'a [usize],
    /// Right-hand side of the force balance; none in the homogeneous system.
    rhs: Option<&'a [f64]>,
    moved: &'a mut [f64],
    density: &'a mut [f64],
    pool: Option<&'a ThreadPool>,
}

impl FluidSystem<'_> {
    /// `image = A df - s a dq` for the pair that belongs to `b`.
    fn image(&mut self, b: &[f64], image: &mut [f64]) -> Result<(), LinearError> {
        match self.rhs {
            Some(rhs) => self.moved.copy_from_slice(rhs),
            None => self.moved.fill(0.0),
        }
        let scale = self.fluid.nonlocal().map_or(1.0, |mobility| mobility.scale());
        let prescribed = &self.model.prescribed;
        for ((&dof, block), b) in self.fluid_dofs.iter().zip(self.fluid.local()).zip(b.chunks_exact(3)) {
            let force = block * Vec3::new(b[0], b[1], b[2]) / scale;
            (0..3).filter(|&c| !prescribed[dof + c]).for_each(|c| self.moved[dof + c] -= force[c]);
        }
        self.sparse.solve(self.moved)?;
        let moved = &*self.moved;
        gather(self.fluid_dofs, |dof| if prescribed[dof] { 0.0 } else { moved[dof] }, image);
        for (k, block) in self.fluid.local().iter().enumerate() {
            let block: &Mat3 = block;
            let velocity = Vec3::from_fn(|c, _| b[3 * k + c] / scale + self.rate * image[3 * k + c]);
            self.density[3 * k..3 * k + 3].copy_from_slice((block * velocity).as_slice());
        }
        let rate = self.rate;
        let Some(mobility) = self.fluid.nonlocal() else { return Ok(()) };
        mobility.unweigh(self.density)?;
        mobility.apply(self.density, image, self.pool)?;
        for (&dof, value) in self.fluid_dofs.iter().zip(image.chunks_exact_mut(3)) {
            (0..3).filter(|&c| !prescribed[dof + c]).for_each(|c| value[c] -= scale * rate * moved[dof + c]);
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
            self.image(&unit, column)?;
            unit[k] = 0.0;
        }
        dense.factor()?;
        seek.copy_from_slice(target);
        dense.solve(seek)
    }
}

impl LinearOperator for FluidSystem<'_> {
    fn apply(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), LinearError> {
        self.image(x, out)
    }

    fn precondition(&mut self, _: &mut [f64]) -> Result<(), LinearError> {
        Ok(())
    }
}
