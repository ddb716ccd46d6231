//! Newton's method on equations of one or two unknowns with known answers.

use super::super::equations::{Correction, Obstacle};
use super::*;
use nalgebra::{Matrix2, Vector2};

type Function = fn(&Vector2<f64>) -> Vector2<f64>;
type Slope = fn(&Vector2<f64>) -> Matrix2<f64>;

/// Two equations of two unknowns and what may be in their way.
struct Toy {
    function: Function,
    slope: Slope,
    /// Residual that counts as solved.
    target: f64,
    at: Vector2<f64>,
    residual: Vector2<f64>,
    matrix: Matrix2<f64>,
    /// The matrix that stands in where directions are to lead downhill.
    definite: Option<Matrix2<f64>>,
    is_definite: bool,
    longest: f64,
    /// Whether points with a negative first unknown have no residual.
    positive: bool,
    stop_after: usize,
    /// Whether the correction that was measured last may be made.
    polishes: bool,
    evaluations: usize,
    linearizations: usize,
    tolerances: Vec<f64>,
}

impl Toy {
    fn new(function: Function, slope: Slope) -> Self {
        Self {
            function,
            slope,
            target: 1e-10,
            at: Vector2::zeros(),
            residual: Vector2::zeros(),
            matrix: Matrix2::zeros(),
            definite: None,
            is_definite: false,
            longest: 1.0,
            positive: false,
            stop_after: usize::MAX,
            polishes: true,
            evaluations: 0,
            linearizations: 0,
            tolerances: Vec::new(),
        }
    }

    fn solve(&mut self, goal: Goal, from: [f64; 2]) -> Result<Vector2<f64>, NewtonFailure> {
        let mut at = Vector2::from(from);
        let mut work = NewtonWork::new(&at);
        let settings = NewtonSettings { goal, ..NewtonSettings::default() };
        solve(self, &settings, &mut work, &mut at).map(|()| at)
    }

    fn step(&self) -> Option<Vector2<f64>> {
        self.matrix.try_inverse().map(|inverse| -(inverse * self.residual))
    }
}

const SINGULAR: LinearError = LinearError::Singular { what: "toy" };

impl Equations for Toy {
    type Point = Vector2<f64>;

    fn aim(&mut self, goal: Goal, _: &Self::Point) {
        if let Goal::Residual(target) = goal {
            self.target = target;
        }
    }

    fn evaluate(&mut self, at: &Self::Point) -> Option<Size> {
        self.evaluations += 1;
        self.at = *at;
        self.residual = (self.function)(at);
        let (norm, worst) = (self.residual.amax(), self.residual.iamax());
        let size = Size { norm, excess: norm / self.target, merit: self.residual.norm(), worst };
        Some(size).filter(|_| !(self.positive && at.x < 0.0))
    }

    fn place(&mut self, at: &Self::Point) -> bool {
        self.at = *at;
        true
    }

    fn obstacle(&self, at: &Self::Point) -> Obstacle {
        Obstacle { place: Some(0), reason: format!("{} is negative", at.x) }
    }

    fn weigh(&mut self) -> f64 {
        self.residual.norm()
    }

    fn linearize(&mut self, _: &Self::Point) -> Result<(), LinearError> {
        self.linearizations += 1;
        self.matrix = (self.slope)(&self.at);
        if let Some(definite) = self.definite.filter(|_| self.is_definite) {
            self.matrix = definite;
        }
        if self.matrix.determinant() == 0.0 { Err(SINGULAR) } else { Ok(()) }
    }

    fn direction(&mut self, _: &Self::Point, tolerance: f64, out: &mut Self::Point) -> Result<(), LinearError> {
        self.tolerances.push(tolerance);
        *out = self.step().ok_or(SINGULAR)?;
        Ok(())
    }

    fn correction(&mut self, tolerance: f64) -> Result<Correction, LinearError> {
        let size = self.step().ok_or(SINGULAR)?.amax();
        Ok(Correction { size, negligible: size <= tolerance })
    }

