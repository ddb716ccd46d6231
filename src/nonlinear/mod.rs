//! Systems of nonlinear equations.
//!
//! * [`newton`]: Newton's method with line search.
//! * [`continuation`]: Newton's method led to the turn of friction over wider ones.

pub(crate) mod continuation;
pub(crate) mod newton;
