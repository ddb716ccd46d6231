//! What motors and clamps do over a step.

use crate::forces::motors::Drive;
use crate::kinematics::clamp::Clamp;
use crate::model::Model;
use crate::signal::quadrature::Course;
use crate::signal::{Signal, SignalError};

/// Part of a span within which a jump belongs to its end.
const AT_THE_END: f64 = 1e-6;

/// Angles, turns and torques at the end of a step, and what of them the ends of the step do not show.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Inputs {
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
pub(crate) fn first_jump(model: &Model, (t0, t1): (f64, f64)) -> Result<Option<f64>, SignalError> {
    let motors = model.motors.iter().map(|motor| match &motor.drive {
        Drive::Speed(signal) | Drive::Torque { signal, .. } => signal,
    });
    let clamps = model.clamps.iter().flat_map(Clamp::signals);
    let apart = AT_THE_END * (t1 - t0);
    let mut first: Option<f64> = None;
    for signal in
        motors.chain(clamps).chain(model.inputs.signals()).filter(|signal| matches!(signal, Signal::Function(_)))
    {
        let jump = signal.course(t0, t1)?.jump.filter(|&jump| jump > t0 + apart && jump < t1 - apart);
        first = match (first, jump) {
            (Some(first), Some(jump)) => Some(first.min(jump)),
            (first, jump) => first.or(jump),
        };
    }
    Ok(first)
}

impl Inputs {
    /// Those of a step from `t0`, where the motors stand at the given angles, to `t1`.
    ///
    /// # Errors
    /// What a user's function fails with.
    pub fn new(model: &Model, angles: &[f64], (t0, t1): (f64, f64)) -> Result<Self, SignalError> {
        let mut inputs = Self { angles: angles.to_vec(), torques: vec![0.0; angles.len()], ..Self::default() };
        let unseen = |course: &Course| course.departure + course.uncertainty;
        for (k, motor) in model.motors.iter().enumerate() {
            match &motor.drive {
                Drive::Speed(signal) => {
                    let course = signal.course(t0, t1)?;
                    inputs.angles[k] += course.integral;
                    inputs.departure = inputs.departure.max(unseen(&course));
                }
                Drive::Torque { signal, dof } => {
                    inputs.torques[k] = signal.ends(t0, t1)?[1];
                    let impulse = unseen(&signal.course(t0, t1)?);
                    if impulse > 0.0 {
                        inputs.impulses.push((*dof, impulse));
                    }
                }
            }
        }
        for clamp in &model.clamps {
            let course = if clamp.edges.is_empty() { Course::default() } else { clamp.motion.spin.course(t0, t1)? };
            inputs.turns.push(course.integral);
            inputs.departure = inputs.departure.max(unseen(&course));
        }
        inputs.loads = model.inputs.values(t1)?;
        for (channel, signal) in model.inputs.signals().enumerate() {
            let impulse = unseen(&signal.course(t0, t1)?);
            if impulse > 0.0 {
                inputs.load_impulses.push((channel, impulse));
            }
        }
        Ok(inputs)
    }
}
