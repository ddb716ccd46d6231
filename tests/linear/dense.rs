//! Dense LU and products: known solutions, pivoting, errors, and the same bits on any number of threads.

use flagrs::linear::LinearError;
use flagrs::linear::dense::{DenseLu, multiply};
use nalgebra::{DMatrix, DVector};

use crate::matrices::{distance, matrix, scrambled, vector};

const SINGULAR: LinearError = LinearError::Singular { what: "dense" };

fn factored(a: &DMatrix<f64>) -> Result<DenseLu, LinearError> {
    let mut lu = DenseLu::new(a.nrows());
    lu.matrix_mut().copy_from_slice(a.as_slice());
    lu.factor()?;
    Ok(lu)
}

#[test]
fn the_hilbert_matrix_has_its_known_inverse() {
    // Its inverse has whole entries; the condition number of five rows is 4.8e5.
    let hilbert = DMatrix::from_fn(5, 5, |i, j| 1.0 / (i + j + 1) as f64);
    let mut column = vec![1.0, 0.0, 0.0, 0.0, 0.0];
    factored(&hilbert).expect("a regular matrix").solve(&mut column).expect("factors");
    let expected = DVector::from_column_slice(&[25.0, -300.0, 1050.0, -1400.0, 630.0]);
    assert!(distance(&column, &expected) < 5e5 * f64::EPSILON, "{column:?}");
}

#[test]
fn several_columns_are_solved_at_once_and_rows_are_exchanged_where_needed() {
    let a = matrix(&[&[0.0, 2.0, 1.0], &[1e-18, 0.0, -3.0], &[4.0, 1.0, 0.0]]);
    let mut lu = factored(&a).expect("a regular matrix");
    assert_eq!(lu.size(), 3);
    let exact = DMatrix::from_fn(3, 2, |i, j| 1.0 + i as f64 - 5.0 * j as f64);
    let mut x = &a * &exact;
    lu.solve(x.as_mut_slice()).expect("factors");
    assert!((x - exact).amax() < 1e-14);
}

#[test]
fn what_cannot_be_factored_is_refused_and_old_factors_are_not_used() {
    assert_eq!(factored(&matrix(&[&[1.0, 2.0], &[2.0, 4.0]])).err(), Some(SINGULAR));
    assert_eq!(factored(&matrix(&[&[1.0, f64::NAN], &[2.0, 4.0]])).err(), Some(SINGULAR));
    let mut lu = DenseLu::new(2);
    assert_eq!(lu.solve(&mut [1.0, 1.0]), Err(SINGULAR), "solved before it was factored");
    let mut lu = factored(&scrambled(2)).expect("a regular matrix");
    lu.matrix_mut();
    assert_eq!(lu.solve(&mut [1.0, 1.0]), Err(SINGULAR), "solved with a matrix that may have changed");
}

#[test]
fn products_agree_with_sums_and_do_not_depend_on_threads() {
    for (rows, columns) in [(3, 5), (511, 4), (512, 30), (700, 77)] {
        let a = DMatrix::from_fn(rows, columns, |i, j| (12.9898 * i as f64 + 78.233 * j as f64).sin());
        let x = vector(columns);
        let (mut alone, mut shared) = (vec![0.0; rows], vec![0.0; rows]);
        multiply(a.as_slice(), x.as_slice(), &mut alone, None);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads");
        multiply(a.as_slice(), x.as_slice(), &mut shared, Some(&pool));
        assert_eq!(alone, shared);
        let expected = DVector::from_fn(rows, |i, _| (0..columns).map(|j| a[(i, j)] * x[j]).sum());
        assert!(distance(&alone, &expected) < 1e-14);
    }
}
