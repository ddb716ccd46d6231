//! Motion: a constant model, a changing state, and the schemes that take one state to the next.
//!
//! * [`specification`]: what a scene says, as plain data.
//! * [`model`]: the constant part of a simulation, built once from a specification.
//! * `scene_terms`: the terms that a scene asks for.
//! * [`state`]: the changing part, plain data that can be saved and restored to the last bit; `state_check`: of one from
//!   elsewhere, what must hold.
//! * [`terms`]: inertia and loads, the terms that belong to no other room.
//! * [`adaptive`]: steps of adaptive size and order; `between`: states between them; `breaks`: where they must end.
//! * [`balance`]: the force balance of one step: residual and derivative; `solve`: its linear systems.
//! * [`contact_model`]: how rods are kept apart; `barrier_term`: the barrier in a step's equations.
//! * [`control`]: the size and order of adaptive steps.
//! * [`filaments`]: the parts of a scene that move on their own, and their sizes; `targets`, `round_off`: what a residual is
//!   measured by on each.
//! * [`newton`]: Newton's method with line search on that balance.
//! * [`failure`]: what can go wrong with a step; `inputs`: what motors and clamps do over it.
//! * [`interrupt`]: a way out of a long one.
//! * `outside`: forces that a function gives; `output`: states between steps that contact allows; `progress`: whether work still moves the time on.
//! * [`predictor`]: past states: guesses, backward differences, dense output.
//! * [`scheme`]: which terms a time-stepping scheme keeps and how it treats the fluid.
//! * [`simulation`]: steps, retries, acceptance.
//! * [`diagnostics`]: motor torques, force densities, gaps.
//! * [`threads`]: our own thread pool, safe across forks.

pub mod adaptive;
pub mod balance;
mod barrier_term;
mod between;
mod breaks;
pub mod budget;
pub mod contact_model;
mod continuation;
pub mod control;
pub mod diagnostics;
pub mod failure;
pub mod filaments;
mod inputs;
pub mod interrupt;
pub mod model;
pub mod newton;
mod output;
mod outside;
pub mod predictor;
mod progress;
mod round_off;
mod scene_terms;
pub mod scheme;
pub mod simulation;
mod solve;
pub mod specification;
pub mod state;
mod state_check;
pub mod statistics;
mod targets;
pub mod terms;
pub mod threads;