    fn last_correction(&mut self, _: &Self::Point, out: &mut Self::Point) -> Result<(), LinearError> {
        *out = self.step().filter(|_| self.polishes).ok_or(SINGULAR)?;
        Ok(())
    }

    fn advance(&self, from: &Self::Point, direction: &Self::Point, part: f64, out: &mut Self::Point) {
        *out = from + direction * part;
    }

    fn difference(&self, from: &Self::Point, to: &Self::Point, out: &mut Self::Point) {
        *out = to - from;
    }

    fn longest_step(&mut self, _: &Self::Point, _: &Self::Point) -> f64 {
        self.longest
    }

    fn use_definite_matrix(&mut self) -> bool {
        let new = self.definite.is_some() && !self.is_definite;
        self.is_definite |= new;
        new
    }

    fn stop_requested(&mut self) -> bool {
        self.linearizations >= self.stop_after
    }
}

/// A valley along a parabola, with its root at (1, 1).
fn rosenbrock() -> Toy {
    Toy::new(|x| Vector2::new(10.0 * (x.y - x.x * x.x), 1.0 - x.x), |x| Matrix2::new(-20.0 * x.x, 10.0, -1.0, 0.0))
}

/// `arctan x`: from far away, full steps go ever farther.
fn arctan() -> Toy {
    Toy::new(|x| Vector2::new(x.x.atan(), x.y), |x| Matrix2::new(1.0 / (1.0 + x.x * x.x), 0.0, 0.0, 1.0))
}

/// `x^2 + c` beside a second unknown that is solved.
fn parabola() -> Toy {
    Toy::new(|x| Vector2::new(x.x * x.x + 1.0, x.y), |x| Matrix2::new(2.0 * x.x, 0.0, 0.0, 1.0))
}

const GOALS: [Goal; 2] = [Goal::Residual(1e-10), Goal::Correction(1e-7)];

#[test]
fn both_goals_find_the_root_of_a_curved_valley() {
    for goal in GOALS {
        let found = rosenbrock().solve(goal, [-1.2, 1.0]).expect("there is a root");
        assert!((found - Vector2::new(1.0, 1.0)).amax() < 1e-9, "{goal:?}: {found}");
    }
}

#[test]
fn steps_that_would_overshoot_are_cut() {
    // Full steps alone go ever farther from beyond 1.39.
    for (goal, start) in GOALS.into_iter().zip([20.0, 1.8]) {
        let found = arctan().solve(goal, [start, 3.0]).expect("there is a root");
        assert!(found.amax() < 1e-9, "{goal:?}: {found}");
    }
}

#[test]
fn convergence_is_quadratic() {
    let mut cubic =
        Toy::new(|x| Vector2::new(x.x.powi(3) - 2.0, x.y), |x| Matrix2::new(3.0 * x.x * x.x, 0.0, 0.0, 1.0));
    let found = cubic.solve(Goal::Residual(1e-14), [1.5, 0.0]).expect("there is a root");
    assert!((found.x - 2.0_f64.cbrt()).abs() < 1e-15);
    // Errors from 0.24: 4e-2, 1e-3, 1e-6, 1e-12, 1e-24.
    assert!(cubic.linearizations <= 5, "{}", cubic.linearizations);
}

#[test]
fn equations_without_a_root_end_at_the_foot_of_the_slope() {
    for (goal, reason) in GOALS.into_iter().zip(["no lower residual", "no smaller correction"]) {
        let failure = parabola().solve(goal, [0.7, 0.0]).expect_err("there is no root");
        let stuck = failure.reason.contains(reason) || failure.reason == "too many iterations";
        assert!(stuck && failure.residual >= 1.0 && failure.worst == Some(0), "{goal:?}: {failure:?}");
    }
}

#[test]
fn a_singular_derivative_is_told() {
    for goal in GOALS {
        let failure = parabola().solve(goal, [0.0, 1.0]).expect_err("the slope vanishes");
        assert_eq!((failure.iterations, failure.reason), (0, SINGULAR.to_string()), "{goal:?}");
    }
}

