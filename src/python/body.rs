//! The surface of a rigid body in the flow.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use super::arrays::from_points;
use super::errors::scene_error;
use crate::body::profile::RoundedCylinder;
use crate::body::shape::Shape;
use crate::body::surface::Surface;

/// Sources inside a body, fitted to its surface.
#[pyclass(frozen)]
pub struct BodySurface {
    inner: Surface,
}

#[pymethods]
impl BodySurface {
    /// The surface of an ellipsoid with these semi-axes along x, y and z, m.
    #[staticmethod]
    fn ellipsoid(py: Python<'_>, semi_axes: [f64; 3], accuracy: f64) -> PyResult<Self> {
        Self::of(py, Shape::Ellipsoid { semi_axes }, accuracy)
    }

    /// The surface of a cylinder along z with rounded edges; radius, length and radius of the rounding in m.
    #[staticmethod]
    fn cylinder(py: Python<'_>, radius: f64, length: f64, edge_radius: f64, accuracy: f64) -> PyResult<Self> {
        Self::of(py, Shape::Cylinder(RoundedCylinder { radius, length, edge_radius }), accuracy)
    }

    /// Positions (S, 3) of the sources in the body's frame, m.
    #[getter]
    fn sources<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        from_points(py, &self.inner.sources)
    }

    /// Positions (P, 3) of the points of the surface that they are fitted to, m.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        from_points(py, &self.inner.points)
    }

    /// Estimated relative error of the resistance.
    #[getter]
    fn error(&self) -> f64 {
        self.inner.error
    }

    /// Root-mean-square velocity left on the surface, relative to the surface's own.
    #[getter]
    fn slip(&self) -> f64 {
        self.inner.slip
    }

    /// Force and torque on the fluid (6, 6) by velocity and angular velocity, for a viscosity in Pa s.
    fn resistance<'py>(&self, py: Python<'py>, viscosity: f64) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.inner.resistance(viscosity).transpose();
        PyArray1::from_slice(py, rows.as_slice()).reshape([6, 6])
    }

    /// Forces (S, 3) of the sources on the fluid, N, as the body moves with the velocity and angular velocity (6) in a fluid of the given
    /// viscosity, Pa s.
    fn forces<'py>(&self, py: Python<'py>, motion: [f64; 6], viscosity: f64) -> PyResult<Bound<'py, PyArray2<f64>>> {
        from_points(py, &self.inner.forces(&motion.into(), viscosity))
    }
}

impl BodySurface {
    fn of(py: Python<'_>, shape: Shape, accuracy: f64) -> PyResult<Self> {
        let built = py.detach(|| Surface::new(&shape, accuracy));
        let inner = built.map_err(|error| {
            scene_error(py, "accuracy", &format!("{accuracy:e}"), &format!("one that can be reached ({error})"))
        })?;
        Ok(Self { inner })
    }
}
