//! Nonlocal drag by regularized Stokeslet segments: `Res = 8 pi mu W A^-1` (equations 12 to 14).
//!
//! `A` maps nodal force densities to nodal velocities by collocation and is not symmetric, so it is factored by LU; `W`
//! holds the integrals of products of hat functions, so that total force and torque are exact (docs/theory, "Fluid").

use super::rft::ResistiveForce;
use super::stokeslet::{HatWeights, mobility};
use super::{FluidModel, immersed_part};
use crate::linear::LinearError;
use crate::linear::dense::DenseLu;
use crate::{Mat3, Vec3};

/// Regularized Stokeslet segments on the immersed edges.
pub struct StokesletSegments {
    nodes: Vec<usize>,
    edges: Vec<[usize; 2]>,
    epsilon: Vec<f64>,
    viscosity: f64,
    positions: Vec<Vec3>,
    lu: DenseLu,
    weights: HatWeights,
    scratch: Vec<f64>,
    local: ResistiveForce,
}

impl StokesletSegments {
    /// `epsilon` is the regularization of every edge of the network, m; `local` are drag coefficients along and across,
    /// used for preconditioning only.
    pub fn new(
        nodes: &[Vec3],
        edges: &[[usize; 2]],
        immersed: &[bool],
        epsilon: &[f64],
        viscosity: f64,
        local: &[[f64; 2]],
    ) -> Self {
        let (own, own_edges, chosen) = immersed_part(edges, immersed);
        let positions: Vec<Vec3> = own.iter().map(|&node| nodes[node]).collect();
        Self {
            lu: DenseLu::new(3 * own.len()),
            weights: HatWeights::new(&positions, &own_edges),
            scratch: vec![0.0; 3 * own.len()],
            epsilon: chosen.iter().map(|&edge| epsilon[edge]).collect(),
            local: ResistiveForce::new(edges, immersed, local),
            nodes: own,
            edges: own_edges,
            viscosity,
            positions,
        }
    }
}

impl FluidModel for StokesletSegments {
    fn name(&self) -> &'static str {
        "regularized Stokeslet segments"
    }

    fn immersed(&self) -> &[usize] {
        &self.nodes
    }

    fn update(&mut self, nodes: &[Vec3], pool: Option<&rayon::ThreadPool>) -> Result<(), LinearError> {
        for (position, &node) in self.positions.iter_mut().zip(&self.nodes) {
            *position = nodes[node];
        }
        mobility(&self.positions, &self.positions, &self.edges, &self.epsilon, self.lu.matrix_mut(), pool);
        self.lu.factor()?;
        self.weights.update(&self.positions);
        self.local.update(nodes, pool)
    }

    fn resist(&mut self, velocity: &mut [f64]) -> Result<(), LinearError> {
        self.force_density(velocity)?;
        self.scratch.copy_from_slice(velocity);
        self.weights.apply(&self.scratch, velocity);
        Ok(())
    }

    fn force_density(&mut self, velocity: &mut [f64]) -> Result<(), LinearError> {
        let scale = 8.0 * std::f64::consts::PI * self.viscosity;
        velocity.iter_mut().for_each(|component| *component *= scale);
        self.lu.solve(velocity)
    }

    fn local(&self) -> &[Mat3] {
        self.local.local()
    }

    fn is_local(&self) -> bool {
        false
    }
}
