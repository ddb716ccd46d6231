//! The pairs of edges near enough to be worth measuring.
//!
//! Each edge has a bounding box: the hull of its two nodes, inflated by its radius and the margin.
//! A pair is a candidate when the boxes overlap, both edges are active and the pair is not
//! excluded. The search over all pairs is done with some slack, the skin, and its result (a Verlet
//! list) serves until the nodes have used the slack up; every call then tests the current boxes of
//! the listed pairs only. So the candidates depend on the current positions alone, to the bit, and
//! never on when the last search was.

use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};

use super::exclusion::Exclusion;
use crate::Vec3;

/// How a search goes through all pairs; both find the same pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// Tests every pair of boxes: time grows as the square of the number of edges, and nothing can
    /// go wrong.
    BruteForce,
    /// Descends a tree of boxes (parry's `Bvh`).
    Tree,
}

/// Number of active edges from which a tree is the faster search.
///
/// Measured on bundles of helices, one search on one core of a 2-core Xeon: 134 edges 14 us by
/// brute force and 22 us by tree, 268 edges 49 us both, 402 edges 106 and 85 us, 2010 edges 2.9 and
/// 0.66 ms.
const TREE_FROM: usize = 270;

/// Default skin over the largest radius: a node may move by one radius before the next search. Only
/// speed depends on it.
const SKIN_PER_RADIUS: f64 = 2.0;

/// Finds candidate pairs of edges, keeping what can be reused between calls.
#[derive(Clone)]
pub struct BroadPhase {
    edges: Vec<[usize; 2]>,
    active: Vec<u32>,
    exclusion: Exclusion,
    search: Search,
    skin: Option<f64>,
    searches: u64,
    last: Option<LastSearch>,
    boxes: Vec<Bounds>,
    near: Vec<[u32; 2]>,
    candidates: Vec<[u32; 2]>,
}

/// What the last search saw.
#[derive(Clone)]
struct LastSearch {
    nodes: Vec<Vec3>,
    radius: Vec<f64>,
    margin: f64,
    skin: f64,
}

impl BroadPhase {
    /// A broad phase for the edges of one network.
    ///
    /// `edges` (E) are pairs of node indices, `active` (E) says which edges can touch others
    /// (`None`: all), `exclusion` which pairs never count. The search is chosen by the number of
    /// active edges, the skin is twice the largest radius; see [`Self::with_search`] and
    /// [`Self::with_skin`].
    ///
    /// # Panics
    /// If `active` or `exclusion` is made for another number of edges.
    pub fn new(edges: &[[usize; 2]], active: Option<&[bool]>, exclusion: Exclusion) -> Self {
        assert!(active.is_none_or(|active| active.len() == edges.len()), "one flag per edge");
        assert_eq!(exclusion.edge_count(), edges.len(), "the exclusion belongs to another network");
        let active: Vec<u32> =
            (0..edges.len()).filter(|&e| active.is_none_or(|active| active[e])).map(|e| e as u32).collect();
        let search = if active.len() < TREE_FROM { Search::BruteForce } else { Search::Tree };
        Self {
            edges: edges.to_vec(),
            active,
            exclusion,
            search,
            skin: None,
            searches: 0,
            last: None,
            boxes: Vec::new(),
            near: Vec::new(),
            candidates: Vec::new(),
        }
    }

    /// Prescribes the way of searching.
    pub fn with_search(self, search: Search) -> Self {
        Self { search, ..self }
    }

    /// Prescribes the skin (m): the slack of a search, used up when a node has moved half of it. 0
    /// searches anew whenever anything moves.
    pub fn with_skin(self, skin: f64) -> Self {
        Self { skin: Some(skin), ..self }
    }

    /// The candidates `[i, j]`, `i < j`, in ascending order.
    ///
    /// Contains every pair of active, not excluded edges whose capsules, of radius `radius[e] +
    /// margin` each, touch: every pair with a gap of at most `2 margin` between its surfaces.
    /// `nodes` are positions (m), `radius` (E) and `margin` in metres and not negative. The result
    /// is a function of these arguments alone. For an edge with a coordinate that is not finite it
    /// is not specified.
    ///
    /// # Panics
    /// If `radius` is not one per edge, or an edge names a node beyond `nodes`.
    pub fn candidates(&mut self, nodes: &[Vec3], radius: &[f64], margin: f64) -> &[[u32; 2]] {
        assert_eq!(radius.len(), self.edges.len(), "one radius per edge");
        if !self.last.as_ref().is_some_and(|last| last.covers(nodes, radius, margin)) {
            self.search(nodes, radius, margin);
        }
        fill_boxes(&mut self.boxes, &self.edges, nodes, radius, margin, PAD);
        self.candidates.clear();
        for &[i, j] in &self.near {
            if self.boxes[i as usize].overlaps(&self.boxes[j as usize]) {
                self.candidates.push([i, j]);
            }
        }
        &self.candidates
    }

