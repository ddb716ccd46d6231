//! Newton's method with line search on the force balance of a step.

use super::balance::{Balance, Size, Step};
use super::model::Model;
use super::statistics::Statistics;

/// How far and how long Newton's method goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NewtonSettings {
    /// Residual force at which it stops, relative to the largest force in the balance.
    pub tolerance: f64,
    /// Most iterations.
    pub max_iterations: usize,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self { tolerance: 1e-10, max_iterations: 40 }
    }
}

/// Why Newton's method gave up.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NewtonFailure {
    pub residual: f64,
    pub iterations: usize,
    pub worst: usize,
    pub reason: String,
}

/// Relative residual of the linear systems: small enough that Newton gains as many digits an iteration.
const LINEAR_TOLERANCE: f64 = 1e-6;
/// Halvings of a step that does not reduce the residual.
const BACKTRACKS: usize = 14;
/// A residual this many times the round-off estimate that no longer falls is accepted as converged.
const STAGNATION: f64 = 100.0;

/// Solves the balance from the guess `q`, in place.
pub(super) fn solve(
    balance: &mut Balance,
    model: &Model,
    step: &Step,
    settings: &NewtonSettings,
    work: &mut NewtonWork,
    q: &mut [f64],
    statistics: &mut Statistics,
) -> Result<(), NewtonFailure> {
    let failure = |size: Option<Size>, iterations: usize, reason: &str| NewtonFailure {
        residual: size.map_or(f64::NAN, |size| size.norm),
        iterations,
        worst: size.map_or(0, |size| size.worst),
        reason: reason.to_owned(),
    };
    let floor = round_off(model, q);
    let Some(mut size) = balance.evaluate(model, step, q, statistics) else {
        return Err(failure(None, 0, "the guess is not a configuration"));
    };
    for iteration in 0..settings.max_iterations {
        let target = (settings.tolerance * size.scale.max(1e-8 * model.bending_scale)).max(floor);
        if size.norm <= target {
            return Ok(());
        }
        statistics.newton_iterations += 1;
        if let Err(error) = balance.direction(model, step, LINEAR_TOLERANCE, &mut work.direction, statistics) {
            return Err(failure(Some(size), iteration, &error.to_string()));
        }
        let mut length = 1.0;
        let mut accepted = None;
        for _ in 0..BACKTRACKS {
            for ((trial, start), direction) in work.trial.iter_mut().zip(&*q).zip(&work.direction) {
                *trial = start + length * direction;
            }
            let trial = balance.evaluate(model, step, &work.trial, statistics);
            if let Some(trial) = trial.filter(|trial| trial.merit < (1.0 - 1e-4 * length) * size.merit) {
                accepted = Some(trial);
                break;
            }
            length *= 0.5;
        }
        let Some(next) = accepted else {
            if size.norm <= STAGNATION * target {
                // The configuration is left at the last trial: bring it back to the accepted point.
                let _ = balance.evaluate(model, step, q, statistics);
                return Ok(());
            }
            return Err(failure(Some(size), iteration, "the line search found no lower residual"));
        };
        q.copy_from_slice(&work.trial);
        size = next;
    }
    Err(failure(Some(size), settings.max_iterations, "too many iterations"))
}

/// Vectors of Newton's method.
pub(super) struct NewtonWork {
    direction: Vec<f64>,
    trial: Vec<f64>,
}

impl NewtonWork {
    pub fn new(dof_count: usize) -> Self {
        Self { direction: vec![0.0; dof_count], trial: vec![0.0; dof_count] }
    }
}

/// Round-off of a nodal force: positions are exact to `u |x|`, strains to `u |x| / l`, tensions to EA times that.
fn round_off(model: &Model, q: &[f64]) -> f64 {
    let farthest = model
        .network
        .node_dofs()
        .iter()
        .flat_map(|&dof| q[dof..dof + 3].iter())
        .fold(0.0, |far: f64, x| far.max(x.abs()));
    2.0 * f64::EPSILON * model.stretching_scale * (1.0 + farthest / model.shortest_edge)
}
