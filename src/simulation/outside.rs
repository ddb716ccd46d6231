//! The forces that a caller's function gives at the beginning of a step.

use std::sync::Arc;

use crate::forces::outside::{ForceFunction, OutsideForce, Surroundings};
use crate::rod::configuration::{Configuration, node};
use crate::simulation::Simulation;
use crate::simulation::failure::TryError;

impl Simulation {
    /// Asks a function for forces at the beginning of every step.
    pub fn set_force(&mut self, force: Option<ForceFunction>) {
        self.force = force;
        self.given = None;
    }

    /// Its forces for the next step: a step that is tried again sees the same.
    pub(crate) fn outside_force(&mut self) -> Result<Option<Arc<OutsideForce>>, TryError> {
        let Some(force) = &self.force else { return Ok(None) };
        if let Some((_, given)) = self.given.as_ref().filter(|(steps, _)| *steps == self.state.steps) {
            return Ok(Some(Arc::clone(given)));
        }
        let (network, state) = (&self.model.network, &self.state);
        let mut configuration = Configuration::new(network, self.model.dof_count);
        configuration.update(network, &state.q, &state.frames, &self.model.shafts(&state.motor_angles, &state.q));
        let directors = (0..network.edges().len()).map(|edge| {
            let [m1, m2] = configuration.material(edge);
            [m1, m2, configuration.tangent(edge)]
        });
        let given = force(&Surroundings {
            time: state.time,
            nodes: state.positions(network),
            velocities: network.node_dofs().iter().map(|&dof| node(&state.velocity, dof)).collect(),
            directors: directors.collect(),
        })?;
        let outside = Arc::new(OutsideForce::new(network, &configuration, &given)?);
        self.given = Some((state.steps, Arc::clone(&outside)));
        Ok(Some(outside))
    }
}