#[test]
fn a_guess_that_is_no_point_is_told_with_its_obstacle() {
    for goal in GOALS {
        let mut toy = Toy { positive: true, ..arctan() };
        let failure = toy.solve(goal, [-1.0, 0.0]).expect_err("there is no residual");
        assert_eq!((failure.worst, failure.reason.as_str()), (Some(0), "-1 is negative"), "{goal:?}");
        assert!(failure.residual.is_nan() && toy.linearizations == 0);
    }
}

#[test]
fn trials_without_a_residual_are_backed_off_from() {
    for goal in GOALS {
        // The full step from 1.2 leads to -0.94.
        let mut toy = Toy { positive: true, polishes: false, ..arctan() };
        let found = toy.solve(goal, [1.2, 0.0]).expect("shorter steps lead to the root");
        assert!((0.0..1e-6).contains(&found.x), "{goal:?}: {found}");
    }
}

#[test]
fn a_line_search_that_meets_no_point_says_why() {
    for goal in GOALS {
        // Every step from the edge of what is allowed leads beyond it.
        let mut toy = Toy { positive: true, ..Toy::new(|x| x.add_scalar(1.0), |_| Matrix2::identity()) };
        let failure = toy.solve(goal, [0.0, 0.0]).expect_err("no shorter step is allowed either");
        assert!(
            failure.reason.starts_with("the line search") && failure.reason.ends_with("is negative"),
            "{failure:?}"
        );
    }
}

#[test]
fn whoever_wants_to_stop_is_heard_at_every_iteration() {
    for goal in GOALS {
        for stop_after in 0..2 {
            let mut toy = Toy { stop_after, ..rosenbrock() };
            let failure = toy.solve(goal, [-1.2, 1.0]).expect_err("it was stopped");
            assert_eq!((failure.iterations, failure.reason.as_str()), (stop_after, "interrupted"), "{goal:?}");
            assert_eq!(toy.linearizations, stop_after);
        }
    }
}

#[test]
fn no_step_is_longer_than_is_allowed() {
    for goal in GOALS {
        let mut toy = Toy { longest: 0.5, polishes: false, ..Toy::new(|x| *x, |_| Matrix2::identity()) };
        toy.solve(goal, [1.0, 0.0]).expect("halves add up");
        let halvings = match goal {
            Goal::Residual(target) => (1.0 / target).log2().ceil(),
            Goal::Correction(tolerance) => (1.0 / tolerance).log2().ceil(),
        };
        assert_eq!(toy.linearizations, halvings as usize, "{goal:?}");
    }
}

#[test]
fn linear_systems_are_solved_as_well_as_the_next_iterate_needs() {
    // A residual of 1 on the way to a target, solved at once: a tenth of what is left, within bounds.
    for (target, expected) in [(0.5, 1e-2), (1e-1, 1e-2), (1e-3, 1e-4), (2e-5, 2e-6), (1e-12, 1e-6)] {
        let mut toy = Toy::new(|x| *x, |_| Matrix2::identity());
        toy.solve(Goal::Residual(target), [1.0, 0.0]).expect("it is linear");
        assert!((toy.tolerances[0] / expected - 1.0).abs() < 1e-12, "{target}: {:?}", toy.tolerances);
        let mut toy = Toy::new(|x| *x, |_| Matrix2::identity());
        toy.solve(Goal::Correction(target), [1.0, 0.0]).expect("it is linear");
        // A correction may be found more roughly than a residual.
        let expected = if target == 0.5 { 5e-2 } else { expected };
        assert!((toy.tolerances[0] / expected - 1.0).abs() < 1e-12, "{target}: {:?}", toy.tolerances);
    }
    let mut toy = Toy::new(|x| *x, |_| Matrix2::identity());
    toy.solve(Goal::Correction(0.9), [0.95, 0.0]).expect("it is linear");
    assert!((toy.tolerances[0] - 0.1 * 0.9 / 0.95).abs() < 1e-12, "{:?}", toy.tolerances);
}

