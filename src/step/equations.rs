//! The equations of a step as Newton's method sees them.

use crate::contact::pair::Curvature;
use crate::linear::LinearError;
use crate::nonlinear::continuation::Turning;
use crate::nonlinear::equations::{Correction, Equations, Goal, Obstacle, Size};
use crate::step::contact::Treatment;
use crate::step::problem::{Problem, Unbalanced};
use crate::step::solver::Solver;
use crate::step::statistics::Statistics;
use crate::step::unknowns::Unknowns;

/// Change of a sliding velocity, over the larger of itself and the smoothing velocity, that may be left: where friction has
/// turned over, the change that is asked for is half the smoothing velocity or more.
const SLIP_SHARE: f64 = 0.1;

/// The equations of one step, and the workspace that evaluates them.
pub(crate) struct StepEquations<'a> {
    pub problem: Problem<'a>,
    pub solver: &'a mut Solver,
    pub statistics: &'a mut Statistics,
}

impl Equations for StepEquations<'_> {
    type Point = Unknowns;

    fn aim(&mut self, goal: Goal, from: &Unknowns) {
        self.solver.aim(self.problem, goal, &from.q);
    }

    fn evaluate(&mut self, at: &Unknowns) -> Option<Size> {
        self.solver.evaluate(self.problem, at, self.statistics)
    }

    fn place(&mut self, at: &Unknowns) -> bool {
        self.problem.place(&at.q, &mut self.solver.at)
    }

    fn obstacle(&self, at: &Unknowns) -> Obstacle {
        let known = self.solver.unbalanced().cloned();
        let Unbalanced { place, reason } = known.unwrap_or_else(|| self.problem.fault(&at.q));
        Obstacle { place, reason }
    }

    fn weigh(&mut self) -> f64 {
        self.solver.weigh(self.problem.model)
    }

    fn linearize(&mut self, at: &Unknowns) -> Result<(), LinearError> {
        self.statistics.newton_iterations += 1;
        self.solver.linearize(self.problem, &at.tensions, self.statistics)
    }

    fn direction(&mut self, at: &Unknowns, tolerance: f64, out: &mut Unknowns) -> Result<(), LinearError> {
        self.solver.direction(self.problem, (&at.tensions, tolerance), out, self.statistics)
    }

    /// Neither displacements nor sliding velocities may still matter. While a contact sticks, displacements are small however large the
    /// force is that should make it slide: they alone do not tell.
    fn correction(&mut self, tolerance: f64) -> Result<Correction, LinearError> {
        let left = self.solver.correction(self.problem, tolerance, self.statistics)?;
        Ok(Correction {
            size: left.length.max(tolerance * left.slip.over_smoothing / SLIP_SHARE),
            negligible: left.length <= tolerance && left.slip.relative <= SLIP_SHARE,
        })
    }

    fn last_correction(&mut self, at: &Unknowns, out: &mut Unknowns) -> Result<(), LinearError> {
        self.solver.last_correction(self.problem, &at.tensions, out)
    }

    fn advance(&self, from: &Unknowns, direction: &Unknowns, part: f64, out: &mut Unknowns) {
        out.advance(from, direction, part);
    }

    fn difference(&self, from: &Unknowns, to: &Unknowns, out: &mut Unknowns) {
        out.difference(from, to);
    }

    fn longest_step(&mut self, from: &Unknowns, to: &Unknowns) -> f64 {
        self.solver.step_limit(&from.q, &to.q, self.statistics)
    }

    fn use_definite_matrix(&mut self) -> bool {
        let contact = self.solver.medium.contact.as_ref();
        let new =
            self.problem.treatment.curvature == Curvature::Exact && contact.is_some_and(|c| c.may_be_indefinite());
        self.problem.treatment.curvature = Curvature::Definite;
        new
    }

    fn stop_requested(&mut self) -> bool {
        self.solver.interrupt.requested()
    }
}

/// Friction turns over within its smoothing velocity.
impl Turning for StepEquations<'_> {
    fn turns(&self) -> bool {
        self.solver.medium.contact.as_ref().is_some_and(|contact| contact.has_friction())
    }

    fn reach(&mut self, guess: &Unknowns) -> f64 {
        let _ = self.evaluate(guess);
        self.solver.friction_reach(self.problem.model, self.problem.step)
    }

    fn widen(&mut self, factor: f64) {
        self.problem.treatment = Treatment { widening: factor, ..Treatment::default() };
    }
}
