//! Newton's method with line search on the force balance of a step.

use crate::linear::LinearError;
use crate::model::Model;
use crate::rod::fault::fault;
use crate::step::problem::{Balance, Step, Unknowns};
use crate::step::saddle::Correction;
use crate::step::statistics::Statistics;
use crate::step::targets::Size;

/// Where Newton's method stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Goal {
    /// Largest residual force, relative to the largest force on the same filament: forces and torques then balance that well.
    Residual(f64),
    /// Largest displacement, relative to the size of its filament, by which the solution is still to be corrected. Tensions may
    /// then be off by the axial stiffness times a strain that no one can see, as long as the nodes are where they should be.
    Displacement(f64),
}

/// How far and how long Newton's method goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NewtonSettings {
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
pub(crate) struct NewtonFailure {
    pub residual: f64,
    pub iterations: usize,
    pub worst: Option<usize>,
    pub reason: String,
}

/// Relative residual of the linear systems: no smaller than lets Newton gain as many digits an iteration as are wanted.
const LINEAR_TOLERANCE: f64 = 1e-6;
/// Share of the remaining distance to the target that a linear system may leave.
const LINEAR_SHARE: f64 = 0.1;
/// Loosest linear system, by goal: a residual that is to fall to its target, a correction that is to fall below its own.
const LOOSEST: f64 = 1e-2;
const LOOSEST_CORRECTION: f64 = 0.1;
/// Change of a sliding velocity, over the larger of itself and the smoothing velocity, that may be left: where friction has
/// turned over, the change that is asked for is half the smoothing velocity or more.
const SLIP_SHARE: f64 = 0.1;
/// How often, and by how much, the correction may grow under full steps.
const UPHILL_ITERATIONS: usize = 3;
const UPHILL: f64 = 2.0;
/// Halvings of a step that does not reduce the residual.
const BACKTRACKS: usize = 14;
/// A residual this many times the target that no longer falls is accepted as converged.
const STAGNATION: f64 = 100.0;

