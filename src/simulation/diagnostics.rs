//! What a state tells: energies, motor torques, force densities, gaps, the balance of forces and torques.

use rayon::ThreadPool;

use crate::Vec3;
use crate::fluid::FluidModel;
use crate::fluid::product::FarFieldChoice;
use crate::forces::motors::Drive;
use crate::linear::LinearError;
use crate::model::Model;
use crate::rod::configuration::node;
use crate::rod::term::TermError;
use crate::signal::SignalError;
use crate::simulation::Simulation;
use crate::state::State;
use crate::step::solver::Solver;

/// Nodes up to which a resistance matrix is formed although steps do without the mobility's: with it, its factors and
/// the mobility 3.5 GB.
const MOST_RESISTANCES: usize = 4000;

/// Distance, in sizes of a filament, within which a node stands on an edge.
const COINCIDENT: f64 = 1e-7;

impl Simulation {
    /// Energies of all terms that have one, J, by name; none where the state is no configuration.
    pub fn energies(&mut self) -> Vec<(&'static str, f64)> {
        energies(&mut self.solver, &self.model, &self.state)
    }

    /// The same at another state.
    pub(super) fn energies_of(&mut self, state: &State) -> Vec<(&'static str, f64)> {
        energies(&mut self.solver, &self.model, state)
    }

    /// Elastic gradient and Hessian values on the model's pattern.
    ///
    /// # Errors
    /// [`TermError`] if a term has none.
    pub fn elastic_derivatives(&mut self) -> Result<(Vec<f64>, Vec<f64>), TermError> {
        self.solver.elastic(&self.model, &self.state)
    }

    /// Smallest gap between surfaces that may touch, m; `None` without contact.
    pub fn smallest_gap(&mut self) -> Option<f64> {
        self.solver.medium.contact.as_mut()?.smallest_gap(&self.state.q)
    }

    /// Torque of every motor on its shaft, N m.
    pub fn motor_torques(&mut self) -> Vec<f64> {
        if !self.solver.place_state(&self.model, &self.state) {
            return vec![f64::NAN; self.model.motors.len()];
        }
        let configuration = &self.solver.at.configuration;
        self.model
            .motors
            .iter()
            .map(|motor| motor.torque(self.model.hinges.moments(motor.hinge, configuration)))
            .collect()
    }

    /// Angular velocity of every motor over the last step, rad/s: the prescribed one, or that of the free angle.
    ///
    /// # Errors
    /// What a motor's function of time fails with.
    pub fn motor_speeds(&self) -> Result<Vec<f64>, SignalError> {
        self.model
            .motors
            .iter()
            .zip(self.inputs.motors())
            .map(|(motor, signal)| match &motor.drive {
                Drive::Speed => signal.value(self.state.time),
                Drive::Torque { dof } => Ok(self.state.velocity[*dof]),
            })
            .collect()
    }

    /// Force per length on the fluid at every node (3N), N/m, for the present velocities; zero on dry nodes.
    ///
    /// # Errors
    /// If the fluid's matrix is singular.
    pub fn force_density(&mut self) -> Result<Vec<f64>, LinearError> {
        if !self.state.density.is_empty() {
            let mut out = vec![0.0; 3 * self.model.network.node_count()];
            if let Some(fluid) = self.solver.medium.flow.model_mut() {
                for (&node, value) in fluid.immersed().iter().zip(self.state.density.chunks_exact(3)) {
                    out[3 * node..3 * node + 3].copy_from_slice(value);
                }
            }
            return Ok(out);
        }
        self.with_fluid(|fluid, velocity, pool| fluid.force_density(velocity, pool))
    }

