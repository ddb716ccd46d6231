//! LDL^T checked by residuals, and LU in its place where they are too large.

use flagrs::linear::LinearError;
use flagrs::linear::nearly_symmetric::NearlySymmetric;
use nalgebra::{DMatrix, DVector};

use crate::matrices::{distance, matrix, on_pattern, scrambled, values_on, vector};

const SINGULAR: LinearError = LinearError::Singular { what: "sparse" };
const SIZE: usize = 10;

fn filled(a: &DMatrix<f64>) -> NearlySymmetric {
    let (pattern, values) = on_pattern(a);
    let mut system = NearlySymmetric::new(pattern).expect("a pattern");
    system.values_mut().copy_from_slice(&values);
    system
}

/// A definite matrix and, of relative size `skewness`, a part that is not symmetric.
fn tilted(skewness: f64) -> DMatrix<f64> {
    let scrambled = scrambled(SIZE);
    let symmetric = &scrambled + scrambled.transpose() + DMatrix::identity(SIZE, SIZE) * 20.0;
    symmetric + (&scrambled - scrambled.transpose()) * (10.0 * skewness)
}

/// The ways to solve: checked, refined, roughly.
type Way = fn(&mut NearlySymmetric, &[f64], &mut [f64]) -> Result<(), LinearError>;

const CHECKED: Way = NearlySymmetric::solve_checked;
const REFINED: Way = NearlySymmetric::solve_refined;
const ROUGHLY: Way = NearlySymmetric::solve_roughly;

/// The error of a solution relative to the exact one.
fn error_of(a: &DMatrix<f64>, nearly_symmetric: bool, way: Way) -> Result<f64, LinearError> {
    let exact = vector(a.nrows());
    let mut system = filled(a);
    system.factor(nearly_symmetric)?;
    let mut x = vec![f64::NAN; a.nrows()];
    way(&mut system, (a * &exact).as_slice(), &mut x)?;
    Ok(distance(&x, &exact))
}

#[test]
fn a_symmetric_system_is_solved_to_round_off_in_every_way() {
    for way in [CHECKED, REFINED, ROUGHLY] {
        assert!(error_of(&tilted(0.0), true, way).expect("a definite matrix") < 1e-14);
    }
}

#[test]
fn refinement_takes_the_square_of_the_asymmetry_out_of_the_error() {
    let errors = |way: Way| [1e-4, 1e-5].map(|skewness| error_of(&tilted(skewness), true, way).expect("a solution"));
    let (checked, refined) = (errors(CHECKED), errors(REFINED));
    // The lower triangle is not read: without refinement the error goes with the asymmetry, with it as its square.
    assert!((5.0..20.0).contains(&(checked[0] / checked[1])), "{checked:?}");
    assert!((50.0..200.0).contains(&(refined[0] / refined[1])), "{refined:?}");
    assert!(refined[0] < 1e-2 * checked[0] && checked[0] > 1e-6);
}

#[test]
fn a_system_that_is_not_nearly_symmetric_is_pivoted_whatever_was_said() {
    for skewness in [0.3, 3.0] {
        for way in [CHECKED, REFINED] {
            assert!(error_of(&tilted(skewness), true, way).expect("a solution") < 1e-13);
        }
        assert!(error_of(&tilted(skewness), true, ROUGHLY).expect("a solution") < 2e-3);
    }
    assert!(error_of(&tilted(3.0), false, CHECKED).expect("a solution") < 1e-13);
    // Unasked for, the asymmetry of a thousandth is passed over; it is not if the caller says that it counts.
    assert!(error_of(&tilted(1e-4), false, CHECKED).expect("a solution") < 1e-14);
}

#[test]
fn a_rough_solution_is_refined_before_the_matrix_is_pivoted() {
    // The residual of the first solution is above what is trusted, and that of the refined one is below.
    let error = error_of(&tilted(3e-3), true, ROUGHLY).expect("a solution");
    assert!((1e-7..1e-3).contains(&error), "{error}");
    assert!(error_of(&tilted(3e-3), true, CHECKED).expect("a solution") < 1e-13);
}

#[test]
fn indefinite_systems_whose_pivots_vanish_or_nearly_do_are_pivoted() {
    for corner in [0.0, 1e-18, -1e-18] {
        let large = matrix(&[&[corner, 1.0, 0.0], &[1.0, 0.0, 2.0], &[0.0, 2.0, 3.0]]);
        for a in [large, matrix(&[&[corner, 1.0], &[1.0, corner]])] {
            for way in [CHECKED, REFINED, ROUGHLY] {
                let error = error_of(&a, true, way).expect("a regular matrix");
                assert!(error < 1e-12, "{corner}: {error}");
            }
        }
    }
}

#[test]
fn digits_lost_to_a_small_pivot_come_back_by_refinement() {
    // A pivot of 1e-13 costs thirteen digits: what is left passes the check, and one refinement squares the error.
    let a = matrix(&[&[1e-13, 1.0], &[1.0, 1e-13]]);
    let checked = error_of(&a, true, CHECKED).expect("a regular matrix");
    assert!((1e-6..1e-3).contains(&checked), "{checked}");
    assert!(error_of(&a, true, REFINED).expect("a regular matrix") < 10.0 * checked * checked);
}

#[test]
fn unknowns_of_any_scale_are_solved() {
    // Positions in metres beside angles: rows and columns scaled alike over twelve decades.
    let scales = DMatrix::from_diagonal(&DVector::from_fn(SIZE, |i, _| 10_f64.powi(3 * (i as i32 % 5) - 6)));
    let a = &scales * tilted(0.0) * &scales;
    let exact = scales.try_inverse().expect("scales") * vector(SIZE);
    let rhs = &a * &exact;
    let mut system = filled(&a);
    system.factor(true).expect("a definite matrix");
    let mut x = vec![0.0; SIZE];
    system.solve_refined(rhs.as_slice(), &mut x).expect("a solution");
    for (found, expected) in x.iter().zip(&exact) {
        assert!((found / expected - 1.0).abs() < 1e-12, "{found}, not {expected}");
    }
}

#[test]
fn singular_systems_are_refused_in_every_way() {
    let rank_one = matrix(&[&[1.0, 1.0], &[1.0, 1.0]]);
    for way in [CHECKED, REFINED, ROUGHLY] {
        for nearly_symmetric in [true, false] {
            assert_eq!(error_of(&rank_one, nearly_symmetric, way), Err(SINGULAR));
        }
    }
    let mut system = filled(&tilted(0.0));
    system.values_mut()[3] = f64::NAN;
    assert_eq!(system.factor(true), Err(SINGULAR));
}

#[test]
fn a_matrix_that_was_pivoted_once_is_not_for_ever() {
    let exchange = matrix(&[&[0.0, 1.0], &[1.0, 0.0]]);
    let mut system = filled(&exchange);
    let mut x = vec![0.0; 2];
    system.factor(true).expect("a regular matrix");
    system.solve_checked(&[3.0, 5.0], &mut x).expect("factors");
    assert_eq!(x, [5.0, 3.0]);
    // A lower triangle that LDL^T does not read tells which factors are used.
    let (pattern, _) = on_pattern(&exchange);
    let values = values_on(&pattern, &matrix(&[&[2.0, 0.0], &[1e-3, 4.0]]));
    system.values_mut().copy_from_slice(&values);
    system.factor(true).expect("a definite upper triangle");
    let mut x = vec![4.0, 8.0];
    system.solve(&mut x).expect("factors");
    assert_eq!(x, [2.0, 2.0]);
}
