//! Contact in a step's equations.
//!
//! * [`barrier`]: the barrier, whose elements change as rods move.

pub(crate) mod barrier;
