//! Degrees of freedom as points of a manifold: increments are added by a retraction, differences taken by its inverse.
//!
//! In a vector space both are what they always are. A rotation `Q` is a point whose increments are rotation vectors in space,
//!
//! ```text
//!   retract(Q, phi) = exp([phi]) Q,      difference(Q, P) = log(P Q^T),
//! ```
//!
//! and backward differences of it are taken in the frame of a pose near by, the predicted one: there its past is a curve of rotation
//! vectors, whose rate is differenced as usual, and gives the angular velocity by the left Jacobian of the exponential.

use nalgebra::{Quaternion, UnitQuaternion};

use crate::{Mat3, Vec3};

/// Angle below which the coefficients of the left Jacobian are taken from their series, rad.
const SMALL: f64 = 1e-4;

/// A space of degrees of freedom.
pub trait Manifold {
    /// Numbers that a point is stored in.
    fn point_length(&self) -> usize;

    /// Components of a direction.
    fn direction_length(&self) -> usize;

    /// Sets `out` to the point `part` of the way from a point along a direction.
    fn retract(&self, from: &[f64], direction: &[f64], part: f64, out: &mut [f64]);

    /// Sets `out` to the direction that leads from one point to another.
    fn difference(&self, from: &[f64], to: &[f64], out: &mut [f64]);

    /// Sets `out` to the sum of the directions from a frame to points, each with its weight: with those of a backward difference, and the
    /// present point first, the rate of the coordinates in that frame.
    fn combine(&self, frame: &[f64], points: &[&[f64]], weights: &[f64], out: &mut [f64]) {
        let mut direction = vec![0.0; self.direction_length()];
        out.fill(0.0);
        for (point, weight) in points.iter().zip(weights) {
            self.difference(frame, point, &mut direction);
            out.iter_mut().zip(&direction).for_each(|(out, direction)| *out += weight * direction);
        }
    }
}

/// A vector space of a dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VectorSpace(pub usize);

impl Manifold for VectorSpace {
    fn point_length(&self) -> usize {
        self.0
    }

    fn direction_length(&self) -> usize {
        self.0
    }

    fn retract(&self, from: &[f64], direction: &[f64], part: f64, out: &mut [f64]) {
        for ((out, from), direction) in out.iter_mut().zip(from).zip(direction) {
            *out = from + part * direction;
        }
    }

    fn difference(&self, from: &[f64], to: &[f64], out: &mut [f64]) {
        for ((out, from), to) in out.iter_mut().zip(from).zip(to) {
            *out = to - from;
        }
    }
}

/// Rotations, each stored as a unit quaternion: scalar part first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rotations(pub usize);

impl Rotations {
    /// The rotation of four numbers.
    pub fn read(point: &[f64]) -> UnitQuaternion<f64> {
        UnitQuaternion::new_normalize(Quaternion::new(point[0], point[1], point[2], point[3]))
    }

    /// Writes a rotation to four numbers.
    pub fn write(rotation: &UnitQuaternion<f64>, out: &mut [f64]) {
        out.copy_from_slice(&[rotation.w, rotation.i, rotation.j, rotation.k]);
    }

    /// Angular velocity in space of a rotation `exp([phi]) Q` whose rotation vector has the given rate.
    pub fn angular_velocity(phi: &Vec3, rate: &Vec3) -> Vec3 {
        let (angle, cross) = (phi.norm(), phi.cross_matrix());
        let square = angle * angle;
        let [a, b] = if angle < SMALL {
            [0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0]
        } else {
            [(1.0 - angle.cos()) / square, (angle - angle.sin()) / (square * angle)]
        };
        (Mat3::identity() + cross * a + cross * cross * b) * rate
    }
}

impl Manifold for Rotations {
    fn point_length(&self) -> usize {
        4 * self.0
    }

    fn direction_length(&self) -> usize {
        3 * self.0
    }

    fn retract(&self, from: &[f64], direction: &[f64], part: f64, out: &mut [f64]) {
        for ((from, phi), out) in from.chunks_exact(4).zip(direction.chunks_exact(3)).zip(out.chunks_exact_mut(4)) {
            let turn = UnitQuaternion::from_scaled_axis(Vec3::new(phi[0], phi[1], phi[2]) * part);
            Self::write(&(turn * Self::read(from)), out);
        }
    }

