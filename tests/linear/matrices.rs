//! Small matrices as nested arrays, and the same on a sparse pattern.

use flagrs::linear::pattern::Pattern;
use nalgebra::{DMatrix, DVector};

/// A square matrix of rows.
pub fn matrix(rows: &[&[f64]]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows.len(), |i, j| rows[i][j])
}

/// A matrix with entries of order one that looks random, the same on every machine.
pub fn scrambled(size: usize) -> DMatrix<f64> {
    DMatrix::from_fn(size, size, |i, j| ((12.9898 * i as f64 + 78.233 * j as f64 + 1.0).sin() * 437.5).fract())
}

/// A vector whose entries all differ.
pub fn vector(size: usize) -> DVector<f64> {
    DVector::from_fn(size, |i, _| 1.0 + 0.7 * (2.3 * i as f64).cos())
}

/// The pattern of all entries that are not zero in the matrix or its transpose, and the values on it.
pub fn on_pattern(matrix: &DMatrix<f64>) -> (Pattern, Vec<f64>) {
    let size = matrix.nrows();
    let pairs: Vec<[usize; 2]> = (0..size)
        .flat_map(|j| (0..size).map(move |i| [i, j]))
        .filter(|&[i, j]| matrix[(i, j)] != 0.0 || matrix[(j, i)] != 0.0)
        .collect();
    let pattern = Pattern::from_stencils(size, pairs.iter().map(<[usize; 2]>::as_slice));
    let values = values_on(&pattern, matrix);
    (pattern, values)
}

/// The values of a matrix on a pattern that holds it.
pub fn values_on(pattern: &Pattern, matrix: &DMatrix<f64>) -> Vec<f64> {
    (0..pattern.size())
        .flat_map(|column| {
            let range = pattern.column_starts()[column]..pattern.column_starts()[column + 1];
            pattern.row_indices()[range].iter().map(move |&row| matrix[(row, column)])
        })
        .collect()
}

/// The largest entry of the difference over the largest of what is expected.
pub fn distance(found: &[f64], expected: &DVector<f64>) -> f64 {
    assert_eq!(found.len(), expected.len());
    (DVector::from_column_slice(found) - expected).amax() / expected.amax()
}
