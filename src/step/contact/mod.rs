//! Contact in a step's equations, by one of two methods behind one trait.
//!
//! * [`barrier`]: an energy and friction in the equations, whose elements change as rods move; `stall`: what to say where it stands still.
//! * [`passes`]: forces that are held while the equations are solved, and corrected between solves.

pub(crate) mod barrier;
pub(crate) mod passes;
mod stall;

use crate::Vec3;
use crate::contact::pair::Curvature;
use crate::contact::potential::SlipChange;
use crate::linear::pattern::Pattern;
use crate::model::Model;
use crate::model::contact::ContactModel;
use crate::rod::assembly::Increment;
use crate::state::State;

/// How contact is treated in a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Treatment {
    /// Factor on the smoothing velocity of friction.
    pub widening: f64,
    /// The exact derivative, or its positive semidefinite part.
    pub curvature: Curvature,
}

impl Default for Treatment {
    fn default() -> Self {
        Self { widening: 1.0, curvature: Curvature::Exact }
    }
}

/// What is to be done after the equations have been solved.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Review {
    /// Rods are apart.
    Settled,
    /// Forces have changed: the equations are to be solved anew.
    Again,
    /// They cannot be kept apart.
    Failed(String),
}

/// What to say where contact lets the time move on no more.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stall {
    /// A node where it presses most.
    pub node: usize,
    pub reason: String,
}

/// A method that keeps rods apart, with its memory of a step.
///
/// What is found at a trial is kept for the calls that follow: matrices, slip and reach are meant at the last [`Self::add_forces`].
pub(crate) trait ContactStrategy: Send + Sync {
    /// Prepares a step from a state; `stiffness` is that of every node against displacement within the step, N/m.
    fn begin(&mut self, state: &State, stiffness: &[f64]);

    /// Adds the gradient of its energy, and what has none, at a trial.
    fn add_forces(&mut self, q: &[f64], increment: &Increment, treatment: Treatment, out: (&mut [f64], &mut [f64]));

    /// Adds minus the forces that come from outside the scene's rods, such as those of walls, friction included.
    fn add_outer_forces(&mut self, _q: &[f64], _increment: &Increment, _out: &mut [f64]) {}

    /// Whether anything of it has no energy.
    fn dissipates(&self) -> bool;

    /// Energy, J.
    fn energy(&mut self, q: &[f64]) -> f64;

    /// First degrees of freedom of the nodes of every element, if they have changed since the last [`Self::bind`].
    fn new_blocks(&self) -> Option<Vec<Vec<usize>>> {
        None
    }

    /// Looks up where the elements are stored.
    fn bind(&mut self, _pattern: &Pattern) {}

    /// Adds the derivative, with rates that change by `rate` of displacements; rows and columns of what is prescribed are left out.
    fn add_matrix(&self, _rate: f64, _treatment: Treatment, _values: &mut [f64]) {}

    /// Whether that is symmetric.
    fn is_symmetric(&self, _treatment: Treatment) -> bool {
        true
    }

    /// Whether the positive semidefinite part differs from the exact derivative anywhere.
    fn may_be_indefinite(&self) -> bool {
        false
    }

    /// Whether friction, which turns over within its smoothing velocity, can act.
    fn has_friction(&self) -> bool {
        false
    }

    /// Whether it acts at the last trial.
    fn slides(&self) -> bool {
        false
    }

    /// What a displacement (m), over which velocities change by `rate` of it, means for contacts with friction: see
    /// [`crate::contact::potential::BarrierLaw::slip_change`].
    fn slip_change(&mut self, _moved: &[f64], _rate: f64, _yielding: &[f64], _tolerance: f64) -> SlipChange {
        SlipChange::default()
    }

    /// By how much friction can change sliding velocities, over its smoothing velocity, given how fast every node moves under a force,
    /// m/(N s).
    fn friction_reach(&self, _mobility: &[f64]) -> f64 {
        0.0
    }

    /// Part of the way between two sets of degrees of freedom that may be gone.
    fn step_limit(&mut self, _from: &[f64], _to: &[f64]) -> f64 {
        1.0
    }

    /// Whether forces are still being found, so that the equations need not be solved to the last digit.
    fn is_rough(&self) -> bool {
        false
    }

    /// Looks at a solution; passes that changed forces are counted in `passes`.
    fn review(&mut self, _q: &[f64], _passes: &mut u64) -> Review {
        Review::Settled
    }

    /// Writes what a state keeps of contact.
    fn record(&mut self, state: &mut State);

    /// Goes back to a state: results depend on its list of near pairs in their last digits.
    fn restore(&mut self, _state: &State) {}

    /// How often all pairs have been searched for near ones.
    fn searches(&self) -> u64 {
        0
    }

    /// Smallest gap between surfaces that may touch, m.
    fn smallest_gap(&mut self, q: &[f64]) -> Option<f64>;

    /// What to say if so many iterations have moved the time on by `advanced` seconds only.
    fn stall(&mut self, _q: &[f64], _iterations: u64, _advanced: f64) -> Option<Stall> {
        None
    }
}

/// The strategy of a model's contact, if there is any.
pub(crate) fn strategy(model: &Model) -> Option<Box<dyn ContactStrategy>> {
    let nodes = model.network.node_dofs();
    Some(match model.contact.as_ref()? {
        ContactModel::Barrier(law) => Box::new(barrier::Barrier::new(law, nodes, &model.prescribed)),
        ContactModel::SpillmannTeschner(law) => Box::new(passes::Passes::new(law, nodes)),
    })
}

/// Positions of nodes, from their first degrees of freedom.
fn place(q: &[f64], node_dofs: &[usize], out: &mut Vec<Vec3>) {
    out.clear();
    out.extend(node_dofs.iter().map(|&dof| crate::rod::configuration::node(q, dof)));
}
