//! Barrier contact as a part of a step's equations: its elements change as rods move, and with them the sparsity pattern.

use crate::Vec3;
use crate::contact::pair::Curvature;
use crate::contact::potential::{Approach, BarrierLaw, BarrierState, ContactForce, FrictionDerivative, SlipChange};
use crate::linear::pattern::{ElementSlots, Pattern};
use crate::rod::assembly::Increment;
use crate::rod::configuration::node;

/// The near pairs at the configuration of the last residual, and where their matrices are stored.
pub(crate) struct BarrierTerm {
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
    curvature: Curvature,
}

fn place(q: &[f64], node_dofs: &[usize], out: &mut Vec<Vec3>) {
    out.clear();
    out.extend(node_dofs.iter().map(|&dof| node(q, dof)));
}

impl BarrierTerm {
    pub fn new(law: &BarrierLaw) -> Self {
        let state = law.state();
        let bound = state.stencils().next().is_none();
        Self {
            // Nothing to bind, unless there are walls.
            bound,
            state,
            nodes: Vec::new(),
            velocities: Vec::new(),
            change: Vec::new(),
            path: [Vec::new(), Vec::new()],
            stencils: Vec::new(),
            slots: Vec::new(),
            curvature: Curvature::Exact,
        }
    }

    /// Takes the positive semidefinite part of the matrix until the next step; whether there is any that it was not taken of.
    pub fn define(&mut self) -> bool {
        let exact = self.curvature == Curvature::Exact;
        self.curvature = Curvature::Definite;
        exact && self.state.stencils().next().is_some()
    }

    /// Prepares a step from these degrees of freedom.
    pub fn begin(&mut self, law: &BarrierLaw, node_dofs: &[usize], q: &[f64]) {
        self.curvature = Curvature::Exact;
        self.place(law, node_dofs, q);
    }

    /// Multiplies the smoothing velocity of friction by a factor, for a solve with the exact matrix.
    pub fn widen_friction(&mut self, factor: f64) {
        self.curvature = Curvature::Exact;
        self.state.widen_friction(factor);
    }

    /// Where the list of near pairs was made, m: part of a state, since results depend on the list in their last digits.
    pub fn anchor(&self) -> &[Vec3] {
        self.state.anchor()
    }

    /// Makes the list of near pairs where another state had made it.
    pub fn ensure_at(&mut self, law: &BarrierLaw, anchor: &[Vec3]) {
        if law.ensure_at(&mut self.state, anchor) {
            self.bound = false;
        }
    }

    fn place(&mut self, law: &BarrierLaw, node_dofs: &[usize], q: &[f64]) {
        place(q, node_dofs, &mut self.nodes);
        if law.ensure(&mut self.state, &self.nodes) {
            self.bound = false;
        }
    }

    /// How often all pairs have been searched for near ones.
    pub fn searches(&self) -> u64 {
        self.state.searches()
    }

    /// Adds the gradient of the energy to `elastic`, and friction to `residual`.
    pub fn add_forces(
        &mut self,
        law: &BarrierLaw,
        node_dofs: &[usize],
        q: &[f64],
        increment: &Increment,
        elastic: &mut [f64],
        residual: &mut [f64],
    ) {
        self.place(law, node_dofs, q);
        law.find_sliding(&mut self.state, &self.nodes);
        if law.has_friction() {
            self.follow(node_dofs, q, increment);
        }
        let state = &self.state;
        let spread = |element: usize, gradient: &[f64], out: &mut [f64]| {
            for (&node, part) in state.stencil(element).iter().zip(gradient.chunks_exact(3)) {
                (0..3).for_each(|c| out[node_dofs[node] + c] += part[c]);
            }
        };
        law.add(&self.state, &self.nodes, None, |element, gradient, _| spread(element, gradient, elastic));
        if law.has_friction() {
            let add = |element: usize, gradient: &[f64], _: Option<&[f64]>| spread(element, gradient, residual);
            law.add_friction(&self.state, &self.nodes, &self.velocities, None, add);
        }
    }

    /// Adds minus the forces of walls, friction included, to `out`.
    pub fn add_wall_forces(
        &mut self,
        law: &BarrierLaw,
        node_dofs: &[usize],
        q: &[f64],
        increment: &Increment,
        out: &mut [f64],
    ) {
        let walls = law.bodies().at_walls().count();
        if walls == 0 {
            return;
        }
        self.place(law, node_dofs, q);
        law.find_sliding(&mut self.state, &self.nodes);
        self.follow(node_dofs, q, increment);
        let mut spread = |element: usize, gradient: &[f64], _: Option<&[f64]>| {
            for (&node, part) in self.state.stencil(element).iter().zip(gradient.chunks_exact(3)) {
                (0..3).filter(|_| element < walls).for_each(|c| out[node_dofs[node] + c] += part[c]);
            }
        };
        law.add(&self.state, &self.nodes, None, &mut spread);
        law.add_friction(&self.state, &self.nodes, &self.velocities, None, &mut spread);
    }

