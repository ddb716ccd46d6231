//! Resistance of a small body near a plane, to first order in its size over its distance.
//!
//! The image of the force that the body exerts drives a flow there that adds to its own mobility: with the resistance `R0` in unbounded
//! fluid and the block `G` of the image at the force's own place,
//!
//! ```text
//!   R = (I / R0 + G / 8 pi mu)^-1,      G = -3/4 (I + n n^T) / h  by a wall,    1/2 (I - 3 n n^T) / h  by a free surface,
//! ```
//!
//! whatever the body's shape (Brenner, J. Fluid Mech. 12 (1962) 35; Lorentz 1907 for the sphere). `G` falls as `1/h`, so that
//! `dR/dh = R G R / 8 pi mu h`.

use super::kernel::Boundary;
use crate::{Mat3, Vec3};

/// The plane and the fluid that a small body is near to.
#[derive(Clone, Copy, Debug)]
pub struct NearPlane {
    /// The plane.
    pub boundary: Boundary,
    /// Dynamic viscosity, Pa s.
    pub viscosity: f64,
}

/// Part of a body's own mobility that the image may take away, at most; beyond, higher orders count.
const MOST_TAKEN: f64 = 0.5;

impl NearPlane {
    /// Resistance (N s/m) of a body at `at` (m) whose resistance in unbounded fluid is `own` (N s/m), and its derivative with respect
    /// to the height (N s/m^2).
    pub fn resistance(&self, own: f64, at: &Vec3) -> (Mat3, Mat3) {
        let plane = self.boundary.plane();
        let along = Mat3::identity() * own;
        if own == 0.0 {
            return (along, Mat3::zeros());
        }
        let image = self.boundary.point_image(at, at, 0.0) / (8.0 * std::f64::consts::PI * self.viscosity);
        let mobility = Mat3::identity() / own + image;
        let resistance = mobility.try_inverse().unwrap_or(along);
        (resistance, resistance * image * resistance / plane.height(at))
    }

    /// Height (m) below which a body of this resistance (N s/m) is too close for the first order.
    pub fn least_height(&self, own: f64) -> f64 {
        let plane = self.boundary.plane();
        let at = plane.point() + plane.normal();
        let most = -self.boundary.point_image(&at, &at, 0.0).symmetric_eigenvalues().min();
        own * most / (8.0 * std::f64::consts::PI * self.viscosity * MOST_TAKEN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Plane;

    fn near(kind: fn(Plane) -> Boundary) -> NearPlane {
        let plane = Plane::new(Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.0, -2.0, 2.0)).expect("a plane");
        NearPlane { boundary: kind(plane), viscosity: 0.7 }
    }

    #[test]
    fn a_sphere_far_from_a_wall_has_the_drag_of_lorentz() {
        let near = near(Boundary::NoSlip);
        let (n, own) = (*near.boundary.plane().normal(), 6.0 * std::f64::consts::PI * 0.7 * 0.01);
        let at = near.boundary.plane().point() + n * 0.2;
        let along = n.cross(&Vec3::x()).normalize();
        let (resistance, _) = near.resistance(own, &at);
        for (direction, factor) in [(n, 9.0 / 8.0), (along, 9.0 / 16.0)] {
            let expected = own / (1.0 - factor * 0.01 / 0.2);
            assert!((direction.dot(&(resistance * direction)) / expected - 1.0).abs() < 1e-12);
        }
        assert!((near.least_height(own) - 2.0 * 9.0 / 8.0 * 0.01).abs() < 1e-14);
    }

    #[test]
    fn the_slope_is_the_derivative() {
        for near in [near(Boundary::NoSlip), near(Boundary::FreeSurface)] {
            let (n, step) = (*near.boundary.plane().normal(), 1e-6);
            let at = near.boundary.plane().point() + n * 0.5 + Vec3::x();
            let at_height = |shift: f64| near.resistance(0.9, &(at + n * shift)).0;
            let difference = (at_height(step) - at_height(-step)) / (2.0 * step);
            let (_, slope) = near.resistance(0.9, &at);
            assert!((difference - slope).amax() < 1e-8 * slope.amax(), "{difference} {slope}");
        }
    }
}
