//! Which pairs of edges can never touch because they are neighbours along a rod.
//!
//! Two edges of one rod lie within a diameter of each other simply because the rod connects them.
//! Counting edges to skip such pairs ties the mesh to the radius; the rest arc length between them
//! does not: a pair is excluded when the shortest path along the network, from the nearest end of
//! one edge to the nearest end of the other, is shorter than `factor (r_i + r_j)`. Edges that share
//! a node are always excluded, edges of unconnected rods never.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::FRAC_PI_2;

/// Default excluded arc length over the sum of the radii: `pi/2`, that is `pi r` for a uniform rod.
///
/// Take a rod of radius `r` whose centreline bends with curvature at most `1/r`, the most a solid
/// rod can. By Schur's comparison theorem two of its points an arc `sigma <= pi r` apart are at
/// least as far apart as on the circle of radius `r`, `2 r sin(sigma / 2 r)`, which reaches the
/// diameter `2 r` at `sigma = pi r` and not before. Up to there, closeness shows the bend and is no
/// contact. Points further apart along the rod and closer than `2 r` in space mean that the rod has
/// come back to itself, which is contact: the tightest case is the U of its own radius, whose arms
/// meet exactly at the arc `pi r`. On a straight rod the first pair that counts is `pi r` apart, so
/// a contact model may act up to `1.57 (r_i + r_j)` without a rod repelling itself.
///
/// Two straight arms that leave a node at an angle `alpha` overlap up to the arc
/// `2 r / sin(alpha/2)`: below 79 degrees, where that exceeds `pi r`, a fork or kink needs the
/// factor `1 / sin(alpha/2)`.
pub const DEFAULT_FACTOR: f64 = FRAC_PI_2;

/// The excluded pairs of one network, constant in time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exclusion {
    /// Partners `j > i` of edge `i`, ascending, are `partners[first[i]..first[i + 1]]`.
    first: Vec<usize>,
    partners: Vec<u32>,
}

impl Exclusion {
    /// Finds all excluded pairs, by a shortest-path search from each edge that stops at the
    /// greatest excluded arc.
    ///
    /// `edges` (E) are pairs of node indices below `node_count`, `rest_lengths` (E) and `radius`
    /// (E) are in metres and not negative, `factor` is the excluded arc over `r_i + r_j` (see
    /// [`DEFAULT_FACTOR`]; 0 leaves only the edges that share a node). Time grows as the number of
    /// edges times the number within reach of one.
    ///
    /// # Panics
    /// If an edge names a node that does not exist or the lengths of the slices differ; scenes are
    /// checked for both before a model is built.
    pub fn new(node_count: usize, edges: &[[usize; 2]], rest_lengths: &[f64], radius: &[f64], factor: f64) -> Self {
        assert!(rest_lengths.len() == edges.len() && radius.len() == edges.len(), "one length and radius per edge");
        let network = Network::new(node_count, edges, rest_lengths);
        let largest = radius.iter().copied().fold(0.0, f64::max);
        let mut search = Search::new(node_count);
        let mut first = vec![0];
        let mut partners: Vec<u32> = Vec::new();
        let mut excluded: Vec<u32> = Vec::new();

        for (i, ends) in edges.iter().enumerate() {
            search.run(&network, *ends, factor * (radius[i] + largest));
            excluded.clear();
            for &node in &search.reached {
                // Sharing a node excludes a pair whatever the factor.
                let shared = ends.contains(&node);
                for &(j, _) in network.neighbours(node) {
                    if j > i && (shared || search.arc[node] < factor * (radius[i] + radius[j])) {
                        excluded.push(j as u32);
                    }
                }
            }
            // An edge within reach is met at both of its ends.
            excluded.sort_unstable();
            excluded.dedup();
            partners.extend_from_slice(&excluded);
            first.push(partners.len());
        }
        Self { first, partners }
    }

    /// Whether edges `i` and `j` never count as a pair; an edge is excluded from itself.
    pub fn excludes(&self, i: usize, j: usize) -> bool {
        let (low, high) = (i.min(j), i.max(j));
        low == high || self.partners_after(low).binary_search(&(high as u32)).is_ok()
    }

    /// The edges `j > i` excluded with edge `i`, ascending.
    pub fn partners_after(&self, i: usize) -> &[u32] {
        &self.partners[self.first[i]..self.first[i + 1]]
    }

    /// Number of edges of the network.
    pub fn edge_count(&self) -> usize {
        self.first.len() - 1
    }
}

/// Edges at each node, with the node at their other end.
struct Network<'a> {
    first: Vec<usize>,
    incident: Vec<(usize, usize)>,
    rest_lengths: &'a [f64],
}

impl<'a> Network<'a> {
    fn new(node_count: usize, edges: &[[usize; 2]], rest_lengths: &'a [f64]) -> Self {
        let mut first = vec![0; node_count + 1];
        for &node in edges.iter().flatten() {
            first[node + 1] += 1;
        }
        for node in 0..node_count {
            first[node + 1] += first[node];
        }
        let mut next = first.clone();
        let mut incident = vec![(0, 0); 2 * edges.len()];
        for (e, &[i, j]) in edges.iter().enumerate() {
            for (node, other) in [(i, j), (j, i)] {
                incident[next[node]] = (e, other);
                next[node] += 1;
            }
        }
        Self { first, incident, rest_lengths }
    }

    fn neighbours(&self, node: usize) -> &[(usize, usize)] {
        &self.incident[self.first[node]..self.first[node + 1]]
    }
}

/// Dijkstra's search from the two ends of an edge, with buffers that serve every edge in turn.
struct Search {
    /// Shortest arc to each node (m); infinite where the search has not been.
    arc: Vec<f64>,
    /// Nodes given a finite arc by the current search.
    reached: Vec<usize>,
    queue: BinaryHeap<Visit>,
}

impl Search {
    fn new(node_count: usize) -> Self {
        Self { arc: vec![f64::INFINITY; node_count], reached: Vec::new(), queue: BinaryHeap::new() }
    }

    /// Fills `arc` for every node nearer than `limit` to one of `sources`, which themselves are at
    /// 0.
    fn run(&mut self, network: &Network, sources: [usize; 2], limit: f64) {
        for node in self.reached.drain(..) {
            self.arc[node] = f64::INFINITY;
        }
        for node in sources {
            self.offer(node, 0.0);
        }
        while let Some(Visit { arc, node }) = self.queue.pop() {
            if arc > self.arc[node] {
                continue;
            }
            for &(edge, other) in network.neighbours(node) {
                let through = arc + network.rest_lengths[edge];
                if through < limit {
                    self.offer(other, through);
                }
            }
        }
    }

    fn offer(&mut self, node: usize, arc: f64) {
        if arc < self.arc[node] {
            if self.arc[node].is_infinite() {
                self.reached.push(node);
            }
            self.arc[node] = arc;
            self.queue.push(Visit { arc, node });
        }
    }
}

/// A node waiting in the queue; the nearest one is the greatest, so that the heap yields it first.
#[derive(PartialEq)]
struct Visit {
    arc: f64,
    node: usize,
}

impl Eq for Visit {}

impl Ord for Visit {
    fn cmp(&self, other: &Self) -> Ordering {
        other.arc.total_cmp(&self.arc).then_with(|| other.node.cmp(&self.node))
    }
}

impl PartialOrd for Visit {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
