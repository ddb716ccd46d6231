//! Contact of a whole scene as one potential: what a solver asks of it.
//!
//! The energy is `kappa` times the sum over all pairs that may touch of [`super::pair`]; no pair comes closer than `(1 - delta)`
//! times the sum of its radii if every move is cut to [`BarrierLaw::step_limit`]. A [`BarrierLaw`] is constant; what changes is
//! the list of near pairs, [`BarrierState`], so that one law serves many states.

use super::bodies::{Bodies, Body};
use super::candidates::Candidates;
use super::continuous::safe_part;
use super::distance::segment_distance;
use super::friction::{Friction, LaggedContact};
use super::pair::{Curvature, Pair};
use super::separation::{Gradient12, Hessian12};
use crate::Vec3;

/// Default tolerance: rods act on each other between 0.95 and 1.05 of the sum of their radii.
pub const DEFAULT_DELTA: f64 = 0.05;

/// Default skin over the radius of the thinnest edge that can touch; only speed depends on it.
const SKIN_PER_RADIUS: f64 = 1.0;

/// The constants of barrier contact.
#[derive(Clone, Debug)]
pub struct BarrierLaw {
    bodies: Bodies,
    delta: f64,
    stiffness: f64,
    skin: f64,
    friction: Option<Friction>,
}

/// The near pairs of one state of a scene, and the contacts whose friction acts.
#[derive(Clone)]
pub struct BarrierState {
    candidates: Candidates,
    /// Ascending: the candidates and, besides, the pairs with friction.
    elements: Vec<Element>,
    lagged: Vec<Lagged>,
    /// Factor on the smoothing velocity of friction.
    widening: f64,
}

#[derive(Clone)]
struct Lagged {
    bodies: [usize; 2],
    element: usize,
    contact: LaggedContact,
}

#[derive(Clone)]
struct Element {
    bodies: [usize; 2],
    pair: Pair,
    nodes: [usize; 4],
    rows: [usize; 4],
    count: usize,
}

/// Two bodies and how far apart they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// The two bodies.
    pub bodies: [Body; 2],
    /// Distance of their centrelines or centres, m.
    pub distance: f64,
    /// Sum of their radii, m.
    pub thickness: f64,
}

impl Approach {
    /// Distance of the surfaces, m; negative where they overlap.
    pub fn gap(&self) -> f64 {
        self.distance - self.thickness
    }
}

impl ContactForce {
    /// The two bodies in the numbering of the law's [`Bodies`].
    pub fn indices(&self, law: &BarrierLaw) -> [u32; 2] {
        self.bodies.map(|body| law.bodies.index(body) as u32)
    }
}

/// A pair that pushes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactForce {
    /// The two bodies.
    pub bodies: [Body; 2],
    /// The centre of force on either, in `[0, 1]` along its edge.
    pub places: [f64; 2],
    /// Force on the first body, N; the second has its opposite.
    pub force: Vec3,
    /// Nodes, weights, direction and size, as friction needs them.
    pub lagged: LaggedContact,
}

impl BarrierLaw {
    /// Contact of `bodies` with the tolerance `delta` (see [`DEFAULT_DELTA`]) and the stiffness `kappa`, Pa.
    ///
    /// # Panics
    /// Unless `0 < delta < 1` and `stiffness > 0`.
    pub fn new(bodies: Bodies, delta: f64, stiffness: f64) -> Self {
        assert!(delta > 0.0 && delta < 1.0, "the tolerance is between 0 and 1");
        assert!(stiffness > 0.0, "the stiffness is positive");
        let skin = SKIN_PER_RADIUS * bodies.thinnest();
        Self { bodies, delta, stiffness, skin, friction: None }
    }

    /// Prescribes the skin of the list of near pairs, m.
    pub fn with_skin(self, skin: f64) -> Self {
        Self { skin, ..self }
    }

    /// The same law with friction.
    pub fn with_friction(self, friction: Friction) -> Self {
        Self { friction: Some(friction), ..self }
    }

    /// Stiffness `kappa`, Pa.
    pub fn stiffness(&self) -> f64 {
        self.stiffness
    }

