//! The distance of two segments, of an end and a segment, or of two ends, with its derivatives.
//!
//! The distance is `D = |g|`, `g = sum_i w_i x_i` over the nodes `x = (a0, a1, b0, b1)` with
//! `w = (1 - s, s, t - 1, -t)` at the closest places `s` and `t`. Since those are optimal, `dD/dx_i = w_i n` with `n = g / D`,
//! whether they are inside the segments or at ends. With `u = a1 - a0`, `v = b1 - b0`, `W = (w_0 I, ..., w_3 I)` and
//! `P = I - n n^T` the second derivative is
//!
//! ```text
//!   D'' = (W^T P W - R^T G^-1 R) / D,
//!   R_s = u^T W + g^T (-I, I, 0, 0),   R_t = -v^T W - g^T (0, 0, -I, I),   G = (u.u, -u.v; -u.v, v.v)
//! ```
//!
//! with the rows and columns of those places that are free to move: both for lines that pass each other, one for an end beside
//! a segment, none for two ends. `det G = |u x v|^2` is the only thing that can vanish. Source: implicit function theorem on
//! `dD^2/ds = dD^2/dt = 0`; agrees with the generated code of the IPC toolkit in all cases.

use nalgebra::{SMatrix, SVector};

use super::distance::segment_distance;
use crate::Vec3;

/// A gradient with respect to the four nodes of a pair, `a0, a1, b0, b1`.
pub type Gradient12 = SVector<f64, 12>;
/// The matrix of second derivatives with respect to the four nodes of a pair.
pub type Hessian12 = SMatrix<f64, 12, 12>;

/// Two features of a pair of segments at their closest.
#[derive(Clone, Copy, Debug)]
pub struct Separation {
    /// Distance, m.
    pub distance: f64,
    /// Unit vector from B to A.
    pub normal: Vec3,
    /// Derivative of the gap vector with respect to the nodes.
    pub weights: [f64; 4],
    /// Place on A and on B, each in `[0, 1]`.
    pub places: [f64; 2],
    free: [bool; 2],
}

/// Derivatives of a separation with respect to the nodes `a0, a1, b0, b1`, 1/m.
pub struct SeparationVariation {
    /// Of the normal.
    pub normal: SMatrix<f64, 3, 12>,
    /// Of the places on A and B.
    pub places: [Gradient12; 2],
}

impl Separation {
    /// Segment A and segment B; either may have no length.
    pub fn of_segments(x: &[Vec3; 4]) -> Self {
        let closest = segment_distance(&x[0], &x[1], &x[2], &x[3]);
        let inside = |place: f64| place > 0.0 && place < 1.0;
        Self {
            distance: closest.distance,
            normal: closest.normal,
            weights: weights(closest.s, closest.t),
            places: [closest.s, closest.t],
            free: [inside(closest.s), inside(closest.t)],
        }
    }

    /// End `end` (0 or 1) of segment A and segment B.
    pub fn of_end_of_a(x: &[Vec3; 4], end: usize) -> Self {
        let (t, free) = project(&x[end], &x[2], &x[3]);
        Self::at(x, [end as f64, t], [false, free])
    }

    /// Segment A and end `end` (0 or 1) of segment B.
    pub fn of_end_of_b(x: &[Vec3; 4], end: usize) -> Self {
        let (s, free) = project(&x[2 + end], &x[0], &x[1]);
        Self::at(x, [s, end as f64], [free, false])
    }

    /// End `a` of segment A and end `b` of segment B.
    pub fn of_ends(x: &[Vec3; 4], a: usize, b: usize) -> Self {
        Self::at(x, [a as f64, b as f64], [false, false])
    }

    fn at(x: &[Vec3; 4], places: [f64; 2], free: [bool; 2]) -> Self {
        let gap = point(&x[0], &x[1], places[0]) - point(&x[2], &x[3], places[1]);
        let distance = gap.norm();
        // Features that coincide are closer than any barrier allows; they have no direction.
        let normal = if distance > 0.0 { gap / distance } else { Vec3::zeros() };
        Self { distance, normal, weights: weights(places[0], places[1]), places, free }
    }

    /// Adds `factor` times the gradient of the distance.
    #[inline]
    pub fn add_gradient(&self, factor: f64, gradient: &mut Gradient12) {
        for (i, w) in self.weights.iter().enumerate() {
            for k in 0..3 {
                gradient[3 * i + k] += factor * w * self.normal[k];
            }
        }
    }

