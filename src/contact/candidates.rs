//! The pairs that an energy is made of, kept while nothing has moved far.
//!
//! The list made at positions X holds every pair closer than `(1 + delta) xi + skin`. A distance changes by at most the sum of what
//! the nodes of both bodies have moved, so until a node has moved half the skin no other pair is in range: the list, and with
//! it the sparsity pattern of the Hessian, stays. Pairs are in ascending order of their bodies whatever the search.

use super::bodies::Bodies;
use super::broad_phase::{BroadPhase, Search};
use super::distance::segment_distance;
use crate::Vec3;

/// Near pairs and where they were found.
#[derive(Clone)]
pub struct Candidates {
    broad_phase: BroadPhase,
    skin: f64,
    reach: Vec<f64>,
    positions: Vec<Vec3>,
    pairs: Vec<[usize; 2]>,
    searches: u64,
}

impl Candidates {
    /// No pairs yet, for bodies that act on each other up to `1 + delta` times the sum of their radii; `skin` in m, not negative.
    pub fn new(bodies: &Bodies, delta: f64, skin: f64) -> Self {
        let broad_phase =
            BroadPhase::new(bodies.ends(), Some(bodies.colliding()), bodies.exclusion().clone()).with_skin(0.0);
        let reach = bodies.radius().iter().map(|radius| (1.0 + delta) * radius).collect();
        Self { broad_phase, skin, reach, positions: Vec::new(), pairs: Vec::new(), searches: 0 }
    }

    /// Prescribes the way of searching.
    pub fn with_search(self, search: Search) -> Self {
        Self { broad_phase: self.broad_phase.with_search(search), ..self }
    }

    /// Makes the list hold every pair in range of `nodes` (m), and says whether it is another list now.
    pub fn ensure(&mut self, bodies: &Bodies, nodes: &[Vec3]) -> bool {
        if self.spare(nodes) >= 0.0 {
            return false;
        }
        self.positions.clear();
        self.positions.extend_from_slice(nodes);
        self.searches += 1;
        let found = self.broad_phase.candidates(nodes, &self.reach, 0.5 * self.skin);
        let pairs: Vec<[usize; 2]> = found
            .iter()
            .map(|pair| pair.map(|body| body as usize))
            .filter(|&pair| {
                let x = bodies.corners(pair, nodes);
                let distance = segment_distance(&x[0], &x[1], &x[2], &x[3]).distance;
                distance < self.reach[pair[0]] + self.reach[pair[1]] + self.skin
            })
            .collect();
        let changed = pairs != self.pairs;
        self.pairs = pairs;
        changed
    }

    /// Where the list was made, m; empty before the first search.
    pub fn anchor(&self) -> &[Vec3] {
        &self.positions
    }

    /// How much further every node may move (m) before a pair outside the list can be in range; negative if that has happened.
    pub fn spare(&self, nodes: &[Vec3]) -> f64 {
        if nodes.len() != self.positions.len() {
            return f64::NEG_INFINITY;
        }
        let moved2 =
            nodes.iter().zip(&self.positions).map(|(now, then)| (now - then).norm_squared()).fold(0.0, f64::max);
        0.5 * self.skin - moved2.sqrt()
    }

    /// Pairs of bodies, ascending.
    pub fn pairs(&self) -> &[[usize; 2]] {
        &self.pairs
    }

    /// Number of searches so far.
    pub fn searches(&self) -> u64 {
        self.searches
    }

    /// Every pair that can come closer than the sum of its radii times `1 + delta` on straight paths between two positions (m).
    pub fn swept(&mut self, from: &[Vec3], to: &[Vec3]) -> &[[u32; 2]] {
        self.broad_phase.swept(from, to, &self.reach)
    }
}
