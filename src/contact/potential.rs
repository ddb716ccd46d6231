//! Contact of a whole scene as one potential: what a solver asks of it.
//!
//! The energy is `kappa` times the sum over all pairs that may touch of [`super::pair`]; no pair comes closer than `(1 - delta)`
//! times the sum of its radii if every move is cut to [`BarrierLaw::step_limit`]. A [`BarrierLaw`] is constant; what changes is
//! the list of near pairs, [`BarrierState`], so that one law serves many states.

use super::bodies::{Bodies, Body};
use super::candidates::Candidates;
use super::continuous::safe_part;
use super::distance::segment_distance;
use super::element::{Element, Shape};
use super::friction::{Friction, SlidingContact};
use super::pair::Curvature;
use super::stiffness::Stiffness;
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
    stiffness: Stiffness,
    skin: f64,
    friction: Option<Friction>,
    /// Smoothing velocity of every body's contacts, m/s, the larger of two counts; empty if all have that of `friction`.
    slip_velocities: Vec<f64>,
}

/// The near pairs of one state of a scene, and the contacts whose friction acts.
#[derive(Clone)]
pub struct BarrierState {
    candidates: Candidates,
    /// Those at walls, which stay, then those of the candidates, in their order.
    elements: Vec<Element>,
    /// Contacts that push at the positions of the last [`BarrierLaw::find_sliding`], and their elements.
    sliding: Vec<(usize, SlidingContact)>,
    /// Factor on the smoothing velocity of friction.
    widening: f64,
}

/// The largest changes of sliding velocities that are still to be made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlipChange {
    /// Over the smoothing velocity.
    pub over_smoothing: f64,
    /// Over the smoothing velocity or, where that is larger, the sliding velocity itself.
    pub relative: f64,
}

