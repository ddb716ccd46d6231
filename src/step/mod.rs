//! One step: its equations, their linear systems, contact, and the account of what it did.
//!
//! * [`scheme`]: which terms a time-stepping scheme keeps and how it treats the fluid.
//! * [`problem`]: the force balance of a step: residual and derivative.
//! * `saddle`: its linear systems, forces and flow.
//! * `targets`: what a residual is measured by.
//! * `contact`: contact in a step's equations.
//! * [`budget`]: energies, balances and extremes of a run.
//! * [`statistics`]: counts and times.

pub mod budget;
pub(crate) mod contact;
pub mod problem;
pub(crate) mod saddle;
pub mod scheme;
pub mod statistics;
pub(crate) mod targets;
