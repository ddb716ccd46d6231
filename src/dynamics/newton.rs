//! Newton's method with line search on the force balance of a step.

use super::balance::{Balance, Size, Step, Unknowns};
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

/// Relative residual of the linear systems: no smaller than lets Newton gain as many digits an iteration as are wanted.
const LINEAR_TOLERANCE: f64 = 1e-6;
/// Share of the remaining distance to the target that a linear system may leave.
const LINEAR_SHARE: f64 = 0.1;
/// Loosest linear system.
const LOOSEST: f64 = 1e-2;
/// Halvings of a step that does not reduce the residual.
const BACKTRACKS: usize = 14;
/// A residual this many times the target that no longer falls is accepted as converged.
const STAGNATION: f64 = 100.0;

/// Solves the balance from the guess `unknowns`, in place.
pub(super) fn solve(
    balance: &mut Balance,
    model: &Model,
    step: &Step,
    settings: &NewtonSettings,
    work: &mut NewtonWork,
    unknowns: &mut Unknowns,
    statistics: &mut Statistics,
) -> Result<(), NewtonFailure> {
    let failure = |size: Option<Size>, iterations: usize, reason: &str| NewtonFailure {
        residual: size.map_or(f64::NAN, |size| size.norm),
        iterations,
        worst: size.map_or(0, |size| size.worst),
        reason: reason.to_owned(),
    };
    let floor = round_off(balance, model, step, &unknowns.q);
    let Some(mut size) = balance.evaluate(model, step, unknowns, statistics) else {
        return Err(failure(None, 0, "the guess is not a configuration"));
    };
    let target = |size: &Size| (settings.tolerance * size.scale.max(1e-8 * model.bending_scale)).max(floor);
    for iteration in 0..settings.max_iterations {
        let target = target(&size);
        if size.norm <= target {
            return Ok(());
        }
        statistics.newton_iterations += 1;
        let linear = (LINEAR_SHARE * target / size.norm).clamp(LINEAR_TOLERANCE, LOOSEST);
        let direction = (&mut work.direction.q[..], &mut work.direction.density[..]);
        if let Err(error) = balance.direction(model, step, linear, direction, statistics) {
            return Err(failure(Some(size), iteration, &error.to_string()));
        }
        let mut length = 1.0;
        let mut accepted = None;
        for _ in 0..BACKTRACKS {
            work.try_length(unknowns, length);
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
                let _ = balance.evaluate(model, step, unknowns, statistics);
                return Ok(());
            }
            return Err(failure(Some(size), iteration, "the line search found no lower residual"));
        };
        std::mem::swap(unknowns, &mut work.trial);
        size = next;
    }
    if size.norm <= STAGNATION * target(&size) {
        return Ok(());
    }
    Err(failure(Some(size), settings.max_iterations, "too many iterations"))
}

/// Vectors of Newton's method.
pub(super) struct NewtonWork {
    direction: Unknowns,
    trial: Unknowns,
}

impl NewtonWork {
    pub fn new(like: &Unknowns) -> Self {
        Self { direction: like.clone(), trial: like.clone() }
    }

    fn try_length(&mut self, from: &Unknowns, length: f64) {
        let move_along = |trial: &mut [f64], start: &[f64], direction: &[f64]| {
            for ((trial, start), direction) in trial.iter_mut().zip(start).zip(direction) {
                *trial = start + length * direction;
            }
        };
        move_along(&mut self.trial.q, &from.q, &self.direction.q);
        move_along(&mut self.trial.density, &from.density, &self.direction.density);
    }
}

/// Round-off of a nodal force: positions are exact to `u |x|`, strains to `u |x| / l`, tensions to EA times that; inertia
/// and drag multiply differences of positions by masses and resistances over powers of the step.
fn round_off(balance: &Balance, model: &Model, step: &Step, q: &[f64]) -> f64 {
    let farthest = model
        .network
        .node_dofs()
        .iter()
        .flat_map(|&dof| q[dof..dof + 3].iter())
        .fold(0.0, |far: f64, x| far.max(x.abs()));
    let tension = model.stretching_scale * (1.0 + farthest / model.shortest_edge);
    2.0 * f64::EPSILON * (tension + balance.largest_stiffness(model, step) * farthest)
}
