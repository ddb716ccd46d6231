//! Barrier contact as a part of a step's equations: its elements change as rods move, and with them the sparsity pattern.

use std::sync::Arc;

use super::{ContactStrategy, Stall, Treatment, place, stall};
use crate::Vec3;
use crate::contact::pair::Curvature;
use crate::contact::potential::{BarrierLaw, BarrierState, FrictionDerivative, SlipChange};
use crate::linear::pattern::{ElementSlots, Pattern};
use crate::rod::assembly::Increment;
use crate::rod::configuration::node;
use crate::state::State;

/// The near pairs at the last trial, and where their matrices are stored.
pub(crate) struct Barrier {
    law: Arc<BarrierLaw>,
    node_dofs: Vec<usize>,
    prescribed: Vec<bool>,
    state: BarrierState,
    nodes: Vec<Vec3>,
    velocities: Vec<Vec3>,
    /// Change of the velocities that a correction makes.
    change: Vec<Vec3>,
    /// Ends of the last path that was searched.
    path: [Vec<Vec3>; 2],
    stencils: Vec<Vec<usize>>,
    slots: Vec<ElementSlots>,
    bound: bool,
}

impl Barrier {
    /// Contact under a law, for nodes given by their first degrees of freedom, some of which may be prescribed.
    pub fn new(law: &Arc<BarrierLaw>, node_dofs: &[usize], prescribed: &[bool]) -> Self {
        let state = law.state();
        // Nothing to bind, unless there are walls.
        let bound = state.stencils().next().is_none();
        Self {
            state,
            bound,
            law: Arc::clone(law),
            node_dofs: node_dofs.to_vec(),
            prescribed: prescribed.to_vec(),
            nodes: Vec::new(),
            velocities: Vec::new(),
            change: Vec::new(),
            path: [Vec::new(), Vec::new()],
            stencils: Vec::new(),
            slots: Vec::new(),
        }
    }

    /// Takes the velocities of a trial.
    fn follow(&mut self, q: &[f64], increment: &Increment) {
        self.velocities.clear();
        let rate = |dof: usize| increment.rate_of(dof, q[dof]);
        self.velocities.extend(self.node_dofs.iter().map(|&dof| Vec3::from_fn(|c, _| rate(dof + c))));
    }

    /// Moves to these degrees of freedom, with all pairs in range listed.
    fn place(&mut self, q: &[f64]) {
        place(q, &self.node_dofs, &mut self.nodes);
        if self.law.ensure(&mut self.state, &self.nodes) {
            self.bound = false;
        }
    }
}

impl ContactStrategy for Barrier {
    fn begin(&mut self, state: &State, _: &[f64]) {
        self.place(&state.q);
    }

    fn add_forces(
        &mut self,
        q: &[f64],
        increment: &Increment,
        treatment: Treatment,
        (gradient, residual): (&mut [f64], &mut [f64]),
    ) {
        self.place(q);
        if self.law.has_friction() {
            self.follow(q, increment);
        }
        let Self { law, node_dofs, state, nodes, velocities, .. } = self;
        state.widen_friction(treatment.widening);
        law.find_sliding(state, nodes);
        let spread = |element: usize, part: &[f64], out: &mut [f64]| {
            for (&node, part) in state.stencil(element).iter().zip(part.chunks_exact(3)) {
                (0..3).for_each(|c| out[node_dofs[node] + c] += part[c]);
            }
        };
        law.add(state, nodes, None, |element, part, _| spread(element, part, gradient));
        if law.has_friction() {
            let add = |element: usize, part: &[f64], _: Option<&[f64]>| spread(element, part, residual);
            law.add_friction(state, nodes, velocities, None, add);
        }
    }

    fn dissipates(&self) -> bool {
        self.law.has_friction()
    }

    fn add_outer_forces(&mut self, q: &[f64], increment: &Increment, out: &mut [f64]) {
        let walls = self.law.bodies().at_walls().count();
        if walls == 0 {
            return;
        }
        self.place(q);
        self.follow(q, increment);
        let Self { law, node_dofs, state, nodes, velocities, .. } = self;
        law.find_sliding(state, nodes);
        let mut spread = |element: usize, gradient: &[f64], _: Option<&[f64]>| {
            for (&node, part) in state.stencil(element).iter().zip(gradient.chunks_exact(3)) {
                (0..3).filter(|_| element < walls).for_each(|c| out[node_dofs[node] + c] += part[c]);
            }
        };
        law.add(state, nodes, None, &mut spread);
        law.add_friction(state, nodes, velocities, None, &mut spread);
    }