    /// Adds `curvature * grad D grad D^T + slope * D''`: the Hessian of a function of the distance with these derivatives.
    pub fn add_hessian(&self, x: &[Vec3; 4], slope: f64, curvature: f64, hessian: &mut Hessian12) {
        let tension = slope / self.distance;
        let core = self.normal * self.normal.transpose() * (curvature - tension) + crate::Mat3::identity() * tension;
        for j in 0..4 {
            for i in 0..4 {
                let scale = self.weights[i] * self.weights[j];
                if scale != 0.0 {
                    let mut block = hessian.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                    block += core * scale;
                }
            }
        }
        let (u, v) = (x[1] - x[0], x[3] - x[2]);
        let (uu, vv) = (u.norm_squared(), v.norm_squared());
        match self.free {
            [false, false] => {}
            [true, false] => {
                let r = self.row(&u, 0);
                hessian.ger(-tension / uu, &r, &r, 1.0);
            }
            [false, true] => {
                let r = self.row(&v, 1);
                hessian.ger(-tension / vv, &r, &r, 1.0);
            }
            [true, true] => {
                let determinant = u.cross(&v).norm_squared();
                // The closest points of parallel segments are not unique; the weight of such a pair vanishes.
                if determinant > 0.0 {
                    // R^T G^-1 R with G = L D L^T: the part of R_s that R_t leaves, over det G / v.v.
                    let (s, t) = (self.row(&u, 0), -self.row(&v, 1));
                    let rest = s + t * (u.dot(&v) / vv);
                    hessian.ger(-tension / vv, &t, &t, 1.0);
                    hessian.ger(-tension * vv / determinant, &rest, &rest, 1.0);
                }
            }
        }
    }

    /// How the normal and the places change with the nodes.
    pub fn variation(&self, x: &[Vec3; 4]) -> SeparationVariation {
        let (u, v) = (x[1] - x[0], x[3] - x[2]);
        let (uu, vv) = (u.norm_squared(), v.norm_squared());
        let mut places = [Gradient12::zeros(); 2];
        match self.free {
            [false, false] => {}
            [true, false] => places[0] = self.row(&u, 0) * (-1.0 / uu),
            [false, true] => places[1] = self.row(&v, 1) / vv,
            [true, true] => {
                let determinant = u.cross(&v).norm_squared();
                if determinant > 0.0 {
                    // G (ds, dt) = -(R_s, R_t), eliminated as in the second derivative.
                    let (s, t, uv) = (self.row(&u, 0), -self.row(&v, 1), u.dot(&v));
                    places[0] = (s + t * (uv / vv)) * (-vv / determinant);
                    places[1] = (places[0] * uv - t) / vv;
                }
            }
        }
        let mut gap = SMatrix::<f64, 3, 12>::zeros();
        for (i, w) in self.weights.iter().enumerate() {
            gap.fixed_view_mut::<3, 3>(0, 3 * i).fill_diagonal(*w);
        }
        gap += u * places[0].transpose() - v * places[1].transpose();
        let across = gap - self.normal * (self.normal.transpose() * gap);
        SeparationVariation { normal: across / self.distance, places }
    }

    /// `along^T W + g^T (-I, I)` with the differences on the nodes of A (`side` 0) or B (`side` 1).
    #[inline]
    fn row(&self, along: &Vec3, side: usize) -> Gradient12 {
        let gap = self.normal * self.distance;
        let mut row = Gradient12::zeros();
        for i in 0..4 {
            row.fixed_rows_mut::<3>(3 * i).copy_from(&(along * self.weights[i]));
        }
        let mut start = row.fixed_rows_mut::<3>(6 * side);
        start -= gap;
        let mut end = row.fixed_rows_mut::<3>(6 * side + 3);
        end += gap;
        row
    }
}

fn weights(s: f64, t: f64) -> [f64; 4] {
    [1.0 - s, s, t - 1.0, -t]
}

/// A point of a segment; exactly its node at an end.
fn point(start: &Vec3, end: &Vec3, place: f64) -> Vec3 {
    if place == 1.0 { *end } else { start + (end - start) * place }
}

/// The place on a segment closest to a point, and whether it is inside.
#[inline]
fn project(p: &Vec3, start: &Vec3, end: &Vec3) -> (f64, bool) {
    let along = end - start;
    let (level, length2) = (along.dot(&(p - start)), along.norm_squared());
    if level <= 0.0 {
        (0.0, false)
    } else if level >= length2 {
        (1.0, false)
    } else {
        (level / length2, true)
    }
}
