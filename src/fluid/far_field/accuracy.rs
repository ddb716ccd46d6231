//! How a required error becomes expansion orders, a separation of cells, and quadrature rules.
//!
//! Three errors add up: the truncation of expansions, at its worst along a straight rod with a uniform density; the
//! quadrature of edges, at its worst in a dense bundle with random densities; the regularization beyond second order, at
//! its worst where it exceeds the length of the edges. `tests/far_field.rs` holds their sum to the tolerance in all three.

use super::harmonics::MAX_ORDER;

/// The parameters of a product, chosen for a relative error.
#[derive(Clone, Debug)]
pub(crate) struct Accuracy {
    /// Highest degree of the expansions.
    pub order: usize,
    /// Relative error allowed in what one cell brings to another.
    pub truncation: f64,
    /// Gauss points on every edge.
    pub gauss: usize,
    /// Distance of a target from an edge's centre, in half-lengths, beyond which the Gauss points serve.
    pub close: f64,
    /// Distance in regularization lengths beyond which the regularization counts to second order only.
    pub smooth: f64,
    /// Most targets in a cell that is not halved.
    pub targets: usize,
    /// Most edges in a cell that is not halved.
    pub edges: usize,
}

/// Ratio of radii and distance (see [`Accuracy::order_for`]) up to which expansions should serve. A higher one needs higher
/// orders, a lower one leaves more to be summed one by one; between 0.4 and 0.5 the time is the same within a sixth (1e-4 to 1e-8).
const WIDEST_RATIO: f64 = 0.45;

impl Accuracy {
    pub fn for_tolerance(tolerance: f64) -> Self {
        // With the whole tolerance, 0.65 of it was measured along a straight rod, but 1.04 where regularization lengths of
        // twenty edges leave no near flow to outweigh the far one.
        let truncation = 0.5 * tolerance;
        let order = (truncation.ln() / WIDEST_RATIO.ln()).ceil() - 1.0;
        let gauss = match tolerance {
            t if t >= 1e-2 => 1,
            t if t >= 3e-5 => 2,
            t if t >= 3e-7 => 3,
            _ => 4,
        };
        // Cells in which summing one by one costs as much as the expansions (at 1e-4, leaves of
        // 24 to 48 take the same time within a tenth for scattered flagella; other orders are scaled from there).
        let leaf = 16.0 + 0.12 * order * order;
        Self {
            order: (order as usize).clamp(2, MAX_ORDER),
            truncation,
            gauss,
            // The rule's error is (2 D)^(-2 gauss) at D half-lengths; many edges beyond add up to a few times that.
            close: (0.5 * (0.25 * tolerance).powf(-0.5 / gauss as f64)).max(2.5),
            // At worst 9/8 (eps/r)^4 of the pair's own flow, itself a quarter or less of the flow of a cell within it.
            smooth: (0.5 / tolerance).powf(0.25),
            targets: (leaf as usize).next_multiple_of(8),
            edges: leaf as usize,
        }
    }

    /// The order that two cells need at a distance, if there is one.
    ///
    /// Of a source on the rim of its cell and a target on the rim of its own, the multipole of order p leaves out
    /// `(s / (d - t))^(p + 1)` and the local expansion `(t / (d - s))^(p + 1)`, relative to the flow, if both lie on the line
    /// of the centres; elsewhere less.
    pub fn order_for(&self, target: f64, source: f64, distance: f64) -> Option<usize> {
        let ratio = (source / (distance - target)).max(target / (distance - source));
        if !(0.0..1.0).contains(&ratio) {
            return None;
        }
        let order = (self.truncation.ln() / ratio.ln()).ceil().max(2.0) - 1.0;
        (order <= self.order as f64).then_some(order as usize)
    }

    /// Pairs of a target and a Gauss point that cost as much as a pair of cells with expansions of this order.
    ///
    /// With AVX-512 about 1.1 ns for the former and 0.4 us + 0.5 ns (order + 1)^3 for the latter, estimated from
    /// the times of whole products at several orders and cell sizes.
    pub fn worthwhile(&self, order: usize) -> usize {
        350 + 9 * (order + 1).pow(3) / 20
    }
}

/// Gauss-Legendre rule of `count` points, one to four, on `[0, 1]`: (point, weight).
pub(crate) fn gauss_rule(count: usize) -> &'static [[f64; 2]] {
    match count {
        1 => &[[0.5, 1.0]],
        2 => &[[0.21132486540518713, 0.5], [0.7886751345948129, 0.5]],
        3 => &[
            [0.1127016653792583, 0.2777777777777778],
            [0.5, 0.4444444444444444],
            [0.8872983346207417, 0.2777777777777778],
        ],
        _ => &[
            [0.06943184420297371, 0.17392742256872692],
            [0.33000947820757187, 0.32607257743127305],
            [0.6699905217924281, 0.32607257743127305],
            [0.9305681557970262, 0.17392742256872692],
        ],
    }
}