    fn energy(&mut self, q: &[f64]) -> f64 {
        self.place(q);
        self.law.energy(&self.state, &self.nodes)
    }

    fn new_blocks(&self) -> Option<Vec<Vec<usize>>> {
        let first = |nodes: &[usize]| nodes.iter().map(|&node| self.node_dofs[node]).collect();
        (!self.bound).then(|| self.state.stencils().map(first).collect())
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.stencils.clear();
        let dofs = |nodes: &[usize]| nodes.iter().flat_map(|&n| self.node_dofs[n]..self.node_dofs[n] + 3).collect();
        self.stencils.extend(self.state.stencils().map(dofs));
        self.slots.clear();
        self.slots.extend(self.stencils.iter().map(|stencil| pattern.element_slots(stencil)));
        self.bound = true;
    }

    fn add_matrix(&self, rate: f64, treatment: Treatment, values: &mut [f64]) {
        let mut free = [0.0; 144];
        let mut store = |element: usize, _: &[f64], matrix: Option<&[f64]>| {
            let (stencil, Some(matrix)) = (&self.stencils[element], matrix) else { return };
            let width = stencil.len();
            for (column, &j) in stencil.iter().enumerate() {
                for (row, &i) in stencil.iter().enumerate() {
                    let k = row + width * column;
                    free[k] = if self.prescribed[i] || self.prescribed[j] { 0.0 } else { matrix[k] };
                }
            }
            self.slots[element].add(&free[..width * width], values);
        };
        let Treatment { curvature, .. } = treatment;
        self.law.add(&self.state, &self.nodes, Some(curvature), &mut store);
        let derivative = Some(FrictionDerivative { rate, curvature });
        self.law.add_friction(&self.state, &self.nodes, &self.velocities, derivative, &mut store);
    }

    fn is_symmetric(&self, treatment: Treatment) -> bool {
        treatment.curvature == Curvature::Definite || !self.slides()
    }

    fn may_be_indefinite(&self) -> bool {
        self.state.stencils().next().is_some()
    }

    fn has_friction(&self) -> bool {
        self.law.has_friction()
    }

    fn slides(&self) -> bool {
        self.law.slides(&self.state)
    }

    fn slip_change(&mut self, moved: &[f64], rate: f64, yielding: &[f64], tolerance: f64) -> SlipChange {
        self.change.clear();
        self.change.extend(self.node_dofs.iter().map(|&dof| node(moved, dof) * rate));
        self.law.slip_change(&self.state, &self.velocities, &self.change, yielding, tolerance)
    }

    fn friction_reach(&self, mobility: &[f64]) -> f64 {
        self.law.friction_reach(&self.state, mobility)
    }

    fn step_limit(&mut self, from: &[f64], to: &[f64]) -> f64 {
        let [start, end] = &mut self.path;
        place(from, &self.node_dofs, start);
        place(to, &self.node_dofs, end);
        self.law.step_limit(&mut self.state, start, end)
    }

    fn record(&mut self, state: &mut State) {
        self.place(&state.q);
        let forces = self.law.forces(&self.state, &self.nodes);
        state.contacts = forces.iter().map(|force| (force.indices(&self.law), force.force.norm())).collect();
        state.contact_anchor.clear();
        state.contact_anchor.extend_from_slice(self.state.anchor());
    }

    fn restore(&mut self, state: &State) {
        let mut positions = Vec::new();
        if state.contact_anchor.is_empty() {
            place(&state.q, &self.node_dofs, &mut positions);
        }
        let anchor = if state.contact_anchor.is_empty() { &positions } else { &state.contact_anchor };
        if self.law.ensure_at(&mut self.state, anchor) {
            self.bound = false;
        }
    }

    fn searches(&self) -> u64 {
        self.state.searches()
    }

    fn smallest_gap(&mut self, q: &[f64]) -> Option<f64> {
        self.place(q);
        self.law.smallest_gap(&mut self.state, &self.nodes).map(|approach| approach.gap())
    }

    fn stall(&mut self, q: &[f64], iterations: u64, advanced: f64) -> Option<Stall> {
        self.place(q);
        let forces = self.law.forces(&self.state, &self.nodes);
        let strongest = forces.into_iter().max_by(|a, b| a.contact.force.total_cmp(&b.contact.force))?;
        let reason = stall::reason(&self.law, &strongest, iterations, advanced);
        Some(Stall { node: strongest.contact.nodes[0], reason })
    }
}
