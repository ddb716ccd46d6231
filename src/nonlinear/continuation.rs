//! Newton's method led to the turn of friction over wider ones.
//!
//! From sticking to sliding the force of friction turns over within the smoothing velocity. Where what drives a contact would move it
//! many powers of ten faster, Newton's method does not see the turn coming: on either side of it the force is constant. A step that is not
//! solved at once is therefore solved with a smoothing velocity as large as what friction itself can make of velocities, where the force is
//! all but linear, and then with ever smaller ones. Solutions depend on that velocity almost linearly, in contacts that stick and in
//! those that slide alike, so that each starts from the line through the two before.

use crate::model::Model;
use crate::nonlinear::newton::{self, Goal, NewtonFailure, NewtonSettings, NewtonWork};
use crate::step::problem::{Balance, Step, Unknowns};
use crate::step::statistics::Statistics;

/// Factor between smoothing velocities, at first; its root is taken where it proves to be too much.
const FACTOR: f64 = 10.0;
/// Smallest factor.
const LEAST_FACTOR: f64 = 1.2;
/// Widest smoothing velocity, over the given one.
const WIDEST: f64 = 1e14;
/// Residual, relative to the largest force, to which the balance is solved on the way.
const ROUGH: f64 = 1e-5;

/// What the solves of one step share.
pub(crate) struct Continuation<'a, 'b> {
    pub balance: &'a mut Balance,
    pub model: &'a Model,
    pub step: &'a Step<'b>,
    pub settings: &'a NewtonSettings,
    pub work: &'a mut NewtonWork,
    pub statistics: &'a mut Statistics,
}

impl Continuation<'_, '_> {
    /// Solves the balance from the guess `unknowns`, in place.
    pub fn solve(&mut self, unknowns: &mut Unknowns) -> Result<(), NewtonFailure> {
        if !self.model.barrier().is_some_and(|law| law.has_friction()) {
            return self.newton(self.settings, unknowns);
        }
        let guess = unknowns.clone();
        let failure = match self.newton(self.settings, unknowns) {
            Ok(()) => return Ok(()),
            Err(failure) => failure,
        };
        unknowns.clone_from(&guess);
        let widest = self.widest(unknowns);
        let led = if widest > 1.0 { self.narrow(widest, unknowns) } else { Err(failure) };
        self.balance.widen_friction(1.0);
        led
    }

    fn newton(&mut self, settings: &NewtonSettings, unknowns: &mut Unknowns) -> Result<(), NewtonFailure> {
        newton::solve(self.balance, self.model, self.step, settings, self.work, unknowns, self.statistics)
    }

    /// The smoothing velocity, over the given one, up to which friction can move contacts from the guess.
    fn widest(&mut self, guess: &Unknowns) -> f64 {
        let _ = self.balance.evaluate(self.model, self.step, guess, self.statistics);
        let reach = self.balance.friction_reach(self.model, self.step);
        if reach.is_finite() { reach.min(WIDEST) } else { 1.0 }
    }

    /// Solutions for smoothing velocities from the widest down to the given one.
    fn narrow(&mut self, widest: f64, unknowns: &mut Unknowns) -> Result<(), NewtonFailure> {
        let rough = match self.settings.goal {
            Goal::Residual(target) => Goal::Residual(target.max(ROUGH)),
            goal @ Goal::Displacement(_) => goal,
        };
        let rough = NewtonSettings { goal: rough, ..*self.settings };
        let (mut factor, mut width) = (FACTOR, widest);
        self.at(width, &rough, unknowns)?;
        let mut before: Option<(f64, Unknowns)> = None;
        while width > 1.0 {
            let next = (width / factor).max(1.0);
            let mut trial = unknowns.clone();
            if let Some((earlier, past)) = &before {
                self.extrapolate((*earlier, past), (width, unknowns), next, &mut trial);
            }
            let settings = if next > 1.0 { rough } else { *self.settings };
            match self.at(next, &settings, &mut trial) {
                Ok(()) => {
                    before = Some((width, std::mem::replace(unknowns, trial)));
                    width = next;
                }
                Err(failure) => {
                    factor = factor.sqrt();
                    if factor < LEAST_FACTOR {
                        return Err(failure);
                    }
                }
            }
        }
        Ok(())
    }

    fn at(&mut self, width: f64, settings: &NewtonSettings, unknowns: &mut Unknowns) -> Result<(), NewtonFailure> {
        self.balance.widen_friction(width);
        self.newton(settings, unknowns)
    }

    /// The line through two solutions at the next smoothing velocity, if contact lets it be reached.
    fn extrapolate(
        &mut self,
        (earlier, past): (f64, &Unknowns),
        (width, now): (f64, &Unknowns),
        next: f64,
        out: &mut Unknowns,
    ) {
        let part = (next - width) / (width - earlier);
        let go = |out: &mut [f64], now: &[f64], past: &[f64]| {
            out.iter_mut().zip(now.iter().zip(past)).for_each(|(out, (now, past))| *out = now + part * (now - past));
        };
        go(&mut out.q, &now.q, &past.q);
        if self.balance.step_limit(self.model, &now.q, &out.q, self.statistics) < 1.0 {
            out.q.copy_from_slice(&now.q);
            return;
        }
        go(&mut out.density, &now.density, &past.density);
        go(&mut out.tensions, &now.tensions, &past.tensions);
    }
}
