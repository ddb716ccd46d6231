//! Newton's method led to a sharp turn of the equations over smoother ones.
//!
//! Where a term turns over within a width far smaller than the guess is off, Newton's method does not see the turn coming: on either side
//! of it the term is constant. So it is with friction, which turns within its smoothing velocity from one side to the other. A system that
//! is not solved at once is therefore solved with a width as large as the term can move the unknowns, where it is all but linear, and then
//! with ever smaller ones. Solutions depend on the width almost linearly, on either side of the turn and within it, so that each starts
//! from the line through the two before.

use super::equations::{Equations, Goal};
use super::newton::{self, NewtonFailure, NewtonSettings, NewtonWork};

/// Factor between widths, at first; its root is taken where it proves to be too much.
const FACTOR: f64 = 10.0;
/// Smallest factor.
const LEAST_FACTOR: f64 = 1.2;
/// Largest width, over the given one.
const WIDEST: f64 = 1e14;
/// Residual, relative to the largest force, to which the equations are solved on the way.
const ROUGH: f64 = 1e-5;

/// Equations with a term that turns over within a width that can be made larger.
pub trait Turning: Equations {
    /// Whether there is such a term.
    fn turns(&self) -> bool;

    /// The width, over the given one, up to which the term can move the unknowns from a guess.
    fn reach(&mut self, guess: &Self::Point) -> f64;

    /// Multiplies the given width by a factor from here on; 1 takes the given one.
    fn widen(&mut self, factor: f64);
}

/// Solves the equations from the guess `at`, in place; where there is a turn that hides the solution, over wider ones.
///
/// # Errors
/// [`NewtonFailure`].
pub fn solve<E: Turning>(
    equations: &mut E,
    settings: &NewtonSettings,
    work: &mut NewtonWork<E::Point>,
    at: &mut E::Point,
) -> Result<(), NewtonFailure> {
    if !equations.turns() {
        return newton::solve(equations, settings, work, at);
    }
    let guess = at.clone();
    let failure = match newton::solve(equations, settings, work, at) {
        Ok(()) => return Ok(()),
        Err(failure) => failure,
    };
    at.clone_from(&guess);
    let reach = equations.reach(at);
    let widest = if reach.is_finite() { reach.min(WIDEST) } else { 1.0 };
    let led = if widest > 1.0 { Continuation { equations, settings, work }.narrow(widest, at) } else { Err(failure) };
    equations.widen(1.0);
    led
}

/// What the solves share.
struct Continuation<'a, E: Turning> {
    equations: &'a mut E,
    settings: &'a NewtonSettings,
    work: &'a mut NewtonWork<E::Point>,
}

