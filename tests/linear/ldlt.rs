//! LDL^T without pivoting: exact where it exists, an error where not.

use flagrs::linear::LinearError;
use flagrs::linear::ldlt::SparseLdlt;
use nalgebra::{DMatrix, DVector};

use crate::matrices::{distance, matrix, on_pattern, scrambled, values_on, vector};

const SINGULAR: LinearError = LinearError::Singular { what: "sparse" };

fn solve(a: &DMatrix<f64>, rhs: &DVector<f64>) -> Result<Vec<f64>, LinearError> {
    let (pattern, values) = on_pattern(a);
    let mut ldlt = SparseLdlt::new(&pattern)?;
    ldlt.factor(&pattern, &values)?;
    let mut x = rhs.as_slice().to_vec();
    ldlt.solve(&mut x)?;
    Ok(x)
}

/// A chain of springs, held at its first end.
fn chain(size: usize) -> DMatrix<f64> {
    DMatrix::from_fn(size, size, |i, j| match i.abs_diff(j) {
        0 => 2.0,
        1 => -1.0,
        _ => 0.0,
    })
}

#[test]
fn a_chain_of_springs_sags_along_the_known_parabola() {
    // -u'' = 1 between fixed ends, on a unit mesh: u_k = (k + 1) (n - k) / 2.
    let size = 20;
    let expected = DVector::from_fn(size, |k, _| 0.5 * (k as f64 + 1.0) * (size - k) as f64);
    let x = solve(&chain(size), &DVector::from_element(size, 1.0)).expect("a definite matrix");
    assert!(distance(&x, &expected) < 1e-13);
}

#[test]
fn an_indefinite_matrix_with_pivots_is_solved_as_well() {
    // Positive and negative blocks, as of a saddle: any order of elimination has pivots.
    let mut a = DMatrix::zeros(8, 8);
    let coupling = scrambled(4);
    for i in 0..4 {
        (a[(i, i)], a[(i + 4, i + 4)]) = (3.0, -2.0);
        for j in 0..4 {
            (a[(i, j + 4)], a[(j + 4, i)]) = (coupling[(i, j)], coupling[(i, j)]);
        }
    }
    let exact = vector(8);
    let x = solve(&a, &(&a * &exact)).expect("a quasi-definite matrix");
    assert!(distance(&x, &exact) < 1e-13);
}

#[test]
fn only_the_upper_triangle_is_read() {
    let mut a = chain(6);
    let exact = vector(6);
    let rhs = &a * &exact;
    a[(3, 2)] = 1e9;
    let x = solve(&a, &rhs).expect("a definite upper triangle");
    assert!(distance(&x, &exact) < 1e-13);
}

#[test]
fn a_matrix_without_pivots_is_refused() {
    let exchange = matrix(&[&[0.0, 1.0], &[1.0, 0.0]]);
    assert_eq!(solve(&exchange, &vector(2)), Err(SINGULAR));
    let rank_one = matrix(&[&[1.0, 1.0], &[1.0, 1.0]]);
    assert_eq!(solve(&rank_one, &vector(2)), Err(SINGULAR));
}

#[test]
fn a_matrix_that_is_not_finite_is_refused_and_spoils_nothing() {
    let (pattern, values) = on_pattern(&chain(4));
    let mut ldlt = SparseLdlt::new(&pattern).expect("a pattern");
    assert_eq!(ldlt.solve(&mut [1.0; 4]), Err(SINGULAR), "solved before it was factored");
    ldlt.factor(&pattern, &values).expect("a definite matrix");
    let mut bad = values.clone();
    bad[1] = f64::NAN;
    assert_eq!(ldlt.factor(&pattern, &bad), Err(SINGULAR));
    assert_eq!(ldlt.solve(&mut [1.0; 4]), Err(SINGULAR), "solved with factors of another matrix");
    let stiffer = values_on(&pattern, &(chain(4) * 2.0));
    ldlt.factor(&pattern, &stiffer).expect("a definite matrix");
    let mut x = [1.0; 4];
    ldlt.solve(&mut x).expect("a factored matrix");
    assert!(distance(&x, &DVector::from_column_slice(&[1.0, 1.5, 1.5, 1.0])) < 1e-14);
}
