//! A Python function that is asked for forces at the beginning of every step.

use std::sync::Arc;

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::forces::outside::{ForceFunction, Given, Surroundings};
use crate::signal::SignalError;
use crate::{Mat3, Vec3};

/// Forces (N, 3), torques (E, 3) or nothing, stiffness (N, 3, 3) or nothing.
type Answer<'py> =
    (PyReadonlyArrayDyn<'py, f64>, Option<PyReadonlyArrayDyn<'py, f64>>, Option<PyReadonlyArrayDyn<'py, f64>>);

/// The function in the form the core asks it in.
pub fn force_function(function: Py<PyAny>) -> ForceFunction {
    Arc::new(move |around: &Surroundings| {
        Python::attach(|py| ask(py, &function, around)).map_err(|error| Box::new(error) as SignalError)
    })
}

fn ask(py: Python<'_>, function: &Py<PyAny>, around: &Surroundings) -> PyResult<Given> {
    let rows = |vectors: &mut dyn Iterator<Item = f64>, shape: Vec<usize>| {
        PyArray1::from_iter(py, vectors).reshape(shape).map(|array| array.into_any())
    };
    let (n, e) = (around.nodes.len(), around.directors.len());
    let nodes = rows(&mut around.nodes.iter().flat_map(|v| v.iter().copied()), vec![n, 3])?;
    let velocities = rows(&mut around.velocities.iter().flat_map(|v| v.iter().copied()), vec![n, 3])?;
    let frames = around.directors.iter().flat_map(|frame| frame.iter().flat_map(|v| v.iter().copied()));
    let directors = rows(&mut frames.collect::<Vec<_>>().into_iter(), vec![e, 3, 3])?;
    let answer = function.call1(py, (around.time, nodes, velocities, directors))?;
    let (forces, torques, stiffness): Answer<'_> = answer.extract(py)?;
    let matrices = |array: &PyReadonlyArrayDyn<'_, f64>| -> PyResult<Vec<Mat3>> {
        expect_shape(array, &[3, 3])?;
        let values: Vec<f64> = array.as_array().iter().copied().collect();
        Ok(values.chunks_exact(9).map(Mat3::from_row_slice).collect())
    };
    Ok(Given {
        forces: vectors(&forces)?,
        torques: torques.as_ref().map_or(Ok(Vec::new()), vectors)?,
        stiffness: stiffness.as_ref().map_or(Ok(Vec::new()), matrices)?,
    })
}

fn vectors(array: &PyReadonlyArrayDyn<'_, f64>) -> PyResult<Vec<Vec3>> {
    expect_shape(array, &[3])?;
    let values: Vec<f64> = array.as_array().iter().copied().collect();
    Ok(values.chunks_exact(3).map(|row| Vec3::new(row[0], row[1], row[2])).collect())
}

/// Every row of the array must have this shape.
fn expect_shape(array: &PyReadonlyArrayDyn<'_, f64>, row: &[usize]) -> PyResult<()> {
    if array.shape().len() == row.len() + 1 && array.shape()[1..] == *row {
        Ok(())
    } else {
        Err(PyValueError::new_err(format!("rows of shape {row:?} expected, not an array of shape {:?}", array.shape())))
    }
}