    /// Tolerance `delta`.
    pub fn delta(&self) -> f64 {
        self.delta
    }

    /// Whether contacts resist sliding.
    pub fn has_friction(&self) -> bool {
        self.friction.is_some()
    }

    /// What can touch.
    pub fn bodies(&self) -> &Bodies {
        &self.bodies
    }

    /// A state without pairs; [`Self::ensure`] fills it.
    pub fn state(&self) -> BarrierState {
        let candidates = Candidates::new(&self.bodies, self.delta, self.skin);
        BarrierState { candidates, elements: Vec::new(), lagged: Vec::new(), widening: 1.0 }
    }

    /// Makes the state's elements hold every pair in range of `nodes` (m), and says whether they have changed, and with them the
    /// stencils. Pairs with friction stay until [`Self::lag`] lets them go.
    pub fn ensure(&self, state: &mut BarrierState, nodes: &[Vec3]) -> bool {
        state.candidates.ensure(&self.bodies, nodes) && self.list_elements(state)
    }

    /// As [`Self::ensure`] for the nodes (m) at which another state had made its list: afterwards both have the same.
    pub fn ensure_at(&self, state: &mut BarrierState, anchor: &[Vec3]) -> bool {
        if state.candidates.anchor() == anchor {
            return false;
        }
        state.lagged.clear();
        state.candidates.list(&self.bodies, anchor);
        self.list_elements(state)
    }

    /// Makes elements of the near pairs and those with friction; whether they have changed.
    fn list_elements(&self, state: &mut BarrierState) -> bool {
        let with_friction = state.lagged.iter().map(|lagged| lagged.bodies);
        let mut pairs: Vec<[usize; 2]> = state.candidates.pairs().iter().copied().chain(with_friction).collect();
        pairs.sort_unstable();
        pairs.dedup();
        if pairs.iter().eq(state.elements.iter().map(|element| &element.bodies)) {
            return false;
        }
        state.elements.clear();
        state.elements.extend(pairs.iter().map(|&bodies| {
            let (nodes, count) = self.bodies.stencil(bodies);
            let (rows, _) = self.bodies.rows(bodies);
            Element { bodies, pair: self.bodies.pair(bodies, self.delta), nodes, rows, count }
        }));
        for lagged in &mut state.lagged {
            lagged.element = pairs.binary_search(&lagged.bodies).expect("pairs with friction are elements");
        }
        true
    }

    /// Energy, J; infinite if a pair is at its least distance or below.
    pub fn energy(&self, state: &BarrierState, nodes: &[Vec3]) -> f64 {
        let sum: f64 = state.elements.iter().map(|e| e.pair.energy(&self.bodies.corners(e.bodies, nodes))).sum();
        self.stiffness * sum
    }

    /// Hands the gradient (N) and, if asked for, the second derivative (N/m, column by column) of every element in range to
    /// `add(element, gradient, matrix)`, in the order of the nodes of its stencil, three coordinates each.
    ///
    /// `nodes` (m) must be a state that [`Self::step_limit`] allows.
    pub fn add(
        &self,
        state: &BarrierState,
        nodes: &[Vec3],
        curvature: Option<Curvature>,
        mut add: impl FnMut(usize, &[f64], Option<&[f64]>),
    ) {
        for (index, element) in state.elements.iter().enumerate() {
            let x = self.bodies.corners(element.bodies, nodes);
            let Some(at) = element.pair.evaluate(&x, curvature) else { continue };
            let gradient = at.gradient * self.stiffness;
            let hessian = curvature.map(|_| at.hessian * self.stiffness);
            element.hand_over(&gradient, hessian.as_ref(), |gradient, matrix| add(index, gradient, matrix));
        }
    }

    /// Takes forces and directions of friction from `nodes` (m), in whose range the state must be ([`Self::ensure`]), and lets
    /// go of pairs that are near no more; whether the elements have changed.
    pub fn lag(&self, state: &mut BarrierState, nodes: &[Vec3]) -> bool {
        state.lagged.clear();
        if self.friction.is_none() {
            return false;
        }
        let changed = self.list_elements(state);
        for (index, element) in state.elements.iter().enumerate() {
            if let Some(force) = self.force(element, nodes) {
                state.lagged.push(Lagged { bodies: element.bodies, element: index, contact: force.lagged });
            }
        }
        changed
    }

