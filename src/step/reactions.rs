//! The forces and torques with which clamps hold what they hold, of the last residual of a step.

use crate::Vec3;
use crate::kinematics::clamp::Clamp;
use crate::model::Model;
use crate::rod::configuration::node;
use crate::state::reaction::Reaction;
use crate::step::solver::Solver;

impl Solver {
    /// What every clamp exerts: the residual of its degrees of freedom, where that of all others vanishes.
    ///
    /// Forces on nodes turn about the clamp's first node; the generalised force of an edge's angle is a torque along its tangent, less
    /// what of it the holonomy of the step has put on the edge's nodes.
    pub(crate) fn reactions(&self, model: &Model, q: &[f64], velocity: &[f64]) -> Vec<Reaction> {
        let of_clamp = |clamp: &Clamp| {
            let mut sum = Reaction::default();
            let pivot = clamp.nodes.first().map(|&dof| node(q, dof));
            for &dof in &clamp.nodes {
                let force = node(&self.at.reaction, dof);
                sum.force += force;
                sum.torque += pivot.map_or_else(Vec3::zeros, |pivot| (node(q, dof) - pivot).cross(&force));
                sum.power += force.dot(&node(velocity, dof));
            }
            for clamped in &clamp.edges {
                let (edge, torque) = (clamped.edge, self.at.reaction[clamped.dof]);
                let spin = self.at.configuration.vector(edge).cross(&self.at.configuration.holonomy(edge).gradient);
                sum.torque += (self.at.configuration.tangent(edge) - spin) * torque;
                sum.power += torque * velocity[clamped.dof];
            }
            sum
        };
        model.clamps.iter().map(of_clamp).collect()
    }
}
