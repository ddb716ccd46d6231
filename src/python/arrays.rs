//! Positions and indices in and out of NumPy, with shapes checked.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::errors::scene_error;
use crate::Vec3;

/// Rows of an (N, 3) array as points; not finite values are an error naming the field.
pub fn points(py: Python<'_>, field: &str, array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<Vec3>> {
    if array.shape()[1] != 3 {
        return Err(scene_error(py, field, &format!("shape {:?}", array.shape()), "of shape (N, 3)"));
    }
    let view = array.as_array();
    let points: Vec<Vec3> = view.rows().into_iter().map(|row| Vec3::new(row[0], row[1], row[2])).collect();
    match points.iter().position(|point| !point.iter().all(|x| x.is_finite())) {
        Some(k) => Err(scene_error(py, &format!("{field}[{k}]"), &format!("{:?}", points[k].as_slice()), "finite")),
        None => Ok(points),
    }
}

/// Rows of an (N, 2) array of indices below `limit`.
pub fn pairs(
    py: Python<'_>,
    field: &str,
    array: &PyReadonlyArray2<'_, i64>,
    limit: usize,
) -> PyResult<Vec<[usize; 2]>> {
    if array.shape()[1] != 2 {
        return Err(scene_error(py, field, &format!("shape {:?}", array.shape()), "of shape (N, 2)"));
    }
    let view = array.as_array();
    view.rows()
        .into_iter()
        .enumerate()
        .map(|(k, row)| {
            let valid = |index: i64| usize::try_from(index).ok().filter(|&index| index < limit);
            valid(row[0]).zip(valid(row[1])).map(|(a, b)| [a, b]).ok_or_else(|| {
                let value = format!("({}, {})", row[0], row[1]);
                scene_error(py, &format!("{field}[{k}]"), &value, &format!("two indices in 0..{limit}"))
            })
        })
        .collect()
}

/// Values of a one-dimensional array.
pub fn values(array: &PyReadonlyArray1<'_, f64>) -> Vec<f64> {
    array.as_array().to_vec()
}

/// Points as a new (N, 3) array.
pub fn from_points<'py>(py: Python<'py>, points: &[Vec3]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat: Vec<f64> = points.iter().flat_map(|point| [point.x, point.y, point.z]).collect();
    PyArray1::from_vec(py, flat).reshape([points.len(), 3])
}

/// A flat row-major buffer as a new (rows, columns) array.
pub fn from_flat(py: Python<'_>, flat: Vec<f64>, columns: usize) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let rows = flat.len().checked_div(columns).unwrap_or(0);
    PyArray1::from_vec(py, flat).reshape([rows, columns])
}
