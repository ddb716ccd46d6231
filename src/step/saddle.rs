//! The saddle system of forces and flow: a Krylov method on the fluid's equation, with the force balance eliminated.
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

use rayon::ThreadPool;

use crate::fluid::FluidModel;
use crate::linear::LinearError;
use crate::linear::dense::DenseLu;
use crate::linear::krylov::{Gmres, LinearOperator};
use crate::linear::nearly_symmetric::NearlySymmetric;
use crate::runtime::interrupt::Interrupt;
use crate::{Mat3, Vec3};

/// Relative residual of a linear system from which on products of single precision are exact enough.
const SINGLE_PRECISION: f64 = 1e-4;

/// GMRES iterations before the dense fallback; far above what a good preconditioner needs.
const KRYLOV_LIMIT: usize = 120;

/// What couples forces and flow.
pub(crate) struct Coupling<'a> {
    /// The drag model, nonlocal, at its geometry.
    pub fluid: &'a mut (dyn FluidModel + 'static),
    /// First degrees of freedom of its nodes.
    pub dofs: &'a [usize],
    /// Degrees of freedom that do not move.
    pub prescribed: &'a [bool],
    /// Derivative of rates with respect to degrees of freedom, 1/s.
    pub rate: f64,
    /// Weights of the fluid's equation, and of the unknowns: no filament's is then hidden behind another's.
    pub weights: &'a [f64],
    pub pool: Option<&'a ThreadPool>,
    pub interrupt: &'a mut Interrupt,
}

impl Coupling<'_> {
    /// `8 pi mu`, Pa s.
    fn scale(&mut self) -> f64 {
        self.fluid.nonlocal().map_or(1.0, |mobility| mobility.scale())
    }

    /// `out -= R b / s` at the nodes that are free to move.
    pub fn resist_locally(&mut self, b: &[f64], out: &mut [f64]) {
        let scale = self.scale();
        for ((&dof, block), b) in self.dofs.iter().zip(self.fluid.local()).zip(b.chunks_exact(3)) {
            let force = block * Vec3::new(b[0], b[1], b[2]) / scale;
            (0..3).filter(|&c| !self.prescribed[dof + c]).for_each(|c| out[dof + c] -= force[c]);
        }
    }

    /// The force density that belongs to `b` and a displacement.
    pub fn complete(&mut self, b: &[f64], moved: &[f64], density: &mut [f64]) -> Result<(), LinearError> {
        let scale = self.scale();
        let free = |dof: usize| if self.prescribed[dof] { 0.0 } else { moved[dof] };
        for (k, (block, &dof)) in self.fluid.local().iter().zip(self.dofs).enumerate() {
            let block: &Mat3 = block;
            let velocity = Vec3::from_fn(|c, _| b[3 * k + c] / scale + self.rate * free(dof + c));
            density[3 * k..3 * k + 3].copy_from_slice((block * velocity).as_slice());
        }
        self.fluid.nonlocal().map_or(Ok(()), |mobility| mobility.unweigh(density))
    }

    /// `A df - s a dq`; single precision will do if it is wanted `roughly`.
    fn product(&mut self, density: &[f64], moved: &[f64], roughly: bool, image: &mut [f64]) -> Result<(), LinearError> {
        if self.interrupt.requested() {
            return Err(LinearError::Interrupted);
        }
        let Some(mobility) = self.fluid.nonlocal() else { return Ok(()) };
        if roughly {
            mobility.apply_roughly(density, image, self.pool)?;
        } else {
            mobility.apply(density, image, self.pool)?;
        }
        let factor = mobility.scale() * self.rate;
        for (&dof, value) in self.dofs.iter().zip(image.chunks_exact_mut(3)) {
            (0..3).filter(|&c| !self.prescribed[dof + c]).for_each(|c| value[c] -= factor * moved[dof + c]);
        }
        Ok(())
    }
}

/// What solving the system took.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Effort {
    pub krylov_iterations: u64,
    pub dense_solves: u64,
}

/// Memory of the Krylov method.
pub(crate) struct Saddle {
    gmres: Gmres,
    seek: Vec<f64>,
    target: Vec<f64>,
    image: Vec<f64>,
    unweighted: Vec<f64>,
}

