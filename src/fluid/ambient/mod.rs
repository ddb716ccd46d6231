//! Prescribed background flows `u(x, t)`: what the fluid does far from, and without, the filaments.
//!
//! Drag acts on velocities relative to the background: `v - u` at nodes, `d theta/dt - (curl u / 2) . t` on edges.
//!
//! * [`linear`]: uniform flow and any velocity gradient: shear, extension, rotation.
//! * [`poiseuille`]: flow through a round tube or between two plates.
//! * [`function`]: a function of points and time supplied by the user.

pub mod function;
pub mod linear;
pub mod poiseuille;

use std::sync::Arc;

use crate::Vec3;
use crate::rod::assembly::Background;
use crate::signal::SignalError;

/// Velocity and half the vorticity at a point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Local {
    /// Velocity, m/s.
    pub velocity: Vec3,
    /// Angular velocity of a fluid element, half the vorticity, rad/s.
    pub spin: Vec3,
}

/// A background flow.
pub trait AmbientFlow: Send + Sync {
    /// Adds the flow at all points at a time to `out`.
    ///
    /// # Errors
    /// What a user's function fails with.
    fn add(&self, points: &[Vec3], time: f64, out: &mut [Local]) -> Result<(), SignalError>;
}

/// The background at the nodes and edges of a scene, in one instant.
#[derive(Debug, Clone, Default)]
pub struct Ambient {
    points: Vec<Vec3>,
    local: Vec<Local>,
    node_velocities: Vec<Vec3>,
    node_spins: Vec<Vec3>,
    edge_spins: Vec<f64>,
}

impl Ambient {
    /// Evaluates flows at positions of the nodes and at the midpoints of the edges.
    ///
    /// # Errors
    /// As [`AmbientFlow::add`].
    pub fn update(
        &mut self,
        flows: &[Arc<dyn AmbientFlow>],
        nodes: &[Vec3],
        edges: &[[usize; 2]],
        time: f64,
    ) -> Result<(), SignalError> {
        self.points.clear();
        self.points.extend_from_slice(nodes);
        self.points.extend(edges.iter().map(|&[i, j]| (nodes[i] + nodes[j]) * 0.5));
        self.local.clear();
        self.local.resize(self.points.len(), Local::default());
        for flow in flows {
            flow.add(&self.points, time, &mut self.local)?;
        }
        let (at_nodes, at_edges) = self.local.split_at(nodes.len());
        self.node_velocities.clear();
        self.node_velocities.extend(at_nodes.iter().map(|local| local.velocity));
        self.node_spins.clear();
        self.node_spins.extend(at_nodes.iter().map(|local| local.spin));
        self.edge_spins.clear();
        self.edge_spins.extend(edges.iter().zip(at_edges).map(|(&[i, j], local)| {
            let vector = nodes[j] - nodes[i];
            local.spin.dot(&vector) / vector.norm()
        }));
        Ok(())
    }

    /// What terms of the force balance see of it.
    pub fn background(&self) -> Background<'_> {
        Background {
            node_velocities: &self.node_velocities,
            node_spins: &self.node_spins,
            edge_spins: &self.edge_spins,
        }
    }
}
