//! How the angle between two edges shares their contact between a point and a line.
//!
//! Rods that cross touch at a point, rods that lie along each other on a line. Both are the integral of the barrier along the
//! rods, `int b(D(x)) dx`. Where the edges cross at an angle `theta` it is taken at the closest points, times the length over
//! which the rods stay in range, `xi sqrt(2 delta) / sin theta` (to either side of rods at `D = xi`); where they are nearly
//! parallel, closest points jump from end to end, and it is summed over the nodes. With `c = sin^2 theta` (edge vectors over rest
//! lengths) and `eps = 1e-3` (1.8 degrees) the weights of point and line are
//!
//! ```text
//!   phi(c) = m(c) / sqrt(c + eps / 10)   (times xi sqrt(2 delta)),      1 - m(c),      m(c) = (2 - c / eps) c / eps, 1 from eps on.
//! ```
//!
//! `m` is the mollifier of Li et al. (2020), equation 24. `phi` is proportional to `c` where the edges are parallel, which keeps
//! energy and gradient of the pair continuous there.

use crate::{Mat3, Vec3};

use super::separation::{Gradient12, Hessian12};

/// `sin^2` of the angle above which an edge pair touches at a point only (1.8 degrees).
const PARALLEL_SIN2: f64 = 1e-3;

/// Where the growth of the point's weight towards parallel ends, over [`PARALLEL_SIN2`]: the sum of both parts then follows
/// the integral to 10 % from one regime to the other.
const ROUNDING: f64 = 0.1;

/// A function of `c` with its first two derivatives.
pub type Derivatives = [f64; 3];

/// The weight `m / sqrt(c + eps / 10)` of the closest points and the weight `1 - m` of the nodes.
#[inline]
pub fn shares(c: f64) -> (Derivatives, Derivatives) {
    let m = mollifier(c);
    let base = c + ROUNDING * PARALLEL_SIN2;
    let root = base.powf(-0.5);
    let (slope, curvature) = (-0.5 * root / base, 0.75 * root / (base * base));
    let point = [m[0] * root, m[1] * root + m[0] * slope, m[2] * root + 2.0 * m[1] * slope + m[0] * curvature];
    (point, [1.0 - m[0], -m[1], -m[2]])
}

#[inline]
fn mollifier(c: f64) -> Derivatives {
    let x = c / PARALLEL_SIN2;
    if x >= 1.0 {
        return [1.0, 0.0, 0.0];
    }
    [(2.0 - x) * x, 2.0 * (1.0 - x) / PARALLEL_SIN2, -2.0 / (PARALLEL_SIN2 * PARALLEL_SIN2)]
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
