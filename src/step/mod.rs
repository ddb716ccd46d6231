//! One step: its equations, their linear systems, contact, and the account of what it did.
//!
//! * [`scheme`]: which terms a time-stepping scheme keeps and how it treats the fluid.
//! * [`problem`]: the force balance of a step: residual and derivative.
//! * `equations`: the same as Newton's method sees it.
//! * `saddle`: its linear systems, forces and flow.
//! * `targets`: what a residual is measured by.
//! * `contact`: contact in a step's equations.
//! * `budget`: what a step adds to energies, balances and extremes.
//! * `reactions`: what clamps exert.
//! * [`statistics`]: counts and times.

pub(crate) mod budget;
pub(crate) mod contact;
pub(crate) mod equations;
pub mod problem;
pub(crate) mod reactions;
pub(crate) mod saddle;
pub mod scheme;
pub mod statistics;
pub(crate) mod targets;
