//! Backward differences of variable size and order; knows nothing of rods.
//!
//! * [`history`]: past states: guesses, backward differences, dense output.
//! * [`control`]: the size and order of the next step, from how far predictions have missed.

pub mod control;
pub mod history;
