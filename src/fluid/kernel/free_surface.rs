//! The image of a regularized point force behind a flat free surface: no shear on it, and nothing crosses it.
//!
//! It is the force mirrored, at the mirrored place: `G = [(1/R + eps^2/R^3) I + R R^T/R^3] P` with the vector `R` from the mirrored
//! source to the target and `P = I - 2 n n^T`. By symmetry the sum with the force's own flow has no normal velocity and no
//! shear on the plane, regularized or not.

use super::{Block, PointImage};
use crate::fluid::lanes::{Lanes, inverse_sqrt};
use crate::fluid::segment::{add_scaled, dot, splat};
use crate::plane::Plane;

/// The image behind a plane with this unit normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeSurface {
    normal: [f64; 3],
}

impl FreeSurface {
    pub(crate) fn new(plane: &Plane) -> Self {
        Self { normal: (*plane.normal()).into() }
    }
}

impl PointImage for FreeSurface {
    #[inline(always)]
    fn block<L: Lanes>(&self, apart: [L; 3], _: [L; 2], epsilon_squared: L) -> Block<L> {
        let n = splat::<L>(&self.normal);
        let inverse = inverse_sqrt(dot(apart, apart) + epsilon_squared);
        let cube = inverse * inverse * inverse;
        let isotropic = epsilon_squared.mul_add(cube, inverse);
        // -2 times the components on the normal.
        let twice = L::splat(-2.0) * dot(apart, n);
        let mirrored = add_scaled(apart, twice, n);
        let mut block = [L::splat(0.0); 9];
        for j in 0..3 {
            let on_apart = cube * mirrored[j];
            let on_normal = L::splat(-2.0) * isotropic * n[j];
            for i in 0..3 {
                let entry = apart[i].mul_add(on_apart, n[i] * on_normal);
                block[3 * i + j] = if i == j { entry + isotropic } else { entry };
            }
        }
        block
    }
}