impl Saddle {
    /// For an equation of so many components.
    pub fn new(size: usize) -> Self {
        Self {
            gmres: Gmres::new(size, KRYLOV_LIMIT.min(size)),
            seek: vec![0.0; size],
            target: vec![0.0; size],
            image: vec![0.0; size],
            unweighted: Vec::with_capacity(size),
        }
    }

    /// Solves `K dq + W df = rhs`, `A df - s a dq = -slip` with the factors of `K`, to a relative residual of the second equation; the first
    /// holds exactly.
    pub fn solve(
        &mut self,
        sparse: &mut NearlySymmetric,
        coupling: &mut Coupling,
        (rhs, slip): (&[f64], &[f64]),
        tolerance: f64,
        (moved, density): (&mut [f64], &mut [f64]),
    ) -> Result<Effort, LinearError> {
        let Self { gmres, seek, target, image, unweighted } = self;
        let mut effort = Effort::default();
        // The image of b = 0 carries the force balance's own right-hand side.
        sparse.solve_checked(rhs, moved)?;
        seek.fill(0.0);
        coupling.complete(seek, moved, density)?;
        coupling.product(density, moved, false, image)?;
        let weights = coupling.weights;
        for (((target, slip), image), weight) in target.iter_mut().zip(slip).zip(&*image).zip(weights) {
            *target = (-slip - image) * weight;
        }
        let matrix_free = coupling.fluid.nonlocal().is_some_and(|mobility| mobility.is_matrix_free());
        let roughly = tolerance >= SINGLE_PRECISION;
        let mut eliminated = Eliminated { sparse, coupling, moved, density, roughly, unweighted };
        match gmres.solve(&mut eliminated, target, seek, tolerance) {
            Ok(iterations) => effort.krylov_iterations = iterations as u64,
            Err(error) if matrix_free || error == LinearError::Interrupted => return Err(error),
            Err(_) => {
                effort.dense_solves = 1;
                eliminated.roughly = false;
                eliminated.solve_densely(target, seek)?;
            }
        }
        seek.iter_mut().zip(weights).for_each(|(b, weight)| *b /= weight);
        eliminated.moved.copy_from_slice(rhs);
        eliminated.pair(seek)?;
        Ok(effort)
    }

    /// Sets the right-hand side of the fluid's equation to that of local resistance alone, and takes its forces from `rhs`.
    pub fn assume_local(&mut self, coupling: &mut Coupling, slip: &[f64], rhs: &mut [f64]) {
        self.seek.iter_mut().zip(slip).for_each(|(seek, slip)| *seek = -slip);
        coupling.resist_locally(&self.seek, rhs);
    }

    /// The force density that belongs to the last right-hand side and a displacement.
    pub fn complete(&self, coupling: &mut Coupling, moved: &[f64], density: &mut [f64]) -> Result<(), LinearError> {
        coupling.complete(&self.seek, moved, density)
    }
}

/// The fluid's equation with the force balance eliminated, weighted.
struct Eliminated<'a, 'b> {
    sparse: &'a mut NearlySymmetric,
    coupling: &'a mut Coupling<'b>,
    moved: &'a mut [f64],
    density: &'a mut [f64],
    /// Whether single precision will do.
    roughly: bool,
    unweighted: &'a mut Vec<f64>,
}

impl Eliminated<'_, '_> {
    /// The pair that belongs to `b`, on top of the right-hand side of the force balance that stands in `moved`.
    fn pair(&mut self, b: &[f64]) -> Result<(), LinearError> {
        self.coupling.resist_locally(b, self.moved);
        self.sparse.solve(self.moved)?;
        self.coupling.complete(b, self.moved, self.density)
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

impl LinearOperator for Eliminated<'_, '_> {
    /// The image `A df - s a dq` of the pair that belongs to `x`, in the homogeneous force balance.
    fn apply(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), LinearError> {
        let mut b = std::mem::take(self.unweighted);
        b.clear();
        b.extend(x.iter().zip(self.coupling.weights).map(|(x, weight)| x / weight));
        self.moved.fill(0.0);
        let applied = self.pair(&b).and_then(|()| self.coupling.product(self.density, self.moved, self.roughly, out));
        *self.unweighted = b;
        out.iter_mut().zip(self.coupling.weights).for_each(|(out, weight)| *out *= weight);
        applied
    }

    fn precondition(&mut self, _: &mut [f64]) -> Result<(), LinearError> {
        Ok(())
    }
}
