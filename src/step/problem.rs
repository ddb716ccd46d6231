//! The equations of one step, as a function of what is given and of a trial: residual and derivative of the force balance.
//!
//! The unknowns are the degrees of freedom `q` and, if the fluid is nonlocal and implicit, the force density `f` on it at the
//! immersed nodes. The balance has two parts,
//!
//! ```text
//!   r1 = dE/dq + W f + dissipation - loads - contact,        r2 = A f - 8 pi mu dx/dt,
//! ```
//!
//! so that no dense matrix is ever factored. Nothing is hidden: a [`Problem`] holds the model, the state at the beginning with what drives
//! the step, and how contact is treated; the fluid's geometry is that of the [`Flow`], and the near pairs of contact are found anew
//! wherever a trial needs others. How the linear systems are solved is told in `saddle.rs`.

use std::time::Instant;

use rayon::ThreadPool;

use crate::linear::LinearError;
use crate::model::Model;
use crate::rod::assembly::Assembly;
use crate::rod::fault::fault;
use crate::rod::term::{External, TermError};
use crate::step::contact::{ContactStrategy, Treatment};
use crate::step::evaluation::Evaluation;
use crate::step::flow::Flow;
use crate::step::given::Step;
use crate::step::unknowns::Unknowns;

/// The equations of a step.
#[derive(Clone, Copy)]
pub(crate) struct Problem<'a> {
    pub model: &'a Model,
    pub step: &'a Step<'a>,
    pub treatment: Treatment,
}

/// What stands beside the terms of the model with a memory of its own.
pub(crate) struct Medium {
    pub flow: Flow,
    pub contact: Option<Box<dyn ContactStrategy>>,
    /// Seconds spent on contact.
    pub seconds_contact: f64,
}

/// Why there is no residual at a trial.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Unbalanced {
    /// Degree of freedom where that shows, if it is known.
    pub place: Option<usize>,
    pub reason: String,
}

impl From<TermError> for Unbalanced {
    fn from(error: TermError) -> Self {
        Self { place: None, reason: error.to_string() }
    }
}

impl From<LinearError> for Unbalanced {
    fn from(error: LinearError) -> Self {
        Self { place: None, reason: error.to_string() }
    }
}

impl<'a> Problem<'a> {
    /// The problem of a step, as it is.
    pub fn new(model: &'a Model, step: &'a Step<'a>) -> Self {
        Self { model, step, treatment: Treatment::default() }
    }

    /// Moves the configuration alone to given degrees of freedom; whether they are one.
    pub fn place(&self, q: &[f64], at: &mut Evaluation) -> bool {
        let motors = self.model.motors.iter().zip(&self.step.drives.motor_angles);
        at.shafts.clear();
        at.shafts.extend(motors.map(|(motor, &angle)| motor.shaft(angle, q)));
        at.configuration.update(&self.model.network, q, &self.step.state.frames, &at.shafts)
    }

    /// Why degrees of freedom have no finite residual.
    pub fn fault(&self, q: &[f64]) -> Unbalanced {
        match fault(&self.model.network, q) {
            Some(fault) => {
                Unbalanced { place: Some(self.model.network.node_dofs()[fault.node]), reason: fault.what.to_owned() }
            }
            None => Unbalanced { place: None, reason: "forces are too large to be numbers".to_owned() },
        }
    }

    /// Evaluates the residual at a trial: gradients of energies apart from all other terms.
    pub fn evaluate(
        &self,
        trial: &Unknowns,
        medium: &mut Medium,
        pool: Option<&ThreadPool>,
        at: &mut Evaluation,
    ) -> Result<(), Unbalanced> {
        let Self { model, step, treatment } = *self;
        if !self.place(&trial.q, at) {
            return Err(self.fault(&trial.q));
        }
        let increment = step.increment();
        at.gradient.fill(0.0);
        at.residual.copy_from_slice(medium.flow.constant());
        let mut out = Assembly { residual: &mut at.gradient, jacobian: None };
        for term in model.conservative() {
            term.add(&at.configuration, step.end, &mut out)?;
        }
        let mut out = Assembly { residual: &mut at.residual, jacobian: None };
        for term in self.external() {
            term.add(&at.configuration, &increment, &mut out)?;
        }
        if let Some(contact) = &mut medium.contact {
            let start = Instant::now();
            contact.add_forces(&trial.q, &increment, treatment, (&mut at.gradient, &mut at.residual));
            medium.seconds_contact += start.elapsed().as_secs_f64();
        }
        if let Some(outside) = &step.drives.outside {
            outside.add(model.network.node_dofs(), &step.state.q, &trial.q, &mut at.residual);
        }
        medium.flow.add_forces(step, trial, pool, (&mut at.residual, &mut at.slip))?;
        Ok(())
    }

    /// The terms without an energy that count in this step.
    fn external(&self) -> impl Iterator<Item = &'a dyn External> + use<'a> {
        let inertia: Option<&'a dyn External> =
            if self.step.scheme.has_inertia() { Some(&self.model.inertia) } else { None };
        inertia.into_iter().chain(self.model.external.iter().map(|term| &**term as &dyn External))
    }

    /// Derivative of the force balance but for contact at the configuration of the last residual and the given tensions of edges, with
    /// every node's own resistance in place of a nonlocal one. Contact's goes where its pattern has room ([`crate::step::system`]).
    pub fn differentiate(&self, tensions: &[f64], flow: &Flow, at: &mut Evaluation) -> Result<(), TermError> {
        let Self { model, step, .. } = *self;
        let increment = step.increment();
        at.jacobian.fill(0.0);
        let mut out = Assembly { residual: &mut at.gradient, jacobian: Some(&mut at.jacobian) };
        model.stretching.add_with_tensions(&at.configuration, tensions, &mut out);
        for term in model.conservative().skip(1) {
            term.add(&at.configuration, step.end, &mut out)?;
        }
        for term in self.external() {
            term.add(&at.configuration, &increment, &mut out)?;
        }
        flow.add_matrix(model, step, &mut at.jacobian);
        if let Some(outside) = &step.drives.outside {
            for (slots, block) in model.storage.node_blocks.iter().zip(outside.stiffness()) {
                for (&slot, entry) in slots.iter().zip(block.as_slice()) {
                    at.jacobian[slot] += entry;
                }
            }
        }
        model.storage.held.iter().for_each(|&slot| at.jacobian[slot] = 0.0);
        model.storage.held_diagonal.iter().for_each(|&slot| at.jacobian[slot] = 1.0);
        Ok(())
    }
}
