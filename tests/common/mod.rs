//! What several integration tests need: plain scenes and reproducible random numbers.
#![allow(dead_code)]

use flagrs::Vec3;
use flagrs::model::specification::Specification;

/// A small linear congruential generator: the same numbers on every machine.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// Uniform in (-1, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self, size: f64) -> Vec3 {
        Vec3::new(self.uniform(), self.uniform(), self.uniform()) * size
    }
}

/// A network without fluid, with stiffnesses of order one.
pub fn scene(nodes: Vec<Vec3>, edges: Vec<[usize; 2]>, hinges: Vec<[usize; 2]>) -> Specification {
    let (e, h) = (edges.len(), hinges.len());
    Specification {
        rest_nodes: nodes.clone(),
        nodes,
        edges,
        hinges,
        theta: vec![0.0; e],
        directors: vec![],
        radius: vec![0.1; e],
        density: vec![1.0; e],
        stretching: vec![3.0; e],
        bending: vec![[[1.0, 0.0], [0.0, 1.0]]; h],
        twisting: vec![0.8; h],
        natural_curvature: vec![None; h],
        natural_twist: vec![None; h],
        motors: vec![],
        head: None,
        clamps: vec![],
        loads: vec![],
        magnetism: None,
        walls: vec![],
        flows: vec![],
        gravity: Vec3::zeros(),
        reynolds: vec![],
        fluid: None,
        contact: None,
    }
}

/// Edges of a chain of `n` nodes.
pub fn chain_edges(n: usize) -> Vec<[usize; 2]> {
    (0..n - 1).map(|k| [k, k + 1]).collect()
}

/// Hinges of a chain of `n` nodes.
pub fn chain_hinges(n: usize) -> Vec<[usize; 2]> {
    (0..n - 2).map(|k| [k, k + 1]).collect()
}
