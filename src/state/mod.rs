//! The changing part of a simulation: plain data, copied and restored to the last bit.
//!
//! * [`account`]: energies, balances and extremes so far.
//! * [`reaction`]: what clamps exert.
//! * `check`: what must hold of a state from elsewhere.

pub mod account;
mod check;
pub mod reaction;

use account::Account;
use reaction::Reaction;

use crate::Vec3;
use crate::bdf::control::Control;
use crate::bdf::history::History;
use crate::model::{Model, ModelError, coordinates, shape_frames};
use crate::rod::configuration::{Configuration, node};
use crate::rod::network::Network;
use crate::rod::reference::ReferenceFrames;

/// A state of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Time, s.
    pub time: f64,
    /// Accepted steps since the start.
    pub steps: u64,
    /// Degrees of freedom: positions (m), edge angles (rad), free motor angles (rad).
    pub q: Vec<f64>,
    /// Their rates over the last step.
    pub velocity: Vec<f64>,
    /// Force density on the fluid at the immersed nodes, N/m; empty unless the fluid is nonlocal and implicit.
    pub density: Vec<f64>,
    /// Tensions of edges, N, with which the next step's equations are linearised.
    pub tensions: Vec<f64>,
    /// Size and order of the next adaptive step.
    pub control: Control,
    /// States before this one, for the next guess.
    pub history: History,
    /// Reference frames of this state.
    pub frames: ReferenceFrames,
    /// Angle of every motor, rad.
    pub motor_angles: Vec<f64>,
    /// Contact forces of the last step: pairs of bodies (edges first) and force, N.
    pub contacts: Vec<([u32; 2], f64)>,
    /// Energies, balances and extremes so far.
    pub account: Account,
    /// Positions of the nodes, m, where barrier contact has listed its near pairs; empty without.
    pub contact_anchor: Vec<Vec3>,
    /// What every clamp exerted in the last step.
    pub reactions: Vec<Reaction>,
}

impl State {
    /// The state in which a scene begins.
    ///
    /// # Errors
    /// [`ModelError::Shape`] if the scene's nodes are not a configuration.
    pub fn initial(model: &Model) -> Result<Self, ModelError> {
        let (specification, network) = (&model.specification, model.network());
        let state = Self {
            time: 0.0,
            steps: 0,
            q: coordinates(network, &specification.nodes, &specification.theta, model.dof_count()),
            velocity: vec![0.0; model.dof_count()],
            density: Vec::new(),
            control: Control::default(),
            history: History::default(),
            frames: shape_frames(specification, network, &specification.nodes),
            tensions: vec![0.0; network.edges().len()],
            motor_angles: vec![0.0; model.motors.len()],
            contacts: Vec::new(),
            account: Account::default(),
            contact_anchor: Vec::new(),
            reactions: vec![Reaction::default(); model.clamps.len()],
        };
        let mut configuration = Configuration::new(network, model.dof_count());
        let shafts = model.shafts(&state.motor_angles, &state.q);
        let placed = configuration.update(network, &state.q, &state.frames, &shafts);
        if placed { Ok(state) } else { Err(ModelError::Shape { shape: "nodes" }) }
    }

    /// Gives the state force densities on the fluid of the length its scheme needs, if it has none: the next step finds them.
    pub(crate) fn fit_density(&mut self, flow: usize) {
        let kept = self.density.len();
        if kept != flow && (kept == 0 || flow == 0) {
            self.density = vec![0.0; flow];
            self.history.past.iter_mut().for_each(|sample| sample.density = vec![0.0; flow]);
        }
    }

    /// Positions of all nodes, m.
    pub fn positions(&self, network: &Network) -> Vec<Vec3> {
        network.node_dofs().iter().map(|&dof| node(&self.q, dof)).collect()
    }
}
