//! The flow of a point force in free space.

use crate::{Mat3, Vec3};

/// `S` of `8 pi mu u = S g`: the velocity that a force `g` at a distance `d` from it drives, 1/m.
///
/// `I / r + d d^T / r^3` (Stokeslet; Kim and Karrila 1991, section 2.5).
pub fn stokeslet(d: &Vec3) -> Mat3 {
    let inverse = 1.0 / d.norm();
    Mat3::identity() * inverse + d * d.transpose() * inverse.powi(3)
}

/// The matrix `S` (3M x 3N, by columns) from forces at `sources` (N) to velocities at `points` (M).
pub fn stokeslet_matrix(points: &[Vec3], sources: &[Vec3]) -> Vec<f64> {
    let rows = 3 * points.len();
    let mut matrix = vec![0.0; rows * 3 * sources.len()];
    for (j, source) in sources.iter().enumerate() {
        for (i, point) in points.iter().enumerate() {
            let block = stokeslet(&(point - source));
            for column in 0..3 {
                let start = 3 * i + rows * (3 * j + column);
                matrix[start..start + 3].copy_from_slice(block.column(column).as_slice());
            }
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flow_is_that_of_a_slow_sphere_far_away() {
        // Along the force twice as fast as across it, and without divergence.
        let along = stokeslet(&Vec3::new(2.0, 0.0, 0.0));
        assert_eq!((along[(0, 0)], along[(1, 1)], along[(0, 1)]), (1.0, 0.5, 0.0));
        let (at, h) = (Vec3::new(0.3, -0.7, 0.4), 1e-5);
        for column in 0..3 {
            let slope = |c: usize| {
                let step = Vec3::from_fn(|k, _| if k == c { h } else { 0.0 });
                (stokeslet(&(at + step)) - stokeslet(&(at - step)))[(c, column)] / (2.0 * h)
            };
            assert!((slope(0) + slope(1) + slope(2)).abs() < 1e-9);
        }
    }

    #[test]
    fn the_matrix_holds_a_block_for_every_pair() {
        let points = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.5), Vec3::new(0.0, 0.0, -1.0)];
        let sources = [Vec3::new(0.1, 0.2, 0.3), Vec3::zeros()];
        let matrix = stokeslet_matrix(&points, &sources);
        for (i, point) in points.iter().enumerate() {
            for (j, source) in sources.iter().enumerate() {
                let block = stokeslet(&(point - source));
                assert!((0..9).all(|k| matrix[3 * i + k % 3 + 9 * (3 * j + k / 3)] == block[(k % 3, k / 3)]));
            }
        }
    }
}