    fn difference(&self, from: &[f64], to: &[f64], out: &mut [f64]) {
        for ((from, to), out) in from.chunks_exact(4).zip(to.chunks_exact(4)).zip(out.chunks_exact_mut(3)) {
            let turn = Self::read(to) * Self::read(from).inverse();
            out.copy_from_slice(turn.scaled_axis().as_slice());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bdf::history::derivative_weights;

    /// A top that spins about its axis while that goes round the vertical: pose and angular velocity at a time.
    fn top(time: f64) -> ([f64; 4], Vec3) {
        let (precession, tilt, spin) = (1.3, 0.7, 2.1);
        let about = |axis: Vec3, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
        let around = about(Vec3::z(), precession * time);
        let pose = around * about(Vec3::x(), tilt) * about(Vec3::z(), spin * time);
        let axis = around * about(Vec3::x(), tilt) * Vec3::z();
        let mut point = [0.0; 4];
        Rotations::write(&pose, &mut point);
        (point, Vec3::z() * precession + axis * spin)
    }

    #[test]
    fn differences_undo_retractions() {
        let (from, _) = top(0.4);
        for phi in [[0.3, -0.7, 0.2], [1e-9, 0.0, -2e-9], [1.5, 2.0, -1.0]] {
            let (mut to, mut back, mut half) = ([0.0; 4], [0.0; 3], [0.0; 4]);
            Rotations(1).retract(&from, &phi, 1.0, &mut to);
            Rotations(1).difference(&from, &to, &mut back);
            assert!(back.iter().zip(phi).all(|(a, b)| (a - b).abs() < 1e-15), "{back:?} {phi:?}");
            // Half of it twice is all of it, and the norm stays.
            Rotations(1).retract(&from, &phi, 0.5, &mut half);
            let mut twice = [0.0; 4];
            Rotations(1).retract(&half, &phi, 0.5, &mut twice);
            Rotations(1).difference(&to, &twice, &mut back);
            assert!(
                back.iter().all(|a| a.abs() < 1e-15) && (to.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-15
            );
        }
        let (from, to) = ([1.0, 2.0], [4.0, -1.0]);
        let (mut direction, mut out) = ([0.0; 2], [0.0; 2]);
        VectorSpace(2).difference(&from, &to, &mut direction);
        VectorSpace(2).retract(&from, &direction, 1.0, &mut out);
        assert_eq!((direction, out), ([3.0, -3.0], to));
    }

    #[test]
    fn opposite_quaternions_are_the_same_rotation() {
        let (point, _) = top(0.4);
        let mut difference = [1.0; 3];
        Rotations(1).difference(&point, &point.map(|x| -x), &mut difference);
        assert!(difference.iter().all(|x| x.abs() < 1e-15), "{difference:?}");
    }

    #[test]
    fn the_left_jacobian_is_the_derivative_of_the_exponential() {
        for phi in [Vec3::new(0.3, -0.7, 0.2), Vec3::new(2e-5, 1e-5, 0.0), Vec3::new(1.5, 1.0, -1.0)] {
            let (rate, h) = (Vec3::new(0.4, 0.9, -0.5), 1e-4);
            let at = |time: f64| UnitQuaternion::from_scaled_axis(phi + rate * time);
            let turned = (at(h) * at(-h).inverse()).scaled_axis() / (2.0 * h);
            assert!((Rotations::angular_velocity(&phi, &rate) - turned).norm() < 1e-7, "{phi}");
        }
    }

    #[test]
    fn backward_differences_of_a_rotation_have_their_order_in_any_frame_near_by() {
        let (end, expected) = (1.0, top(1.0).1);
        for order in 1..=3 {
            let error = |h: f64| {
                let times: Vec<f64> = [0.0, 1.0, 1.8, 3.1][..=order].iter().map(|back| end - h * back).collect();
                let poses: Vec<[f64; 4]> = times.iter().map(|&time| top(time).0).collect();
                let points: Vec<&[f64]> = poses.iter().map(|pose| &pose[..]).collect();
                // The predicted pose is off, as predictions are.
                let mut frame = [0.0; 4];
                Rotations(1).retract(&poses[0], &[0.3, -0.2, 0.1], h, &mut frame);
                let (mut phi, mut rate) = (Vec3::zeros(), Vec3::zeros());
                Rotations(1).combine(&frame, &points, &derivative_weights(&times), rate.as_mut_slice());
                Rotations(1).difference(&frame, points[0], phi.as_mut_slice());
                (Rotations::angular_velocity(&phi, &rate) - expected).norm()
            };
            let found = (error(0.04) / error(0.02)).log2();
            assert!((found - order as f64).abs() < 0.25, "order {order}: {found}");
        }
    }
}