    fn friction_of(&self, state: &BarrierState) -> Option<Friction> {
        self.friction.map(|friction| friction.widened(state.widening))
    }

    /// Dissipation potential of friction (W) at the velocities of the nodes (m/s).
    pub fn friction_potential(&self, state: &BarrierState, velocities: &[Vec3]) -> f64 {
        let Some(friction) = &self.friction_of(state) else { return 0.0 };
        let potential =
            |lagged: &Lagged| lagged.contact.potential(friction, &lagged.contact.nodes.map(|n| velocities[n]));
        state.lagged.iter().map(potential).sum()
    }

    /// Hands the gradient of [`Self::friction_potential`] with respect to the velocities (N, minus the forces) and, if asked for,
    /// its second derivative (N s/m) to `add`, as [`Self::add`] does, on the same elements.
    pub fn add_friction(
        &self,
        state: &BarrierState,
        velocities: &[Vec3],
        with_matrix: bool,
        mut add: impl FnMut(usize, &[f64], Option<&[f64]>),
    ) {
        let Some(friction) = &self.friction_of(state) else { return };
        for Lagged { element, contact, .. } in &state.lagged {
            let velocities = contact.nodes.map(|node| velocities[node]);
            let gradient = contact.gradient(friction, &velocities);
            let hessian = with_matrix.then(|| contact.hessian(friction, &velocities));
            let hand = |gradient: &[f64], matrix: Option<&[f64]>| add(*element, gradient, matrix);
            state.elements[*element].hand_over(&gradient, hessian.as_ref(), hand);
        }
    }

    /// The largest part in `[0, 1]` of the straight way from `from` to `to` (m) over which every pair that comes into range
    /// keeps at least a tenth of its gap above the least distance. 0 if a pair has none at `from`.
    ///
    /// Any displacement is allowed: if it leaves the range of the list of near pairs, the whole way is searched.
    pub fn step_limit(&self, state: &mut BarrierState, from: &[Vec3], to: &[Vec3]) -> f64 {
        let listed = state.candidates.spare(from) >= 0.0 && state.candidates.spare(to) >= 0.0;
        let shorten = |limit: f64, pair: [usize; 2]| {
            let least = self.bodies.barrier(pair, self.delta).least();
            safe_part(&self.bodies.corners(pair, from), &self.bodies.corners(pair, to), least, limit)
        };
        if listed {
            state.candidates.pairs().iter().fold(1.0, |limit, &pair| shorten(limit, pair))
        } else {
            let pairs = state.candidates.swept(from, to);
            pairs.iter().fold(1.0, |limit, &pair| shorten(limit, pair.map(|body| body as usize)))
        }
    }

    /// The pair whose surfaces are closest; `None` if no pair may touch.
    pub fn smallest_gap(&self, state: &mut BarrierState, nodes: &[Vec3]) -> Option<Approach> {
        let listed = self.closest(state.candidates.pairs().iter().copied(), nodes);
        // A pair outside the list was further than the range and the skin when it was made.
        let known = 2.0 * (self.delta * self.bodies.thinnest() + state.candidates.spare(nodes));
        if listed.is_some_and(|approach| approach.gap() <= known) {
            return listed;
        }
        let size = nodes.iter().map(|node| (node - nodes[0]).norm()).fold(0.0, f64::max);
        let mut margin = self.skin;
        loop {
            let near = state.candidates.within_margin(nodes, margin);
            let found = self.closest(near.iter().map(|pair| pair.map(|body| body as usize)), nodes);
            // Every pair closer than both margins is listed; no two nodes are further apart than twice the size.
            if found.is_some_and(|approach| approach.gap() <= 2.0 * margin) || margin > 2.0 * size {
                return found;
            }
            margin *= 2.0;
        }
    }

    fn closest(&self, pairs: impl Iterator<Item = [usize; 2]>, nodes: &[Vec3]) -> Option<Approach> {
        pairs.map(|pair| self.approach(pair, nodes)).min_by(|a, b| a.gap().total_cmp(&b.gap()))
    }

