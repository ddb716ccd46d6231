//! Frames and reactions of clamps as arrays.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::{from_flat, from_points};
use super::errors::{linear_error, step_error};
use crate::simulation::frame::{Frame, FrameError};
use crate::state::reaction::Reaction;

/// Forces (C, 3), torques (C, 3) and powers (C,).
pub type Reactions<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>);

/// What clamps exert, as arrays.
pub fn reaction_arrays<'py>(py: Python<'py>, reactions: &[Reaction]) -> PyResult<Reactions<'py>> {
    let points = |part: fn(&Reaction) -> crate::Vec3| {
        let points: Vec<_> = reactions.iter().map(part).collect();
        from_points(py, &points)
    };
    let powers = PyArray1::from_iter(py, reactions.iter().map(|reaction| reaction.power));
    Ok((points(|reaction| reaction.force)?, points(|reaction| reaction.torque)?, powers))
}

/// A frame that cannot be told.
pub fn frame_error(py: Python<'_>, error: FrameError) -> PyErr {
    match error {
        FrameError::Step(error) => step_error(py, error),
        FrameError::Linear(error) => linear_error(py, &error),
    }
}

/// A frame as a mapping of arrays, with the names of `flagrs.frame.FIELDS`.
pub fn frame_arrays<'py>(py: Python<'py>, frame: &Frame) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    let (forces, torques, powers) = reaction_arrays(py, &frame.reactions)?;
    out.set_item("time", frame.time)?;
    out.set_item("nodes", from_points(py, &frame.nodes)?)?;
    out.set_item("theta", PyArray1::from_slice(py, &frame.theta))?;
    out.set_item("velocities", from_points(py, &frame.velocities)?)?;
    out.set_item("force_density", from_flat(py, frame.force_density.clone(), 3)?)?;
    out.set_item("motor_angle", PyArray1::from_slice(py, &frame.motor_angles))?;
    out.set_item("motor_speed", PyArray1::from_slice(py, &frame.motor_speeds))?;
    out.set_item("motor_torque", PyArray1::from_slice(py, &frame.motor_torques))?;
    out.set_item("clamp_force", forces)?;
    out.set_item("clamp_torque", torques)?;
    out.set_item("clamp_power", powers)?;
    out.set_item("minimum_gap", frame.minimum_gap)?;
    out.set_item("contacts", frame.contacts)?;
    out.set_item("account", PyArray1::from_slice(py, &frame.account.numbers()))?;
    out.set_item("energy", PyArray1::from_slice(py, &frame.energies))?;
    Ok(out)
}
