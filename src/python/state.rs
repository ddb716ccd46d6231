//! The state of a simulation as a mapping of arrays, and back.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::{from_points, points, values};
use super::errors::scene_error;
use crate::bdf::control::{Control, NO_CEILING};
use crate::bdf::history::{History, Sample};
use crate::rod::reference::ReferenceFrames;
use crate::state::State;
use crate::state::account::Account;
use crate::state::reaction::{Reaction, WIDTH};

/// The whole state as a mapping of arrays, exact to the last bit.
pub fn state_arrays<'py>(py: Python<'py>, state: &State) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    let pairs = state.contacts.iter().flat_map(|(pair, _)| pair.map(i64::from));
    out.set_item("time", PyArray1::from_slice(py, &[state.time]))?;
    out.set_item("steps", PyArray1::from_slice(py, &[state.steps]))?;
    out.set_item("q", PyArray1::from_slice(py, &state.q))?;
    out.set_item("velocity", PyArray1::from_slice(py, &state.velocity))?;
    let past = &state.history.past;
    let rows = |part: fn(&Sample) -> &Vec<f64>, width: usize| {
        PyArray1::from_vec(py, past.iter().flat_map(part).copied().collect::<Vec<f64>>()).reshape([past.len(), width])
    };
    out.set_item("density", PyArray1::from_slice(py, &state.density))?;
    out.set_item("tensions", PyArray1::from_slice(py, &state.tensions))?;
    out.set_item("control_step", PyArray1::from_slice(py, &control_numbers(&state.control)))?;
    out.set_item("control_order", PyArray1::from_slice(py, &[state.control.order as u64]))?;
    out.set_item("history_times", PyArray1::from_iter(py, past.iter().map(|sample| sample.time)))?;
    out.set_item("history_states", rows(|sample| &sample.q, state.q.len())?)?;
    out.set_item("history_velocities", rows(|sample| &sample.velocity, state.q.len())?)?;
    out.set_item("history_densities", rows(|sample| &sample.density, state.density.len())?)?;
    out.set_item("history_order", PyArray1::from_slice(py, &[state.history.order as u64]))?;
    out.set_item("tangents", from_points(py, &state.frames.tangents)?)?;
    out.set_item("directors", from_points(py, &state.frames.directors)?)?;
    out.set_item("twists", PyArray1::from_slice(py, &state.frames.twists))?;
    out.set_item("motor_angles", PyArray1::from_slice(py, &state.motor_angles))?;
    out.set_item("contact_pairs", PyArray1::from_iter(py, pairs).reshape([state.contacts.len(), 2])?)?;
    out.set_item("contact_anchor", from_points(py, &state.contact_anchor)?)?;
    out.set_item("account", PyArray1::from_slice(py, &state.account.numbers()))?;
    let reactions: Vec<f64> = state.reactions.iter().flat_map(Reaction::numbers).collect();
    out.set_item("clamp_reactions", PyArray1::from_vec(py, reactions).reshape([state.reactions.len(), WIDTH])?)?;
    out.set_item("contact_forces", PyArray1::from_iter(py, state.contacts.iter().map(|(_, force)| *force)))?;
    Ok(out)
}

/// A saved state.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct StateInput<'py> {
    time: PyReadonlyArray1<'py, f64>,
    steps: PyReadonlyArray1<'py, u64>,
    q: PyReadonlyArray1<'py, f64>,
    velocity: PyReadonlyArray1<'py, f64>,
    density: PyReadonlyArray1<'py, f64>,
    tensions: PyReadonlyArray1<'py, f64>,
    control_step: PyReadonlyArray1<'py, f64>,
    control_order: PyReadonlyArray1<'py, u64>,
    history_times: PyReadonlyArray1<'py, f64>,
    history_states: PyReadonlyArray2<'py, f64>,
    history_velocities: PyReadonlyArray2<'py, f64>,
    history_densities: PyReadonlyArray2<'py, f64>,
    history_order: PyReadonlyArray1<'py, u64>,
    tangents: PyReadonlyArray2<'py, f64>,
    directors: PyReadonlyArray2<'py, f64>,
    twists: PyReadonlyArray1<'py, f64>,
    motor_angles: PyReadonlyArray1<'py, f64>,
    contact_pairs: PyReadonlyArray2<'py, i64>,
    contact_forces: PyReadonlyArray1<'py, f64>,
    contact_anchor: PyReadonlyArray2<'py, f64>,
    account: PyReadonlyArray1<'py, f64>,
    clamp_reactions: PyReadonlyArray2<'py, f64>,
}

fn first(array: &PyReadonlyArray1<'_, f64>) -> f64 {
    array.as_array().first().copied().unwrap_or(f64::NAN)
}

fn whole(array: &PyReadonlyArray1<'_, u64>) -> usize {
    array.as_array().first().map_or(0, |&value| value as usize)
}

