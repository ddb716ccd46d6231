//! Newton's method with line search.

#[cfg(test)]
mod tests;

use super::equations::{Equations, Goal, Size};
use crate::linear::LinearError;

/// How far and how long Newton's method goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonSettings {
    /// Where it stops.
    pub goal: Goal,
    /// Most iterations.
    pub max_iterations: usize,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self { goal: Goal::Residual(1e-10), max_iterations: 40 }
    }
}

/// Why Newton's method gave up.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonFailure {
    /// Largest entry of the residual that is left; not a number if there was none.
    pub residual: f64,
    /// Iterations made.
    pub iterations: usize,
    /// Number of the worst entry.
    pub worst: Option<usize>,
    /// What went wrong.
    pub reason: String,
}

/// Relative residual of the linear systems: no smaller than lets Newton gain as many digits an iteration as are wanted.
const LINEAR_TOLERANCE: f64 = 1e-6;
/// Share of the remaining distance to the target that a linear system may leave.
const LINEAR_SHARE: f64 = 0.1;
/// Loosest linear system, by goal: a residual that is to fall to its target, a correction that is to fall below its own.
const LOOSEST: f64 = 1e-2;
const LOOSEST_CORRECTION: f64 = 0.1;
/// How often, and by how much, the correction may grow under full steps.
const UPHILL_ITERATIONS: usize = 3;
const UPHILL: f64 = 2.0;
/// Halvings of a step that does not reduce the residual.
const BACKTRACKS: usize = 14;
/// A residual this many times the target that no longer falls is accepted as converged.
const STAGNATION: f64 = 100.0;

/// Points that Newton's method needs besides its solution.
pub struct NewtonWork<P> {
    direction: P,
    trial: P,
}

impl<P: Clone> NewtonWork<P> {
    /// Workspace for points like this one.
    pub fn new(like: &P) -> Self {
        Self { direction: like.clone(), trial: like.clone() }
    }
}

/// Solves the equations from the guess `at`, in place.
///
/// # Errors
/// [`NewtonFailure`]; `at` is then the last point that was accepted.
pub fn solve<E: Equations>(
    equations: &mut E,
    settings: &NewtonSettings,
    work: &mut NewtonWork<E::Point>,
    at: &mut E::Point,
) -> Result<(), NewtonFailure> {
    equations.aim(settings.goal, at);
    let mut newton = Newton { equations, work, at, blocked: None };
    match settings.goal {
        Goal::Residual(_) => newton.reduce_residual(settings.max_iterations),
        Goal::Correction(tolerance) => newton.reduce_correction(tolerance, settings.max_iterations),
    }
}

fn failure(size: Option<Size>, iterations: usize, reason: &str) -> NewtonFailure {
    NewtonFailure {
        residual: size.map_or(f64::NAN, |size| size.norm),
        iterations,
        worst: size.map(|size| size.worst),
        reason: reason.to_owned(),
    }
}

/// The parts of one solve.
struct Newton<'a, E: Equations> {
    equations: &'a mut E,
    work: &'a mut NewtonWork<E::Point>,
    at: &'a mut E::Point,
    /// Why the last trial had no residual, if it had none.
    blocked: Option<String>,
}

