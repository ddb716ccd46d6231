//! Resistive force theory: each edge feels only its own motion, with one coefficient along and one across it.

use super::{FluidModel, Mobility, immersed_part};
use crate::linear::LinearError;
use crate::{Mat3, Vec3};

/// Local drag of the immersed edges, half of each on its two nodes.
pub struct ResistiveForce {
    nodes: Vec<usize>,
    edges: Vec<[usize; 2]>,
    coefficients: Vec<[f64; 2]>,
    blocks: Vec<Mat3>,
    lengths: Vec<f64>,
}

impl ResistiveForce {
    /// `coefficients` are drag per length along and across every edge of the network, N s/m^2.
    pub fn new(edges: &[[usize; 2]], immersed: &[bool], coefficients: &[[f64; 2]]) -> Self {
        let (nodes, local, chosen) = immersed_part(edges, immersed);
        Self {
            blocks: vec![Mat3::zeros(); nodes.len()],
            lengths: vec![0.0; nodes.len()],
            coefficients: chosen.iter().map(|&edge| coefficients[edge]).collect(),
            nodes,
            edges: local,
        }
    }
}

impl FluidModel for ResistiveForce {
    fn name(&self) -> &'static str {
        "resistive force theory"
    }

    fn immersed(&self) -> &[usize] {
        &self.nodes
    }

    fn update(&mut self, nodes: &[Vec3], _: Option<&rayon::ThreadPool>) -> Result<(), LinearError> {
        self.blocks.fill(Mat3::zeros());
        self.lengths.fill(0.0);
        for (&[i, j], &[along, across]) in self.edges.iter().zip(&self.coefficients) {
            let vector = nodes[self.nodes[j]] - nodes[self.nodes[i]];
            let length = vector.norm();
            let t = vector / length;
            let parallel = t * t.transpose();
            let block = (parallel * along + (Mat3::identity() - parallel) * across) * (0.5 * length);
            for node in [i, j] {
                self.blocks[node] += block;
                self.lengths[node] += 0.5 * length;
            }
        }
        Ok(())
    }

    fn resist(&mut self, velocity: &mut [f64], _: Option<&rayon::ThreadPool>) -> Result<(), LinearError> {
        for (block, v) in self.blocks.iter().zip(velocity.chunks_exact_mut(3)) {
            let force = block * Vec3::new(v[0], v[1], v[2]);
            v.copy_from_slice(force.as_slice());
        }
        Ok(())
    }

    fn force_density(&mut self, velocity: &mut [f64], pool: Option<&rayon::ThreadPool>) -> Result<(), LinearError> {
        self.resist(velocity, pool)?;
        for (length, v) in self.lengths.iter().zip(velocity.chunks_exact_mut(3)) {
            v.iter_mut().for_each(|component| *component /= length);
        }
        Ok(())
    }

    fn local(&self) -> &[Mat3] {
        &self.blocks
    }

    fn nonlocal(&mut self) -> Option<&mut (dyn Mobility + 'static)> {
        None
    }

    fn is_local(&self) -> bool {
        true
    }
}
