//! What motors, clamps and loads do over a step.

use crate::forces::motors::Drive;
use crate::inputs::Inputs;
use crate::model::Model;
use crate::signal::quadrature::Course;
use crate::signal::{Signal, SignalError};

/// Part of a span within which a jump belongs to its end.
const AT_THE_END: f64 = 1e-6;

/// Angles, turns and torques at the end of a step, and what of them the ends of the step do not show.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct OverStep {
    /// Angle of every motor, rad; entries of torque-driven ones are not read.
    pub angles: Vec<f64>,
    /// Torque of every torque-driven motor, N m; zero for the others.
    pub torques: Vec<f64>,
    /// Turn of every clamp over the step, rad.
    pub turns: Vec<f64>,
    /// Largest angle, rad, that a prescribed rotation departs within the step from what its ends suggest, or is unsure of.
    pub departure: f64,
    /// The same of torques: degree of freedom and impulse, N m s.
    pub impulses: Vec<(usize, f64)>,
    /// Values of the loads' signals.
    pub loads: Vec<f64>,
    /// The same of loads: channel and its integral, in its unit times s.
    pub load_impulses: Vec<(usize, f64)>,
}

/// Where the first function of time jumps within a span, but for its ends.
///
/// # Errors
/// What a user's function fails with.
pub(crate) fn first_jump(model: &Model, inputs: &Inputs, (t0, t1): (f64, f64)) -> Result<Option<f64>, SignalError> {
    let clamps = inputs.clamps().iter().zip(&model.clamps).flat_map(|(motion, clamp)| clamp.signals(motion));
    let signals = inputs.motors().iter().chain(clamps).chain(inputs.loads());
    let apart = AT_THE_END * (t1 - t0);
    let mut first: Option<f64> = None;
    for signal in signals.filter(|signal| matches!(signal, Signal::Function(_))) {
        let jump = signal.course(t0, t1)?.jump.filter(|&jump| jump > t0 + apart && jump < t1 - apart);
        first = match (first, jump) {
            (Some(first), Some(jump)) => Some(first.min(jump)),
            (first, jump) => first.or(jump),
        };
    }
    Ok(first)
}

impl OverStep {
    /// Those of a step from `t0`, where the motors stand at the given angles, to `t1`.
    ///
    /// # Errors
    /// What a user's function fails with.
    pub fn new(model: &Model, inputs: &Inputs, angles: &[f64], (t0, t1): (f64, f64)) -> Result<Self, SignalError> {
        let mut over = Self { angles: angles.to_vec(), torques: vec![0.0; angles.len()], ..Self::default() };
        let unseen = |course: &Course| course.departure + course.uncertainty;
        for (k, (motor, signal)) in model.motors.iter().zip(inputs.motors()).enumerate() {
            match &motor.drive {
                Drive::Speed => {
                    let course = signal.course(t0, t1)?;
                    over.angles[k] += course.integral;
                    over.departure = over.departure.max(unseen(&course));
                }
                Drive::Torque { dof } => {
                    over.torques[k] = signal.ends(t0, t1)?[1];
                    let impulse = unseen(&signal.course(t0, t1)?);
                    if impulse > 0.0 {
                        over.impulses.push((*dof, impulse));
                    }
                }
            }
        }
        for (clamp, motion) in model.clamps.iter().zip(inputs.clamps()) {
            let course = if clamp.edges.is_empty() { Course::default() } else { motion.spin.course(t0, t1)? };
            over.turns.push(course.integral);
            over.departure = over.departure.max(unseen(&course));
        }
        over.loads = inputs.load_values(t1)?;
        for (channel, signal) in inputs.loads().iter().enumerate() {
            let impulse = unseen(&signal.course(t0, t1)?);
            if impulse > 0.0 {
                over.load_impulses.push((channel, impulse));
            }
        }
        Ok(over)
    }
}
