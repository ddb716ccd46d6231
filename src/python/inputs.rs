//! What drives a scene, from a mapping as `flagrs.assemble.native_inputs` makes it.

use std::sync::Arc;

use pyo3::prelude::*;

use super::errors::model_error;
use super::loads::{FlowInput, LoadInput, MagnetismInput};
use super::specification::{ClampInput, MotorInput};
use crate::fluid::ambient::AmbientFlow;
use crate::inputs::Inputs;
use crate::model::Model;
use crate::signal::Signal;

/// Signals of motors, clamps, loads and the magnetic field, and background flows.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct InputsInput<'py> {
    motors: Vec<MotorInput<'py>>,
    clamps: Vec<ClampInput<'py>>,
    loads: Vec<LoadInput<'py>>,
    magnetism: Option<MagnetismInput<'py>>,
    flows: Vec<FlowInput<'py>>,
}

impl InputsInput<'_> {
    /// The inputs of a model.
    pub fn inputs(self, py: Python<'_>, model: &Model) -> PyResult<Inputs> {
        let motors = self.motors.into_iter().map(MotorInput::signal).collect();
        let clamps = self.clamps.into_iter().map(ClampInput::motion).collect();
        let loads = self.loads.into_iter().map(LoadInput::specification).collect::<PyResult<Vec<_>>>()?;
        let field = self.magnetism.map(|magnetism| magnetism.specification().field);
        let signals: Vec<Signal> = loads.into_iter().map(|load| load.signal).chain(field).flatten().collect();
        let flow = |flow: FlowInput<'_>| -> Arc<dyn AmbientFlow> { Arc::from(flow.specification().flow()) };
        let flows = self.flows.into_iter().map(flow).collect();
        Inputs::with(model, motors, clamps, signals, flows).map_err(|error| model_error(py, &error))
    }
}
