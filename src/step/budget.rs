//! What an accepted step adds to the account of energies, balances and extremes.
//!
//! Powers are those of the step's own forces at its end: every term's force times the velocities of the step. A step of first
//! order moves at one velocity throughout, so force times displacement is its exact work; at higher orders the mean of both ends
//! is taken. What is stored is measured as a state, so that the defect of the budget is the error of the step and no identity.

use crate::Vec3;
use crate::forces::motors::Drive;
use crate::model::Model;
use crate::rod::assembly::{Assembly, Increment, Term};
use crate::rod::configuration::node;
use crate::state::account::{Account, CHANNELS, CLAMPS, CONTACT, FLUID, GRAVITY, HEAD, LOADS, MOTORS, OTHER, TWIST};
use crate::step::problem::{Balance, Step, gather, scatter, subtract_background};

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

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Balance {
    /// Account after an accepted step, of which the last residual was evaluated at its end.
    pub(crate) fn account(&mut self, accepted: &Accepted) -> Account {
        let Accepted { model, step, velocity, dt, order, .. } = *accepted;
        let mut account = step.state.account;
        let mut power = [0.0; CHANNELS];
        self.outer.fill(0.0);
        power[MOTORS] = self.motor_power(accepted);
        power[CLAMPS] = dot(&self.reaction, velocity);
        power[GRAVITY] = dot(&model.weights, velocity);
        power[FLUID] = self.fluid_power(accepted);
        self.carried(accepted, false);
        let carried = self.flow.iter().zip(self.fluid_dofs.iter().flat_map(|&dof| dof..dof + 3));
        let given = carried.map(|(force, dof)| force * self.carried[dof]).sum::<f64>();
        // The work that a background flow does on the filaments is given by it, and not taken from what resists.
        power[FLUID] -= given;
        power[LOADS] -= given;
        self.add_terms(accepted, &mut power);
        power[CONTACT] = self.contact_power(accepted);
        account.add(dt, order, power);
        account.stored = self.stored(model, accepted.q, velocity, step.scheme.has_inertia());
        account.most_stored = account.most_stored.max(account.stored.iter().sum::<f64>().abs());
        self.check_balance(model, accepted.q, &mut account);
        self.meet_extremes(accepted, &mut account);
        account
    }

    fn motor_power(&self, accepted: &Accepted) -> f64 {
        let Accepted { model, step, velocity, dt, .. } = *accepted;
        let power = model.motors.iter().enumerate().map(|(k, motor)| {
            let torque = motor.torque(model.hinges.moments(motor.hinge, &self.configuration));
            let speed = match motor.drive {
                Drive::Speed => (accepted.motor_angles[k] - step.state.motor_angles[k]) / dt,
                Drive::Torque { dof } => velocity[dof],
            };
            torque * speed
        });
        power.sum()
    }

    fn fluid_power(&mut self, accepted: &Accepted) -> f64 {
        let (velocity, implicit) = (accepted.velocity, accepted.step.scheme.fluid_is_implicit());
        let Some(fluid) = self.fluid.as_mut().filter(|_| implicit) else {
            self.outer.iter_mut().zip(&self.constant).for_each(|(outer, force)| *outer += force);
            return dot(&self.constant, velocity);
        };
        match fluid.nonlocal() {
            Some(mobility) => mobility.weigh(accepted.density, &mut self.flow),
            None => {
                gather(&self.fluid_dofs, |dof| velocity[dof], &mut self.flow);
                subtract_background(accepted.step, fluid.immersed(), &mut self.flow);
                if fluid.resist(&mut self.flow, self.threads.pool().as_deref()).is_err() {
                    self.flow.fill(0.0);
                }
            }
        }
        scatter(&self.fluid_dofs, &self.flow, &mut self.outer);
        let parts = self.fluid_dofs.iter().zip(self.flow.chunks_exact(3));
        parts.map(|(&dof, force)| dot(force, &velocity[dof..dof + 3])).sum()
    }

    /// Sets the rates of all degrees of freedom that move with the background flow; the head's edges turn with it like a rigid body
    /// if `head` asks for it.
    fn carried(&mut self, accepted: &Accepted, head: bool) {
        let Accepted { model, step, q, .. } = *accepted;
        self.carried.fill(0.0);
        let Some(ambient) = &step.ambient else { return };
        let background = ambient.background();
        let (node_dofs, edge_dofs) = (model.network.node_dofs(), model.network.edge_dofs());
        let mut set = |dof: usize, value: Vec3| self.carried[dof..dof + 3].copy_from_slice(value.as_slice());
        match model.specification.head.as_ref().filter(|_| head) {
            None => {
                node_dofs.iter().zip(background.node_velocities).for_each(|(&dof, flow)| set(dof, *flow));
                edge_dofs.iter().zip(background.edge_spins).for_each(|(&dof, spin)| self.carried[dof] = *spin);
            }
            Some(head) => {
                let (centre, spin) = (node(q, node_dofs[head.node]), background.node_spins[head.node]);
                for &end in head.edges.iter().flat_map(|&edge| &model.network.edges()[edge]) {
                    let arm = node(q, node_dofs[end]) - centre;
                    set(node_dofs[end], background.node_velocities[head.node] + spin.cross(&arm));
                }
                for &edge in &head.edges {
                    self.carried[edge_dofs[edge]] = spin.dot(&self.configuration.tangent(edge));
                }
            }
        }
    }

    /// Powers of the dissipative terms one by one, and their forces, inertia and loads among the outer ones.
    fn add_terms(&mut self, accepted: &Accepted, power: &mut [f64; CHANNELS]) {
        let Accepted { model, step, velocity, .. } = *accepted;
        let increment = step.increment();
        for term in &model.dissipative {
            self.share.fill(0.0);
            let mut out = Assembly { residual: &mut self.share, jacobian: None };
            term.add(&self.configuration, &increment, &mut out);
            self.outer.iter_mut().zip(&self.share).for_each(|(outer, force)| *outer += force);
            let channel = match term.name() {
                "weight" => continue,
                "forces" | "torques" | "follower forces" | "follower torques" | "magnetism" => {
                    power[LOADS] -= dot(&self.share, velocity);
                    continue;
                }
                "twist drag" => TWIST,
                "head" => HEAD,
                _ => OTHER,
            };
            power[channel] += dot(&self.share, velocity);
            if step.ambient.is_some() {
                let share = std::mem::take(&mut self.share);
                self.carried(accepted, channel == HEAD);
                let given = dot(&share, &self.carried);
                self.share = share;
                power[channel] -= given;
                power[LOADS] -= given;
            }
        }
        if let Some(outside) = &step.outside {
            self.share.fill(0.0);
            outside.add(model.network.node_dofs(), &step.state.q, accepted.q, &mut self.share);
            self.outer.iter_mut().zip(&self.share).for_each(|(outer, force)| *outer += force);
            power[LOADS] -= dot(&self.share, velocity);
        }
        if let (Some(law), Some(barrier)) = (model.barrier(), &mut self.barrier) {
            barrier.add_wall_forces(law, model.network.node_dofs(), accepted.q, &increment, &mut self.outer);
        }
        if step.scheme.has_inertia() {
            let mut out = Assembly { residual: &mut self.outer, jacobian: None };
            model.inertia.add(&self.configuration, &increment, &mut out);
        }
    }

    /// What friction takes, or the passes of the method of Spillmann and Teschner, which has no energy.
    fn contact_power(&mut self, accepted: &Accepted) -> f64 {
        let Accepted { model, step, q, velocity, .. } = *accepted;
        let passes = -dot(&self.contact, velocity);
        let (Some(law), Some(barrier)) = (model.barrier(), &mut self.barrier) else { return passes };
        if !law.has_friction() {
            return passes;
        }
        self.share.fill(0.0);
        let mut ignored = vec![0.0; q.len()];
        let increment: Increment = step.increment();
        barrier.add_forces(law, model.network.node_dofs(), q, &increment, &mut ignored, &mut self.share);
        passes + dot(&self.share, velocity)
    }

    /// Elastic energy of the present configuration, contact energy and kinetic energy, J.
    pub(crate) fn stored(&mut self, model: &Model, q: &[f64], velocity: &[f64], inertia: bool) -> [f64; 3] {
        let elastic = model.stretching.energy(&self.configuration) + model.hinges.energy(&self.configuration);
        let contact = match (model.barrier(), &mut self.barrier) {
            (Some(law), Some(barrier)) => barrier.energy(law, model.network.node_dofs(), q),
            _ => 0.0,
        };
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
            let (force, arm) = (node(&self.outer, dof), node(q, dof) - centres[part]);
            sums[part][0] += force;
            sums[part][1] += arm.cross(&force);
            sizes[part][0] += force.norm();
            sizes[part][1] += arm.norm() * force.norm();
        }
        for (edge, (&[i, _], &dof)) in model.network.edges().iter().zip(edge_dofs).enumerate() {
            let (part, torque) = (model.part_of_node[i], self.outer[dof]);
            let spin = self.configuration.vector(edge).cross(&self.configuration.holonomy(edge).gradient);
            sums[part][1] += (self.configuration.tangent(edge) - spin) * torque;
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
        let (time, configuration) = (account.time, &self.configuration);
        let largest = |values: &mut dyn Iterator<Item = f64>| {
            values.enumerate().fold((0.0, 0), |most, (k, value)| if value > most.0 { (value, k) } else { most })
        };
        let bend = |hinge: usize| model.hinges.bend(hinge, configuration);
        let strain = |edge: usize| model.stretching.strain(configuration, edge).abs();
        let width = |edge: usize| model.regularization[edge] / configuration.length(edge);
        // In the instant in which what is out of balance lets go, velocities say nothing of the motion that follows.
        let lasting = accepted.dt >= accepted.shortest_lasting;
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
