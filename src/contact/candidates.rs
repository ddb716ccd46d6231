//! The pairs that an energy is made of, kept while nothing has moved far.
//!
//! The list made at positions X holds every pair closer than `(1 + delta) xi + skin`. A distance changes by at most the sum of what
//! the nodes of both bodies have moved, so until a node has moved half the skin no other pair is in range: the list, and with
//! it the sparsity pattern of the Hessian, stays. It is taken from a wider list, so that all pairs are searched more rarely still. Pairs are in ascending order of their bodies whatever the search.

use super::bodies::Bodies;
use super::broad_phase::{BroadPhase, Search};
use super::distance::segment_distance;
use crate::Vec3;

/// Skin of the list of pairs from which near ones are taken, in skins of these: all pairs are searched that much less often.
const WIDER: f64 = 12.0;

/// Near pairs and where they were found.
#[derive(Clone)]
pub struct Candidates {
    broad_phase: BroadPhase,
    skin: f64,
    reach: Vec<f64>,
    positions: Vec<Vec3>,
    pairs: Vec<[usize; 2]>,
    /// Pairs within the wider skin of where they were searched for: they save searches, and results do not depend on them.
    wider: Vec<[usize; 2]>,
    searched_at: Vec<Vec3>,
    searches: u64,
}

/// The largest distance between nodes of two sets of positions, m; infinite if they are not as many.
fn moved(nodes: &[Vec3], since: &[Vec3]) -> f64 {
    if nodes.len() != since.len() {
        return f64::INFINITY;
    }
    nodes.iter().zip(since).map(|(now, then)| (now - then).norm_squared()).fold(0.0, f64::max).sqrt()
}

impl Candidates {
    /// No pairs yet, for bodies that act on each other up to `1 + delta` times the sum of their radii; `skin` in m, not negative.
    pub fn new(bodies: &Bodies, delta: f64, skin: f64) -> Self {
        let broad_phase =
            BroadPhase::new(bodies.ends(), Some(bodies.colliding()), bodies.exclusion().clone()).with_skin(0.0);
        let reach = bodies.radius().iter().map(|radius| (1.0 + delta) * radius).collect();
        Self {
            broad_phase,
            skin,
            reach,
            positions: Vec::new(),
            pairs: Vec::new(),
            wider: Vec::new(),
            searched_at: Vec::new(),
            searches: 0,
        }
    }

    /// Prescribes the way of searching.
    pub fn with_search(self, search: Search) -> Self {
        Self { broad_phase: self.broad_phase.with_search(search), ..self }
    }

    /// Makes the list hold every pair in range of `nodes` (m), and says whether it is another list now.
    pub fn ensure(&mut self, bodies: &Bodies, nodes: &[Vec3]) -> bool {
        self.slack(nodes) < 0.0 && self.list(bodies, nodes)
    }

    /// Makes the list anew at `nodes` (m), and says whether it is another one now.
    pub fn list(&mut self, bodies: &Bodies, nodes: &[Vec3]) -> bool {
        self.positions.clear();
        self.positions.extend_from_slice(nodes);
        if moved(nodes, &self.searched_at) > 0.5 * (WIDER - 1.0) * self.skin {
            self.search(bodies, nodes);
        }
        let pairs: Vec<[usize; 2]> = self.within(&self.wider, bodies, nodes, self.skin).collect();
        let changed = pairs != self.pairs;
        self.pairs = pairs;
        changed
    }

    /// Where the list was made, m; empty before the first search.
    pub fn anchor(&self) -> &[Vec3] {
        &self.positions
    }

    /// Lists all pairs within the wider skin.
    fn search(&mut self, bodies: &Bodies, nodes: &[Vec3]) {
        self.searches += 1;
        self.searched_at.clear();
        self.searched_at.extend_from_slice(nodes);
        let found = self.broad_phase.candidates(nodes, &self.reach, 0.5 * WIDER * self.skin);
        let found: Vec<[usize; 2]> = found.iter().map(|pair| pair.map(|body| body as usize)).collect();
        self.wider = self.within(&found, bodies, nodes, WIDER * self.skin).collect();
    }

    /// Those of the pairs that are in range, or within the skin of it.
    fn within<'a>(
        &'a self,
        pairs: &'a [[usize; 2]],
        bodies: &'a Bodies,
        nodes: &'a [Vec3],
        skin: f64,
    ) -> impl Iterator<Item = [usize; 2]> + 'a {
        pairs.iter().copied().filter(move |&pair| {
            let x = bodies.corners(pair, nodes);
            let distance = segment_distance(&x[0], &x[1], &x[2], &x[3]).distance;
            distance < self.reach[pair[0]] + self.reach[pair[1]] + skin
        })
    }

    /// How much further every node may move (m) before a pair outside the list can be in range; negative if that has happened.
    pub fn slack(&self, nodes: &[Vec3]) -> f64 {
        0.5 * self.skin - moved(nodes, &self.positions)
    }

    /// Pairs of bodies, ascending.
    pub fn pairs(&self) -> &[[usize; 2]] {
        &self.pairs
    }

    /// Number of searches so far.
    pub fn searches(&self) -> u64 {
        self.searches
    }

    /// Every pair whose surfaces are closer than twice a margin (m), and some more.
    pub fn within_margin(&mut self, nodes: &[Vec3], margin: f64) -> &[[u32; 2]] {
        self.broad_phase.candidates(nodes, &self.reach, margin)
    }

    /// Every pair that can come closer than the sum of its radii times `1 + delta` on straight paths between two positions (m).
    pub fn swept(&mut self, from: &[Vec3], to: &[Vec3]) -> &[[u32; 2]] {
        self.broad_phase.swept(from, to, &self.reach)
    }
}
