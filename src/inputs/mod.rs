//! What drives a scene: the signals of motors, clamps, loads and fields, and background flows. They may change between steps.
//!
//! * `over_step`: what they do over a step.
//! * `breaks`: instants at which one of them has a corner or a jump.

pub(crate) mod breaks;
pub(crate) mod over_step;

use std::sync::Arc;

use breaks::Breaks;

use crate::Vec3;
use crate::fluid::ambient::{Ambient, AmbientFlow};
use crate::forces::motors::Drive;
use crate::kinematics::clamp::Motion;
use crate::model::{Model, ModelError};
use crate::signal::{Signal, SignalError};

/// What drives the scene of one simulation: plain signals, in the order of the model's motors, clamps, loads and flows.
#[derive(Clone)]
pub struct Inputs {
    motors: Vec<Signal>,
    clamps: Vec<Motion>,
    loads: Vec<Signal>,
    flows: Vec<Arc<dyn AmbientFlow>>,
    breaks: Breaks,
}

impl Inputs {
    /// Those that the scene of a model was described with.
    pub fn of(model: &Model) -> Self {
        let specification = &model.specification;
        let field = specification.magnetism.iter().flat_map(|magnetism| &magnetism.field);
        let loads = specification.loads.iter().flat_map(|load| &load.signal).chain(field).cloned().collect();
        let mut inputs = Self {
            motors: specification.motors.iter().map(|motor| motor.signal.clone()).collect(),
            clamps: specification.clamps.iter().map(|clamp| clamp.motion.clone()).collect(),
            loads,
            flows: specification.flows.iter().map(|flow| Arc::from(flow.flow())).collect(),
            breaks: Breaks::default(),
        };
        inputs.find_breaks(model);
        inputs
    }

    /// Angular velocity (rad/s) or torque (N m) of every motor.
    pub fn motors(&self) -> &[Signal] {
        &self.motors
    }

    /// Motion of every clamp.
    pub fn clamps(&self) -> &[Motion] {
        &self.clamps
    }

    /// The loads' signals by channel, three for every load, and then three for the magnetic field.
    pub fn loads(&self) -> &[Signal] {
        &self.loads
    }

    /// Background flows; they add up.
    pub fn flows(&self) -> &[Arc<dyn AmbientFlow>] {
        &self.flows
    }

    /// These inputs with other signals, motions and flows; as many of each as there are.
    ///
    /// # Errors
    /// [`ModelError::Length`] if there are more or fewer.
    pub fn with(
        model: &Model,
        motors: Vec<Signal>,
        clamps: Vec<Motion>,
        loads: Vec<Signal>,
        flows: Vec<Arc<dyn AmbientFlow>>,
    ) -> Result<Self, ModelError> {
        let count = |field, length: usize, expected: usize| {
            if length == expected { Ok(()) } else { Err(ModelError::Length { field, length, expected }) }
        };
        count("motors", motors.len(), model.motors.len())?;
        count("clamps", clamps.len(), model.clamps.len())?;
        count("loads", loads.len(), model.load_channels)?;
        let mut inputs = Self { motors, clamps, loads, flows, breaks: Breaks::default() };
        inputs.find_breaks(model);
        Ok(inputs)
    }

    fn find_breaks(&mut self, model: &Model) {
        let speeds = self.driving(model, |drive| matches!(drive, Drive::Speed));
        let torques = self.driving(model, |drive| matches!(drive, Drive::Torque { .. }));
        let turning = self.clamps.iter().zip(&model.clamps).filter(|(_, clamp)| !clamp.edges.is_empty());
        let turns = turning.map(|(motion, _)| &motion.spin);
        let shifts = self.clamps.iter().flat_map(Motion::shifts);
        self.breaks = Breaks::new(speeds.chain(turns), torques.chain(shifts).chain(&self.loads));
    }

    fn driving<'a>(&'a self, model: &'a Model, by: impl Fn(&Drive) -> bool + 'a) -> impl Iterator<Item = &'a Signal> {
        self.motors.iter().zip(&model.motors).filter(move |(_, motor)| by(&motor.drive)).map(|(signal, _)| signal)
    }

    /// Instants at which a step must end.
    pub(crate) fn breaks(&self) -> &Breaks {
        &self.breaks
    }

    /// The value of every channel of the loads at a time.
    ///
    /// # Errors
    /// What a user's function fails with.
    pub(crate) fn load_values(&self, time: f64) -> Result<Vec<f64>, SignalError> {
        self.loads.iter().map(|signal| signal.value(time)).collect()
    }

    /// The background flow where the nodes are, if there is any.
    ///
    /// # Errors
    /// What a user's function fails with.
    pub(crate) fn ambient(
        &self,
        edges: &[[usize; 2]],
        nodes: &[Vec3],
        time: f64,
    ) -> Result<Option<Ambient>, SignalError> {
        if self.flows.is_empty() {
            return Ok(None);
        }
        let mut ambient = Ambient::default();
        ambient.update(&self.flows, nodes, edges, time)?;
        Ok(Some(ambient))
    }
}
