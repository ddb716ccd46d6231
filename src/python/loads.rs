//! Loads, magnetism and background flows from mappings, as `flagrs.native_loads` makes them.

use std::sync::Arc;

use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::specification::SignalInput;
use crate::fluid::ambient::function::FlowFunction;
use crate::model::specification::{FlowSpecification, Frame, LoadKind, LoadSpecification, MagnetismSpecification};
use crate::signal::{Signal, SignalError};
use crate::{Mat3, Vec3};

type VectorInput<'py> = [SignalInput<'py>; 3];

fn vector(input: VectorInput<'_>) -> [Signal; 3] {
    input.map(SignalInput::signal)
}

fn matrix(rows: [[f64; 3]; 3]) -> Mat3 {
    Mat3::from_fn(|row, column| rows[row][column])
}

/// A load: what it is, where it acts, and its three signals.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct LoadInput<'py> {
    kind: String,
    material: bool,
    nodes: Vec<usize>,
    edges: Vec<usize>,
    signal: VectorInput<'py>,
}

impl LoadInput<'_> {
    /// The load as the core knows it.
    pub fn specification(self) -> PyResult<LoadSpecification> {
        let missing = || PyValueError::new_err("a load without a place");
        let kind = match self.kind.as_str() {
            "node force" => LoadKind::NodeForce {
                node: *self.nodes.first().ok_or_else(missing)?,
                edge: *self.edges.first().ok_or_else(missing)?,
            },
            "edge torque" => LoadKind::EdgeTorque { edge: *self.edges.first().ok_or_else(missing)? },
            "force per length" => LoadKind::ForcePerLength { edges: self.edges },
            "torque per length" => LoadKind::TorquePerLength { edges: self.edges },
            other => return Err(PyValueError::new_err(format!("a load of unknown kind {other:?}"))),
        };
        let frame = if self.material { Frame::Material } else { Frame::Laboratory };
        Ok(LoadSpecification { kind, frame, signal: vector(self.signal) })
    }
}

/// Magnetised edges and their field.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct MagnetismInput<'py> {
    moments: Vec<(usize, [f64; 3])>,
    field: VectorInput<'py>,
    gradient: [[f64; 3]; 3],
}

impl MagnetismInput<'_> {
    /// The magnetism as the core knows it.
    pub fn specification(self) -> MagnetismSpecification {
        MagnetismSpecification {
            moments: self.moments.into_iter().map(|(edge, moment)| (edge, Vec3::from(moment))).collect(),
            field: vector(self.field),
            gradient: matrix(self.gradient),
        }
    }
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct LinearFlowInput<'py> {
    velocity: VectorInput<'py>,
    gradient: [[f64; 3]; 3],
    strength: SignalInput<'py>,
    center: [f64; 3],
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct PoiseuilleInput<'py> {
    direction: [f64; 3],
    normal: Option<[f64; 3]>,
    center: [f64; 3],
    radius: f64,
    speed: SignalInput<'py>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct FunctionFlowInput {
    function: Py<PyAny>,
    reach: f64,
}

/// A background flow; which one is told by its fields.
#[derive(FromPyObject)]
pub enum FlowInput<'py> {
    Linear(LinearFlowInput<'py>),
    Poiseuille(PoiseuilleInput<'py>),
    Function(FunctionFlowInput),
}

impl FlowInput<'_> {
    /// The flow as the core knows it.
    pub fn specification(self) -> FlowSpecification {
        match self {
            Self::Linear(flow) => FlowSpecification::Linear {
                velocity: vector(flow.velocity),
                gradient: matrix(flow.gradient),
                strength: flow.strength.signal(),
                center: Vec3::from(flow.center),
            },
            Self::Poiseuille(flow) => FlowSpecification::Poiseuille {
                direction: Vec3::from(flow.direction),
                normal: flow.normal.map(Vec3::from),
                center: Vec3::from(flow.center),
                radius: flow.radius,
                speed: flow.speed.signal(),
            },
            Self::Function(flow) => {
                FlowSpecification::Function { function: callable(flow.function), reach: flow.reach }
            }
        }
    }
}

/// A flow that calls a Python function with arrays of points (M, 3) and the time.
fn callable(function: Py<PyAny>) -> FlowFunction {
    Arc::new(move |points: &[Vec3], time: f64| {
        Python::attach(|py| -> PyResult<Vec<Vec3>> {
            let rows: Vec<Vec<f64>> = points.iter().map(|point| point.as_slice().to_vec()).collect();
            let array = PyArray2::from_vec2(py, &rows)?;
            let result = function.call1(py, (array, time))?;
            let velocities: PyReadonlyArray2<'_, f64> = result
                .extract(py)
                .map_err(|_| PyValueError::new_err("the background flow must return an array (M, 3) of float64"))?;
            let velocities = velocities.as_array();
            if velocities.shape() != [points.len(), 3] {
                let shape = velocities.shape();
                return Err(PyValueError::new_err(format!(
                    "the background flow returned shape {shape:?} for {} points; must be ({}, 3)",
                    points.len(),
                    points.len()
                )));
            }
            Ok(velocities.rows().into_iter().map(|row| Vec3::new(row[0], row[1], row[2])).collect())
        })
        .map_err(|error| Box::new(error) as SignalError)
    })
}
