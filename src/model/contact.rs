//! How a scene's rods are kept apart: by one of two methods.

use std::fmt;
use std::sync::Arc;

use crate::Vec3;
use crate::contact::bodies::{Bodies, Body};
use crate::contact::exclusion::Exclusion;
use crate::contact::friction::Friction;
use crate::contact::potential::BarrierLaw;
use crate::contact::spillmann::ContactLaw;
use crate::model::specification::{ContactMethodSpecification, ContactSpecification, Specification};
use crate::rod::network::Network;

/// The method and its constants.
pub enum ContactModel {
    /// Penetration is turned into forces by passes around the step's equations.
    SpillmannTeschner(Arc<ContactLaw>),
    /// A potential in the step's equations that grows without bound.
    Barrier(Arc<BarrierLaw>),
}

/// Two bodies that are too close, for messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// The two bodies.
    pub bodies: [Body; 2],
    /// Distance of their centrelines or centres, m.
    pub distance: f64,
    /// The distance that is allowed, m.
    pub allowed: f64,
}

impl fmt::Display for Overlap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = self.bodies;
        write!(
            f,
            "{a} and {b}, {:.4e} m apart between centrelines where contact needs more than {:.4e} m",
            self.distance, self.allowed
        )
    }
}

impl ContactModel {
    /// The method that is specified, for a scene with these rest lengths of edges, m.
    pub fn new(
        contact: &ContactSpecification,
        specification: &Specification,
        network: &Network,
        rest_lengths: &[f64],
    ) -> Self {
        let (count, edges, exclusion) = (network.node_count(), network.edges(), contact.exclusion);
        let (colliding, radius) = (&contact.colliding, &specification.radius);
        match &contact.method {
            &ContactMethodSpecification::SpillmannTeschner { tolerance, max_iterations } => {
                let exclusion = Exclusion::new(count, edges, rest_lengths, radius, exclusion);
                let law = ContactLaw::new(edges, radius, exclusion, colliding, tolerance, max_iterations);
                Self::SpillmannTeschner(Arc::new(law))
            }
            ContactMethodSpecification::Barrier { tolerance, stiffness, friction, slip_velocities, spheres } => {
                let bodies = Bodies::new(count, edges, radius, rest_lengths, colliding, spheres, exclusion);
                let bodies = bodies.with_walls(specification.walls.iter().map(|wall| wall.plane).collect());
                let law = BarrierLaw::new(bodies, *tolerance, 1.0).with_stiffness(stiffness.clone());
                let sliding = Friction { coefficient: *friction, smoothing_velocity: f64::INFINITY };
                Self::Barrier(Arc::new(if *friction > 0.0 {
                    law.with_friction(sliding).with_slip_velocities(slip_velocities.clone())
                } else {
                    law
                }))
            }
        }
    }

    /// The law of the barrier, if that is the method.
    pub fn barrier(&self) -> Option<&BarrierLaw> {
        match self {
            Self::Barrier(law) => Some(law),
            Self::SpillmannTeschner(_) => None,
        }
    }

    /// The law of Spillmann and Teschner, if that is the method.
    pub fn spillmann(&self) -> Option<&ContactLaw> {
        match self {
            Self::SpillmannTeschner(law) => Some(law),
            Self::Barrier(_) => None,
        }
    }

    /// The deepest overlap from which the method cannot start.
    pub fn overlap(&self, nodes: &[Vec3]) -> Option<Overlap> {
        match self {
            Self::SpillmannTeschner(law) => {
                let (distance, [a, b]) = law.deepest(nodes)?;
                let thickness = law.thickness([a, b]);
                let allowed = (1.0 - law.tolerance()) * thickness;
                let bodies = [Body::Edge(a), Body::Edge(b)];
                (distance < allowed).then_some(Overlap { bodies, distance, allowed })
            }
            Self::Barrier(law) => law.first_overlap(nodes).map(|approach| Overlap {
                bodies: approach.bodies,
                distance: approach.distance,
                allowed: (1.0 - law.delta()) * approach.thickness,
            }),
        }
    }
}
