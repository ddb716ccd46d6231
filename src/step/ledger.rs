//! What an accepted step adds to the account of energies, balances and extremes.
//!
//! Powers are those of the step's own forces at its end: every term's force times the velocities of the step. A step of first
//! order moves at one velocity throughout, so force times displacement is its exact work; at higher orders the mean of both ends
//! is taken. What is stored is measured as a state, so that the defect of the budget is the error of the step and no identity.

use crate::Vec3;
use crate::forces::motors::Drive;
use crate::kinematics::points::Points;
use crate::model::Model;
use crate::rod::assembly::Assembly;
use crate::rod::configuration::node;
use crate::rod::term::{External, Purpose, TermError};
use crate::state::account::{Account, CHANNELS, CLAMPS, CONTACT, FLUID, GRAVITY, HEAD, LOADS, MOTORS, OTHER, TWIST};
use crate::step::contact::Treatment;
use crate::step::given::Step;
use crate::step::solver::Solver;

/// An accepted step, as far as its account needs it.
pub(crate) struct Accepted<'a> {
    pub model: &'a Model,
    pub step: &'a Step<'a>,
    pub q: &'a [f64],
    pub velocity: &'a [f64],
    pub density: &'a [f64],
    /// Angles of the speed-driven motors at its end.
    pub motor_angles: &'a [f64],
    pub dt: f64,
    pub order: usize,
    /// Length of a step, s, from which on its velocities are those of a motion and not of an instant.
    pub shortest_lasting: f64,
}

