//! Sparse systems that are symmetric but for a few entries: LDL^T as long as its solutions are right, LU where not.

use std::sync::Arc;

use super::LinearError;
use super::ldlt::{Analysis, SparseLdlt};
use super::pattern::Pattern;
use super::sparse::SparseLu;

/// Relative residual above which a factorization without pivoting is not trusted.
const TRUSTED: f64 = 1e-3;

/// Factorizations of a matrix on a fixed pattern, and the matrix itself, whose solutions are checked against it.
pub struct NearlySymmetric {
    pattern: Arc<Pattern>,
    values: Vec<f64>,
    ldlt: SparseLdlt,
    /// Analysed when first needed: most scenes never do.
    lu: Option<SparseLu>,
    pivoted: bool,
    residual: Vec<f64>,
}

fn size(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
}

impl NearlySymmetric {
    /// Analyses the pattern.
    ///
    /// # Errors
    /// [`LinearError::Symbolic`] if the pattern cannot be analysed.
    pub fn new(pattern: Pattern) -> Result<Self, LinearError> {
        let analysis = Arc::new(Analysis::new(&pattern)?);
        Ok(Self::of(Arc::new(pattern), analysis))
    }

    /// Memory for a matrix on a pattern that has been analysed; many may share both.
    pub fn of(pattern: Arc<Pattern>, analysis: Arc<Analysis>) -> Self {
        Self {
            values: vec![0.0; pattern.entries()],
            ldlt: SparseLdlt::of(analysis),
            lu: None,
            pivoted: false,
            residual: vec![0.0; pattern.size()],
            pattern,
        }
    }

    /// The matrix on the pattern, to be filled before [`Self::factor`].
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Factors the matrix, without pivoting if it is nearly symmetric and that is possible at all.
    ///
    /// # Errors
    /// [`LinearError::Singular`] if the matrix is not finite or singular.
    pub fn factor(&mut self, nearly_symmetric: bool) -> Result<(), LinearError> {
        if !nearly_symmetric {
            return self.factor_with_pivoting();
        }
        self.pivoted = false;
        match self.ldlt.factor(&self.pattern, &self.values) {
            Ok(()) => Ok(()),
            Err(_) => self.factor_with_pivoting(),
        }
    }

    fn factor_with_pivoting(&mut self) -> Result<(), LinearError> {
        self.pivoted = true;
        if self.lu.is_none() {
            self.lu = Some(SparseLu::new(&self.pattern)?);
        }
        match &mut self.lu {
            Some(lu) => lu.factor(&self.pattern, &self.values),
            None => Err(LinearError::Singular { what: "sparse" }),
        }
    }

    /// `x <- K^-1 x` with the last factors, unchecked.
    ///
    /// # Errors
    /// [`LinearError::Singular`] if there are none or the solution is not finite.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        match &mut self.lu {
            Some(lu) if self.pivoted => lu.solve(x),
            _ => self.ldlt.solve(x),
        }
    }

    /// Solves `K x = rhs` and looks at the residual; where it is too large, factors anew with pivoting and solves again.
    ///
    /// # Errors
    /// As [`Self::factor`] and [`Self::solve`].
    pub fn solve_checked(&mut self, rhs: &[f64], x: &mut [f64]) -> Result<(), LinearError> {
        x.copy_from_slice(rhs);
        let solved = self.solve(x);
        if self.pivoted {
            return solved;
        }
        if solved.is_ok() && self.find_residual(rhs, x) <= TRUSTED * size(rhs) {
            return Ok(());
        }
        self.factor_with_pivoting()?;
        x.copy_from_slice(rhs);
        self.solve(x)
    }

    /// As [`Self::solve_checked`], for a solution of which only the size is wanted: refined where it is not good enough, before
    /// the matrix is factored with pivoting.
    ///
    /// # Errors
    /// As [`Self::solve_checked`].
    pub fn solve_roughly(&mut self, rhs: &[f64], x: &mut [f64]) -> Result<(), LinearError> {
        x.copy_from_slice(rhs);
        let trusted = TRUSTED * size(rhs);
        let solved = self.solve(x).is_ok()
            && (self.find_residual(rhs, x) <= trusted
                || (self.refine(x).is_ok() && self.find_residual(rhs, x) <= trusted));
        if solved { Ok(()) } else { self.solve_checked(rhs, x) }
    }

    /// As [`Self::solve_checked`], with a step of iterative refinement for the part of the matrix that is not symmetric.
    ///
    /// # Errors
    /// As [`Self::solve_checked`].
    pub fn solve_refined(&mut self, rhs: &[f64], x: &mut [f64]) -> Result<(), LinearError> {
        self.solve_checked(rhs, x)?;
        self.find_residual(rhs, x);
        self.refine(x)
    }

    /// Takes off `x` what leads to the residual in the workspace.
    fn refine(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        let mut change = std::mem::take(&mut self.residual);
        let solved = self.solve(&mut change);
        x.iter_mut().zip(&change).for_each(|(value, change)| *value -= change);
        self.residual = change;
        solved
    }

    /// `out += K x` for the matrix itself.
    pub fn multiply_add(&self, x: &[f64], out: &mut [f64]) {
        self.pattern.multiply_add(&self.values, x, out);
    }

    /// Leaves `K x - rhs` in the workspace and returns its largest entry.
    fn find_residual(&mut self, rhs: &[f64], x: &[f64]) -> f64 {
        self.residual.iter_mut().zip(rhs).for_each(|(residual, rhs)| *residual = -rhs);
        self.pattern.multiply_add(&self.values, x, &mut self.residual);
        size(&self.residual)
    }
}
