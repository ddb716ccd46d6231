//! The image of a regularized point force behind a plane on which the fluid is at rest.
//!
//! With the target at the height `k`, the source at `h`, both above the plane, `q` the part of their distance along it,
//! `R^2 = q^2 + (h + k)^2 + eps^2`, `n` the normal,
//!
//! ```text
//!   G = - [ (1/R + eps^2/R^3) I + r r^T/R^3 ],     r = q + (k - h) n
//!       - 2 h k [ (1/R^3 - 3 eps^2/R^5) I - 3 q q^T/R^5 + 3 (h + k) (q n^T - n q^T)/R^5 + 3 ((h + k)^2 + 2 eps^2) n n^T/R^5 ]
//! ```
//!
//! On the plane, `k = 0`, the first line is the force's own flow with the opposite sign, and the second vanishes; exchanging target and
//! source transposes `G`. With `eps = 0` it is the image of Blake (1971); with it, that of Ainley et al., J. Comput. Phys. 227
//! (2008) 4600, as corrected by Smith (2009), whose many terms are collected here (docs/theory/walls.md).

use super::{Block, PointImage};
use crate::fluid::lanes::{Lanes, inverse_sqrt};
use crate::fluid::segment::{add_scaled, dot, splat};
use crate::plane::Plane;

/// The image behind a plane with this unit normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoSlip {
    normal: [f64; 3],
}

impl NoSlip {
    pub(crate) fn new(plane: &Plane) -> Self {
        Self { normal: (*plane.normal()).into() }
    }
}

impl PointImage for NoSlip {
    #[inline(always)]
    fn block<L: Lanes>(&self, apart: [L; 3], [k, h]: [L; 2], epsilon_squared: L) -> Block<L> {
        let zero = L::splat(0.0);
        let n = splat::<L>(&self.normal);
        let sum = h + k;
        let q = add_scaled(apart, zero - sum, n);
        let r = add_scaled(q, k - h, n);
        let inverse = inverse_sqrt(dot(q, q) + sum.mul_add(sum, epsilon_squared));
        let square = inverse * inverse;
        let cube = inverse * square;
        let product = (h + h) * k;
        let fifth = L::splat(3.0) * product * (cube * square);
        let along = epsilon_squared.mul_add(cube, inverse);
        let isotropic = epsilon_squared.mul_sub(fifth, product.mul_add(cube, along));
        let (twist, across) = (sum * fifth, (epsilon_squared + epsilon_squared + sum * sum) * fifth);
        // G = isotropic I - r (r/R^3) + q (fifth q - twist n) + n (twist q - across n), columns last.
        let mut block = [zero; 9];
        for j in 0..3 {
            let on_q = fifth.mul_sub(q[j], twist * n[j]);
            let on_n = twist.mul_sub(q[j], across * n[j]);
            let on_r = cube * r[j];
            for i in 0..3 {
                let entry = q[i].mul_add(on_q, n[i].mul_sub(on_n, r[i] * on_r));
                block[3 * i + j] = if i == j { entry + isotropic } else { entry };
            }
        }
        block
    }
}
