//! What is given for a step: its scheme, the state at its beginning, how rates follow from its end, and what drives it.

use std::sync::Arc;

use crate::bdf::history::derivative_weights;
use crate::fluid::ambient::Ambient;
use crate::forces::outside::OutsideForce;
use crate::rod::assembly::Increment;
use crate::state::State;
use crate::step::scheme::Scheme;

/// What drives a step, at its end.
#[derive(Debug, Clone, Default)]
pub struct Drives {
    /// Angles of speed-driven motors, rad; entries of torque-driven ones are not read.
    pub motor_angles: Vec<f64>,
    /// Torques of torque-driven motors, N m.
    pub motor_torques: Vec<f64>,
    /// Values of the loads' signals.
    pub inputs: Vec<f64>,
    /// The background flow, where the fluid's geometry is taken.
    pub ambient: Option<Ambient>,
    /// What a caller's function gave at the beginning of the step.
    pub outside: Option<Arc<OutsideForce>>,
}

/// A step, as far as it is given.
pub struct Step<'a> {
    /// Which terms count, and how the fluid does.
    pub scheme: Scheme,
    /// The state at its beginning.
    pub state: &'a State,
    /// Time at its end, s.
    pub end: f64,
    /// What drives it.
    pub drives: Drives,
    /// Backward difference: rates are `rate (q - q_n) + drift`, 1/s.
    pub rate: f64,
    /// The rates were the degrees of freedom those of the beginning.
    pub drift: Vec<f64>,
    /// The same of the rates of these rates.
    pub velocity_drift: Vec<f64>,
}

impl<'a> Step<'a> {
    /// A step of the given length (s) and order, which at most is one more than there are past states.
    pub fn new(scheme: Scheme, state: &'a State, dt: f64, order: usize, drives: Drives) -> Self {
        let past = &state.history.past;
        let end = state.time + dt;
        let times: Vec<f64> = std::iter::once(end).chain(state.history.times(state.time, order)).collect();
        let weights = derivative_weights(&times);
        let difference = |present: &[f64], part: &dyn Fn(usize) -> &'a [f64]| {
            let mut drift = vec![0.0; present.len()];
            for (k, weight) in weights[2..].iter().enumerate() {
                drift.iter_mut().zip(part(k)).zip(present).for_each(|((d, old), now)| *d += weight * (old - now));
            }
            drift
        };
        Self {
            scheme,
            state,
            end,
            drives,
            rate: weights[0],
            drift: difference(&state.q, &|k| &past[k].q),
            velocity_drift: difference(&state.velocity, &|k| &past[k].velocity),
        }
    }

    /// How rates follow from the degrees of freedom, and what drives, as terms see it.
    pub fn increment(&self) -> Increment<'_> {
        Increment {
            time: self.end,
            inputs: &self.drives.inputs,
            motor_torques: &self.drives.motor_torques,
            background: self.drives.ambient.as_ref().map(Ambient::background),
            rate: self.rate,
            previous: &self.state.q,
            drift: &self.drift,
            velocity: &self.state.velocity,
            velocity_drift: &self.velocity_drift,
        }
    }
}
