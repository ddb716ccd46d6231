//! What a long computation shares with its caller's process; knows nothing of rods.
//!
//! * [`threads`]: our own pool of threads, safe across forks.
//! * [`interrupt`]: a way out of a long step.

pub mod interrupt;
pub mod threads;
