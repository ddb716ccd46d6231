//! Contact with a plane wall: of an end of an edge, or of a sphere.
//!
//! The distance of a straight edge from a plane is least at one of its ends, so it is enough to keep those away. An edge of rest
//! length `l` whose ends are at the heights `D_v` has the energy
//!
//! ```text
//!   E / kappa = l / 2 sum_v b(D_v),
//! ```
//!
//! the integral along the edge by the trapezoidal rule, so that the force per length of a rod that lies on a wall does not
//! depend on the mesh; `b` is the barrier of [`super::barrier`] with the edge's radius for the thickness. A sphere touches at a point:
//! `E / kappa = xi sqrt(2 delta) b(D)`, as in [`super::pair`]. The second derivative `E'' = w b'' n n^T` is never negative.

use super::barrier::Barrier;
use super::pair::PairEnergy;
use super::push::{Jacobian3x12, Push, PushVariation};
use super::separation::{Gradient12, Hessian12};
use crate::Vec3;
use crate::plane::Plane;

/// A node that a wall pushes.
#[derive(Clone, Copy, Debug)]
pub struct WallContact {
    plane: Plane,
    barrier: Barrier,
    /// Length that the node stands for, m.
    weight: f64,
    /// Which end of its edge the node is: 0 or 1.
    end: usize,
}

impl WallContact {
    /// End `end` of an edge with this rest length and radius (m), with the tolerance `0 < delta < 1`.
    pub fn of_end(plane: Plane, radius: f64, delta: f64, rest_length: f64, end: usize) -> Self {
        Self { plane, barrier: Barrier::new(radius, delta), weight: 0.5 * rest_length, end }
    }

    /// A sphere.
    pub fn of_sphere(plane: Plane, radius: f64, delta: f64) -> Self {
        Self { plane, barrier: Barrier::new(radius, delta), weight: radius * (2.0 * delta).sqrt(), end: 0 }
    }

    /// `E / kappa` (m^3) of the node at `x`; infinite at the least distance or below.
    pub fn energy(&self, x: &Vec3) -> f64 {
        self.weight * self.barrier.at(self.plane.height(x)).value
    }

    /// Energy, gradient and second derivative, all over stiffness; `None` out of range.
    pub fn evaluate(&self, x: &Vec3) -> Option<PairEnergy> {
        let at = self.barrier.at(self.plane.height(x));
        let n = self.plane.normal();
        let (mut gradient, mut hessian) = (Gradient12::zeros(), Hessian12::zeros());
        gradient.fixed_rows_mut::<3>(0).copy_from(&(n * (self.weight * at.slope)));
        hessian.fixed_view_mut::<3, 3>(0, 0).copy_from(&(n * n.transpose() * (self.weight * at.curvature)));
        (at.slope < 0.0).then_some(PairEnergy { energy: self.weight * at.value, gradient, hessian })
    }

    /// How hard the wall pushes, over stiffness; `None` out of range.
    pub fn push(&self, x: &Vec3) -> Option<Push> {
        let slope = self.barrier.at(self.plane.height(x)).slope;
        let force = self.plane.normal() * (-self.weight * slope);
        (slope < 0.0).then_some(Push { force, places: [self.end as f64, 0.0] })
    }

    /// The push with its derivatives; `None` out of range.
    pub fn push_with_variation(&self, x: &Vec3) -> Option<(Push, PushVariation)> {
        let at = self.evaluate(x)?;
        let force = -Jacobian3x12::from(at.hessian.fixed_rows::<3>(0));
        Some((self.push(x)?, PushVariation { force, places: [Gradient12::zeros(); 2] }))
    }

    /// Height of the node, m.
    pub fn distance(&self, x: &Vec3) -> f64 {
        self.plane.height(x)
    }

    /// The distances between which the wall acts.
    pub fn barrier(&self) -> &Barrier {
        &self.barrier
    }

    /// The largest part in `[0, 1]` of the straight way between two places over which the node keeps at least a tenth of its
    /// gap above the least distance; 0 if it has none at the start.
    pub fn safe_part(&self, from: &Vec3, to: &Vec3) -> f64 {
        let gap = self.distance(from) - self.barrier.least();
        let (spare, way) = ((1.0 - KEPT) * gap, self.plane.normal().dot(&(from - to)));
        if gap <= 0.0 {
            0.0
        } else if way <= spare {
            1.0
        } else {
            spare / way
        }
    }
}

/// Part of the first gap that a step must leave, as between edges ([`super::continuous`]).
const KEPT: f64 = 0.1;
