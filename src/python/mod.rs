//! The Python face of the crate: thin classes and functions over arrays, nothing of the mechanics.
//!
//! * [`specification`]: a scene's plain data from a mapping of arrays.
//! * [`simulation`]: the simulation class.
//! * [`state`], [`frame`]: states and frames as arrays; [`inputs`]: what drives a scene; [`rollout`]: many states side by side.
//! * [`force`]: a function that is asked for forces.
//! * [`loads`]: loads, magnetism and background flows from mappings.
//! * [`body`]: the surface of a rigid body.
//! * [`far_field`]: the product with the mobility without its matrix.
//! * [`numerics`]: mobility, velocity and distances on plain arrays; [`walls`]: walls from mappings.
//! * [`errors`]: errors of the core as Python exceptions.
//! * [`arrays`]: positions and indices in and out of NumPy.

mod arrays;
mod body;
mod errors;
mod far_field;
mod force;
mod frame;
mod inputs;
mod loads;
mod numerics;
mod rollout;
mod simulation;
mod specification;
mod state;
mod walls;

use pyo3::prelude::*;

/// Native core of flagrs; use the package `flagrs`.
#[pymodule]
fn _flagrs(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<simulation::Simulation>()?;
    module.add_class::<far_field::FastMobility>()?;
    module.add_class::<body::BodySurface>()?;
    module.add_function(wrap_pyfunction!(numerics::mobility, module)?)?;
    module.add_function(wrap_pyfunction!(numerics::velocity, module)?)?;
    module.add_function(wrap_pyfunction!(numerics::image_velocity, module)?)?;
    module.add_function(wrap_pyfunction!(numerics::hat_weights, module)?)?;
    module.add_function(wrap_pyfunction!(numerics::segment_distance, module)?)?;
    module.add_function(wrap_pyfunction!(numerics::thread_count, module)?)?;
    Ok(())
}
