//! Elastic energies of a rod network and the motors that drive it.
//!
//! * [`stretching`]: axial strain of every edge (equations 5 and 6).
//! * [`bending`]: curvature of every hinge (equations 1, 2 and 7).
//! * [`twisting`]: twist of every hinge (equations 3 and 8).
//! * [`hinges`]: the term that adds bending and twisting of a hinge in one pass.
//! * [`motors`]: prescribed angle or torque of a shaft against its housing (equation 4, corrected).
//! * [`quadrature`]: integrals of functions of time.
//! * [`signal`]: constants, tables and functions of time that drive motors and clamps.

pub mod bending;
pub mod hinges;
pub mod motors;
pub mod quadrature;
pub mod signal;
pub mod stretching;
pub mod twisting;
