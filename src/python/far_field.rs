//! The product with the mobility without its matrix.

use numpy::{PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::arrays::{from_flat, pairs, points, values};
use super::errors::{far_field_error, scene_error};
use crate::fluid::far_field::FarField;
use crate::fluid::product::BLOCK_MEMORY;
use crate::runtime::threads::Threads;

/// `8 pi mu u = A f` for given segments and targets.
#[pyclass]
pub struct FastMobility {
    inner: FarField,
    own_targets: bool,
    threads: Threads,
}

#[pymethods]
impl FastMobility {
    #[new]
    fn new(
        py: Python<'_>,
        nodes: PyReadonlyArray2<'_, f64>,
        edges: PyReadonlyArray2<'_, i64>,
        epsilon: PyReadonlyArray1<'_, f64>,
        targets: Option<PyReadonlyArray2<'_, f64>>,
        error: f64,
        threads: usize,
    ) -> PyResult<Self> {
        let nodes = points(py, "nodes", &nodes)?;
        let edges = pairs(py, "edges", &edges, nodes.len())?;
        let targets = targets.map(|targets| points(py, "targets", &targets)).transpose()?;
        let epsilon = values(&epsilon);
        let threads = Threads(threads);
        let pool = threads.pool();
        let built = py.detach(|| {
            FarField::new(&nodes, &edges, &epsilon, targets.as_deref(), error, BLOCK_MEMORY, pool.as_deref())
        });
        let inner = built.map_err(|error| far_field_error(py, &error))?;
        Ok(Self { inner, own_targets: targets.is_some(), threads })
    }

    /// Moves to other positions of the same nodes, and of the targets if there are any.
    fn update(
        &mut self,
        py: Python<'_>,
        nodes: PyReadonlyArray2<'_, f64>,
        targets: Option<PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<()> {
        let nodes = points(py, "nodes", &nodes)?;
        let targets = targets.map(|targets| points(py, "targets", &targets)).transpose()?;
        if self.own_targets != targets.is_some() {
            let allowed = if self.own_targets { "given, as at first" } else { "None, as at first" };
            return Err(scene_error(py, "targets", if self.own_targets { "None" } else { "an array" }, allowed));
        }
        let Self { inner, threads, .. } = self;
        let pool = threads.pool();
        let moved = py.detach(|| inner.update(&nodes, targets.as_deref(), pool.as_deref()));
        moved.map_err(|error| far_field_error(py, &error))
    }

    /// `A f` (M, 3) of a nodal force density (N, 3).
    fn apply<'py>(
        &mut self,
        py: Python<'py>,
        force_density: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let density: Vec<f64> =
            points(py, "force_density", &force_density)?.iter().flat_map(|f| [f.x, f.y, f.z]).collect();
        let mut out = vec![0.0; 3 * self.inner.target_count()];
        let Self { inner, threads, .. } = self;
        let pool = threads.pool();
        py.detach(|| inner.apply(&density, &mut out, pool.as_deref())).map_err(|error| far_field_error(py, &error))?;
        from_flat(py, out, 3)
    }

    /// Memory held by what grows with the scene, bytes.
    #[getter]
    fn bytes(&self) -> usize {
        self.inner.summary().bytes
    }
}
