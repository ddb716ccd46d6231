//! The edges as a far target sees them: Gauss points with a force each, in a tree, with multipoles.
//!
//! With `q = w L f` the force at a Gauss point `y`, and `r = x - y`, the flow beyond some regularization lengths is
//!
//! ```text
//! 8 pi mu u_i = q_i / r + r_i (r . q) / r^3 + (eps^2 / 2) (q_i / r^3 - 3 r_i (r . q) / r^5) + O(eps^4 / r^5)
//!             = phi_i - (x - c)_j d_i phi_j + d_i chi
//! phi_j = sum q_j / r       chi = sum ((y - c) . q + (eps^2 / 2) q . grad_y) / r
//! ```
//!
//! for any centre `c`: four harmonic potentials, the first three with charges `q`, the fourth with charges `(y - c) . q` and
//! dipoles `eps^2 q / 2` (Tornberg and Greengard, J. Comput. Phys. 227 (2008) 1613, extended by the regularization).

use super::harmonics::{Harmonics, MAX_COEFFICIENTS};
use super::octet::{Eight, Four, Octet, on_path};
use super::translation::Place;
use crate::fluid::lanes::Lanes;

/// A Gauss point of an edge and the force there.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Source {
    pub position: [f64; 3],
    pub epsilon_squared: f64,
    pub force: [f64; 3],
}

/// An edge in the order of the tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub nodes: [u32; 2],
    /// Number of the edge in the network.
    pub index: u32,
    pub length: f64,
}

/// Sets the forces on the Gauss points of some edges from the nodal force density.
pub(crate) fn charge(edges: &[Edge], rule: &[[f64; 2]], density: &[f64], sources: &mut [Source]) {
    for (edge, sources) in edges.iter().zip(sources.chunks_exact_mut(rule.len())) {
        let [start, end] = edge.nodes.map(|node| &density[3 * node as usize..][..3]);
        for (source, [point, weight]) in sources.iter_mut().zip(rule) {
            let (a, b) = ((1.0 - point) * weight * edge.length, point * weight * edge.length);
            source.force = std::array::from_fn(|k| a * start[k] + b * end[k]);
        }
    }
}

on_path! {
    /// Sets the multipole of a cell from its sources.
    pub(crate) fn multipole(
        harmonics: &Harmonics,
        place: &Place,
        sources: &[Source],
        out: &mut [Four],
    ) = multipole_as
}

#[inline(always)]
fn multipole_as<L: Lanes>(harmonics: &Harmonics, place: &Place, sources: &[Source], out: &mut [Four]) {
    let count = out.len();
    let mut values = [Eight::ZERO; MAX_COEFFICIENTS];
    // phi, chi without its dipoles, the dipoles.
    let mut moments = [Eight::ZERO; MAX_COEFFICIENTS];
    let inverse = 1.0 / place.scale;
    for sources in sources.chunks(8) {
        let mut point = [Eight::ZERO; 3];
        let mut charges = [Eight::ZERO; 8];
        for (lane, source) in sources.iter().enumerate() {
            let q = source.force;
            let from: [f64; 3] = std::array::from_fn(|k| source.position[k] - place.centre[k]);
            for k in 0..3 {
                point[k].0[lane] = from[k] * inverse;
            }
            let half = 0.5 * source.epsilon_squared;
            let chi = from[0] * q[0] + from[1] * q[1] + from[2] * q[2];
            charges[lane] = Eight([q[0], q[1], q[2], chi, half * q[0], half * q[1], half * q[2], 0.0]);
        }
        harmonics.evaluate(Octet::<L>::load_each(&point), &mut values);
        let charges = Octet::<L>::load_each(&charges);
        for (moment, value) in moments[..count].iter_mut().zip(&values) {
            // Two sums, so that neither waits long for itself.
            let (mut even, mut odd) = (Octet::<L>::load(moment), Octet::<L>::zero());
            for k in 0..4 {
                even = charges[2 * k].fma_scalar(value.0[2 * k], even);
                odd = charges[2 * k + 1].fma_scalar(value.0[2 * k + 1], odd);
            }
            even.plus(odd).store(moment);
        }
    }
    for (out, Eight(moment)) in out.iter_mut().zip(&moments) {
        *out = Four([moment[0], moment[1], moment[2], moment[3]]);
    }
    for rung in harmonics.ladder() {
        out[rung.of].0[3] += rung.factor * inverse * moments[rung.to].0[4 + rung.axis];
    }
}
