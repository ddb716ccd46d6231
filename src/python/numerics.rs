//! Mobility, velocity and distances on plain arrays.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::arrays::{from_points, pairs, points, values};
use super::errors::scene_error;
use super::walls::WallInput;
use crate::contact::distance::segment_distance as distance;
use crate::fluid::kernel::Boundary;
use crate::fluid::kernel::network::Segments;
use crate::fluid::stokeslet;
use crate::runtime::threads;

fn regularizations(py: Python<'_>, epsilon: &PyReadonlyArray1<'_, f64>, edges: usize) -> PyResult<Vec<f64>> {
    let epsilon = values(epsilon);
    if epsilon.len() != edges {
        return Err(scene_error(py, "epsilon", &format!("length {}", epsilon.len()), &format!("of length {edges}")));
    }
    match epsilon.iter().find(|value| !(**value > 0.0 && value.is_finite())) {
        Some(value) => Err(scene_error(py, "epsilon", &value.to_string(), "> 0 m")),
        None => Ok(epsilon),
    }
}

/// `A` with `8 pi mu u = A f`, (3M, 3N).
#[pyfunction]
pub fn mobility<'py>(
    py: Python<'py>,
    nodes: PyReadonlyArray2<'py, f64>,
    edges: PyReadonlyArray2<'py, i64>,
    epsilon: PyReadonlyArray1<'py, f64>,
    targets: PyReadonlyArray2<'py, f64>,
    wall: Option<WallInput>,
    threads: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let boundary = boundary(py, wall)?;
    let nodes = points(py, "nodes", &nodes)?;
    let targets = points(py, "targets", &targets)?;
    let edges = pairs(py, "edges", &edges, nodes.len())?;
    let epsilon = regularizations(py, &epsilon, edges.len())?;
    let mut out = vec![0.0; 9 * nodes.len() * targets.len()];
    py.detach(|| {
        let pool = threads::pool(threads);
        stokeslet::mobility(&targets, &nodes, &edges, &epsilon, &mut out, pool.as_deref());
        if let Some(boundary) = boundary {
            let segments = Segments { nodes: &nodes, edges: &edges, epsilon: &epsilon };
            boundary.add_to_mobility(segments, &targets, &mut out, pool.as_deref());
        }
    });
    PyArray1::from_vec(py, out)
        .reshape_with_order([3 * targets.len(), 3 * nodes.len()], numpy::npyffi::NPY_ORDER::NPY_FORTRANORDER)
}

fn boundary(py: Python<'_>, wall: Option<WallInput>) -> PyResult<Option<Boundary>> {
    Ok(wall.map(|wall| wall.specification(py)).transpose()?.and_then(|wall| wall.boundary()))
}

/// Velocity at the points, (M, 3), for a force density over `8 pi mu`.
#[pyfunction]
pub fn velocity<'py>(
    py: Python<'py>,
    at: PyReadonlyArray2<'py, f64>,
    nodes: PyReadonlyArray2<'py, f64>,
    edges: PyReadonlyArray2<'py, i64>,
    density: PyReadonlyArray2<'py, f64>,
    epsilon: PyReadonlyArray1<'py, f64>,
    threads: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let at = points(py, "points", &at)?;
    let nodes = points(py, "nodes", &nodes)?;
    let density = points(py, "force_density", &density)?;
    let edges = pairs(py, "edges", &edges, nodes.len())?;
    let epsilon = regularizations(py, &epsilon, edges.len())?;
    let mut out = vec![crate::Vec3::zeros(); at.len()];
    py.detach(|| {
        let pool = threads::pool(threads);
        stokeslet::velocity(&at, &nodes, &edges, &density, &epsilon, &mut out, pool.as_deref());
    });
    from_points(py, &out)
}

/// Nodes, edges and regularizations of segments.
type SegmentArrays<'py> = (PyReadonlyArray2<'py, f64>, PyReadonlyArray2<'py, i64>, PyReadonlyArray1<'py, f64>);

/// What the images behind a wall add to the velocity at the points, (M, 3), of a force density over 8 pi mu.
#[pyfunction]
pub fn image_velocity<'py>(
    py: Python<'py>,
    at: PyReadonlyArray2<'py, f64>,
    segments: SegmentArrays<'py>,
    density: PyReadonlyArray2<'py, f64>,
    wall: WallInput,
    threads: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (nodes, edges, epsilon) = segments;
    let at = points(py, "points", &at)?;
    let nodes = points(py, "nodes", &nodes)?;
    let density = points(py, "force_density", &density)?;
    let edges = pairs(py, "edges", &edges, nodes.len())?;
    let epsilon = regularizations(py, &epsilon, edges.len())?;
    let boundary = boundary(py, Some(wall))?;
    let mut out = vec![crate::Vec3::zeros(); at.len()];
    py.detach(|| {
        let pool = threads::pool(threads);
        if let Some(boundary) = boundary {
            let segments = Segments { nodes: &nodes, edges: &edges, epsilon: &epsilon };
            boundary.add_to_velocity(segments, &density, &at, &mut out, pool.as_deref());
        }
    });
    from_points(py, &out)
}

/// `W f` of a nodal density, (N, 3): the nodal forces.
#[pyfunction]
pub fn hat_weights<'py>(
    py: Python<'py>,
    nodes: PyReadonlyArray2<'py, f64>,
    edges: PyReadonlyArray2<'py, i64>,
    force_density: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let nodes = points(py, "nodes", &nodes)?;
    let density = points(py, "force_density", &force_density)?;
    let edges = pairs(py, "edges", &edges, nodes.len())?;
    let flat: Vec<f64> = density.iter().flat_map(|f| [f.x, f.y, f.z]).collect();
    let mut out = vec![0.0; flat.len()];
    stokeslet::HatWeights::new(&nodes, &edges).apply(&flat, &mut out);
    super::arrays::from_flat(py, out, 3)
}

type Distances<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// Distances and closest points of pairs of segments.
#[pyfunction]
pub fn segment_distance<'py>(
    py: Python<'py>,
    a0: PyReadonlyArray2<'py, f64>,
    a1: PyReadonlyArray2<'py, f64>,
    b0: PyReadonlyArray2<'py, f64>,
    b1: PyReadonlyArray2<'py, f64>,
) -> PyResult<Distances<'py>> {
    let ends = [points(py, "a0", &a0)?, points(py, "a1", &a1)?, points(py, "b0", &b0)?, points(py, "b1", &b1)?];
    let pairs = (0..ends[0].len()).map(|k| distance(&ends[0][k], &ends[1][k], &ends[2][k], &ends[3][k]));
    let closest: Vec<_> = pairs.collect();
    let array =
        |value: fn(&crate::contact::distance::ClosestPoints) -> f64| PyArray1::from_iter(py, closest.iter().map(value));
    Ok((array(|c| c.distance), array(|c| c.s), array(|c| c.t)))
}

/// Threads used when asked for `asked`, else `FLAGRS_THREADS`, else the machine's.
#[pyfunction]
#[pyo3(signature = (asked=None))]
pub fn thread_count(asked: Option<usize>) -> usize {
    threads::thread_count(asked)
}