impl Accepted<'_> {
    /// Whether it is more than an instant. In the one in which what is out of balance lets go, velocities say nothing of the motion that
    /// follows, and a way that is too short to be solved for leaves forces unbalanced.
    fn lasts(&self) -> bool {
        self.dt >= self.shortest_lasting
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Memory of the account.
pub(crate) struct Ledger {
    /// Outer forces of an accepted step, and a term's share in them.
    outer: Vec<f64>,
    share: Vec<f64>,
    /// Rates that a background flow would give.
    carried: Vec<f64>,
}

impl Ledger {
    /// Room for a model.
    pub fn new(model: &Model) -> Self {
        let zeros = || vec![0.0; model.dof_count];
        Self { outer: zeros(), share: zeros(), carried: zeros() }
    }
}

impl Solver {
    /// Account after an accepted step, of which the last residual was evaluated at its end.
    ///
    /// # Errors
    /// [`TermError`] if a term has no force there.
    pub(crate) fn account(&mut self, accepted: &Accepted) -> Result<Account, TermError> {
        let Accepted { model, step, velocity, dt, order, .. } = *accepted;
        let mut account = step.state.account;
        let mut power = [0.0; CHANNELS];
        self.ledger.outer.fill(0.0);
        power[MOTORS] = self.motor_power(accepted);
        power[CLAMPS] = dot(&self.at.reaction, velocity);
        power[GRAVITY] = dot(&model.weights, velocity);
        power[FLUID] = self.fluid_power(accepted);
        self.set_carried(accepted, false);
        let flow = &self.medium.flow;
        let carried = flow.values.iter().zip(flow.dofs().iter().flat_map(|&dof| dof..dof + 3));
        let given = carried.map(|(force, dof)| force * self.ledger.carried[dof]).sum::<f64>();
        // The work that a background flow does on the filaments is given by it, and not taken from what resists.
        power[FLUID] -= given;
        power[LOADS] -= given;
        self.add_terms(accepted, &mut power)?;
        power[CONTACT] = self.contact_power(accepted);
        account.add(dt, order, power);
        account.stored = self.stored(model, accepted.q, velocity, step.scheme.has_inertia());
        account.most_stored = account.most_stored.max(account.stored.iter().sum::<f64>().abs());
        if accepted.lasts() {
            self.check_balance(model, accepted.q, &mut account);
        }
        self.meet_extremes(accepted, &mut account);
        Ok(account)
    }

    fn motor_power(&self, accepted: &Accepted) -> f64 {
        let Accepted { model, step, velocity, dt, .. } = *accepted;
        let power = model.motors.iter().enumerate().map(|(k, motor)| {
            let torque = motor.torque(model.hinges.moments(motor.hinge, &self.at.configuration));
            let speed = match motor.drive {
                Drive::Speed => (accepted.motor_angles[k] - step.state.motor_angles[k]) / dt,
                Drive::Torque { dof } => velocity[dof],
            };
            torque * speed
        });
        power.sum()
    }

    fn fluid_power(&mut self, accepted: &Accepted) -> f64 {
        let Accepted { step, velocity, density, .. } = *accepted;
        let (pool, outer) = (self.threads.pool(), &mut self.ledger.outer);
        let flow = &mut self.medium.flow;
        if flow.implicit(step).is_none() {
            outer.iter_mut().zip(flow.constant()).for_each(|(outer, force)| *outer += force);
            return dot(flow.constant(), velocity);
        }
        flow.find_forces(step, (velocity, density), pool.as_deref());
        flow.nodes().add_forces(&flow.values, outer);
        let parts = flow.dofs().iter().zip(flow.values.chunks_exact(3));
        parts.map(|(&dof, force)| dot(force, &velocity[dof..dof + 3])).sum()
    }

    /// Sets the rates of all degrees of freedom that move with the background flow; the head's edges turn with it like a rigid body
    /// if `head` asks for it.
    fn set_carried(&mut self, accepted: &Accepted, head: bool) {
        let Accepted { model, step, q, .. } = *accepted;
        self.ledger.carried.fill(0.0);
        let Some(ambient) = &step.drives.ambient else { return };
        let background = ambient.background();
        let (node_dofs, edge_dofs) = (model.network.node_dofs(), model.network.edge_dofs());
        let mut set = |dof: usize, value: Vec3| self.ledger.carried[dof..dof + 3].copy_from_slice(value.as_slice());
        match model.specification.head.as_ref().filter(|_| head) {
            None => {
                node_dofs.iter().zip(background.node_velocities).for_each(|(&dof, flow)| set(dof, *flow));
                edge_dofs.iter().zip(background.edge_spins).for_each(|(&dof, spin)| self.ledger.carried[dof] = *spin);
            }
            Some(head) => {
                let (centre, spin) = (node(q, node_dofs[head.node]), background.node_spins[head.node]);
                for &end in head.edges.iter().flat_map(|&edge| &model.network.edges()[edge]) {
                    let arm = node(q, node_dofs[end]) - centre;
                    set(node_dofs[end], background.node_velocities[head.node] + spin.cross(&arm));
                }
                for &edge in &head.edges {
                    self.ledger.carried[edge_dofs[edge]] = spin.dot(&self.at.configuration.tangent(edge));
                }
            }
        }
    }

    /// Powers of the terms without an energy one by one, and their forces, inertia and loads among the outer ones.
    fn add_terms(&mut self, accepted: &Accepted, power: &mut [f64; CHANNELS]) -> Result<(), TermError> {
        let Accepted { model, step, velocity, .. } = *accepted;
        let increment = step.increment();
        for term in &model.external {
            self.ledger.share.fill(0.0);
            let mut out = Assembly { residual: &mut self.ledger.share, jacobian: None };
            term.add(&self.at.configuration, &increment, &mut out)?;
            self.ledger.outer.iter_mut().zip(&self.ledger.share).for_each(|(outer, force)| *outer += force);
            let channel = match term.purpose() {
                Purpose::Gravity | Purpose::Motor => continue,
                Purpose::Load => {
                    power[LOADS] -= dot(&self.ledger.share, velocity);
                    continue;
                }
                Purpose::TwistDrag => TWIST,
                Purpose::Head => HEAD,
                Purpose::Other => OTHER,
            };
            power[channel] += dot(&self.ledger.share, velocity);
            if step.drives.ambient.is_some() {
                let share = std::mem::take(&mut self.ledger.share);
                self.set_carried(accepted, channel == HEAD);
                let given = dot(&share, &self.ledger.carried);
                self.ledger.share = share;
                power[channel] -= given;
                power[LOADS] -= given;
            }
        }
        if let Some(outside) = &step.drives.outside {
            self.ledger.share.fill(0.0);
            outside.add(model.network.node_dofs(), &step.state.q, accepted.q, &mut self.ledger.share);
            self.ledger.outer.iter_mut().zip(&self.ledger.share).for_each(|(outer, force)| *outer += force);
            power[LOADS] -= dot(&self.ledger.share, velocity);
        }
        if let Some(contact) = &mut self.medium.contact {
            contact.add_outer_forces(accepted.q, &increment, &mut self.ledger.outer);
        }
        if step.scheme.has_inertia() {
            let mut out = Assembly { residual: &mut self.ledger.outer, jacobian: None };
            model.inertia.add(&self.at.configuration, &increment, &mut out)?;
        }
        Ok(())
    }

    /// What friction takes, or the passes of the method of Spillmann and Teschner, which has no energy.
    fn contact_power(&mut self, accepted: &Accepted) -> f64 {
        let Accepted { step, q, velocity, .. } = *accepted;
        let Some(contact) = self.medium.contact.as_mut().filter(|contact| contact.dissipates()) else { return 0.0 };
        self.ledger.share.fill(0.0);
        let mut gradient = vec![0.0; q.len()];
        let out = (&mut gradient[..], &mut self.ledger.share[..]);
        contact.add_forces(q, &step.increment(), Treatment::default(), out);
        dot(&self.ledger.share, velocity)
    }

    /// Elastic energy of the present configuration, contact energy and kinetic energy, J.
    pub(crate) fn stored(&mut self, model: &Model, q: &[f64], velocity: &[f64], inertia: bool) -> [f64; 3] {
        let mut elastic = 0.0;
        for term in model.conservative() {
            let mut own = 0.0;
            term.energies(&self.at.configuration, &mut |_, part| own += part);
            elastic += own;
        }
        let contact = self.medium.contact.as_mut().map_or(0.0, |contact| contact.energy(q));
        let squares = model.mass.iter().zip(velocity).map(|(mass, rate)| mass * rate * rate);
        [elastic, contact, if inertia { 0.5 * squares.sum::<f64>() } else { 0.0 }]
    }

    /// Sums of outer forces and torques over every free part: inner forces, left out, must cancel for them to vanish.
    fn check_balance(&mut self, model: &Model, q: &[f64], account: &mut Account) {
        let (node_dofs, edge_dofs) = (model.network.node_dofs(), model.network.edge_dofs());
        let part_count = model.free_parts.len();
        let mut sums = vec![[Vec3::zeros(); 3]; part_count];
        let mut sizes = vec![[0.0; 3]; part_count];
        for (&part, &dof) in model.part_of_node.iter().zip(node_dofs) {
            sums[part][2] += node(q, dof);
            sizes[part][2] += 1.0;
        }
        let centres: Vec<Vec3> = sums.iter().zip(&sizes).map(|(sum, size)| sum[2] / size[2]).collect();
        for (&part, &dof) in model.part_of_node.iter().zip(node_dofs) {
            let (force, arm) = (node(&self.ledger.outer, dof), node(q, dof) - centres[part]);
            sums[part][0] += force;
            sums[part][1] += arm.cross(&force);
            sizes[part][0] += force.norm();
            sizes[part][1] += arm.norm() * force.norm();
        }
        for (edge, (&[i, _], &dof)) in model.network.edges().iter().zip(edge_dofs).enumerate() {
            let (part, torque) = (model.part_of_node[i], self.ledger.outer[dof]);
            let spin = self.at.configuration.vector(edge).cross(&self.at.configuration.holonomy(edge).gradient);
            sums[part][1] += (self.at.configuration.tangent(edge) - spin) * torque;
            sizes[part][1] += torque.abs();
        }
        for part in (0..part_count).filter(|&part| model.free_parts[part]) {
            for kind in 0..2 {
                account.outer[kind] = account.outer[kind].max(sizes[part][kind]);
                let left = sums[part][kind].norm() / account.outer[kind].max(f64::MIN_POSITIVE);
                account.imbalance[kind] = account.imbalance[kind].max(left);
            }
        }
    }

    fn meet_extremes(&self, accepted: &Accepted, account: &mut Account) {
        let Accepted { model, velocity, .. } = *accepted;
        let (time, configuration) = (account.time, &self.at.configuration);
        let largest = |values: &mut dyn Iterator<Item = f64>| {
            values.enumerate().fold((0.0, 0), |most, (k, value)| if value > most.0 { (value, k) } else { most })
        };
        let bend = |hinge: usize| model.hinges.bend(hinge, configuration);
        let strain = |edge: usize| model.stretching.strain(configuration, edge).abs();
        let width = |edge: usize| model.regularization[edge] / configuration.length(edge);
        let lasting = accepted.lasts();
        let reynolds = |(&dof, scale): (&usize, &f64)| if lasting { node(velocity, dof).norm() * scale } else { 0.0 };
        let nodes = model.network.node_dofs().iter().zip(&model.specification.reynolds);
        let edges = model.network.edges().len();
        let found = [
            largest(&mut (0..model.network.hinges().len()).map(bend)),
            largest(&mut (0..edges).map(strain)),
            largest(&mut (0..edges).map(width)),
            largest(&mut nodes.map(reynolds)),
        ];
        account.extremes.iter_mut().zip(found).for_each(|(extreme, found)| extreme.meet(found, time));
    }
}
