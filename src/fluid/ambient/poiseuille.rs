//! Pressure-driven flow through a round tube, or between two plates: a parabola of the distance from the axis or the middle plane.

use super::{AmbientFlow, Local};
use crate::Vec3;
use crate::signal::{Signal, SignalError};

/// `u = U(t) (1 - d^2 / R^2) e` with the distance `d` from an axis along `e`, or from a plane that holds `e`.
///
/// The formula is used beyond the wall too: walls are not part of a background flow.
pub struct Poiseuille {
    direction: Vec3,
    /// Normal of the middle plane between two plates; none in a round tube.
    normal: Option<Vec3>,
    center: Vec3,
    radius: f64,
    speed: Signal,
}

impl Poiseuille {
    /// `direction` and `normal` are unit vectors, `radius` is that of the tube or half the distance of the plates, m; `speed` is
    /// that at the middle, m/s.
    pub fn new(direction: Vec3, normal: Option<Vec3>, center: Vec3, radius: f64, speed: Signal) -> Self {
        Self { direction, normal, center, radius, speed }
    }
}

impl AmbientFlow for Poiseuille {
    fn add(&self, points: &[Vec3], time: f64, out: &mut [Local]) -> Result<(), SignalError> {
        let speed = self.speed.value(time)?;
        for (point, out) in points.iter().zip(out) {
            let from = point - self.center;
            let across = match self.normal {
                Some(normal) => normal * normal.dot(&from),
                None => from - self.direction * self.direction.dot(&from),
            };
            let squared = self.radius * self.radius;
            out.velocity += self.direction * (speed * (1.0 - across.norm_squared() / squared));
            // curl (f e) = grad f x e with grad f = -2 U d / R^2.
            out.spin += across.cross(&self.direction) * (-speed / squared);
        }
        Ok(())
    }
}
