//! LU of an unsymmetric sparse matrix on a fixed pattern: analysed once, refactored and solved without allocation.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::lu::{self, LuRef, NumericLu, SymbolicLu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};

use super::LinearError;
use super::pattern::Pattern;

/// Sparse LU with partial pivoting.
pub struct SparseLu {
    symbolic: SymbolicLu<usize>,
    numeric: NumericLu<usize, f64>,
    memory: MemBuffer,
    factored: bool,
}

/// The pattern as faer sees it.
pub(super) fn view(pattern: &Pattern) -> SymbolicSparseColMatRef<'_, usize> {
    SymbolicSparseColMatRef::new_checked(
        pattern.size(),
        pattern.size(),
        pattern.column_starts(),
        None,
        pattern.row_indices(),
    )
}

impl SparseLu {
    /// Analyses the pattern.
    ///
    /// # Errors
    /// [`LinearError::Symbolic`] if the pattern cannot be analysed.
    pub fn new(pattern: &Pattern) -> Result<Self, LinearError> {
        let symbolic = lu::factorize_symbolic_lu(view(pattern), lu::LuSymbolicParams::default())
            .map_err(|error| LinearError::Symbolic(format!("{error:?}")))?;
        let memory = MemBuffer::new(StackReq::any_of(&[
            symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ]));
        Ok(Self { symbolic, numeric: NumericLu::new(), memory, factored: false })
    }

    /// Factors the matrix with these values on the pattern the analysis was made for.
    ///
    /// # Errors
    /// [`LinearError::Singular`] if a value is not finite or the matrix is structurally singular. A pivot that
    /// vanishes numerically shows in the solution, which the caller checks.
    pub fn factor(&mut self, pattern: &Pattern, values: &[f64]) -> Result<(), LinearError> {
        self.factored = false;
        if !values.iter().all(|value| value.is_finite()) {
            return Err(LinearError::Singular { what: "sparse" });
        }
        self.symbolic
            .factorize_numeric_lu(
                &mut self.numeric,
                SparseColMatRef::new(view(pattern), values),
                Par::Seq,
                MemStack::new(&mut self.memory),
                Default::default(),
            )
            .map_err(|_| LinearError::Singular { what: "sparse" })?;
        self.factored = true;
        Ok(())
    }

    /// Solves in place with the last factorization.
    ///
    /// # Errors
    /// [`LinearError::Singular`] if there is no valid factorization or the solution is not finite.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        if !self.factored {
            return Err(LinearError::Singular { what: "sparse" });
        }
        let rows = x.len();
        LuRef::new_unchecked(&self.symbolic, &self.numeric).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, rows, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
        if x.iter().all(|value| value.is_finite()) { Ok(()) } else { Err(LinearError::Singular { what: "sparse" }) }
    }
}
