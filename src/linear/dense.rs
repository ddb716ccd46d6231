//! LU with partial pivoting of a dense, unsymmetric, column-major matrix.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::perm::PermRef;
use faer::traits::ComplexField;
use faer::{MatMut, MatRef, Par};
use rayon::ThreadPool;
use rayon::prelude::*;

use super::LinearError;

/// A dense square matrix, overwritten by its factors.
pub struct DenseLu {
    size: usize,
    matrix: Vec<f64>,
    forward: Vec<u32>,
    inverse: Vec<u32>,
    memory: MemBuffer,
    factored: bool,
}

impl DenseLu {
    /// Room for a matrix of the given size.
    pub fn new(size: usize) -> Self {
        let memory = MemBuffer::new(StackReq::any_of(&[
            factor::lu_in_place_scratch::<u32, f64>(size, size, Par::Seq, Default::default()),
            solve::solve_in_place_scratch::<u32, f64>(size, size, Par::Seq),
        ]));
        Self {
            size,
            matrix: vec![0.0; size * size],
            forward: vec![0; size],
            inverse: vec![0; size],
            memory,
            factored: false,
        }
    }

    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.size
    }

    /// The matrix to be filled, column-major, before [`Self::factor`].
    pub fn matrix_mut(&mut self) -> &mut [f64] {
        self.factored = false;
        &mut self.matrix
    }

    /// Factors the matrix in place.
    ///
    /// # Errors
    /// [`LinearError::Singular`] if an entry is not finite or a pivot vanishes.
    pub fn factor(&mut self) -> Result<(), LinearError> {
        let size = self.size;
        factor::lu_in_place(
            MatMut::from_column_major_slice_mut(&mut self.matrix, size, size),
            &mut self.forward,
            &mut self.inverse,
            Par::Seq,
            MemStack::new(&mut self.memory),
            Default::default(),
        );
        let regular = (0..size).all(|k| {
            let pivot = self.matrix[k + k * size];
            pivot.is_finite() && pivot != 0.0
        });
        self.factored = regular;
        if regular { Ok(()) } else { Err(LinearError::Singular { what: "dense" }) }
    }

    /// Solves in place for the columns of `x` (column-major, any number of them).
    ///
    /// # Errors
    /// [`LinearError::Singular`] if there is no valid factorization or the solution is not finite.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        if !self.factored {
            return Err(LinearError::Singular { what: "dense" });
        }
        let size = self.size;
        let columns = x.len() / size;
        debug_assert!(columns <= size, "the work memory is made for at most as many columns as rows");
        let factors = MatRef::from_column_major_slice(&self.matrix, size, size);
        solve::solve_in_place(
            factors,
            factors,
            PermRef::new_checked(&self.forward, &self.inverse, size),
            MatMut::from_column_major_slice_mut(x, size, columns),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
        if x.iter().all(|value| value.is_finite()) { Ok(()) } else { Err(LinearError::Singular { what: "dense" }) }
    }
}

/// Rows from which on a product is shared by threads, and rows of a share: a product with fewer takes no longer than waking them.
const PARALLEL_ROWS: usize = 512;
const SHARE_ROWS: usize = 128;

/// `out = A x` for a dense column-major matrix, in either precision; the same to the last bit on any number of threads.
pub fn multiply<T: ComplexField + Send + Sync>(matrix: &[T], x: &[T], out: &mut [T], pool: Option<&ThreadPool>) {
    let (rows, columns) = (out.len(), x.len());
    let matrix = MatRef::from_column_major_slice(matrix, rows, columns);
    let x = MatRef::from_column_major_slice(x, columns, 1);
    let share = |first: usize, out: &mut [T]| {
        let count = out.len();
        faer::linalg::matmul::matmul(
            MatMut::from_column_major_slice_mut(out, count, 1),
            faer::Accum::Replace,
            matrix.subrows(first, count),
            x,
            T::one_impl(),
            Par::Seq,
        );
    };
    if rows < PARALLEL_ROWS {
        return share(0, out);
    }
    match pool {
        None => out.chunks_mut(SHARE_ROWS).enumerate().for_each(|(k, out)| share(k * SHARE_ROWS, out)),
        Some(pool) => pool.install(|| {
            out.par_chunks_mut(SHARE_ROWS).enumerate().for_each(|(k, out)| share(k * SHARE_ROWS, out));
        }),
    }
}
