//! Frames: what is told of a simulation at one instant.

use crate::Vec3;
use crate::linear::LinearError;
use crate::simulation::Simulation;
use crate::simulation::failure::StepError;
use crate::state::account::Account;
use crate::state::reaction::Reaction;

/// The energies that frames hold, in their order.
const ELASTIC: [&str; 3] = ["stretching", "bending", "twisting"];

/// One instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Time, s.
    pub time: f64,
    /// Positions, m.
    pub nodes: Vec<Vec3>,
    /// Angles of the edges' material frames, rad.
    pub theta: Vec<f64>,
    /// Velocities of the nodes, m/s.
    pub velocities: Vec<Vec3>,
    /// Force per length on the fluid at every node (3N), N/m.
    pub force_density: Vec<f64>,
    /// Angles of the motors, rad.
    pub motor_angles: Vec<f64>,
    /// Their angular velocities, rad/s.
    pub motor_speeds: Vec<f64>,
    /// Their torques on their shafts, N m.
    pub motor_torques: Vec<f64>,
    /// What clamps exert.
    pub reactions: Vec<Reaction>,
    /// Smallest gap between surfaces that may touch, m; infinite without.
    pub minimum_gap: f64,
    /// Number of touching pairs.
    pub contacts: usize,
    /// Energies, balances and extremes so far.
    pub account: Account,
    /// Energies of stretching, bending and twisting, J.
    pub energies: [f64; 3],
}

/// A frame cannot be told.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// A function of time failed, or no state was found at its time.
    #[error(transparent)]
    Step(#[from] StepError),
    /// The fluid's matrix is singular.
    #[error(transparent)]
    Linear(#[from] LinearError),
}

impl Simulation {
    /// The present frame, in the balance of forces.
    ///
    /// # Errors
    /// [`FrameError`] if a motor's function fails or the fluid's matrix is singular.
    pub fn frame(&mut self) -> Result<Frame, FrameError> {
        self.balanced(Self::seen)?
    }

    /// The frame of the state as it is.
    fn seen(&mut self) -> Result<Frame, FrameError> {
        let motor_speeds = self.motor_speeds().map_err(StepError::Signal)?;
        let force_density = self.force_density()?;
        let motor_torques = self.motor_torques();
        let minimum_gap = self.smallest_gap().unwrap_or(f64::INFINITY);
        let energies = self.energies();
        let elastic =
            |part: &str| energies.iter().find(|(name, _)| *name == part).map_or(f64::NAN, |(_, energy)| *energy);
        let energies = ELASTIC.map(elastic);
        let (state, network) = (self.state(), self.model().network());
        Ok(Frame {
            time: state.time,
            nodes: self.positions(),
            theta: network.edge_dofs().iter().map(|&dof| state.q[dof]).collect(),
            velocities: self.velocities(),
            force_density,
            motor_angles: state.motor_angles.clone(),
            motor_speeds,
            motor_torques,
            reactions: state.reactions.clone(),
            minimum_gap,
            contacts: state.contacts.len(),
            account: state.account,
            energies,
        })
    }

    /// The frame at a time within the last step, interpolated as far as contact allows.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn frame_at(&mut self, time: f64) -> Result<Frame, FrameError> {
        let then = self.frame_state(time)?;
        self.look_at(then, Self::seen)
    }
}
