//! LDL^T of a symmetric sparse matrix on a fixed pattern: analysed once, refactored and solved without allocation.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::sparse::SparseColMatRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::{Conj, MatMut, Par, Side};

use super::LinearError;
use super::pattern::Pattern;
use super::sparse::view;

/// Order of elimination and pattern of the factors: all that follows from the pattern of a matrix alone.
pub struct Analysis(SymbolicCholesky<usize>);

impl Analysis {
    /// Analyses a pattern.
    ///
    /// # Errors
    /// [`LinearError::Symbolic`] if it cannot be analysed.
    pub fn new(pattern: &Pattern) -> Result<Self, LinearError> {
        factorize_symbolic_cholesky(
            view(pattern),
            Side::Upper,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        )
        .map(Self)
        .map_err(|error| LinearError::Symbolic(format!("{error:?}")))
    }
}

/// Sparse LDL^T without pivoting; only the upper triangle of the matrix is read.
pub struct SparseLdlt {
    analysis: Arc<Analysis>,
    values: Vec<f64>,
    memory: MemBuffer,
    factored: bool,
}

impl SparseLdlt {
    /// Analyses the pattern.
    ///
    /// # Errors
    /// [`LinearError::Symbolic`] if the pattern cannot be analysed.
    pub fn new(pattern: &Pattern) -> Result<Self, LinearError> {
        Ok(Self::of(Arc::new(Analysis::new(pattern)?)))
    }

    /// Memory for factors whose pattern has been analysed; many may share the analysis.
    pub fn of(analysis: Arc<Analysis>) -> Self {
        let symbolic = &analysis.0;
        let memory = MemBuffer::new(StackReq::any_of(&[
            symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<f64>(3, Par::Seq),
        ]));
        Self { values: vec![0.0; symbolic.len_val()], analysis, memory, factored: false }
    }

    /// Factors the matrix with these values on the pattern the analysis was made for.
    ///
    /// # Errors
    /// [`LinearError::Singular`] if a value is not finite or a pivot vanishes.
    pub fn factor(&mut self, pattern: &Pattern, values: &[f64]) -> Result<(), LinearError> {
        self.factored = false;
        if !values.iter().all(|value| value.is_finite()) {
            return Err(LinearError::Singular { what: "sparse" });
        }
        self.analysis
            .0
            .factorize_numeric_ldlt(
                &mut self.values,
                SparseColMatRef::new(view(pattern), values),
                Side::Upper,
                LdltRegularization::default(),
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
        LdltRef::new(&self.analysis.0, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, rows, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
        if x.iter().all(|value| value.is_finite()) { Ok(()) } else { Err(LinearError::Singular { what: "sparse" }) }
    }
}
