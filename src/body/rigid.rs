//! The map from a body's six velocities to those of points that move with it, and its transpose.

use nalgebra::Vector6;

use crate::Vec3;

/// Velocities `U + Omega x r` of points at `r` from the body's centre, for `(U, Omega)`, m/s and rad/s.
pub fn velocities(motion: &Vector6<f64>, points: &[Vec3]) -> Vec<f64> {
    let (shift, spin) = (motion.fixed_rows::<3>(0), motion.fixed_rows::<3>(3));
    points.iter().flat_map(|r| <[f64; 3]>::from(shift + spin.cross(r))).collect()
}

/// Total force and torque about the body's centre of forces on points at `r` from it, N and N m.
pub fn force_and_torque(forces: &[f64], points: &[Vec3]) -> Vector6<f64> {
    let mut total = Vector6::zeros();
    for (r, force) in points.iter().zip(forces.chunks_exact(3)) {
        let force = Vec3::new(force[0], force[1], force[2]);
        let torque = r.cross(&force);
        (0..3).for_each(|c| {
            total[c] += force[c];
            total[3 + c] += torque[c];
        });
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_is_the_same_on_the_body_and_on_its_points() {
        let points = [Vec3::new(0.3, -0.2, 0.9), Vec3::new(-1.0, 0.4, 0.1)];
        let motion = Vector6::new(0.1, -0.5, 0.2, 0.7, 1.1, -0.4);
        let forces = [0.2, 0.8, -0.3, 0.6, -0.1, 0.5];
        let power: f64 = velocities(&motion, &points).iter().zip(&forces).map(|(v, f)| v * f).sum();
        assert!((power - motion.dot(&force_and_torque(&forces, &points))).abs() < 1e-15);
    }

    #[test]
    fn a_turn_about_z_moves_x_along_y() {
        let motion = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        assert_eq!(velocities(&motion, &[Vec3::new(2.0, 0.0, 0.0)]), [0.0, 2.0, 0.0]);
    }
}
