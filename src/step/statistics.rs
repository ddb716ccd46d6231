//! Counts and times of what a simulation has done.

/// Counts and wall-clock seconds since the simulation was made.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: u64,
    /// Steps given up and retried with a smaller one.
    pub rejected_steps: u64,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Krylov iterations.
    pub krylov_iterations: u64,
    /// Dense solves after the Krylov method had failed.
    pub dense_solves: u64,
    /// Passes of the contact loop.
    pub contact_iterations: u64,
    /// Searches of all pairs for near ones, by barrier contact.
    pub contact_searches: u64,
    /// Seconds spent on the fluid's matrix: assembly and factorization.
    pub seconds_fluid: f64,
    /// Seconds spent on residuals and derivatives.
    pub seconds_assembly: f64,
    /// Seconds spent on sparse factorizations and Krylov iterations.
    pub seconds_linear: f64,
    /// Seconds spent on finding contacts.
    pub seconds_contact: f64,
    /// Seconds spent in steps, all told.
    pub seconds_total: f64,
}
