//! Errors of the core as the exceptions of `flagrs.errors`.

use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::fluid::far_field::{FarFieldError, LARGEST_TOLERANCE, SMALLEST_TOLERANCE};
use crate::linear::LinearError;
use crate::model::ModelError;
use crate::rod::term::TermError;
use crate::simulation::failure::StepError;

fn make(py: Python<'_>, class: &str, message: &str, details: &Bound<'_, PyDict>) -> PyErr {
    let made = py
        .import("flagrs.errors")
        .and_then(|module| module.getattr(class))
        .and_then(|class| class.call((message,), Some(details)));
    match made {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}

/// A `SceneError` naming field, value and what is allowed.
pub fn scene_error(py: Python<'_>, field: &str, value: &str, allowed: &str) -> PyErr {
    let details = PyDict::new(py);
    let filled = details
        .set_item("field", field)
        .and_then(|()| details.set_item("value", value))
        .and_then(|()| details.set_item("allowed", allowed));
    match filled {
        Ok(()) => make(py, "SceneError", &format!("{field}: {value} is not allowed; must be {allowed}"), &details),
        Err(error) => error,
    }
}

/// A model that cannot be built.
pub fn model_error(py: Python<'_>, error: &ModelError) -> PyErr {
    match error {
        ModelError::Value { field, value, allowed } => scene_error(py, field, &value.to_string(), allowed),
        ModelError::Length { field, length, expected } => {
            scene_error(py, field, &format!("length {length}"), &format!("of length {expected}"))
        }
        ModelError::Shape { shape } => {
            scene_error(py, shape, "a degenerate shape", "edges of non-zero length, none folded onto its neighbour")
        }
        ModelError::Overlap(overlap) => scene_error(py, "nodes", &overlap.to_string(), "a shape without overlaps"),
        other => make(py, "SceneError", &other.to_string(), &PyDict::new(py)),
    }
}

/// A product with the mobility that cannot be made.
pub fn far_field_error(py: Python<'_>, error: &FarFieldError) -> PyErr {
    let (field, value, allowed) = match error {
        FarFieldError::Tolerance(value) => {
            ("error".to_owned(), format!("{value:e}"), format!("{SMALLEST_TOLERANCE:e} to {LARGEST_TOLERANCE:e}"))
        }
        FarFieldError::Position { field, index, value } => {
            (format!("{field}s[{index}]"), format!("{value:?}"), "finite".to_owned())
        }
        FarFieldError::Edge { edge, ends, nodes } => {
            (format!("edges[{edge}]"), format!("{ends:?}"), format!("two of {nodes} nodes, at different positions"))
        }
        FarFieldError::Epsilon { edge, value, smallest } => {
            (format!("epsilon[{edge}]"), format!("{value:e}"), format!("finite and > {smallest:e} m"))
        }
        FarFieldError::Length { field, actual, expected } => {
            let field = if *field == "density" { "force_density" } else { field };
            (field.to_owned(), format!("{actual} entries"), format!("{expected} entries"))
        }
    };
    scene_error(py, &field, &value, &allowed)
}

/// A linear system that cannot be solved.
pub fn linear_error(py: Python<'_>, error: &LinearError) -> PyErr {
    make(py, "FlagrsError", &error.to_string(), &PyDict::new(py))
}

/// A term without a force.
pub fn term_error(py: Python<'_>, error: &TermError) -> PyErr {
    make(py, "FlagrsError", &error.to_string(), &PyDict::new(py))
}

/// A step that was not possible.
pub fn step_error(py: Python<'_>, error: StepError) -> PyErr {
    match error {
        StepError::Convergence { time, step, residual, iterations, smallest_gap, worst_node, .. } => {
            let details = PyDict::new(py);
            let filled = details
                .set_item("time", time)
                .and_then(|()| details.set_item("step", step))
                .and_then(|()| details.set_item("residual", residual))
                .and_then(|()| details.set_item("iterations", iterations))
                .and_then(|()| details.set_item("smallest_gap", smallest_gap))
                .and_then(|()| details.set_item("worst_node", worst_node));
            match filled {
                Ok(()) => make(py, "ConvergenceError", &error.to_string(), &details),
                Err(error) => error,
            }
        }
        StepError::Interrupted => make(py, "FlagrsError", "interrupted", &PyDict::new(py)),
        StepError::Signal(cause) => match cause.downcast::<PyErr>() {
            Ok(raised) => *raised,
            Err(other) => make(py, "SceneError", &other.to_string(), &PyDict::new(py)),
        },
    }
}
