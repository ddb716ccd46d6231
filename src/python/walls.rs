//! Walls from the mappings that describe them.

use pyo3::prelude::*;

use super::errors::scene_error;
use crate::Vec3;
use crate::model::specification::{WallKind, WallSpecification};
use crate::plane::Plane;

/// The mapping of one wall.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(super) struct WallInput {
    point: [f64; 3],
    normal: [f64; 3],
    kind: String,
}

impl WallInput {
    pub(super) fn specification(self, py: Python<'_>) -> PyResult<WallSpecification> {
        let Some(plane) = Plane::new(Vec3::from(self.point), Vec3::from(self.normal)) else {
            let normal = format!("{:?}", self.normal);
            return Err(scene_error(py, "walls.normal", &normal, "a direction, with a point that is finite"));
        };
        let kind = match self.kind.as_str() {
            "no_slip" => WallKind::NoSlip,
            "free_surface" => WallKind::FreeSurface,
            "contact" => WallKind::Contact,
            other => return Err(scene_error(py, "walls.kind", other, "no_slip, free_surface or contact")),
        };
        Ok(WallSpecification { plane, kind })
    }
}
