//! How the angle between two edges shares their contact between a point and a line.
//!
//! Rods that cross touch at a point, rods that lie along each other on a line. Both are the integral of the barrier along the
//! rods, `int b(D(x)) dx`. Rods at `D = xi` that cross at an angle `theta` stay in range over the length `reach / sin theta`
//! to either side, `reach = xi sqrt(2 delta)`. Where this is shorter than an edge, the nodes may miss it, and the integral is
//! taken as the barrier at the closest points times that length. Where it is longer, closest points say little (they jump from
//! end to end when the edges become parallel), and the integral is summed over the nodes. With `c = sin^2 theta` (edge vectors
//! over rest lengths) the weights of point, in units of `reach`, and of line are
//!
//! ```text
//!   phi(c) = m(c) / sqrt(c + eps / 10),      1 - m(c),
//!   m(c) = (3 - 2 c / eps) (c / eps)^2,  1 from eps on,      eps = min((reach / l)^2, 1/2)
//! ```
//!
//! with `l` the longer rest length. Since `phi` falls as `c^2` and the second derivative of a distance grows as `1 / c`, the
//! energy is twice differentiable where edges are parallel. The mollifier of Li et al. (2020), equation 24, falls as `c` only:
//! second derivatives then jump at parallel edges, and are so large nearby that Newton's steps become short.

use crate::{Mat3, Vec3};

use super::separation::{Gradient12, Hessian12};

/// Greatest `eps`, for edges shorter than `reach`: those that cross at more than 45 degrees touch at a point on any mesh.
const GREATEST: f64 = 0.5;

/// Where the growth of the point's weight towards parallel ends, over `eps`: the sum of both parts then follows the integral
/// from one regime to the other.
const ROUNDING: f64 = 0.1;

/// A function of `c` with its first two derivatives.
pub type Derivatives = [f64; 3];

/// `eps` of two edges in range of each other over `reach`, with rest lengths in the same unit.
pub fn widest_parallel(reach: f64, rest_lengths: [f64; 2]) -> f64 {
    let ratio = reach / rest_lengths[0].max(rest_lengths[1]);
    (ratio * ratio).min(GREATEST)
}

/// The weight `m / sqrt(c + eps / 10)` of the closest points and the weight `1 - m` of the nodes.
#[inline]
pub fn shares(c: f64, eps: f64) -> (Derivatives, Derivatives) {
    let m = mollifier(c, eps);
    let base = c + ROUNDING * eps;
    let root = base.sqrt().recip();
    let (slope, curvature) = (-0.5 * root / base, 0.75 * root / (base * base));
    let point = [m[0] * root, m[1] * root + m[0] * slope, m[2] * root + 2.0 * m[1] * slope + m[0] * curvature];
    (point, [1.0 - m[0], -m[1], -m[2]])
}

#[inline]
fn mollifier(c: f64, eps: f64) -> Derivatives {
    let x = c / eps;
    if x >= 1.0 {
        return [1.0, 0.0, 0.0];
    }
    [x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) / eps, 6.0 * (1.0 - 2.0 * x) / (eps * eps)]
}

/// `c = |u x v|^2` of two edges, with `u = (a1 - a0) / rest length` and `v = (b1 - b0) / rest length`.
pub struct Angle {
    u: Vec3,
    v: Vec3,
    cross: Vec3,
    rest_lengths: [f64; 2],
}

impl Angle {
    /// Between the edges `x = (a0, a1, b0, b1)` of these rest lengths (m).
    pub fn new(x: &[Vec3; 4], rest_lengths: [f64; 2]) -> Self {
        let (u, v) = ((x[1] - x[0]) / rest_lengths[0], (x[3] - x[2]) / rest_lengths[1]);
        Self { cross: u.cross(&v), u, v, rest_lengths }
    }

    /// `c`, dimensionless.
    pub fn sin2(&self) -> f64 {
        self.cross.norm_squared()
    }

    /// Derivative of `c` with respect to the nodes, 1/m.
    pub fn gradient(&self) -> Gradient12 {
        let along_u = self.v.cross(&self.cross) * (2.0 / self.rest_lengths[0]);
        let along_v = self.cross.cross(&self.u) * (2.0 / self.rest_lengths[1]);
        let mut gradient = Gradient12::zeros();
        for (node, part) in [-along_u, along_u, -along_v, along_v].iter().enumerate() {
            gradient.fixed_rows_mut::<3>(3 * node).copy_from(part);
        }
        gradient
    }

    /// Adds `factor` times the second derivative of `c`, 1/m^2.
    pub fn add_hessian(&self, factor: f64, hessian: &mut Hessian12) {
        let (u, v, [a, b]) = (&self.u, &self.v, self.rest_lengths);
        let across = |w: &Vec3| Mat3::identity() * w.norm_squared() - w * w.transpose();
        let uu = across(v) * (2.0 * factor / (a * a));
        let vv = across(u) * (2.0 * factor / (b * b));
        let uv = (u * v.transpose() * 2.0 - Mat3::identity() * u.dot(v) - v * u.transpose()) * (2.0 * factor / (a * b));
        let blocks = [[uu, uv], [uv.transpose(), vv]];
        for i in 0..4 {
            for j in 0..4 {
                let sign = if (i + j) % 2 == 0 { 1.0 } else { -1.0 };
                let mut block = hessian.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                block += blocks[i / 2][j / 2] * sign;
            }
        }
    }
}
