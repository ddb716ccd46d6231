//! The least-squares inverse of a dense matrix with more rows than columns, cut off where it is singular to working precision.

use nalgebra::DMatrix;

use super::LinearError;

/// A left inverse `P` of a column-major matrix `A` (rows x columns), column-major itself: `P b` is the vector that fits `A x = b` best.
///
/// By QR with pivots, `A Pi = Q R`: `P = Pi R^-1 Q^T`. Columns whose pivot is below `cut` times the largest follow from others to working
/// precision and get nothing.
///
/// # Errors
/// [`LinearError::Singular`] if an entry is not finite, or all are zero.
pub fn pseudo_inverse(matrix: &[f64], rows: usize, columns: usize, cut: f64) -> Result<Vec<f64>, LinearError> {
    let singular = LinearError::Singular { what: "least-squares" };
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return Err(singular);
    }
    let factors = DMatrix::from_column_slice(rows, columns, matrix).col_piv_qr();
    let upper = factors.r();
    let largest = upper[(0, 0)].abs();
    if largest == 0.0 {
        return Err(singular);
    }
    let rank = upper.diagonal().iter().take_while(|pivot| pivot.abs() > cut * largest).count();
    let mut inverse = DMatrix::zeros(columns, rows);
    let coefficients = upper
        .view((0, 0), (rank, rank))
        .solve_upper_triangular(&factors.q().columns(0, rank).transpose())
        .ok_or(singular)?;
    inverse.rows_mut(0, rank).copy_from(&coefficients);
    factors.p().inv_permute_rows(&mut inverse);
    Ok(inverse.as_slice().to_vec())
}

#[cfg(test)]
mod tests {
    use super::pseudo_inverse;

    #[test]
    fn a_tall_matrix_is_inverted_from_the_left() {
        // Columns (1, 0, 2) and (0, 3, 1), and once more in the other order: the pivots differ.
        for matrix in [[1.0, 0.0, 2.0, 0.0, 3.0, 1.0], [0.0, 3.0, 1.0, 1.0, 0.0, 2.0]] {
            let inverse = pseudo_inverse(&matrix, 3, 2, 1e-12).expect("the columns are independent");
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let product: f64 = (0..3).map(|k| inverse[i + 2 * k] * matrix[k + 3 * j]).sum();
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
            // What is orthogonal to the columns is left alone.
            let normal = [-6.0, -1.0, 3.0];
            assert!((0..2).all(|i| (0..3).map(|k| inverse[i + 2 * k] * normal[k]).sum::<f64>().abs() < 1e-14));
        }
    }

    #[test]
    fn columns_that_follow_from_others_get_nothing() {
        let inverse = pseudo_inverse(&[1.0, 2.0, 2.0, 4.0], 2, 2, 1e-12).expect("it has rank one");
        // Least squares of (1, 2) by the second column: half of it.
        let solution: Vec<f64> = (0..2).map(|i| inverse[i] + 2.0 * inverse[i + 2]).collect();
        assert!(solution[0] == 0.0 && (solution[1] - 0.5).abs() < 1e-15, "{solution:?}");
    }

    #[test]
    fn what_is_no_number_is_refused() {
        assert!(pseudo_inverse(&[1.0, f64::NAN], 2, 1, 1e-12).is_err());
        assert!(pseudo_inverse(&[0.0, 0.0], 2, 1, 1e-12).is_err());
    }
}