    /// Takes the velocities of a trial.
    fn follow(&mut self, node_dofs: &[usize], q: &[f64], increment: &Increment) {
        self.velocities.clear();
        let rate = |dof: usize| increment.rate_of(dof, q[dof]);
        self.velocities.extend(node_dofs.iter().map(|&dof| Vec3::from_fn(|c, _| rate(dof + c))));
    }

    /// Energy at these degrees of freedom, J.
    pub fn energy(&mut self, law: &BarrierLaw, node_dofs: &[usize], q: &[f64]) -> f64 {
        self.place(law, node_dofs, q);
        law.energy(&self.state, &self.nodes)
    }

    /// Whether all elements have their storage on the pattern they were bound to.
    pub fn is_bound(&self) -> bool {
        self.bound
    }

    /// First degree of freedom of every node of all elements.
    pub fn blocks(&self, node_dofs: &[usize]) -> Vec<Vec<usize>> {
        self.state.stencils().map(|nodes| nodes.iter().map(|&node| node_dofs[node]).collect()).collect()
    }

    /// Looks up the storage of all elements.
    pub fn bind(&mut self, node_dofs: &[usize], pattern: &Pattern) {
        self.stencils.clear();
        let dofs = |nodes: &[usize]| nodes.iter().flat_map(|&n| node_dofs[n]..node_dofs[n] + 3).collect();
        self.stencils.extend(self.state.stencils().map(dofs));
        self.slots.clear();
        self.slots.extend(self.stencils.iter().map(|stencil| pattern.element_slots(stencil)));
        self.bound = true;
    }

    /// Whether the derivative at the configuration of the last residual is symmetric: not where there is friction.
    pub fn is_symmetric(&self, law: &BarrierLaw) -> bool {
        self.curvature == Curvature::Definite || !law.slides(&self.state)
    }

    /// What the displacements `moved` (m), over which velocities change by `rate` of them, mean for contacts with friction: see
    /// [`BarrierLaw::slip_change`].
    pub fn slip_change(
        &mut self,
        law: &BarrierLaw,
        node_dofs: &[usize],
        (moved, rate): (&[f64], f64),
        yielding: &[f64],
        tolerance: f64,
    ) -> SlipChange {
        self.change.clear();
        self.change.extend(node_dofs.iter().map(|&dof| node(moved, dof) * rate));
        law.slip_change(&self.state, &self.velocities, &self.change, yielding, tolerance)
    }

    /// See [`BarrierLaw::friction_reach`].
    pub fn friction_reach(&self, law: &BarrierLaw, mobility: &[f64]) -> f64 {
        law.friction_reach(&self.state, mobility)
    }

    /// Whether friction acts at the configuration of the last residual.
    pub fn slides(&self, law: &BarrierLaw) -> bool {
        law.slides(&self.state)
    }

    /// Adds the derivative at the configuration of the last residual; rows and columns of prescribed degrees of freedom are left out.
    pub fn add_matrix(&self, law: &BarrierLaw, rate: f64, prescribed: &[bool], values: &mut [f64]) {
        let mut free = [0.0; 144];
        let mut store = |element: usize, _: &[f64], matrix: Option<&[f64]>| {
            let (stencil, Some(matrix)) = (&self.stencils[element], matrix) else { return };
            let width = stencil.len();
            for (column, &j) in stencil.iter().enumerate() {
                for (row, &i) in stencil.iter().enumerate() {
                    let k = row + width * column;
                    free[k] = if prescribed[i] || prescribed[j] { 0.0 } else { matrix[k] };
                }
            }
            self.slots[element].add(&free[..width * width], values);
        };
        law.add(&self.state, &self.nodes, Some(self.curvature), &mut store);
        let derivative = Some(FrictionDerivative { rate, curvature: self.curvature });
        law.add_friction(&self.state, &self.nodes, &self.velocities, derivative, &mut store);
    }

    /// Part of the way from `from` to `to` over which no pair comes too close.
    pub fn step_limit(&mut self, law: &BarrierLaw, node_dofs: &[usize], from: &[f64], to: &[f64]) -> f64 {
        let [start, end] = &mut self.path;
        place(from, node_dofs, start);
        place(to, node_dofs, end);
        law.step_limit(&mut self.state, start, end)
    }

    /// Every pair that pushes at these degrees of freedom.
    pub fn forces(&mut self, law: &BarrierLaw, node_dofs: &[usize], q: &[f64]) -> Vec<ContactForce> {
        self.place(law, node_dofs, q);
        law.forces(&self.state, &self.nodes)
    }

    /// The pair whose surfaces are closest at these degrees of freedom.
    pub fn closest(&mut self, law: &BarrierLaw, node_dofs: &[usize], q: &[f64]) -> Option<Approach> {
        self.place(law, node_dofs, q);
        law.smallest_gap(&mut self.state, &self.nodes)
    }
}
