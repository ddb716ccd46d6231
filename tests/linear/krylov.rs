//! GMRES: exact after as many steps as theory says, smallest in its Krylov space, and honest about what it reached.

use flagrs::linear::LinearError;
use flagrs::linear::krylov::{Gmres, LinearOperator};
use nalgebra::{DMatrix, DVector};

use crate::matrices::{distance, matrix, scrambled, vector};

/// A dense matrix and a preconditioner's inverse, known only by their products.
struct Products {
    matrix: DMatrix<f64>,
    preconditioner: DMatrix<f64>,
    /// Products that succeed before the caller wants to stop.
    allowed: usize,
}

impl Products {
    fn plain(matrix: DMatrix<f64>) -> Self {
        let size = matrix.nrows();
        Self { matrix, preconditioner: DMatrix::identity(size, size), allowed: usize::MAX }
    }

    fn with(matrix: DMatrix<f64>, preconditioner: DMatrix<f64>) -> Self {
        Self { preconditioner, ..Self::plain(matrix) }
    }

    /// `|rhs - A x| / |rhs|`.
    fn residual(&self, rhs: &DVector<f64>, x: &[f64]) -> f64 {
        (rhs - &self.matrix * DVector::from_column_slice(x)).norm() / rhs.norm()
    }
}

impl LinearOperator for Products {
    fn apply(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), LinearError> {
        if self.allowed == 0 {
            return Err(LinearError::Interrupted);
        }
        self.allowed -= 1;
        out.copy_from_slice((&self.matrix * DVector::from_column_slice(x)).as_slice());
        Ok(())
    }

    fn precondition(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        let product = &self.preconditioner * DVector::from_column_slice(x);
        x.copy_from_slice(product.as_slice());
        Ok(())
    }
}

/// Solves, and returns the outcome with the iterate.
fn solve(
    operator: &mut Products,
    rhs: &DVector<f64>,
    limit: usize,
    tolerance: f64,
) -> (Result<usize, LinearError>, Vec<f64>) {
    let mut x = vec![f64::NAN; rhs.len()];
    let outcome = Gmres::new(rhs.len(), limit).solve(operator, rhs.as_slice(), &mut x, tolerance);
    (outcome, x)
}

/// The permutation that moves every entry to the next place: GMRES gains nothing until the last step.
fn shift(size: usize) -> DMatrix<f64> {
    DMatrix::from_fn(size, size, |i, j| if i == (j + 1) % size { 1.0 } else { 0.0 })
}

/// A system of 12 equations that takes GMRES many steps.
fn slow() -> DMatrix<f64> {
    scrambled(12) + DMatrix::identity(12, 12) * 2.0
}

#[test]
fn an_unsymmetric_system_is_solved_in_as_many_steps_as_it_has_rows() {
    let a = matrix(&[&[4.0, 1.0, -2.0, 0.5], &[0.0, 3.0, 1.0, -1.0], &[2.0, -1.0, 5.0, 0.0], &[1.0, 0.0, -3.0, 2.0]]);
    let exact = DVector::from_column_slice(&[1.0, -2.0, 3.0, 0.25]);
    let rhs = &a * &exact;
    let (iterations, x) = solve(&mut Products::plain(a), &rhs, 4, 1e-13);
    assert_eq!(iterations, Ok(4));
    assert!(distance(&x, &exact) < 1e-12, "{x:?}");
}

#[test]
fn as_many_steps_are_made_as_there_are_distinct_eigenvalues() {
    // Similar to a diagonal matrix with three distinct entries: its minimal polynomial is of degree three.
    let basis = DMatrix::identity(9, 9) + scrambled(9) * 0.1;
    let diagonal = DMatrix::from_diagonal(&DVector::from_fn(9, |i, _| [1.0, -2.0, 5.0][i % 3]));
    let a = &basis * diagonal * basis.clone().try_inverse().expect("close to the identity");
    let exact = vector(9);
    let rhs = &a * &exact;
    let (iterations, x) = solve(&mut Products::plain(a), &rhs, 9, 1e-12);
    assert_eq!(iterations, Ok(3));
    assert!(distance(&x, &exact) < 1e-11);
}

