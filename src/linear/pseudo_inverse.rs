//! The least-squares inverse of a dense matrix with more rows than columns, cut off where it is singular to working precision.

use faer::{Mat, MatRef};

use super::LinearError;

/// `V S^-1 U^T` of the singular value decomposition `A = U S V^T` of a column-major matrix, column-major itself: what it makes of a
/// right-hand side is the shortest of the vectors that fit it best. Singular values below `cut` times the largest count as zero.
///
/// # Errors
/// [`LinearError::Singular`] if an entry is not finite, or all are zero.
pub fn pseudo_inverse(matrix: &[f64], rows: usize, columns: usize, cut: f64) -> Result<Vec<f64>, LinearError> {
    let singular = LinearError::Singular { what: "least-squares" };
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return Err(singular);
    }
    let decomposition =
        MatRef::from_column_major_slice(matrix, rows, columns).thin_svd().map_err(|_| singular.clone())?;
    let sizes = decomposition.S().column_vector();
    let largest = sizes.iter().fold(0.0_f64, |largest, size| largest.max(*size));
    if largest == 0.0 {
        return Err(singular);
    }
    let rank = sizes.iter().take_while(|size| **size > cut * largest).count();
    let (left, right) = (decomposition.U().subcols(0, rank), decomposition.V().subcols(0, rank));
    let scaled = Mat::from_fn(columns, rank, |row, column| right[(row, column)] / sizes[column]);
    let inverse = scaled.as_ref() * left.transpose();
    Ok((0..rows).flat_map(|column| (0..columns).map(move |row| (row, column))).map(|place| inverse[place]).collect())
}

#[cfg(test)]
mod tests {
    use super::pseudo_inverse;

    #[test]
    fn a_tall_matrix_is_inverted_from_the_left() {
        // Columns (1, 0, 2) and (0, 3, 1).
        let matrix = [1.0, 0.0, 2.0, 0.0, 3.0, 1.0];
        let inverse = pseudo_inverse(&matrix, 3, 2, 1e-12).expect("the columns are independent");
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let product: f64 = (0..3).map(|k| inverse[i + 2 * k] * matrix[k + 3 * j]).sum();
            assert!((product - f64::from(u8::from(i == j))).abs() < 1e-14);
        }
        // What is orthogonal to the columns is left alone.
        let normal = [-6.0, -1.0, 3.0];
        assert!((0..2).all(|i| (0..3).map(|k| inverse[i + 2 * k] * normal[k]).sum::<f64>().abs() < 1e-14));
    }

    #[test]
    fn of_many_solutions_the_shortest_is_taken() {
        let inverse = pseudo_inverse(&[1.0, 2.0, 1.0, 2.0], 2, 2, 1e-12).expect("it has rank one");
        // Least squares of (1, 2) is any with x + y = 1.
        let solution: Vec<f64> = (0..2).map(|i| inverse[i] + 2.0 * inverse[i + 2]).collect();
        assert!(solution.iter().all(|x| (x - 0.5).abs() < 1e-14), "{solution:?}");
    }

    #[test]
    fn what_is_no_number_is_refused() {
        assert!(pseudo_inverse(&[1.0, f64::NAN], 2, 1, 1e-12).is_err());
        assert!(pseudo_inverse(&[0.0, 0.0], 2, 1, 1e-12).is_err());
    }
}
