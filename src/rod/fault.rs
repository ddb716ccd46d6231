//! Why positions are not a configuration, and where.

use super::configuration::node;
use super::network::Network;

/// Cosine of a turning angle, plus one, below which two edges are folded onto each other, as a configuration has it.
const FOLDED: f64 = 1e-10;

/// What is wrong with positions, at a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// The node.
    pub node: usize,
    /// What is wrong there.
    pub what: &'static str,
}

/// The first reason for which degrees of freedom are not a configuration.
pub fn fault(network: &Network, q: &[f64]) -> Option<Fault> {
    let position = |k: usize| node(q, network.node_dofs()[k]);
    let lost = (0..network.node_count()).find(|&k| position(k).iter().any(|x| !x.is_finite()));
    if let Some(node) = lost {
        return Some(Fault { node, what: "a position is not a finite number" });
    }
    let tangents = network.edges().iter().map(|&[i, j]| position(j) - position(i));
    let tangents: Vec<_> = tangents.collect();
    if let Some(edge) = tangents.iter().position(|vector| vector.norm() == 0.0) {
        return Some(Fault { node: network.edges()[edge][0], what: "an edge has shrunk to no length" });
    }
    let folded = network.hinges().iter().find(|hinge| {
        let [before, after] = [0, 1].map(|k| tangents[hinge.edges[k]].normalize() * hinge.signs[k]);
        1.0 + before.dot(&after) < FOLDED
    });
    folded.map(|hinge| {
        let [e, f] = hinge.edges.map(|edge| network.edges()[edge]);
        let node = if f.contains(&e[1]) { e[1] } else { e[0] };
        Fault { node, what: "two edges have folded onto each other" }
    })
}
