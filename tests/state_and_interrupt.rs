//! States from elsewhere are checked by the core itself; an interrupted step leaves the state as it was.

mod common;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use flagrs::dynamics::failure::StepError;
use flagrs::dynamics::scheme::Scheme;
use flagrs::dynamics::simulation::Simulation;
use flagrs::dynamics::state::State;
