//! Sparse LU with pivoting: unsymmetric and badly scaled systems, and errors where a matrix is singular.

use flagrs::linear::LinearError;
use flagrs::linear::sparse::SparseLu;
use nalgebra::{DMatrix, DVector};

use crate::matrices::{distance, matrix, on_pattern, scrambled, vector};

const SINGULAR: LinearError = LinearError::Singular { what: "sparse" };

fn solve(a: &DMatrix<f64>, rhs: &DVector<f64>) -> Result<Vec<f64>, LinearError> {
    let (pattern, values) = on_pattern(a);
    let mut lu = SparseLu::new(&pattern)?;
    lu.factor(&pattern, &values)?;
    let mut x = rhs.as_slice().to_vec();
    lu.solve(&mut x)?;
    Ok(x)
}

#[test]
fn upwind_transport_has_the_known_solution() {
    // u_k - u_(k-1) = 1 from u_(-1) = 0: u_k = k + 1. Its transpose runs the other way.
    let size = 15;
    let a = DMatrix::from_fn(size, size, |i, j| {
        if i == j {
            1.0
        } else if i == j + 1 {
            -1.0
        } else {
            0.0
        }
    });
    let ones = DVector::from_element(size, 1.0);
    let x = solve(&a, &ones).expect("a triangular matrix");
    assert!(distance(&x, &DVector::from_fn(size, |k, _| k as f64 + 1.0)) < 1e-14);
    let x = solve(&a.transpose(), &ones).expect("a triangular matrix");
    assert!(distance(&x, &DVector::from_fn(size, |k, _| (size - k) as f64)) < 1e-14);
}

#[test]
fn vanishing_and_tiny_pivots_are_avoided() {
    let exact = vector(3);
    for corner in [0.0, 1e-20] {
        let a = matrix(&[&[corner, 2.0, 0.0], &[1.0, 0.0, 3.0], &[0.0, -1.0, 4.0]]);
        let x = solve(&a, &(&a * &exact)).expect("a regular matrix");
        assert!(distance(&x, &exact) < 1e-14, "{x:?}");
    }
}

#[test]
fn rows_of_any_scale_are_solved() {
    let scales = DMatrix::from_diagonal(&DVector::from_fn(9, |i, _| 10_f64.powi(3 * (i as i32 % 7) - 9)));
    let a = scales * (scrambled(9) + DMatrix::identity(9, 9) * 3.0);
    let exact = vector(9);
    let x = solve(&a, &(&a * &exact)).expect("a regular matrix");
    assert!(distance(&x, &exact) < 1e-12, "{}", distance(&x, &exact));
}

#[test]
fn singular_matrices_and_those_that_are_not_finite_are_refused() {
    let rank_one = matrix(&[&[1.0, 2.0], &[0.5, 1.0]]);
    assert_eq!(solve(&rank_one, &vector(2)), Err(SINGULAR));
    let empty_row = matrix(&[&[1.0, 2.0], &[0.0, 0.0]]);
    assert_eq!(solve(&empty_row, &vector(2)), Err(SINGULAR));
    let infinite = matrix(&[&[1.0, f64::INFINITY], &[2.0, 1.0]]);
    assert_eq!(solve(&infinite, &vector(2)), Err(SINGULAR));
    let (pattern, _) = on_pattern(&rank_one);
    let mut lu = SparseLu::new(&pattern).expect("a pattern");
    assert_eq!(lu.solve(&mut [1.0; 2]), Err(SINGULAR), "solved before it was factored");
}
