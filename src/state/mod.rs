//! The changing part of a simulation: plain data, copied and restored to the last bit.
//!
//! * `check`: what must hold of a state from elsewhere.

mod check;

use crate::Vec3;
use crate::bdf::control::Control;
use crate::bdf::history::History;
use crate::rod::configuration::node;
use crate::rod::network::Network;
use crate::rod::reference::ReferenceFrames;
use crate::step::budget::Account;

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
}

impl State {
    /// Positions of all nodes, m.
    pub fn positions(&self, network: &Network) -> Vec<Vec3> {
        network.node_dofs().iter().map(|&dof| node(&self.q, dof)).collect()
    }
}
