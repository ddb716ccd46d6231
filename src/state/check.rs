//! What must hold of a state that comes from elsewhere before a simulation goes on from it.

use crate::Vec3;
use crate::bdf::control::HIGHEST_ORDER;
use crate::bdf::history::{DEPTH, GUESS_ORDER};
use crate::model::{Model, ModelError};
use crate::state::State;

/// Deviation from unit length and right angles that frames may have: far more than transport ever adds up to.
const FRAME_TOLERANCE: f64 = 1e-6;
/// More steps than any run makes.
const MOST_STEPS: u64 = 1 << 62;

impl State {
    /// Checks that the state fits a model and the length `flow` of force densities on the fluid: lengths, ranges, orders, finite values
    /// throughout.
    ///
    /// # Errors
    /// [`ModelError::Length`] or [`ModelError::Value`] naming the first field that is wrong.
    pub fn check(&self, model: &Model, flow: usize) -> Result<(), ModelError> {
        let dofs = model.dof_count();
        let (edges, hinges) = (model.network().edges().len(), model.network().hinges().len());
        finite("state.time", &[self.time])?;
        range("state.steps", self.steps as f64, self.steps <= MOST_STEPS, "at most 2^62")?;
        vector("state.q", &self.q, dofs)?;
        vector("state.velocity", &self.velocity, dofs)?;
        vector("state.density", &self.density, flow)?;
        vector("state.tensions", &self.tensions, edges)?;
        vector("state.motor_angles", &self.motor_angles, model.motors.len())?;
        vector("state.twists", &self.frames.twists, hinges)?;
        let dt = self.control.dt;
        range("state.control_step", dt, dt.is_finite() && dt >= 0.0, "a finite time >= 0 s")?;
        let order = self.control.order;
        range("state.control_order", order as f64, (1..=HIGHEST_ORDER).contains(&order), "1, 2 or 3")?;
        let ceiling = self.control.ceiling;
        range("state.control_step", ceiling, ceiling > 0.0, "> 0 s")?;
        self.check_history(dofs, flow)?;
        self.check_frames(edges)?;
        self.check_contacts(model)?;
        length("state.clamp_reactions", self.reactions.len(), model.clamps.len())?;
        self.reactions.iter().try_for_each(|reaction| finite("state.clamp_reactions", &reaction.numbers()))
    }

    fn check_history(&self, dofs: usize, flow: usize) -> Result<(), ModelError> {
        let (past, order) = (&self.history.past, self.history.order);
        range("state.history_times", past.len() as f64, past.len() <= DEPTH, "at most 4 past states")?;
        range(
            "state.history_order",
            order as f64,
            order <= GUESS_ORDER.min(past.len()),
            "0 to 3, no more than past states",
        )?;
        let mut later = self.time;
        for sample in past {
            finite("state.history_times", &[sample.time])?;
            range("state.history_times", sample.time, sample.time < later, "earlier than the state after it")?;
            later = sample.time;
            vector("state.history_states", &sample.q, dofs)?;
            vector("state.history_velocities", &sample.velocity, dofs)?;
            vector("state.history_densities", &sample.density, flow)?;
        }
        Ok(())
    }

    fn check_frames(&self, edges: usize) -> Result<(), ModelError> {
        let (tangents, directors) = (&self.frames.tangents, &self.frames.directors);
        length("state.tangents", tangents.len(), edges)?;
        length("state.directors", directors.len(), edges)?;
        for (tangent, director) in tangents.iter().zip(directors) {
            unit("state.tangents", tangent)?;
            unit("state.directors", director)?;
            let product = tangent.dot(director);
            range("state.directors", product, product.abs() <= FRAME_TOLERANCE, "at right angles to their tangents")?;
        }
        Ok(())
    }

    fn check_contacts(&self, model: &Model) -> Result<(), ModelError> {
        let bodies = model.body_count();
        for &([first, second], force) in &self.contacts {
            for body in [first, second] {
                let known = (body as usize) < bodies;
                range("state.contact_pairs", f64::from(body), known, "indices of edges, or of the head after them")?;
            }
            finite("state.contact_forces", &[force])?;
        }
        if !self.contact_anchor.is_empty() {
            length("state.contact_anchor", self.contact_anchor.len(), model.network().node_count())?;
        }
        self.contact_anchor.iter().try_for_each(|anchor| finite("state.contact_anchor", anchor.as_slice()))
    }
}

fn range(field: &str, value: f64, holds: bool, allowed: &'static str) -> Result<(), ModelError> {
    if holds { Ok(()) } else { Err(ModelError::Value { field: field.to_owned(), value, allowed }) }
}

fn finite(field: &str, values: &[f64]) -> Result<(), ModelError> {
    values.iter().try_for_each(|&value| range(field, value, value.is_finite(), "finite"))
}

fn length(field: &'static str, length: usize, expected: usize) -> Result<(), ModelError> {
    if length == expected { Ok(()) } else { Err(ModelError::Length { field, length, expected }) }
}

fn vector(field: &'static str, values: &[f64], expected: usize) -> Result<(), ModelError> {
    length(field, values.len(), expected)?;
    finite(field, values)
}

fn unit(field: &str, vector: &Vec3) -> Result<(), ModelError> {
    let size = vector.norm();
    range(field, size, (size - 1.0).abs() <= FRAME_TOLERANCE, "of unit length")
}
