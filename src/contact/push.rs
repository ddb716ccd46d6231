//! The resultant of a pair, where it acts, and how both change with the positions of its nodes: what friction needs to know.
//!
//! The features of a pair in range, k of them, push with `p_k = -(phi c_k + (1 - m) l_k) b'(D_k)` along their normals `n_k` at the
//! places `s_k, t_k`, see [`super::pair`]. The resultant is `F = sum p_k n_k`, the centres of force are the means of the
//! places with the weights `p_k`. Derivatives follow from those of the parts: of the weights by the angle, of `b'` by the
//! distance, of normals and places by [`Separation`].

use nalgebra::SMatrix;

use super::pair::{Contribution, Pair};
use super::separation::{Gradient12, Separation};
use crate::Vec3;

/// Derivative of a vector with respect to the four nodes of a pair.
pub type Jacobian3x12 = SMatrix<f64, 3, 12>;

/// Where a pair pushes and how hard, over stiffness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Force on A, m^2.
    pub force: Vec3,
    /// Centres of force on A and B, each in `[0, 1]`.
    pub places: [f64; 2],
}

/// Derivatives of a [`Push`] with respect to the nodes `a0, a1, b0, b1`.
#[derive(Clone, Debug)]
pub struct PushVariation {
    /// Of the force, m.
    pub force: Jacobian3x12,
    /// Of the centres of force, 1/m.
    pub places: [Gradient12; 2],
}

/// Sums over the features of a pair.
struct Sums {
    force: Vec3,
    moments: [f64; 2],
    total: f64,
}

impl Sums {
    fn push(&self) -> Option<Push> {
        let places = self.moments.map(|moment| (moment / self.total).clamp(0.0, 1.0));
        (self.total > 0.0).then_some(Push { force: self.force, places })
    }
}

impl Pair {
    /// The resultant of the pair and its centres at the nodes `x = (a0, a1, b0, b1)`; `None` where it does not push A and B apart.
    pub fn push(&self, x: &[Vec3; 4]) -> Option<Push> {
        self.sums(x, |_, _, _| ())?.push()
    }

    /// The resultant of the pair with its derivatives; `None` where [`Self::push`] is.
    pub fn push_with_variation(&self, x: &[Vec3; 4]) -> Option<(Push, PushVariation)> {
        let mut force = Jacobian3x12::zeros();
        let (mut moments, mut total) = ([Gradient12::zeros(); 2], Gradient12::zeros());
        let sums = self.sums(x, |feature, pressure, turned| {
            let separation = &feature.separation;
            let mut change = *turned;
            let weight = feature.weight * feature.contribution.barrier.curvature;
            separation.add_gradient(-weight, &mut change);
            let moved = separation.variation(x);
            force += separation.normal * change.transpose() + moved.normal * pressure;
            total += &change;
            for side in 0..2 {
                moments[side] += change * separation.places[side] + moved.places[side] * pressure;
            }
        })?;
        let push = sums.push()?;
        let mut places = moments;
        for side in 0..2 {
            let place = sums.moments[side] / sums.total;
            let inside = place > 0.0 && place < 1.0;
            places[side] = if inside { (moments[side] - total * place) / sums.total } else { Gradient12::zeros() };
        }
        Some((push, PushVariation { force, places }))
    }

    /// Adds up the pressures of all features, each handed to `each` with its pressure and the change of that by the angle.
    fn sums(&self, x: &[Vec3; 4], mut each: impl FnMut(&Feature, f64, &Gradient12)) -> Option<Sums> {
        let closest = Separation::of_segments(x);
        if closest.distance >= self.barrier().most() {
            return None;
        }
        let blend = self.blend(x);
        let turn = blend.angle.as_ref().map_or_else(Gradient12::zeros, |angle| angle.gradient());
        let mut sums = Sums { force: Vec3::zeros(), moments: [0.0; 2], total: 0.0 };
        self.visit(x, closest, |contribution| {
            let weight = blend.point[0] * contribution.point + blend.line[0] * contribution.line;
            let slope = blend.point[1] * contribution.point + blend.line[1] * contribution.line;
            let pressure = -weight * contribution.barrier.slope;
            sums.force += contribution.separation.normal * pressure;
            sums.total += pressure;
            for side in 0..2 {
                sums.moments[side] += pressure * contribution.separation.places[side];
            }
            let turned = turn * (-slope * contribution.barrier.slope);
            each(&Feature { contribution, separation: &contribution.separation, weight }, pressure, &turned);
        });
        Some(sums)
    }
}

/// A feature in range and how often it counts.
struct Feature<'a> {
    contribution: &'a Contribution,
    separation: &'a Separation,
    weight: f64,
}