impl<E: Turning> Continuation<'_, E> {
    /// Solutions for widths from the widest down to the given one.
    fn narrow(&mut self, widest: f64, at: &mut E::Point) -> Result<(), NewtonFailure> {
        let rough = match self.settings.goal {
            Goal::Residual(target) => Goal::Residual(target.max(ROUGH)),
            goal @ Goal::Correction(_) => goal,
        };
        let rough = NewtonSettings { goal: rough, ..*self.settings };
        let (mut factor, mut width) = (FACTOR, widest);
        self.at(width, &rough, at)?;
        let mut before: Option<(f64, E::Point)> = None;
        while width > 1.0 {
            let next = (width / factor).max(1.0);
            let mut trial = at.clone();
            if let Some((earlier, past)) = &before {
                self.extrapolate(past, at, (next - width) / (width - earlier), &mut trial);
            }
            let settings = if next > 1.0 { rough } else { *self.settings };
            match self.at(next, &settings, &mut trial) {
                Ok(()) => {
                    before = Some((width, std::mem::replace(at, trial)));
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

    fn at(&mut self, width: f64, settings: &NewtonSettings, at: &mut E::Point) -> Result<(), NewtonFailure> {
        self.equations.widen(width);
        newton::solve(self.equations, settings, self.work, at)
    }

    /// The point on the line through two solutions, `part` of their distance beyond the second, if it may be reached.
    fn extrapolate(&mut self, past: &E::Point, now: &E::Point, part: f64, out: &mut E::Point) {
        let mut direction = now.clone();
        self.equations.difference(past, now, &mut direction);
        self.equations.advance(now, &direction, part, out);
        if self.equations.longest_step(now, out) < 1.0 {
            out.clone_from(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::equations::{Correction, Obstacle, Size};
    use super::*;
    use crate::linear::LinearError;

    /// `stiffness x + tanh(x / width) = load`: friction that holds a spring.
    struct Held {
        load: f64,
        stiffness: f64,
        width: f64,
        factor: f64,
        x: f64,
        residual: f64,
        slope: f64,
        widths: Vec<f64>,
        longest: f64,
    }

    impl Held {
        fn new(load: f64) -> Self {
            let (stiffness, width) = (1e-3, 1e-9);
            let (x, residual, slope) = (0.0, 0.0, 0.0);
            Self { load, stiffness, width, factor: 1.0, x, residual, slope, widths: Vec::new(), longest: 1.0 }
        }
    }

    impl Equations for Held {
        type Point = f64;

        fn aim(&mut self, _: Goal, _: &f64) {}

        fn evaluate(&mut self, at: &f64) -> Option<Size> {
            self.x = *at;
            self.residual = self.stiffness * at + (at / (self.factor * self.width)).tanh() - self.load;
            let norm = self.residual.abs();
            Some(Size { norm, excess: norm / 1e-12, merit: norm, worst: 0 })
        }

        fn place(&mut self, at: &f64) -> bool {
            self.x = *at;
            true
        }

        fn obstacle(&self, _: &f64) -> Obstacle {
            Obstacle { place: None, reason: String::new() }
        }

        fn weigh(&mut self) -> f64 {
            self.residual.abs()
        }

        fn linearize(&mut self, _: &f64) -> Result<(), LinearError> {
            let width = self.factor * self.width;
            self.slope = self.stiffness + (1.0 - (self.x / width).tanh().powi(2)) / width;
            Ok(())
        }

        fn direction(&mut self, _: &f64, _: f64, out: &mut f64) -> Result<(), LinearError> {
            *out = -self.residual / self.slope;
            Ok(())
        }

        fn correction(&mut self, tolerance: f64) -> Result<Correction, LinearError> {
            let size = (self.residual / self.slope).abs();
            Ok(Correction { size, negligible: size <= tolerance })
        }

        fn last_correction(&mut self, _: &f64, out: &mut f64) -> Result<(), LinearError> {
            *out = -self.residual / self.slope;
            Ok(())
        }

        fn advance(&self, from: &f64, direction: &f64, part: f64, out: &mut f64) {
            *out = from + part * direction;
        }

        fn difference(&self, from: &f64, to: &f64, out: &mut f64) {
            *out = to - from;
        }

        fn longest_step(&mut self, _: &f64, _: &f64) -> f64 {
            self.longest
        }

        fn use_definite_matrix(&mut self) -> bool {
            false
        }

        fn stop_requested(&mut self) -> bool {
            false
        }
    }

    impl Turning for Held {
        fn turns(&self) -> bool {
            true
        }

        fn reach(&mut self, _: &f64) -> f64 {
            2.0 / self.stiffness / self.width
        }

        fn widen(&mut self, factor: f64) {
            self.factor = factor;
            self.widths.push(factor);
        }
    }

    fn solve_held(held: &mut Held, guess: f64) -> Result<f64, NewtonFailure> {
        solve_within(held, guess, 15)
    }

    fn solve_within(held: &mut Held, guess: f64, max_iterations: usize) -> Result<f64, NewtonFailure> {
        let mut at = guess;
        let mut work = NewtonWork::new(&at);
        solve(held, &NewtonSettings { max_iterations, ..NewtonSettings::default() }, &mut work, &mut at)?;
        Ok(at)
    }

    #[test]
    fn a_turn_a_billion_times_narrower_than_the_guess_is_off_is_found() {
        // Sticking within the width, where tanh is the load; the guess slides far away.
        let mut held = Held::new(0.5);
        let newton_alone = newton::solve(
            &mut held,
            &NewtonSettings { max_iterations: 15, ..NewtonSettings::default() },
            &mut NewtonWork::new(&0.0),
            &mut 7e2,
        );
        assert!(newton_alone.is_err());
        let found = solve_held(&mut held, 7e2).expect("continuation finds it");
        assert!((found / 1e-9 - 0.5_f64.atanh()).abs() < 1e-6, "{found}");
        assert!(held.factor == 1.0 && (held.widths[0] / 2e12 - 1.0).abs() < 1e-12, "{:?}", held.widths);
        assert!(held.widths.windows(2).all(|pair| pair[1] < pair[0] || pair[1] == 1.0), "{:?}", held.widths);
    }

    #[test]
    fn what_newton_solves_at_once_is_not_led() {
        let mut held = Held::new(0.5);
        solve_held(&mut held, 0.0).expect("Newton's method finds it");
        assert!(held.widths.is_empty());
    }

    #[test]
    fn sliding_solutions_are_found_from_sticking_guesses() {
        let mut held = Held::new(3.0);
        let found = solve_held(&mut held, 1e-12).expect("continuation finds it");
        // The force of friction is one: the spring bears the rest.
        assert!((found - 2.0e3).abs() < 1e-6, "{found}");
    }

    #[test]
    fn a_width_that_is_too_much_is_tried_again_by_the_root_of_its_factor() {
        // Four iterations do not go a power of ten at once, but its root; three need the fourth root.
        for (iterations, factor) in [(4, 10.0_f64.sqrt()), (3, 10.0_f64.sqrt().sqrt())] {
            let mut held = Held::new(0.5);
            solve_within(&mut held, 7e2, iterations).expect("smaller factors lead there");
            let last = held.widths.iter().rev().skip_while(|width| **width < 3.0);
            let last: Vec<f64> = last.take(2).copied().collect();
            assert!((last[1] / last[0] / factor - 1.0).abs() < 1e-9, "{iterations}: {:?}", held.widths);
        }
    }

    #[test]
    fn equations_that_cannot_be_led_keep_the_given_width() {
        let mut held = Held::new(0.5);
        assert!(solve_within(&mut held, 7e2, 2).is_err());
        assert!(held.factor == 1.0 && held.widths.len() > 1);
    }
}
