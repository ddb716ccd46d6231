//! Contact by the method of Spillmann and Teschner (2008): penetration is turned into forces until it is below a tolerance.
//!
//! A pair of edges that overlap by `p` is pushed apart with a force `f n` at its closest points, `n` the unit vector between
//! them. A pass over all pairs changes every force by
//!
//! ```text
//!   f <- max(0, f + k p),      k = k_A k_B / (k_A + k_B)
//! ```
//!
//! with `k_A` the stiffness of the closest point of an edge against displacement within the step, interpolated from its
//! nodes: `m / dt^2` with inertia (equation 21) plus `zeta / dt` with implicit drag, `zeta` the node's own resistance (at no
//! inertia the drag takes the place of the mass). For equal nodes `k = k_A / 2`, the factor 1/2 of equation 20. The
//! force balance is solved anew after every pass, detection included, until every overlap and, for pairs that push, every gap is
//! below the tolerance. Unlike Lim et al.'s displacements, forces may shrink again within the loop, so those of the last
//! step can be its start: the fixed point is the same. Forces are equal and opposite and act along the line between
//! their points, so that they have neither a resultant nor a torque. Theory: docs/theory, "Contact".

use super::broad_phase::BroadPhase;
use super::distance::{ClosestPoints, segment_distance};
use super::exclusion::Exclusion;
use crate::Vec3;

/// What the contact of a scene obeys; constant.
#[derive(Debug, Clone)]
pub struct ContactLaw {
    edges: Vec<[usize; 2]>,
    radius: Vec<f64>,
    exclusion: Exclusion,
    colliding: Vec<bool>,
    tolerance: f64,
    max_iterations: usize,
}

impl ContactLaw {
    /// `radius` (E) in m, `exclusion` of the same edges; `tolerance` is the deepest overlap left in sums of radii.
    pub fn new(
        edges: &[[usize; 2]],
        radius: &[f64],
        exclusion: Exclusion,
        colliding: &[bool],
        tolerance: f64,
        max_iterations: usize,
    ) -> Self {
        Self {
            edges: edges.to_vec(),
            radius: radius.to_vec(),
            exclusion,
            colliding: colliding.to_vec(),
            tolerance,
            max_iterations,
        }
    }

    /// Largest number of passes in a step.
    pub fn max_iterations(&self) -> usize {
        self.max_iterations
    }

    /// Deepest overlap left, in sums of radii.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Sum of the radii of a pair, m.
    pub fn thickness(&self, [a, b]: [usize; 2]) -> f64 {
        self.radius[a] + self.radius[b]
    }

    fn closest(&self, [a, b]: [usize; 2], nodes: &[Vec3]) -> ClosestPoints {
        let ([a0, a1], [b0, b1]) = (self.edges[a], self.edges[b]);
        segment_distance(&nodes[a0], &nodes[a1], &nodes[b0], &nodes[b1])
    }

    /// The smallest gap between surfaces of edges that may touch, m, and the pair; `None` if no pair may.
    pub fn smallest_gap(&self, nodes: &[Vec3]) -> Option<(f64, [usize; 2])> {
        let gap = |pair: [usize; 2]| self.closest(pair, nodes).distance - self.thickness(pair);
        self.least(gap)
    }

    /// The distance of the centrelines, m, of the pair that overlaps most in sums of radii, and the pair.
    pub fn deepest(&self, nodes: &[Vec3]) -> Option<(f64, [usize; 2])> {
        let ratio = |pair: [usize; 2]| self.closest(pair, nodes).distance / self.thickness(pair);
        self.least(ratio).map(|(ratio, pair)| (ratio * self.thickness(pair), pair))
    }

    fn least(&self, measure: impl Fn([usize; 2]) -> f64) -> Option<(f64, [usize; 2])> {
        let count = self.edges.len();
        let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
        let touching = |&[a, b]: &[usize; 2]| self.colliding[a] && self.colliding[b] && !self.exclusion.excludes(a, b);
        let measured = pairs.filter(touching).map(|pair| (measure(pair), pair));
        measured.min_by(|(a, _), (b, _)| a.total_cmp(b))
    }
}

/// What a pass over all pairs has found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pass {
    /// Worst violation, overlap or gap under load, in sums of radii.
    pub violation: f64,
    /// Pairs that push.
    pub pushing: usize,
}

