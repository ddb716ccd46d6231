//! Elastic energies of a rod network.
//!
//! * [`stretching`]: axial strain of every edge (equations 5 and 6).
//! * [`bending`]: curvature of every hinge (equations 1, 2 and 7).
//! * [`twisting`]: twist of every hinge (equations 3 and 8).
//! * [`hinges`]: the term that adds bending and twisting of a hinge in one pass.

pub mod bending;
pub mod hinges;
pub mod stretching;
pub mod twisting;