impl<E: Equations> Newton<'_, E> {
    fn evaluate_start(&mut self) -> Result<Size, NewtonFailure> {
        self.equations.evaluate(self.at).ok_or_else(|| {
            let obstacle = self.equations.obstacle(self.at);
            NewtonFailure { worst: obstacle.place, ..failure(None, 0, &obstacle.reason) }
        })
    }

    /// An error if the caller wants to stop.
    fn go_on(&mut self, size: Size, iteration: usize) -> Result<(), NewtonFailure> {
        if self.equations.stop_requested() { Err(failure(Some(size), iteration, "interrupted")) } else { Ok(()) }
    }

    /// Residual at the given part of the direction.
    fn try_length(&mut self, length: f64) -> Option<Size> {
        let NewtonWork { direction, trial } = self.work;
        self.equations.advance(self.at, direction, length, trial);
        let size = self.equations.evaluate(trial);
        self.blocked = if size.is_some() { None } else { Some(self.equations.obstacle(trial).reason) };
        size
    }

    /// What to say of a line search without success: why its shortest trial had no residual, or that it was no better.
    fn stuck(&self, size: Size, iteration: usize, what: &str) -> NewtonFailure {
        let reason = self.blocked.as_ref().map_or_else(|| what.to_owned(), |blocked| format!("{what}: {blocked}"));
        failure(Some(size), iteration, &reason)
    }

    /// The part of the direction that may be gone.
    fn full_length(&mut self) -> f64 {
        let NewtonWork { direction, trial } = self.work;
        self.equations.advance(self.at, direction, 1.0, trial);
        self.equations.longest_step(self.at, trial)
    }

    fn accept(&mut self) {
        std::mem::swap(self.at, &mut self.work.trial);
    }

    fn find_direction(&mut self, tolerance: f64) -> Result<(), LinearError> {
        self.equations.direction(self.at, tolerance, &mut self.work.direction)
    }

    fn reduce_residual(&mut self, max_iterations: usize) -> Result<(), NewtonFailure> {
        let mut size = self.evaluate_start()?;
        for iteration in 0..max_iterations {
            self.go_on(size, iteration)?;
            if size.excess <= 1.0 {
                return Ok(());
            }
            let merit = self.equations.weigh();
            let linear = (LINEAR_SHARE / size.excess).clamp(LINEAR_TOLERANCE, LOOSEST);
            self.equations
                .linearize(self.at)
                .and_then(|()| self.find_direction(linear))
                .map_err(|error| failure(Some(size), iteration, &error.to_string()))?;
            let mut length = self.full_length();
            let lower = (0..BACKTRACKS).find_map(|_| {
                let sufficient = (1.0 - 1e-4 * length) * merit;
                let trial = self.try_length(length).filter(|trial| trial.merit < sufficient);
                length *= 0.5;
                trial
            });
            let Some(lower) = lower else {
                if size.excess <= STAGNATION {
                    // The equations are left at the last trial: bring them back to the accepted point.
                    let _ = self.equations.evaluate(self.at);
                    return Ok(());
                }
                if self.equations.use_definite_matrix() {
                    size = self.evaluate_start()?;
                    continue;
                }
                return Err(self.stuck(size, iteration, "the line search found no lower residual"));
            };
            self.accept();
            size = lower;
        }
        if size.excess <= STAGNATION {
            return Ok(());
        }
        Err(failure(Some(size), max_iterations, "too many iterations"))
    }

    /// Newton's method that measures a residual by the correction it asks for, with the factors at hand: residuals of stiff
    /// and of soft directions then count alike (the natural level function of Deuflhard, Newton Methods, 2004, section 3.3).
    fn reduce_correction(&mut self, tolerance: f64, max_iterations: usize) -> Result<(), NewtonFailure> {
        let mut size = self.evaluate_start()?;
        self.equations.weigh();
        for iteration in 0..max_iterations {
            self.go_on(size, iteration)?;
            let broken = |error: LinearError| failure(Some(size), iteration, &error.to_string());
            self.equations.linearize(self.at).map_err(broken)?;
            let correction = self.equations.correction(tolerance).map_err(broken)?;
            if correction.negligible {
                self.polish();
                return Ok(());
            }
            let linear = (LINEAR_SHARE * tolerance / correction.size).clamp(LINEAR_TOLERANCE, LOOSEST_CORRECTION);
            self.find_direction(linear).map_err(broken)?;
            let full = self.full_length();
            let mut length = full;
            let lower = (0..BACKTRACKS).find_map(|_| {
                // The first full steps may go uphill: the test itself is blurred while unknowns still turn by much.
                let uphill = if length == full && iteration < UPHILL_ITERATIONS { UPHILL } else { 1.0 - 0.25 * length };
                let sufficient = uphill * correction.size;
                let trial = self.try_length(length);
                length *= 0.5;
                let left = self.equations.correction(tolerance).ok()?;
                let better = left.negligible || left.size < sufficient;
                trial.filter(|_| better).map(|trial| (trial, left))
            });
            let Some((trial, left)) = lower else {
                if self.equations.use_definite_matrix() {
                    size = self.evaluate_start()?;
                    continue;
                }
                return Err(self.stuck(size, iteration, "the line search found no smaller correction"));
            };
            self.accept();
            size = trial;
            if left.negligible {
                self.polish();
                return Ok(());
            }
        }
        Err(failure(Some(size), max_iterations, "too many iterations"))
    }

    /// Makes the correction that was measured last, which is small enough to be left: it is at hand, and with it the residual
    /// is far smaller. Corrections that no one can see may be residuals that everyone can read.
    fn polish(&mut self) {
        let NewtonWork { direction, trial } = self.work;
        if self.equations.last_correction(self.at, direction).is_err() {
            return;
        }
        self.equations.advance(self.at, direction, 1.0, trial);
        let free = self.equations.longest_step(self.at, trial) >= 1.0;
        if free && self.equations.place(trial) {
            self.accept();
        } else {
            // The equations go back to what is kept.
            self.equations.place(self.at);
        }
    }
}
