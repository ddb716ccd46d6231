//! One step: its equations, their linear systems, contact, and the account of what it did.
//!
//! * [`scheme`]: which terms a time-stepping scheme keeps and how it treats the fluid.
//! * [`given`], [`unknowns`]: what is given for a step, and what is sought.
//! * `problem`: its equations: residual and derivative of the force balance; `evaluation`: their memory.
//! * `flow`: the fluid in them; `contact`: contact in them, by one of two methods.
//! * `saddle`: the linear systems of forces and flow; `system`: the sparse matrix in them; `targets`: what a residual is measured by.
//! * `solver`: all of these together; `equations`: the same as Newton's method sees it.
//! * `reactions`: what clamps exert.
//! * `ledger`: what a step adds to energies, balances and extremes.
//! * [`statistics`]: counts and times.

pub(crate) mod contact;
pub(crate) mod equations;
pub(crate) mod evaluation;
pub(crate) mod flow;
pub mod given;
pub(crate) mod ledger;
pub(crate) mod problem;
pub(crate) mod reactions;
pub(crate) mod saddle;
pub mod scheme;
pub(crate) mod solver;
pub mod statistics;
pub(crate) mod system;
pub(crate) mod targets;
#[cfg(test)]
mod tests;
pub mod unknowns;
