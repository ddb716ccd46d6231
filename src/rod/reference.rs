//! Frames that trial states are transported from: those of a shape at first, of the last accepted state later.

use super::frames::{any_perpendicular, one_plus_cosine, orthonormalised, reference_twist, transport_through};
use super::network::Network;
use crate::Vec3;

/// Frames of the last accepted state, from which trial states are transported in time.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceFrames {
    /// Unit tangent of every edge.
    pub tangents: Vec<Vec3>,
    /// First reference director of every edge.
    pub directors: Vec<Vec3>,
    /// Reference twist of every hinge, continued through whole turns, rad.
    pub twists: Vec<f64>,
}

/// An edge whose `1 + cos` of the angle to its reference is below this has turned right over: the smallest rotation that takes it
/// there is about an axis of round-off.
const TURNED_OVER: f64 = 1e-4;

impl ReferenceFrames {
    /// Frames of a shape: on every connected part the first edge's director is transported in space along the hinges.
    ///
    /// `first` gives that director (its part normal to the edge counts). Without it the director is the curvature binormal
    /// at the first bent hinge met, transported back, so that a rotated scene has rotated frames; a straight part takes any
    /// perpendicular.
    pub fn of_shape(network: &Network, nodes: &[Vec3], first: &dyn Fn(usize) -> Option<Vec3>) -> Self {
        let tangents = tangents(network, nodes);
        let meeting = meeting(network);
        let seed = |root: usize| first(root).or_else(|| binormal_seen_from(root, &meeting, &tangents));
        let untwisted = vec![0.0; network.hinges().len()];
        let known = vec![None; tangents.len()];
        let directors = completed(known, &meeting, &tangents, &untwisted, &seed);
        let mut frames = Self { directors, tangents, twists: untwisted };
        for (k, hinge) in network.hinges().iter().enumerate() {
            let [e, f] = hinge.edges;
            frames.twists[k] = reference_twist(
                &frames.directors[e],
                &(frames.tangents[e] * hinge.signs[0]),
                &frames.directors[f],
                &(frames.tangents[f] * hinge.signs[1]),
                0.0,
            );
        }
        frames
    }

    /// Gives edges that `nodes` would turn right over a reference of their own there, with the twist that they had against their
    /// neighbours: the smallest rotation of each would leave its frame, and so the twist, to chance.
    pub fn follow_turned_over(&mut self, network: &Network, nodes: &[Vec3]) {
        let tangents = tangents(network, nodes);
        let over: Vec<bool> =
            self.tangents.iter().zip(&tangents).map(|(old, new)| one_plus_cosine(old, new) < TURNED_OVER).collect();
        if !over.contains(&true) {
            return;
        }
        let moved = |edge: usize| transport_through(&self.directors[edge], &self.tangents[edge], &tangents[edge]);
        let known = (0..tangents.len()).map(|edge| (!over[edge]).then(|| moved(edge))).collect();
        let directors = completed(known, &meeting(network), &tangents, &self.twists, &|edge| Some(moved(edge)));
        for edge in (0..tangents.len()).filter(|&edge| over[edge]) {
            self.directors[edge] = directors[edge];
            self.tangents[edge] = tangents[edge];
        }
    }
}

/// A hinge as one of its edges sees it.
struct Meeting {
    hinge: usize,
    other: usize,
    /// Whether the edges run through the hinge one after the other, `1`, or against each other, `-1`.
    sign: f64,
    /// The sign of the hinge's twist about the other edge, seen from this one.
    twist_sign: f64,
}

fn tangents(network: &Network, nodes: &[Vec3]) -> Vec<Vec3> {
    network.edges().iter().map(|&[i, j]| (nodes[j] - nodes[i]).normalize()).collect()
}

fn meeting(network: &Network) -> Vec<Vec<Meeting>> {
    let mut meeting: Vec<Vec<Meeting>> = network.edges().iter().map(|_| Vec::new()).collect();
    for (k, hinge) in network.hinges().iter().enumerate() {
        let ([e, f], [se, sf]) = (hinge.edges, hinge.signs);
        meeting[e].push(Meeting { hinge: k, other: f, sign: se * sf, twist_sign: sf });
        meeting[f].push(Meeting { hinge: k, other: e, sign: se * sf, twist_sign: -se });
    }
    meeting
}

/// Completes directors from those that are known, each from a neighbour by transport in space and the twist of their hinge; `seed` gives
/// the first of a part on which none is known.
fn completed(
    mut directors: Vec<Option<Vec3>>,
    meeting: &[Vec<Meeting>],
    tangents: &[Vec3],
    twists: &[f64],
    seed: &dyn Fn(usize) -> Option<Vec3>,
) -> Vec<Vec3> {
    let mut queue: std::collections::VecDeque<usize> =
        (0..tangents.len()).filter(|&edge| directors[edge].is_some()).collect();
    let mut roots = 0..tangents.len();
    loop {
        // What is known goes as far as it reaches before a root is chosen.
        while let Some(edge) = queue.pop_front() {
            let Some(director) = directors[edge] else { continue };
            for &Meeting { hinge, other, sign, twist_sign } in &meeting[edge] {
                if directors[other].is_none() {
                    // A reversed edge keeps its first director, and its tangent changes sign.
                    let moved = transport_through(&director, &(tangents[edge] * sign), &tangents[other]);
                    let (sine, cosine) = (twist_sign * twists[hinge]).sin_cos();
                    let turned = moved * cosine + tangents[other].cross(&moved) * sine;
                    directors[other] = Some(orthonormalised(&turned, &tangents[other]));
                    queue.push_back(other);
                }
            }
        }
        let Some(root) = roots.find(|&edge| directors[edge].is_none()) else {
            return directors.into_iter().flatten().collect();
        };
        let t = tangents[root];
        let seed = seed(root).map(|d| d - t * d.dot(&t)).filter(|d| d.norm() > 0.0);
        directors[root] = Some(seed.map_or_else(|| any_perpendicular(&t), |d| d.normalize()));
        queue.push_back(root);
    }
}

/// Turning angles below this count as straight: the binormal's direction would be round-off.
const STRAIGHT: f64 = 1e-6;

fn binormal_seen_from(root: usize, meeting: &[Vec<Meeting>], tangents: &[Vec3]) -> Option<Vec3> {
    let mut seen = vec![false; tangents.len()];
    let mut queue = std::collections::VecDeque::from([root]);
    seen[root] = true;
    while let Some(edge) = queue.pop_front() {
        for &Meeting { other, sign, .. } in &meeting[edge] {
            let binormal = (tangents[edge] * sign).cross(&tangents[other]);
            if binormal.norm() > STRAIGHT {
                return Some(transport_through(&binormal.normalize(), &tangents[edge], &tangents[root]));
            }
            if !seen[other] {
                seen[other] = true;
                queue.push_back(other);
            }
        }
    }
    None
}