#[test]
fn a_cyclic_shift_is_solved_in_the_last_step_and_not_before() {
    let rhs = DVector::from_fn(6, |i, _| if i == 0 { 3.0 } else { 0.0 });
    let (outcome, x) = solve(&mut Products::plain(shift(6)), &rhs, 5, 1e-10);
    assert_eq!(outcome, Err(LinearError::Krylov { residual: 1.0, iterations: 5 }));
    assert!(x.iter().all(|value| *value == 0.0), "{x:?}");
    let (outcome, x) = solve(&mut Products::plain(shift(6)), &rhs, 6, 1e-10);
    assert_eq!((outcome, x), (Ok(6), vec![0.0, 0.0, 0.0, 0.0, 0.0, 3.0]));
}

#[test]
fn the_best_iterate_of_its_krylov_space_is_left_when_the_limit_is_reached() {
    let preconditioner = DMatrix::identity(12, 12) * 0.4 + scrambled(12).transpose() * 0.05;
    let mut operator = Products::with(slow(), preconditioner.clone());
    let rhs = vector(12);
    for limit in 1..8 {
        let (outcome, x) = solve(&mut operator, &rhs, limit, 1e-12);
        let Err(LinearError::Krylov { residual, iterations }) = outcome else { panic!("{outcome:?}") };
        assert_eq!(iterations, limit);
        let left = &rhs - &operator.matrix * DVector::from_column_slice(&x);
        assert!((residual - left.norm() / rhs.norm()).abs() < 1e-13, "told {residual}, left {}", left.norm());
        // What is left is normal to A P^-1 K, so nothing in the space P^-1 K would leave less.
        let mut direction = rhs.clone();
        for _ in 0..limit {
            direction = (&operator.matrix * (&preconditioner * direction)).normalize();
            assert!(left.dot(&direction).abs() < 1e-11 * rhs.norm(), "limit {limit}: {}", left.dot(&direction));
        }
    }
}

#[test]
fn a_tolerance_is_kept_with_the_fewest_steps_that_keep_it() {
    let mut operator = Products::plain(slow());
    let rhs = vector(12);
    for exponent in 1..12 {
        let tolerance = 10_f64.powi(-exponent);
        let (outcome, x) = solve(&mut operator, &rhs, 12, tolerance);
        let iterations = outcome.expect("twelve steps solve twelve equations");
        assert!(operator.residual(&rhs, &x) <= tolerance * (1.0 + 1e-3));
        let (fewer, _) = solve(&mut operator, &rhs, iterations - 1, tolerance);
        assert!(matches!(fewer, Err(LinearError::Krylov { residual, .. }) if residual > tolerance), "{fewer:?}");
    }
}

#[test]
fn an_exact_preconditioner_leaves_one_step() {
    let a = slow();
    let inverse = a.clone().try_inverse().expect("a regular matrix");
    let exact = vector(12);
    let rhs = &a * &exact;
    let (iterations, x) = solve(&mut Products::with(a, inverse), &rhs, 12, 1e-12);
    assert_eq!(iterations, Ok(1));
    assert!(distance(&x, &exact) < 1e-12);
}

#[test]
fn a_preconditioner_changes_neither_the_solution_nor_what_the_tolerance_measures() {
    // Scales the unknowns over six decades: a residual measured after it would be off by as much.
    let scales = DMatrix::from_diagonal(&DVector::from_fn(12, |i, _| 10_f64.powi(i as i32 % 7 - 3)));
    let a = slow();
    let exact = vector(12);
    let rhs = &a * &exact;
    let mut operator = Products::with(a, scales);
    for tolerance in [1e-3, 1e-6] {
        let (outcome, x) = solve(&mut operator, &rhs, 12, tolerance);
        assert!(outcome.is_ok() && operator.residual(&rhs, &x) <= tolerance * (1.0 + 1e-3), "{outcome:?}");
    }
    let (_, x) = solve(&mut operator, &rhs, 12, 1e-13);
    assert!(distance(&x, &exact) < 1e-9, "{}", distance(&x, &exact));
}