    /// Resistance of the nodes (3N x 3N, column-major), N s/m: the force that moves them through the fluid at given velocities.
    ///
    /// # Errors
    /// If the fluid's matrix is singular, or [`LinearError::MatrixFree`] if the scene has more than 4000 nodes and
    /// the far-field crossover lies below.
    pub fn resistance(&mut self) -> Result<Vec<f64>, LinearError> {
        let nodes = self.model.network.node_count();
        let positions = self.state.positions(&self.model.network);
        let mobility = self.solver.medium.flow.model_mut().and_then(FluidModel::nonlocal);
        let mut stored = match mobility.is_some_and(|mobility| mobility.is_matrix_free()) {
            true if nodes > MOST_RESISTANCES => {
                let gigabytes = 72e-9 * (nodes * nodes) as f64;
                return Err(LinearError::MatrixFree { what: "resistance", nodes, gigabytes });
            }
            true => self.model.fluid_with(Some(&FarFieldChoice::NEVER))?,
            false => None,
        };
        if let Some(fluid) = &mut stored {
            fluid.update(&positions, self.solver.threads.pool().as_deref())?;
        } else {
            let mut ignored = crate::step::statistics::Statistics::default();
            self.solver.place_fluid(&positions, &mut ignored)?;
            self.forget_fluid();
        }
        let mut out = vec![0.0; 9 * nodes * nodes];
        let Some(fluid) = stored.as_deref_mut().or_else(|| self.solver.medium.flow.model_mut()) else {
            return Ok(out);
        };
        let immersed = fluid.immersed().to_vec();
        let mut column = vec![0.0; 3 * immersed.len()];
        for (k, &source) in immersed.iter().enumerate() {
            for c in 0..3 {
                column.fill(0.0);
                column[3 * k + c] = 1.0;
                fluid.resist(&mut column, None)?;
                let target = &mut out[(3 * source + c) * 3 * nodes..][..3 * nodes];
                for (&node, force) in immersed.iter().zip(column.chunks_exact(3)) {
                    target[3 * node..3 * node + 3].copy_from_slice(force);
                }
            }
        }
        Ok(out)
    }

    fn with_fluid(
        &mut self,
        solve: impl FnOnce(&mut (dyn FluidModel + 'static), &mut [f64], Option<&ThreadPool>) -> Result<(), LinearError>,
    ) -> Result<Vec<f64>, LinearError> {
        let mut out = vec![0.0; 3 * self.model.network.node_count()];
        let positions = self.state.positions(&self.model.network);
        let mut ignored = crate::step::statistics::Statistics::default();
        self.solver.place_fluid(&positions, &mut ignored)?;
        self.forget_fluid();
        let dofs = self.solver.medium.flow.dofs().to_vec();
        let pool = self.solver.threads.pool();
        let Some(fluid) = self.solver.medium.flow.model_mut() else {
            return Ok(out);
        };
        let mut values: Vec<f64> =
            dofs.iter().flat_map(|&dof| (0..3).map(move |c| dof + c)).map(|dof| self.state.velocity[dof]).collect();
        solve(fluid, &mut values, pool.as_deref())?;
        for (&node, value) in fluid.immersed().iter().zip(values.chunks_exact(3)) {
            out[3 * node..3 * node + 3].copy_from_slice(value);
        }
        Ok(out)
    }

    /// An immersed node that stands on an edge it is no end of, to a ten-millionth of the size of its filament, and that edge.
    pub(crate) fn coincidence(&self) -> Option<[usize; 2]> {
        let Model { network, error_weight, .. } = &*self.model;
        let positions = self.positions();
        self.solver.medium.flow.dofs().iter().find_map(|&dof| {
            let point = network.node_dofs().partition_point(|&first| first < dof);
            let reach = COINCIDENT / error_weight[dof];
            let on = |&(_, &[a, b]): &(usize, &[usize; 2])| {
                if a == point || b == point {
                    return false;
                }
                let (along, arm) = (positions[b] - positions[a], positions[point] - positions[a]);
                let part = (arm.dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                (arm - along * part).norm() < reach
            };
            network.edges().iter().enumerate().find(on).map(|(edge, _)| [point, edge])
        })
    }

    /// Positions of the nodes, m.
    pub fn positions(&self) -> Vec<Vec3> {
        self.state.positions(&self.model.network)
    }

    /// Velocities of the nodes over the last step, m/s.
    pub fn velocities(&self) -> Vec<Vec3> {
        self.model.network.node_dofs().iter().map(|&dof| node(&self.state.velocity, dof)).collect()
    }
}

/// Energies of all terms at a state, J, by name; none if it is no configuration.
fn energies(solver: &mut Solver, model: &Model, state: &State) -> Vec<(&'static str, f64)> {
    let mut energies = Vec::new();
    if solver.place_state(model, state) {
        for term in model.conservative() {
            term.energies(&solver.at.configuration, &mut |name, energy| energies.push((name, energy)));
        }
    }
    energies
}