/// Which derivative of friction is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionDerivative {
    /// Derivative of every velocity with respect to its position, 1/s.
    pub rate: f64,
    /// The exact one, or the part that is symmetric and positive semidefinite: that of the velocities.
    pub curvature: Curvature,
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
    pub contact: SlidingContact,
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
        let stiffness = Stiffness::Uniform(stiffness);
        Self { bodies, delta, stiffness, skin, friction: None, slip_velocities: Vec::new() }
    }

    /// The same law with a stiffness for every pair.
    pub fn with_stiffness(self, stiffness: Stiffness) -> Self {
        Self { stiffness, ..self }
    }

    /// The same law with a smoothing velocity of friction for every body, m/s; the larger of two counts.
    ///
    /// # Panics
    /// Unless there is one for every body.
    pub fn with_slip_velocities(self, slip_velocities: Vec<f64>) -> Self {
        assert_eq!(slip_velocities.len(), self.bodies.count(), "one slip velocity per body");
        Self { slip_velocities, ..self }
    }

    /// Prescribes the skin of the list of near pairs, m.
    pub fn with_skin(self, skin: f64) -> Self {
        Self { skin, ..self }
    }

    /// The same law with friction.
    pub fn with_friction(self, friction: Friction) -> Self {
        Self { friction: Some(friction), ..self }
    }

    /// Stiffness `kappa` of a pair, Pa.
    pub fn stiffness(&self, [a, b]: [usize; 2]) -> f64 {
        self.stiffness.of([a, b], self.bodies.thickness([a, b]), self.delta)
    }

    /// The stiffness (Pa) with which a pair that touches at a point holds a force (N) at the sum of its radii.
    pub fn stiffness_to_hold(&self, [a, b]: [usize; 2], force: f64) -> f64 {
        let thickness = self.bodies.thickness([a, b]);
        let reach = thickness * (2.0 * self.delta).sqrt();
        force / (reach * self.bodies.barrier([a, b], self.delta).at(thickness).slope.abs())
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
        let elements = self.at_walls().collect();
        BarrierState { candidates, elements, sliding: Vec::new(), widening: 1.0 }
    }

    /// Makes the state's elements hold every pair in range of `nodes` (m), and says whether they have changed, and with them the
    /// stencils.
    pub fn ensure(&self, state: &mut BarrierState, nodes: &[Vec3]) -> bool {
        state.candidates.ensure(&self.bodies, nodes) && self.list_elements(state)
    }

    /// As [`Self::ensure`] for the nodes (m) at which another state had made its list: afterwards both have the same.
    pub fn ensure_at(&self, state: &mut BarrierState, anchor: &[Vec3]) -> bool {
        if state.candidates.anchor() == anchor {
            return false;
        }
        state.candidates.list(&self.bodies, anchor);
        self.list_elements(state)
    }

    /// Makes elements of the near pairs; whether they have changed.
    fn list_elements(&self, state: &mut BarrierState) -> bool {
        let (pairs, at_walls) = (state.candidates.pairs(), self.bodies.at_walls().count());
        if pairs.iter().eq(state.elements[at_walls..].iter().map(|element| &element.bodies)) {
            return false;
        }
        state.sliding.clear();
        state.elements.truncate(at_walls);
        state.elements.extend(pairs.iter().map(|&bodies| self.element(bodies)));
        true
    }

    fn element(&self, bodies: [usize; 2]) -> Element {
        let ((nodes, count), (rows, _)) = (self.bodies.stencil(bodies), self.bodies.rows(bodies));
        let ([a0, a1], [b0, b1]) = (self.bodies.ends()[bodies[0]], self.bodies.ends()[bodies[1]]);
        let (corners, shape) = ([a0, a1, b0, b1], Shape::Pair(self.bodies.pair(bodies, self.delta)));
        let (stiffness, slip_velocity) = (self.stiffness(bodies), self.slip_velocity(bodies));
        Element { bodies, shape, corners, rows, nodes, count, stiffness, slip_velocity }
    }

    /// Elements of all nodes that walls may push; there are few, and each is a single node's, so none is ever left out.
    fn at_walls(&self) -> impl Iterator<Item = Element> + '_ {
        self.bodies.at_walls().map(|(bodies, end)| {
            let node = self.bodies.ends()[bodies[0]][end];
            let shape = Shape::Wall(self.bodies.wall_contact(bodies, end, self.delta));
            let (stiffness, slip_velocity) = (self.stiffness(bodies), self.slip_velocity(bodies));
            Element {
                bodies,
                shape,
                corners: [node; 4],
                rows: [0; 4],
                nodes: [node; 4],
                count: 1,
                stiffness,
                slip_velocity,
            }
        })
    }

    fn slip_velocity(&self, bodies: [usize; 2]) -> f64 {
        let own = |body: usize| self.slip_velocities.get(body).copied();
        let common = self.friction.map_or(f64::INFINITY, |friction| friction.smoothing_velocity);
        own(bodies[0]).zip(own(bodies[1])).map_or(common, |(a, b)| a.max(b))
    }

    /// Energy, J; infinite if a pair is at its least distance or below.
    pub fn energy(&self, state: &BarrierState, nodes: &[Vec3]) -> f64 {
        state.elements.iter().map(|element| element.stiffness * element.energy(nodes)).sum()
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
            let Some(at) = element.evaluate(nodes, curvature) else { continue };
            let gradient = at.gradient * element.stiffness;
            let hessian = curvature.map(|_| at.hessian * element.stiffness);
            element.hand_over(&gradient, hessian.as_ref(), |gradient, matrix| add(index, gradient, matrix));
        }
    }

    /// Finds the contacts whose friction acts at `nodes` (m), in whose range the state must be ([`Self::ensure`]).
    pub fn find_sliding(&self, state: &mut BarrierState, nodes: &[Vec3]) {
        state.sliding.clear();
        if self.friction.is_some() {
            let pushing = |(index, element): (usize, &Element)| Some((index, element.contact(&element.push(nodes)?)?));
            state.sliding.extend(state.elements.iter().enumerate().filter_map(pushing));
        }
    }

    fn friction_of(&self, state: &BarrierState, element: usize) -> Option<Friction> {
        let smoothing_velocity = state.widening * state.elements[element].slip_velocity;
        self.friction.map(|friction| Friction { smoothing_velocity, ..friction })
    }

    /// Dissipation potential of friction (W) at the velocities of the nodes (m/s).
    pub fn friction_potential(&self, state: &BarrierState, velocities: &[Vec3]) -> f64 {
        let potential = |(element, contact): &(usize, SlidingContact)| {
            let friction = self.friction_of(state, *element)?;
            Some(contact.potential(&friction, &contact.nodes.map(|n| velocities[n])))
        };
        state.sliding.iter().filter_map(potential).sum()
    }

    /// Hands the gradient of [`Self::friction_potential`] with respect to the velocities (N, minus the forces) and, if asked for,
    /// the derivative of this gradient with respect to the positions (N/m, column by column) to `add`, as [`Self::add`] does, on the
    /// same elements. `nodes` (m) are those of [`Self::find_sliding`].
    pub fn add_friction(
        &self,
        state: &BarrierState,
        nodes: &[Vec3],
        velocities: &[Vec3],
        derivative: Option<FrictionDerivative>,
        mut add: impl FnMut(usize, &[f64], Option<&[f64]>),
    ) {
        for (index, contact) in &state.sliding {
            let Some(friction) = &self.friction_of(state, *index) else { continue };
            let element = &state.elements[*index];
            let velocities = contact.nodes.map(|node| velocities[node]);
            let gradient = contact.gradient(friction, &velocities);
            let hessian = derivative.map(|FrictionDerivative { rate, curvature }| {
                let mut matrix = contact.hessian(friction, &velocities) * rate;
                if let (Curvature::Exact, Some((_, variation))) = (curvature, element.push_with_variation(nodes)) {
                    matrix += contact.position_derivative(friction, &velocities, &variation, element.stiffness);
                }
                matrix
            });
            let hand = |gradient: &[f64], matrix: Option<&[f64]>| add(*index, gradient, matrix);
            element.hand_over(&gradient, hessian.as_ref(), hand);
        }
    }

    /// What a change of all velocities is to the contacts with friction, as far as they matter: where friction that turned round
    /// would displace the contact by more than `tolerance`, given how far every node yields to a force, `yielding` (1/N); both are relative to
    /// the sizes of filaments.
    pub fn slip_change(
        &self,
        state: &BarrierState,
        velocities: &[Vec3],
        change: &[Vec3],
        yielding: &[f64],
        tolerance: f64,
    ) -> SlipChange {
        let mut largest = SlipChange::default();
        for (element, contact) in &state.sliding {
            let Some(friction) = self.friction_of(state, *element) else { continue };
            let yields = contact.weights.iter().zip(contact.nodes).map(|(w, node)| w * w * yielding[node]).sum::<f64>();
            if 2.0 * friction.coefficient * contact.force * yields > tolerance {
                let at = |values: &[Vec3]| contact.sliding(&contact.nodes.map(|node| values[node])).norm();
                let (change, nu) = (at(change), friction.smoothing_velocity);
                largest.over_smoothing = largest.over_smoothing.max(change / nu);
                largest.relative = largest.relative.max(change / at(velocities).max(nu));
            }
        }
        largest
    }

    /// By how much friction that turns round would change a sliding velocity, over the smoothing velocity, at most; `mobility` is how fast
    /// every node moves under a force, m/(N s).
    pub fn friction_reach(&self, state: &BarrierState, mobility: &[f64]) -> f64 {
        let reach = |(element, contact): &(usize, SlidingContact)| {
            let friction = self.friction_of(state, *element)?;
            let moves = contact.weights.iter().zip(contact.nodes).map(|(w, node)| w * w * mobility[node]).sum::<f64>();
            Some(2.0 * friction.coefficient * contact.force * moves / friction.smoothing_velocity)
        };
        state.sliding.iter().filter_map(reach).fold(0.0, f64::max)
    }

    /// Whether friction acts anywhere: its exact derivative is not symmetric.
    pub fn slides(&self, state: &BarrierState) -> bool {
        !state.sliding.is_empty()
    }

    /// The largest part in `[0, 1]` of the straight way from `from` to `to` (m) over which every pair that comes into range
    /// keeps at least a tenth of its gap above the least distance. 0 if a pair has none at `from`.
    ///
    /// Any displacement is allowed: if it leaves the range of the list of near pairs, the whole way is searched.
    pub fn step_limit(&self, state: &mut BarrierState, from: &[Vec3], to: &[Vec3]) -> f64 {
        let listed = state.candidates.slack(from) >= 0.0 && state.candidates.slack(to) >= 0.0;
        let shorten = |limit: f64, pair: [usize; 2]| {
            let least = self.bodies.barrier(pair, self.delta).least();
            safe_part(&self.bodies.corners(pair, from), &self.bodies.corners(pair, to), least, limit)
        };
        let at_walls = self.bodies.at_walls().map(|(bodies, end)| {
            let node = self.bodies.ends()[bodies[0]][end];
            self.bodies.wall_contact(bodies, end, self.delta).safe_part(&from[node], &to[node])
        });
        let limit = at_walls.fold(1.0, f64::min);
        if listed {
            state.candidates.pairs().iter().fold(limit, |limit, &pair| shorten(limit, pair))
        } else {
            let pairs = state.candidates.swept(from, to);
            pairs.iter().fold(limit, |limit, &pair| shorten(limit, pair.map(|body| body as usize)))
        }
    }

    /// The pair whose surfaces are closest, walls included; `None` if nothing may touch.
    pub fn smallest_gap(&self, state: &mut BarrierState, nodes: &[Vec3]) -> Option<Approach> {
        let nearest = |a: &Approach, b: &Approach| a.gap().total_cmp(&b.gap());
        let at_wall = self.approaches_to_walls(nodes).min_by(nearest);
        self.smallest_gap_of_pairs(state, nodes).into_iter().chain(at_wall).min_by(nearest)
    }

    fn smallest_gap_of_pairs(&self, state: &mut BarrierState, nodes: &[Vec3]) -> Option<Approach> {
        let listed = self.closest(state.candidates.pairs().iter().copied(), nodes);
        // A pair outside the list was further than the range and the skin when it was made.
        let known = 2.0 * (self.delta * self.bodies.thinnest() + state.candidates.slack(nodes));
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
        let least = 1.0 - self.delta;
        let behind = self.approaches_to_walls(nodes).filter(|near| near.distance <= least * near.thickness);
        overlapping.chain(behind).min_by(deepest)
    }

    fn approaches_to_walls<'a>(&'a self, nodes: &'a [Vec3]) -> impl Iterator<Item = Approach> + 'a {
        self.bodies.at_walls().map(|(bodies, end)| Approach {
            bodies: bodies.map(|body| self.bodies.body(body)),
            distance: self.bodies.wall(bodies[1]).height(&nodes[self.bodies.ends()[bodies[0]][end]]),
            thickness: self.bodies.thickness(bodies),
        })
    }

    fn approach(&self, pair: [usize; 2], nodes: &[Vec3]) -> Approach {
        let x = self.bodies.corners(pair, nodes);
        Approach {
            bodies: pair.map(|body| self.bodies.body(body)),
            distance: segment_distance(&x[0], &x[1], &x[2], &x[3]).distance,
            thickness: self.bodies.thickness(pair),
        }
    }

    /// Every pair that pushes, with its force.
    pub fn forces(&self, state: &BarrierState, nodes: &[Vec3]) -> Vec<ContactForce> {
        state.elements.iter().filter_map(|element| self.force(element, nodes)).collect()
    }

    fn force(&self, element: &Element, nodes: &[Vec3]) -> Option<ContactForce> {
        let push = element.push(nodes)?;
        let contact = element.contact(&push)?;
        let bodies = element.bodies.map(|body| self.bodies.body(body));
        Some(ContactForce { bodies, places: push.places, force: push.force * element.stiffness, contact })
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