#[test]
fn a_right_hand_side_in_an_invariant_space_ends_the_iteration_early() {
    let a = matrix(&[&[2.0, 1.0, 0.0], &[0.0, 2.0, 0.0], &[1.0, 4.0, -3.0]]);
    // An eigenvector of the last column's block.
    let rhs = DVector::from_column_slice(&[0.0, 0.0, 6.0]);
    let (outcome, x) = solve(&mut Products::plain(a), &rhs, 3, 1e-14);
    assert_eq!((outcome, x), (Ok(1), vec![0.0, 0.0, -2.0]));
}

#[test]
fn a_singular_system_is_solved_if_it_can_be_and_refused_if_not() {
    let projection = matrix(&[&[1.0, 0.0], &[0.0, 0.0]]);
    let (outcome, x) =
        solve(&mut Products::plain(projection.clone()), &DVector::from_column_slice(&[3.0, 0.0]), 2, 1e-12);
    assert_eq!((outcome, x), (Ok(1), vec![3.0, 0.0]));
    // A turned projection, so that nothing is exactly zero: half of the right-hand side is out of reach.
    for angle in [0.0, 0.3, 1.0, 2.2] {
        let (sine, cosine) = f64::sin_cos(angle);
        let turn = matrix(&[&[cosine, -sine], &[sine, cosine]]);
        let mut operator = Products::plain(&turn * &projection * turn.transpose());
        let rhs = &turn * DVector::from_column_slice(&[1.0, 1.0]);
        let (outcome, x) = solve(&mut operator, &rhs, 2, 1e-10);
        let Err(LinearError::Krylov { residual, .. }) = outcome else { panic!("{angle}: {outcome:?} {x:?}") };
        assert!((residual - 0.5_f64.sqrt()).abs() < 1e-12, "{residual} at {angle}");
        assert!((operator.residual(&rhs, &x) - residual).abs() < 1e-12 && x.iter().all(|value| value.abs() < 10.0));
    }
    let (outcome, x) = solve(&mut Products::plain(DMatrix::zeros(3, 3)), &vector(3), 3, 1e-10);
    assert!(matches!(outcome, Err(LinearError::Krylov { residual: 1.0, .. })), "{outcome:?}");
    assert_eq!(x, vec![0.0; 3]);
}

#[test]
fn nothing_that_is_not_finite_is_returned() {
    let rhs = vector(4);
    let mut broken = scrambled(4);
    broken[(2, 1)] = f64::NAN;
    let singular = LinearError::Singular { what: "Newton" };
    assert_eq!(solve(&mut Products::plain(broken), &rhs, 4, 1e-9).0, Err(singular.clone()));
    let mut bad = rhs.clone();
    bad[3] = f64::INFINITY;
    assert_eq!(solve(&mut Products::plain(scrambled(4)), &bad, 4, 1e-9).0, Err(singular));
}

#[test]
fn no_force_needs_no_product() {
    let mut operator = Products { allowed: 0, ..Products::plain(scrambled(4)) };
    assert_eq!(solve(&mut operator, &DVector::zeros(4), 4, 1e-9), (Ok(0), vec![0.0; 4]));
}

#[test]
fn an_error_of_the_operator_is_handed_on() {
    let mut operator = Products { allowed: 2, ..Products::plain(slow()) };
    assert_eq!(solve(&mut operator, &vector(12), 12, 1e-12).0, Err(LinearError::Interrupted));
}

#[test]
fn a_workspace_that_was_used_before_gives_the_same_bits() {
    let mut gmres = Gmres::new(12, 12);
    let mut run = |rhs: &DVector<f64>| {
        let mut x = vec![0.0; 12];
        gmres.solve(&mut Products::plain(slow()), rhs.as_slice(), &mut x, 1e-9).expect("a regular system");
        x
    };
    let first = run(&vector(12));
    run(&(vector(12) * -1e9));
    assert_eq!(run(&vector(12)), first);
}
