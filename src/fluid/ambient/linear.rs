//! Uniform flows and velocity gradients: `u = U(t) + s(t) G (x - c)`.

use super::{AmbientFlow, Local};
use crate::signal::{Signal, SignalError};
use crate::{Mat3, Vec3};

/// A flow linear in the position.
pub struct LinearFlow {
    velocity: [Signal; 3],
    gradient: Mat3,
    strength: Signal,
    center: Vec3,
}

impl LinearFlow {
    /// `velocity` at `center` (m/s); `gradient` is `du_i/dx_j` (1/s), multiplied by `strength`.
    pub fn new(velocity: [Signal; 3], gradient: Mat3, strength: Signal, center: Vec3) -> Self {
        Self { velocity, gradient, strength, center }
    }
}

/// Half the vorticity of a flow with the given gradient.
pub fn spin_of(gradient: &Mat3) -> Vec3 {
    Vec3::new(
        gradient[(2, 1)] - gradient[(1, 2)],
        gradient[(0, 2)] - gradient[(2, 0)],
        gradient[(1, 0)] - gradient[(0, 1)],
    ) * 0.5
}

impl AmbientFlow for LinearFlow {
    fn add(&self, points: &[Vec3], time: f64, out: &mut [Local]) -> Result<(), SignalError> {
        let mut velocity = Vec3::zeros();
        for (c, signal) in self.velocity.iter().enumerate() {
            velocity[c] = signal.value(time)?;
        }
        let gradient = self.gradient * self.strength.value(time)?;
        let spin = spin_of(&gradient);
        for (point, out) in points.iter().zip(out) {
            out.velocity += velocity + gradient * (point - self.center);
            out.spin += spin;
        }
        Ok(())
    }
}
