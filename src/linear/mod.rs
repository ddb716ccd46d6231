//! Linear algebra without any knowledge of rods: a fixed sparse pattern, sparse and dense factorizations, a Krylov method.
//!
//! * [`pattern`]: which entries a sum of small dense element matrices touches, and where each of them is stored.
//! * [`sparse`]: LU of a matrix on such a pattern (faer).
//! * [`ldlt`]: LDL^T of a symmetric one (faer).
//! * [`nearly_symmetric`]: the one of these two that a matrix needs.
//! * [`dense`]: LU of a dense unsymmetric matrix (faer).
//! * [`pseudo_inverse`]: least squares, cut off where a matrix is singular to working precision.
//! * [`krylov`]: right-preconditioned GMRES for operators that are only known by their action.

pub mod dense;
pub mod krylov;
pub mod ldlt;
pub mod nearly_symmetric;
pub mod pattern;
pub mod pseudo_inverse;
pub mod sparse;

/// A linear system could not be solved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LinearError {
    /// The matrix is singular, structurally or to working precision.
    #[error("the {what} matrix is singular to working precision")]
    Singular {
        /// Which matrix.
        what: &'static str,
    },
    /// The symbolic analysis failed.
    #[error("symbolic analysis of the sparse matrix failed: {0}")]
    Symbolic(String),
    /// The Krylov method did not reach its tolerance.
    #[error("GMRES stopped at a relative residual of {residual:.2e} after {iterations} iterations")]
    Krylov {
        /// Relative residual reached.
        residual: f64,
        /// Iterations made.
        iterations: usize,
    },
    /// The caller wants to stop.
    #[error("interrupted")]
    Interrupted,
    /// An operator known only by its action could not be applied.
    #[error("the product with the mobility failed: {0}")]
    Product(String),
    /// A dense matrix was asked for where none is ever formed.
    #[error(
        "the {what} of {nodes} nodes is a dense matrix of {gigabytes:.1} GB, which is not formed where products are \
         made without it"
    )]
    MatrixFree {
        /// Which matrix.
        what: &'static str,
        /// Nodes of the scene.
        nodes: usize,
        /// Its size, GB.
        gigabytes: f64,
    },
}
