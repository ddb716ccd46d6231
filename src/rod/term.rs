//! What acts on a filament: terms that have an energy, and all others.
//!
//! A term is constant and belongs to a model; a scene that lacks it does not carry it. What has a memory of its own within a step, the
//! fluid and contact, stands beside the terms in [`crate::step`], with the same two calls: add forces, add a matrix.

use super::assembly::{Assembly, Increment};
use super::configuration::Configuration;
use crate::linear::pattern::Pattern;

/// Why a term has no force at a trial.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{term}: {reason}")]
pub struct TermError {
    /// Which term.
    pub term: &'static str,
    /// What is wrong.
    pub reason: String,
}

/// What all terms of the force balance have.
pub trait Term: Send + Sync {
    /// What the term is called in plans and profiles.
    fn name(&self) -> &'static str;

    /// The sets of degrees of freedom its elements couple.
    fn stencils(&self) -> Vec<Vec<usize>>;

    /// Looks up where its elements are stored; called once, after the pattern is known.
    fn bind(&mut self, pattern: &Pattern);
}

/// A term that is the gradient of an energy: its derivative is symmetric, and its power is what is stored.
pub trait Conservative: Term {
    /// Hands its energies (J) to `count`, by name.
    fn energies(&self, configuration: &Configuration, count: &mut dyn FnMut(&'static str, f64));

    /// Adds the gradient and, if wanted, the Hessian of its energies at a time (s).
    ///
    /// # Errors
    /// [`TermError`] if there is none at this configuration.
    fn add(&self, configuration: &Configuration, time: f64, out: &mut Assembly) -> Result<(), TermError>;
}

/// What a term is for: which account its power goes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Given by loads and fields.
    Load,
    /// Given by gravity, whose power follows from the weights of the model.
    Gravity,
    /// Given by motors, whose power is that of their shafts.
    Motor,
    /// Taken by the resistance of edges to spinning.
    TwistDrag,
    /// Taken by the head.
    Head,
    /// Taken by something else.
    Other,
}

/// A term without an energy: drag, loads, motors, inertia. It may depend on rates and on what drives the scene.
pub trait External: Term {
    /// Where its power is counted.
    fn purpose(&self) -> Purpose {
        Purpose::Other
    }

    /// Adds residual (minus forces) and, if wanted, its derivative.
    ///
    /// # Errors
    /// [`TermError`] if there is no force at this configuration.
    fn add(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) -> Result<(), TermError>;
}