/// The contact loop of a step.
pub struct ContactSolver {
    broad_phase: BroadPhase,
    forces: Vec<([u32; 2], f64)>,
    updated: Vec<([u32; 2], f64)>,
    gain: f64,
    last_violation: f64,
}

/// Factors by which the gain grows while passes converge slowly and shrinks when one has made things worse. A node's own
/// resistance overstates how far it yields in a long step, so that plain passes (gain 1) converge, but slowly; many pairs
/// on the same nodes push together, so that less than a plain pass may be needed.
const GAIN_GROWTH: f64 = 1.6;
const GAIN_SHRINKAGE: f64 = 0.4;
const SMALLEST_GAIN: f64 = 1.0 / 16.0;

impl ContactSolver {
    /// A loop for scenes under this law.
    pub fn new(law: &ContactLaw) -> Self {
        Self {
            broad_phase: BroadPhase::new(&law.edges, Some(&law.colliding), law.exclusion.clone()),
            forces: Vec::new(),
            updated: Vec::new(),
            gain: 1.0,
            last_violation: f64::INFINITY,
        }
    }

    /// Starts a step from the forces of the last one.
    pub fn begin(&mut self, previous: &[([u32; 2], f64)]) {
        self.forces.clear();
        self.forces.extend_from_slice(previous);
        self.gain = 1.0;
        self.last_violation = f64::INFINITY;
    }

    /// The present forces, N, by pair, pairs ascending.
    pub fn forces(&self) -> &[([u32; 2], f64)] {
        &self.forces
    }

    /// Measures all pairs at these positions and updates the forces; `stiffness` of every node is in N/m.
    pub fn pass(&mut self, law: &ContactLaw, nodes: &[Vec3], stiffness: &[f64]) -> Pass {
        let margin = law.radius.iter().copied().fold(0.0, f64::max);
        let candidates = self.broad_phase.candidates(nodes, &law.radius, margin);
        self.updated.clear();
        let mut violation: f64 = 0.0;
        // Both lists ascend. A loaded pair that has been thrown out of the candidates is measured all the same: its gap is a
        // violation that its force must answer for.
        let mut old = self.forces.iter().copied().peekable();
        let mut near = candidates.iter().copied().peekable();
        loop {
            let pair = match (old.peek(), near.peek()) {
                (Some(&(loaded, _)), Some(&candidate)) => loaded.min(candidate),
                (Some(&(loaded, _)), None) => loaded,
                (None, Some(&candidate)) => candidate,
                (None, None) => break,
            };
            near.next_if_eq(&pair);
            let force = old.next_if(|(loaded, _)| *loaded == pair).map_or(0.0, |(_, force)| force);
            let [a, b] = pair.map(|edge| edge as usize);
            let sum = law.radius[a] + law.radius[b];
            let closest = law.closest([a, b], nodes);
            let overlap = sum - closest.distance;
            if overlap <= 0.0 && force == 0.0 {
                continue;
            }
            violation = violation.max(overlap.abs() / sum);
            let at = |edge: usize, s: f64| {
                let [i, j] = law.edges[edge];
                (1.0 - s) * stiffness[i] + s * stiffness[j]
            };
            let (ka, kb) = (at(a, closest.s), at(b, closest.t));
            let updated = force + self.gain * overlap * ka * kb / (ka + kb);
            if updated > 0.0 {
                self.updated.push((pair, updated));
            }
        }
        std::mem::swap(&mut self.forces, &mut self.updated);
        if violation > self.last_violation {
            self.gain = (self.gain * GAIN_SHRINKAGE).max(SMALLEST_GAIN);
        } else if violation > 0.5 * self.last_violation {
            self.gain *= GAIN_GROWTH;
        }
        self.last_violation = violation;
        Pass { violation, pushing: self.forces.len() }
    }

    /// Adds the present forces to the nodes through `add(node, force)`.
    pub fn spread(&self, law: &ContactLaw, nodes: &[Vec3], mut add: impl FnMut(usize, Vec3)) {
        for &(pair, force) in &self.forces {
            let [a, b] = pair.map(|edge| edge as usize);
            let closest = law.closest([a, b], nodes);
            let push = closest.normal * force;
            for (edge, place, push) in [(a, closest.s, push), (b, closest.t, -push)] {
                let [i, j] = law.edges[edge];
                add(i, push * (1.0 - place));
                add(j, push * place);
            }
        }
    }
}
