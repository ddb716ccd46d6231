//! The equations of a step as Newton's method sees them.

use std::time::Instant;

use crate::linear::LinearError;
use crate::model::Model;
use crate::nonlinear::continuation::Turning;
use crate::nonlinear::equations::{Correction, Equations, Goal, Obstacle, Size};
use crate::rod::fault::fault;
use crate::step::problem::{Balance, Step, Unknowns};
use crate::step::statistics::Statistics;

/// Change of a sliding velocity, over the larger of itself and the smoothing velocity, that may be left: where friction has
/// turned over, the change that is asked for is half the smoothing velocity or more.
const SLIP_SHARE: f64 = 0.1;

/// The equations of one step: what is given, and the workspace that evaluates them.
pub(crate) struct StepEquations<'a, 'b> {
    pub model: &'a Model,
    pub step: &'a Step<'b>,
    pub balance: &'a mut Balance,
    pub statistics: &'a mut Statistics,
}

impl Equations for StepEquations<'_, '_> {
    type Point = Unknowns;

    fn aim(&mut self, goal: Goal, from: &Unknowns) {
        self.balance.aim(self.model, self.step, goal, &from.q);
    }

    fn evaluate(&mut self, at: &Unknowns) -> Option<Size> {
        self.balance.evaluate(self.model, self.step, at, self.statistics)
    }

    fn place(&mut self, at: &Unknowns) -> bool {
        self.balance.place(self.model, self.step, &at.q)
    }

    fn obstacle(&self, at: &Unknowns) -> Obstacle {
        let network = self.model.network();
        match fault(network, &at.q) {
            Some(fault) => Obstacle { place: Some(network.node_dofs()[fault.node]), reason: fault.what.to_owned() },
            None => Obstacle { place: None, reason: "forces are too large to be numbers".to_owned() },
        }
    }

    fn weigh(&mut self) -> f64 {
        self.balance.weigh(self.model)
    }

    fn linearize(&mut self, at: &Unknowns) -> Result<(), LinearError> {
        self.statistics.newton_iterations += 1;
        self.balance.linearize(self.model, self.step, &at.tensions, self.statistics)
    }

    fn direction(&mut self, at: &Unknowns, tolerance: f64, out: &mut Unknowns) -> Result<(), LinearError> {
        let start = Instant::now();
        let solved = self.balance.solve(self.model, self.step, tolerance, out, self.statistics);
        self.balance.tension_changes(self.model, &at.tensions, out);
        self.statistics.seconds_linear += start.elapsed().as_secs_f64();
        solved
    }

    /// Neither displacements nor sliding velocities may still matter. While a contact sticks, displacements are small however large the
    /// force is that should make it slide: they alone do not tell.
    fn correction(&mut self, tolerance: f64) -> Result<Correction, LinearError> {
        let left = self.balance.correction(self.model, self.step, tolerance, self.statistics)?;
        Ok(Correction {
            size: left.length.max(tolerance * left.slip.over_smoothing / SLIP_SHARE),
            negligible: left.length <= tolerance && left.slip.relative <= SLIP_SHARE,
        })
    }

    fn last_correction(&mut self, at: &Unknowns, out: &mut Unknowns) -> Result<(), LinearError> {
        self.balance.last_correction(self.model, self.step, &at.tensions, out)
    }

    fn advance(&self, from: &Unknowns, direction: &Unknowns, part: f64, out: &mut Unknowns) {
        let go = |from: &[f64], direction: &[f64], out: &mut [f64]| {
            let moved = from.iter().zip(direction).map(|(from, direction)| from + part * direction);
            out.iter_mut().zip(moved).for_each(|(out, moved)| *out = moved);
        };
        go(&from.q, &direction.q, &mut out.q);
        go(&from.density, &direction.density, &mut out.density);
        go(&from.tensions, &direction.tensions, &mut out.tensions);
    }

    fn difference(&self, from: &Unknowns, to: &Unknowns, out: &mut Unknowns) {
        let apart = |from: &[f64], to: &[f64], out: &mut [f64]| {
            out.iter_mut().zip(to.iter().zip(from)).for_each(|(out, (to, from))| *out = to - from);
        };
        apart(&from.q, &to.q, &mut out.q);
        apart(&from.density, &to.density, &mut out.density);
        apart(&from.tensions, &to.tensions, &mut out.tensions);
    }

    fn longest_step(&mut self, from: &Unknowns, to: &Unknowns) -> f64 {
        self.balance.step_limit(self.model, &from.q, &to.q, self.statistics)
    }

    fn use_definite_matrix(&mut self) -> bool {
        self.balance.define_contact()
    }

    fn stop_requested(&mut self) -> bool {
        self.balance.interrupt.requested()
    }
}

/// Friction turns over within its smoothing velocity.
impl Turning for StepEquations<'_, '_> {
    fn turns(&self) -> bool {
        self.model.barrier().is_some_and(|law| law.has_friction())
    }

    fn reach(&mut self, guess: &Unknowns) -> f64 {
        let _ = self.evaluate(guess);
        self.balance.friction_reach(self.model, self.step)
    }

    fn widen(&mut self, factor: f64) {
        self.balance.widen_friction(factor);
    }
}