    /// The pairs `[i, j]`, `i < j`, in ascending order, that may touch on the way from `from` to `to`: every pair of active, not
    /// excluded edges whose capsules of radius `radius[e]` (m) touch while each node goes along a straight path between them.
    ///
    /// # Panics
    /// If `radius` is not one per edge, or an edge names a node beyond `from` or `to`.
    pub fn swept(&mut self, from: &[Vec3], to: &[Vec3], radius: &[f64]) -> &[[u32; 2]] {
        assert_eq!(radius.len(), self.edges.len(), "one radius per edge");
        fill_boxes(&mut self.boxes, &self.edges, from, radius, 0.0, PAD);
        let start = std::mem::take(&mut self.boxes);
        fill_boxes(&mut self.boxes, &self.edges, to, radius, 0.0, PAD);
        for (bounds, start) in self.boxes.iter_mut().zip(&start) {
            *bounds = Bounds { low: bounds.low.inf(&start.low), high: bounds.high.sup(&start.high) };
        }
        let mut found = std::mem::take(&mut self.candidates);
        self.find_overlaps(&mut found);
        self.candidates = found;
        &self.candidates
    }

    /// Forgets the last search, so that the next call makes a new one. Never needed for the result
    /// to be right.
    pub fn reset(&mut self) {
        self.last = None;
    }

    /// Number of searches through all pairs so far.
    pub fn searches(&self) -> u64 {
        self.searches
    }

    /// Refills the list of near pairs with boxes that have the skin on top.
    fn search(&mut self, nodes: &[Vec3], radius: &[f64], margin: f64) {
        let skin = self
            .skin
            .unwrap_or_else(|| SKIN_PER_RADIUS * self.active.iter().map(|&e| radius[e as usize]).fold(0.0, f64::max));
        fill_boxes(&mut self.boxes, &self.edges, nodes, radius, margin + 0.5 * skin, SEARCH_PAD);
        let mut near = std::mem::take(&mut self.near);
        self.find_overlaps(&mut near);
        self.near = near;
        self.searches += 1;
        self.last = Some(LastSearch { nodes: nodes.to_vec(), radius: radius.to_vec(), margin, skin });
    }

    /// All pairs of active, not excluded edges whose boxes overlap, in ascending order.
    fn find_overlaps(&self, found: &mut Vec<[u32; 2]>) {
        found.clear();
        match self.search {
            Search::BruteForce => self.compare_all_pairs(found),
            Search::Tree => self.descend_tree(found),
        }
        found.sort_unstable();
    }

    fn compare_all_pairs(&self, found: &mut Vec<[u32; 2]>) {
        for (k, &i) in self.active.iter().enumerate() {
            let bounds = &self.boxes[i as usize];
            for &j in &self.active[k + 1..] {
                if bounds.overlaps(&self.boxes[j as usize]) && !self.exclusion.excludes(i as usize, j as usize) {
                    found.push([i, j]);
                }
            }
        }
    }

    fn descend_tree(&self, found: &mut Vec<[u32; 2]>) {
        // Leaves are numbered from 0 without gaps: parry 0.30 panics on one or two leaves numbered
        // otherwise.
        let leaves = self.active.iter().map(|&e| self.boxes[e as usize].as_parry()).enumerate();
        let tree = Bvh::from_iter(BvhBuildStrategy::Binned, leaves);
        tree.traverse_bvtt_single_tree::<false>(&mut BvhWorkspace::default(), &mut |k, l| {
            let (i, j) = (self.active[k.min(l) as usize], self.active[k.max(l) as usize]);
            if !self.exclusion.excludes(i as usize, j as usize) {
                found.push([i, j]);
            }
        });
    }
}

impl LastSearch {
    /// Whether the boxes now asked for lie within those of the search: the displacement of every
    /// node and the growth of margin and radii together have not used up half the skin. A position
    /// that is not finite is not covered.
    fn covers(&self, nodes: &[Vec3], radius: &[f64], margin: f64) -> bool {
        let grown = radius.iter().zip(&self.radius).map(|(now, then)| now - then).fold(0.0, f64::max);
        let slack = 0.5 * self.skin - (margin - self.margin).max(0.0) - grown;
        slack >= 0.0
            && nodes.len() == self.nodes.len()
            && nodes.iter().zip(&self.nodes).all(|(now, then)| (now - then).norm_squared() <= slack * slack)
    }
}

/// Allowance for rounding in a box, relative to its coordinates.
const PAD: f64 = 4.0 * f64::EPSILON;

/// The allowance while searching; the excess over [`PAD`] covers the rounding of the displacements
/// since.
const SEARCH_PAD: f64 = 16.0 * f64::EPSILON;

/// Axis-aligned bounding box of one inflated edge.
#[derive(Clone, Copy)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    #[inline(always)]
    fn overlaps(&self, other: &Bounds) -> bool {
        // One axis at a time: most pairs are apart along the first.
        (0..3).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }

    fn as_parry(&self) -> Aabb {
        Aabb::new(Vector::from_slice(self.low.as_slice()), Vector::from_slice(self.high.as_slice()))
    }
}

fn fill_boxes(boxes: &mut Vec<Bounds>, edges: &[[usize; 2]], nodes: &[Vec3], radius: &[f64], margin: f64, pad: f64) {
    boxes.clear();
    boxes.extend(edges.iter().zip(radius).map(|(&[i, j], r)| {
        let (low, high) = nodes[i].inf_sup(&nodes[j]);
        let inflation = r + margin;
        let inflation = inflation + pad * (inflation + low.amax().max(high.amax()));
        Bounds { low: low.add_scalar(-inflation), high: high.add_scalar(inflation) }
    }));
}