#[test]
fn a_residual_that_no_longer_falls_is_accepted_near_its_target_only() {
    // Round-off of one part in a thousand.
    let rough = || Toy::new(|x| x.map(|x| (x * 1e3).round() * 1e-3 + 3e-4), |_| Matrix2::identity());
    let mut near = rough();
    let found = near.solve(Goal::Residual(1e-5), [1.0, 0.0]).expect("3e-4 is within a hundred targets");
    assert_eq!(near.at, found, "the equations are left at the solution");
    let failure = rough().solve(Goal::Residual(1e-6), [1.0, 0.0]).expect_err("3e-4 is not");
    assert!(failure.reason.contains("no lower residual"));
}

#[test]
fn a_residual_that_stays_as_it_is_is_no_progress() {
    let mut toy = Toy::new(|_| Vector2::new(1.0, 0.0), |_| Matrix2::identity());
    let failure = toy.solve(Goal::Residual(1e-10), [0.0, 0.0]).expect_err("nothing changes");
    assert_eq!((failure.iterations, failure.reason.as_str()), (0, "the line search found no lower residual"));
}

#[test]
fn a_matrix_that_leads_uphill_is_replaced_by_the_definite_one() {
    for goal in GOALS {
        // The derivative's sign is wrong: every direction leads away.
        let wrong = || Toy::new(|x| *x, |_| -Matrix2::identity());
        assert!(wrong().solve(goal, [1.0, 0.0]).is_err(), "{goal:?}");
        let mut toy = Toy { definite: Some(Matrix2::identity()), ..wrong() };
        toy.solve(goal, [1.0, 0.0]).expect("the definite matrix leads downhill");
        assert!(toy.is_definite && toy.residual.amax() < 1e-7);
    }
}

#[test]
fn the_first_full_steps_may_go_uphill_but_by_little() {
    // With the slope of the start, the correction of the full step is `factor` times the first one.
    fn bent(factor: f64) -> Vector2<f64> {
        Vector2::new(factor, 0.0)
    }
    let by_half: Function = |x| {
        if x.x > 0.5 {
            *x
        } else if x.x > -0.5 {
            bent(1.5)
        } else {
            x - bent(-1.5)
        }
    };
    let by_double: Function = |x| {
        if x.x > 0.5 {
            *x
        } else if x.x > -2.0 {
            bent(2.5)
        } else {
            x - bent(-2.5)
        }
    };
    let mut uphill = Toy::new(by_half, |_| Matrix2::identity());
    let found = uphill.solve(Goal::Correction(1e-7), [1.0, 0.0]).expect("the second step leads to the root");
    assert_eq!(found.x, -1.5);
    assert_eq!((uphill.linearizations, uphill.evaluations), (2, 3));
    assert!(Toy::new(by_double, |_| Matrix2::identity()).solve(Goal::Correction(1e-7), [1.0, 0.0]).is_err());
}

#[test]
fn the_correction_that_is_left_is_made_if_it_can_be() {
    // The third iterate is off by 4e-6, and its correction leaves 1e-9 of that.
    for (polishes, left) in [(true, 0.0..1e-8), (false, 1e-7..1e-4)] {
        let mut toy = Toy { polishes, ..arctan() };
        let found = toy.solve(Goal::Correction(1e-2), [0.3, 0.0]).expect("there is a root");
        assert!(left.contains(&found.x.abs()), "{polishes}: {found}");
        assert_eq!(toy.at, found);
    }
    // Where the whole way may not be gone, it is left.
    let mut blocked = Toy { longest: 0.999, ..Toy::new(|x| *x, |_| Matrix2::identity()) };
    let found = blocked.solve(Goal::Correction(1e-2), [1.0, 0.0]).expect("there is a root");
    assert!((found.x - 1e-3).abs() < 1e-12 && blocked.at == found, "{found}");
}