/// Solves the balance from the guess `unknowns`, in place.
pub(crate) fn solve(
    balance: &mut Balance,
    model: &Model,
    step: &Step,
    settings: &NewtonSettings,
    work: &mut NewtonWork,
    unknowns: &mut Unknowns,
    statistics: &mut Statistics,
) -> Result<(), NewtonFailure> {
    balance.aim(model, step, settings.goal, &unknowns.q);
    let mut newton = Newton { balance, model, step, work, unknowns, statistics };
    match settings.goal {
        Goal::Residual(_) => newton.reduce_residual(settings.max_iterations),
        Goal::Displacement(tolerance) => newton.reduce_correction(tolerance, settings.max_iterations),
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
struct Newton<'a, 'b> {
    balance: &'a mut Balance,
    model: &'a Model,
    step: &'a Step<'b>,
    work: &'a mut NewtonWork,
    unknowns: &'a mut Unknowns,
    statistics: &'a mut Statistics,
}

impl Newton<'_, '_> {
    fn evaluate_start(&mut self) -> Result<Size, NewtonFailure> {
        let size = self.balance.evaluate(self.model, self.step, self.unknowns, self.statistics);
        size.ok_or_else(|| {
            let fault = fault(&self.model.network, &self.unknowns.q);
            let reason = fault.as_ref().map_or("forces are too large to be numbers", |fault| fault.what);
            let worst = fault.map(|fault| self.model.network.node_dofs()[fault.node]);
            NewtonFailure { worst, ..failure(None, 0, reason) }
        })
    }

    /// An error if the caller wants to stop.
    fn go_on(&mut self, size: Size, iteration: usize) -> Result<(), NewtonFailure> {
        let stopped = self.balance.interrupt.requested();
        if stopped { Err(failure(Some(size), iteration, "interrupted")) } else { Ok(()) }
    }

    /// Residual at the given part of the direction.
    fn try_length(&mut self, length: f64) -> Option<Size> {
        self.work.try_length(self.unknowns, length);
        self.balance.evaluate(self.model, self.step, &self.work.trial, self.statistics)
    }

    /// The part of the direction that contact allows.
    fn full_length(&mut self) -> f64 {
        self.work.try_length(self.unknowns, 1.0);
        self.balance.step_limit(self.model, &self.unknowns.q, &self.work.trial.q, self.statistics)
    }

    fn accept(&mut self) {
        std::mem::swap(self.unknowns, &mut self.work.trial);
    }

    fn linearize(&mut self) -> Result<(), LinearError> {
        self.statistics.newton_iterations += 1;
        self.balance.linearize(self.model, self.step, &self.unknowns.tensions, self.statistics)
    }

    fn find_direction(&mut self, tolerance: f64) -> Result<(), LinearError> {
        let tensions = &self.unknowns.tensions;
        self.balance.direction(self.model, self.step, tensions, tolerance, &mut self.work.direction, self.statistics)
    }

    fn correction(&mut self, tolerance: f64) -> Result<Correction, LinearError> {
        self.balance.correction(self.model, self.step, tolerance, self.statistics)
    }

    fn reduce_residual(&mut self, max_iterations: usize) -> Result<(), NewtonFailure> {
        let mut size = self.evaluate_start()?;
        for iteration in 0..max_iterations {
            self.go_on(size, iteration)?;
            if size.excess <= 1.0 {
                return Ok(());
            }
            let merit = self.balance.weigh(self.model);
            let linear = (LINEAR_SHARE / size.excess).clamp(LINEAR_TOLERANCE, LOOSEST);
            self.linearize()
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
                    // The configuration is left at the last trial: bring it back to the accepted point.
                    let _ = self.balance.evaluate(self.model, self.step, self.unknowns, self.statistics);
                    return Ok(());
                }
                if self.balance.define_contact() {
                    size = self.evaluate_start()?;
                    continue;
                }
                return Err(failure(Some(size), iteration, "the line search found no lower residual"));
            };
            self.accept();
            size = lower;
        }
        if size.excess <= STAGNATION {
            return Ok(());
        }
        Err(failure(Some(size), max_iterations, "too many iterations"))
    }

    /// Newton's method that measures a residual by the displacement it asks for, with the factors at hand: residuals of stiff
    /// and of soft directions then count alike (the natural level function of Deuflhard, Newton Methods, 2004, section 3.3).
    fn reduce_correction(&mut self, tolerance: f64, max_iterations: usize) -> Result<(), NewtonFailure> {
        let mut size = self.evaluate_start()?;
        self.balance.weigh(self.model);
        for iteration in 0..max_iterations {
            self.go_on(size, iteration)?;
            let broken = |error: LinearError| failure(Some(size), iteration, &error.to_string());
            self.linearize().map_err(broken)?;
            let correction = self.correction(tolerance).map_err(broken)?;
            if correction.is_done(tolerance) {
                self.polish();
                return Ok(());
            }
            let correction = correction.size(tolerance);
            let linear = (LINEAR_SHARE * tolerance / correction).clamp(LINEAR_TOLERANCE, LOOSEST_CORRECTION);
            self.find_direction(linear).map_err(broken)?;
            let full = self.full_length();
            let mut length = full;
            let lower = (0..BACKTRACKS).find_map(|_| {
                // The first full steps may go uphill: the test itself is blurred while edges still turn by much.
                let uphill = if length == full && iteration < UPHILL_ITERATIONS { UPHILL } else { 1.0 - 0.25 * length };
                let sufficient = uphill * correction;
                let trial = self.try_length(length);
                length *= 0.5;
                let left = self.correction(tolerance).ok()?;
                let better = left.is_done(tolerance) || left.size(tolerance) < sufficient;
                trial.filter(|_| better).map(|trial| (trial, left))
            });
            let Some((trial, left)) = lower else {
                if self.balance.define_contact() {
                    size = self.evaluate_start()?;
                    continue;
                }
                return Err(failure(Some(size), iteration, "the line search found no smaller correction"));
            };
            self.accept();
            size = trial;
            if left.is_done(tolerance) {
                self.polish();
                return Ok(());
            }
        }
        Err(failure(Some(size), max_iterations, "too many iterations"))
    }

    /// Makes the correction that was measured last, which is small enough to be left: it is at hand, and with it the forces
    /// balance far better. Strains that no one can see are tensions and torques that everyone can read.
    fn polish(&mut self) {
        let Self { balance, model, step, work, unknowns, .. } = self;
        if balance.last_correction(model, step, &unknowns.tensions, &mut work.direction).is_err() {
            return;
        }
        work.try_length(unknowns, 1.0);
        let free = balance.step_limit(model, &unknowns.q, &work.trial.q, self.statistics) >= 1.0;
        if free && balance.place(model, step, &work.trial.q) {
            std::mem::swap(*unknowns, &mut work.trial);
        } else {
            // The configuration goes back to what is kept.
            balance.place(model, step, &unknowns.q);
        }
    }
}

impl Correction {
    /// Whether neither displacements nor sliding velocities still matter. While a contact sticks, displacements are small however
    /// large the force is that should make it slide: they alone do not tell.
    fn is_done(&self, tolerance: f64) -> bool {
        self.length <= tolerance && self.slip.relative <= SLIP_SHARE
    }

    /// One measure of both, linear in the correction: what the line search reduces.
    fn size(&self, tolerance: f64) -> f64 {
        self.length.max(tolerance * self.slip.over_smoothing / SLIP_SHARE)
    }
}

/// Vectors of Newton's method.
pub(crate) struct NewtonWork {
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
        move_along(&mut self.trial.tensions, &from.tensions, &self.direction.tensions);
    }
}
