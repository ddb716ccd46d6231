//! A background flow given by a function of points and time.

use std::sync::Arc;

use super::{AmbientFlow, Local};
use crate::Vec3;
use crate::signal::SignalError;

/// Velocities (m/s) at points (m) at a time (s).
pub type FlowFunction = Arc<dyn Fn(&[Vec3], f64) -> Result<Vec<Vec3>, SignalError> + Send + Sync>;

/// A flow supplied by the user; its vorticity is taken by central differences.
pub struct GivenFlow {
    function: FlowFunction,
    /// Distance of the differences, m: small against the scale of the flow.
    reach: f64,
}

impl GivenFlow {
    /// `reach` is the distance (m) over which velocities are differenced for the vorticity.
    pub fn new(function: FlowFunction, reach: f64) -> Self {
        Self { function, reach }
    }
}

impl AmbientFlow for GivenFlow {
    fn add(&self, points: &[Vec3], time: f64, out: &mut [Local]) -> Result<(), SignalError> {
        // One call for all points: the points themselves, then each moved along the three axes, forwards and backwards.
        let n = points.len();
        let mut all = Vec::with_capacity(7 * n);
        all.extend_from_slice(points);
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                all.extend(points.iter().map(|point| {
                    let mut moved = *point;
                    moved[axis] += sign * self.reach;
                    moved
                }));
            }
        }
        let velocities = (self.function)(&all, time)?;
        if velocities.len() != all.len() {
            return Err(format!("the flow gave {} velocities for {} points", velocities.len(), all.len()).into());
        }
        if let Some(k) = velocities.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
            let [x, y, z] = all[k].into();
            return Err(format!("the flow is not finite at ({x:e}, {y:e}, {z:e}) m, t = {time} s").into());
        }
        for (k, out) in out.iter_mut().enumerate() {
            out.velocity += velocities[k];
            let slope = |axis: usize| {
                let forwards = velocities[n * (2 * axis + 1) + k];
                (forwards - velocities[n * (2 * axis + 2) + k]) / (2.0 * self.reach)
            };
            let (dx, dy, dz) = (slope(0), slope(1), slope(2));
            out.spin += Vec3::new(dy.z - dz.y, dz.x - dx.z, dx.y - dy.x) * 0.5;
        }
        Ok(())
    }
}
