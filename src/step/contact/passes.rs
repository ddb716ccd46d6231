//! The method of Spillmann and Teschner: penetration is turned into forces by passes around the step's equations.

use std::sync::Arc;

use super::{ContactStrategy, Review, Treatment, place};
use crate::Vec3;
use crate::contact::spillmann::{ContactLaw, ContactSolver};
use crate::rod::assembly::Increment;
use crate::state::State;

/// Forces of the present pass.
pub(crate) struct Passes {
    law: Arc<ContactLaw>,
    node_dofs: Vec<usize>,
    solver: ContactSolver,
    positions: Vec<Vec3>,
    stiffness: Vec<f64>,
    /// Contact forces by degree of freedom, N.
    forces: Vec<f64>,
    settled: bool,
    made: usize,
}

impl Passes {
    /// Passes under a law, for nodes given by their first degrees of freedom.
    pub fn new(law: &Arc<ContactLaw>, node_dofs: &[usize]) -> Self {
        Self {
            solver: ContactSolver::new(law),
            law: Arc::clone(law),
            node_dofs: node_dofs.to_vec(),
            positions: Vec::new(),
            stiffness: Vec::new(),
            forces: Vec::new(),
            settled: true,
            made: 0,
        }
    }

    /// Spreads the forces of the pairs to the nodes, where these are.
    fn spread(&mut self) {
        let Self { law, node_dofs, solver, positions, forces, .. } = self;
        forces.fill(0.0);
        solver.spread(law, positions, |node, force| {
            (0..3).for_each(|c| forces[node_dofs[node] + c] += force[c]);
        });
    }
}

impl ContactStrategy for Passes {
    fn begin(&mut self, state: &State, stiffness: &[f64]) {
        self.solver.begin(&state.contacts);
        self.stiffness.clear();
        self.stiffness.extend_from_slice(stiffness);
        place(&state.q, &self.node_dofs, &mut self.positions);
        self.forces.resize(state.q.len(), 0.0);
        self.settled = self.solver.forces().is_empty();
        self.made = 0;
        self.spread();
    }

    fn add_forces(&mut self, _: &[f64], _: &Increment, _: Treatment, (_, residual): (&mut [f64], &mut [f64])) {
        residual.iter_mut().zip(&self.forces).for_each(|(residual, force)| *residual -= force);
    }

    fn dissipates(&self) -> bool {
        true
    }

    fn energy(&mut self, _: &[f64]) -> f64 {
        0.0
    }

    fn is_rough(&self) -> bool {
        !self.settled
    }

    fn review(&mut self, q: &[f64], passes: &mut u64) -> Review {
        place(q, &self.node_dofs, &mut self.positions);
        let loaded = !self.solver.forces().is_empty();
        let pass = self.solver.pass(&self.law, &self.positions, &self.stiffness);
        *passes += u64::from(loaded || pass.pushing > 0);
        let within = pass.violation <= self.law.tolerance();
        if within && self.settled {
            return Review::Settled;
        }
        self.settled = within;
        self.made += 1;
        if self.made == self.law.max_iterations() {
            return Review::Failed(format!("contact left an overlap of {:.2e} of the sum of radii", pass.violation));
        }
        self.spread();
        Review::Again
    }

    fn record(&mut self, state: &mut State) {
        state.contacts.clear();
        state.contacts.extend_from_slice(self.solver.forces());
    }

    fn smallest_gap(&mut self, q: &[f64]) -> Option<f64> {
        let mut positions = Vec::new();
        place(q, &self.node_dofs, &mut positions);
        self.law.smallest_gap(&positions).map(|(gap, _)| gap)
    }
}
