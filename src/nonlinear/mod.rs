//! Systems of nonlinear equations; knows nothing of rods.
//!
//! * [`equations`]: what a solver needs to know of a system.
//! * [`newton`]: Newton's method with line search.
//! * [`continuation`]: Newton's method on systems that turn sharply, led there over smoother ones.

pub mod continuation;
pub mod equations;
pub mod newton;