/// What [`control`] reads, but for the order.
fn control_numbers(control: &Control) -> [f64; 3] {
    [control.dt, control.ceiling, f64::from(u8::from(control.at_jump))]
}

/// Size and order of the next step; files of before there was a ceiling have none.
fn control(saved: &StateInput<'_>) -> Control {
    let number = |k: usize| saved.control_step.as_array().get(k).copied();
    Control {
        dt: first(&saved.control_step),
        order: whole(&saved.control_order),
        ceiling: number(1).filter(|ceiling| *ceiling > 0.0).map_or(NO_CEILING, |ceiling| ceiling.min(NO_CEILING)),
        at_jump: number(2).is_some_and(|flag| flag != 0.0),
    }
}

fn past(saved: &StateInput<'_>) -> Vec<Sample> {
    let (states, velocities) = (saved.history_states.as_array(), saved.history_velocities.as_array());
    let densities = saved.history_densities.as_array();
    saved
        .history_times
        .as_array()
        .iter()
        .zip(states.rows())
        .zip(velocities.rows())
        .zip(densities.rows())
        .map(|(((&time, q), velocity), density)| Sample {
            time,
            q: q.to_vec(),
            velocity: velocity.to_vec(),
            density: density.to_vec(),
        })
        .collect()
}

fn reactions(saved: &StateInput<'_>) -> Vec<Reaction> {
    let rows = saved.clamp_reactions.as_array();
    rows.rows().into_iter().map(|row| Reaction::from_numbers(std::array::from_fn(|k| row[k]))).collect()
}

fn contacts(py: Python<'_>, saved: &StateInput<'_>) -> PyResult<Vec<([u32; 2], f64)>> {
    let (pairs, forces) = (saved.contact_pairs.as_array(), saved.contact_forces.as_array());
    let index = |value: i64| {
        u32::try_from(value)
            .map_err(|_| scene_error(py, "state.contact_pairs", &value.to_string(), "indices of bodies"))
    };
    pairs.rows().into_iter().zip(forces).map(|(pair, &force)| Ok(([index(pair[0])?, index(pair[1])?], force))).collect()
}

impl StateInput<'_> {
    /// The state as the core knows it; the core checks that it belongs to its model.
    pub fn state(&self, py: Python<'_>, dofs: usize) -> PyResult<State> {
        self.check_shapes(py, dofs)?;
        let account = Account::from_numbers(&values(&self.account))
            .ok_or_else(|| scene_error(py, "state", "an account of another length", "what state() returned"))?;
        Ok(State {
            time: first(&self.time),
            steps: self.steps.as_array().first().copied().unwrap_or(0),
            q: values(&self.q),
            velocity: values(&self.velocity),
            density: values(&self.density),
            tensions: values(&self.tensions),
            control: control(self),
            history: History { past: past(self), order: whole(&self.history_order) },
            frames: ReferenceFrames {
                tangents: points(py, "tangents", &self.tangents)?,
                directors: points(py, "directors", &self.directors)?,
                twists: values(&self.twists),
            },
            motor_angles: values(&self.motor_angles),
            contacts: contacts(py, self)?,
            account,
            contact_anchor: points(py, "contact_anchor", &self.contact_anchor)?,
            reactions: reactions(self),
        })
    }

    /// Checks the shapes that converting takes for granted; the core checks everything else.
    fn check_shapes(&self, py: Python<'_>, dofs: usize) -> PyResult<()> {
        let past = self.history_times.as_array().len();
        let flow = self.density.as_array().len();
        let forces = self.contact_forces.as_array().len();
        let wanted = [
            ("time", self.time.shape(), vec![1]),
            ("steps", self.steps.shape(), vec![1]),
            ("control_step", self.control_step.shape(), vec![if self.control_step.len() == 1 { 1 } else { 3 }]),
            ("control_order", self.control_order.shape(), vec![1]),
            ("history_order", self.history_order.shape(), vec![1]),
            ("history_states", self.history_states.shape(), vec![past, dofs]),
            ("history_velocities", self.history_velocities.shape(), vec![past, dofs]),
            ("history_densities", self.history_densities.shape(), vec![past, flow]),
            ("contact_pairs", self.contact_pairs.shape(), vec![forces, 2]),
            ("clamp_reactions", self.clamp_reactions.shape(), vec![self.clamp_reactions.shape()[0], WIDTH]),
        ];
        match wanted.iter().find(|(_, shape, wanted)| shape != wanted) {
            Some((name, shape, wanted)) => {
                let (found, allowed) = (format!("shape {shape:?}"), format!("of shape {wanted:?}"));
                Err(scene_error(py, &format!("state.{name}"), &found, &allowed))
            }
            None => Ok(()),
        }
    }
}