    /// A pair that is at its least distance or closer, from where contact cannot start; the deepest if there are several.
    pub fn first_overlap(&self, nodes: &[Vec3]) -> Option<Approach> {
        let mut candidates = Candidates::new(&self.bodies, self.delta, 0.0);
        candidates.ensure(&self.bodies, nodes);
        let deepest = |a: &Approach, b: &Approach| (a.distance / a.thickness).total_cmp(&(b.distance / b.thickness));
        let overlapping = candidates.pairs().iter().filter_map(|&pair| {
            let approach = self.approach(pair, nodes);
            (approach.distance <= self.bodies.barrier(pair, self.delta).least()).then_some(approach)
        });
        overlapping.min_by(deepest)
    }

    fn approach(&self, pair: [usize; 2], nodes: &[Vec3]) -> Approach {
        let x = self.bodies.corners(pair, nodes);
        let [a, b] = pair;
        Approach {
            bodies: pair.map(|body| self.bodies.body(body)),
            distance: segment_distance(&x[0], &x[1], &x[2], &x[3]).distance,
            thickness: self.bodies.radius()[a] + self.bodies.radius()[b],
        }
    }

    /// Every pair that pushes, with its force.
    pub fn forces(&self, state: &BarrierState, nodes: &[Vec3]) -> Vec<ContactForce> {
        state.elements.iter().filter_map(|element| self.force(element, nodes)).collect()
    }

    fn force(&self, element: &Element, nodes: &[Vec3]) -> Option<ContactForce> {
        let push = element.pair.push(&self.bodies.corners(element.bodies, nodes))?;
        let (size, [s, t]) = (push.force.norm(), push.places);
        let ([a0, a1], [b0, b1]) = (self.bodies.ends()[element.bodies[0]], self.bodies.ends()[element.bodies[1]]);
        let lagged = LaggedContact {
            nodes: [a0, a1, b0, b1],
            weights: [1.0 - s, s, t - 1.0, -t],
            normal: push.force / size,
            force: self.stiffness * size,
        };
        let bodies = element.bodies.map(|body| self.bodies.body(body));
        (size > 0.0).then(|| ContactForce { bodies, places: push.places, force: push.force * self.stiffness, lagged })
    }
}

impl Element {
    /// Hands over what belongs to distinct nodes, column by column.
    #[inline]
    fn hand_over(
        &self,
        gradient: &Gradient12,
        hessian: Option<&Hessian12>,
        mut add: impl FnMut(&[f64], Option<&[f64]>),
    ) {
        let width = 3 * self.count;
        let row_of = |i: usize| 3 * self.rows[i / 3] + i % 3;
        let (mut vector, mut matrix) = ([0.0; 12], [0.0; 144]);
        for i in 0..width {
            vector[i] = gradient[row_of(i)];
        }
        let matrix = hessian.map(|hessian| {
            for j in 0..width {
                for i in 0..width {
                    matrix[j * width + i] = hessian[(row_of(i), row_of(j))];
                }
            }
            &matrix[..width * width]
        });
        add(&vector[..width], matrix);
    }
}

impl BarrierState {
    /// Multiplies the smoothing velocity of friction by a factor: a problem that is easier to solve, from whose solution the
    /// given one is found.
    pub fn widen_friction(&mut self, factor: f64) {
        self.widening = factor;
    }

    /// Distinct nodes of every element, in the order of its gradient and matrix.
    pub fn stencils(&self) -> impl Iterator<Item = &[usize]> {
        self.elements.iter().map(|element| &element.nodes[..element.count])
    }

    /// Distinct nodes of one element.
    pub fn stencil(&self, element: usize) -> &[usize] {
        let element = &self.elements[element];
        &element.nodes[..element.count]
    }

    /// Where the list of near pairs was made, m.
    pub fn anchor(&self) -> &[Vec3] {
        self.candidates.anchor()
    }

    /// Number of searches through all pairs so far.
    pub fn searches(&self) -> u64 {
        self.candidates.searches()
    }
}
