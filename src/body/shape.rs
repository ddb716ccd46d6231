//! The shapes of rigid bodies.

use super::profile::{RoundedCylinder, Spheroid};
use super::rings::{Rings, SurfacePoint};
use crate::Vec3;

/// The shape of a body, about its own centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// An ellipsoid along x, y and z.
    Ellipsoid {
        /// Its semi-axes along x, y and z, m.
        semi_axes: [f64; 3],
    },
    /// A cylinder along z with rounded edges.
    Cylinder(RoundedCylinder),
}

/// Points on a shape, at any density.
pub struct Sampler {
    rings: Rings,
    stretch: Stretch,
}

/// What makes an ellipsoid of one of revolution about z: stretching across, then renaming the axes.
struct Stretch {
    across: [f64; 2],
    /// Which axis of the shape each of x, y and z becomes.
    axes: [usize; 3],
}

impl Shape {
    /// The means to put points on it.
    pub fn sampler(&self) -> Sampler {
        match self {
            Self::Cylinder(cylinder) => {
                let stretch = Stretch { across: [1.0, 1.0], axes: [0, 1, 2] };
                Sampler { rings: Rings::new(Box::new(*cylinder)), stretch }
            }
            Self::Ellipsoid { semi_axes } => ellipsoid(semi_axes),
        }
    }
}

fn ellipsoid(semi_axes: &[f64; 3]) -> Sampler {
    // The surface is most like one of revolution about the axis whose other two are most alike.
    let unlike = |axes: &[usize; 3]| (semi_axes[axes[0]] / semi_axes[axes[1]]).ln().abs();
    let candidates = [[0, 1, 2], [1, 2, 0], [2, 0, 1]];
    let axes = candidates.into_iter().min_by(|a, b| unlike(a).total_cmp(&unlike(b))).unwrap_or([0, 1, 2]);
    let [a, b, c] = axes.map(|axis| semi_axes[axis]);
    let equatorial = (a * b).sqrt();
    Sampler {
        rings: Rings::new(Box::new(Spheroid { equatorial, polar: c })),
        stretch: Stretch { across: [a / equatorial, b / equatorial], axes },
    }
}

impl Sampler {
    /// Points whose spacing is `factor` times `fineness` times the radius of a ball that fits in there.
    pub fn points(&self, fineness: f64, factor: f64) -> Vec<SurfacePoint> {
        self.rings.points(fineness, factor).iter().map(|point| self.stretch.apply(point)).collect()
    }
}

impl Stretch {
    fn apply(&self, point: &SurfacePoint) -> SurfacePoint {
        let [x, y] = self.across;
        let place = |vector: Vec3| {
            let mut out = Vec3::zeros();
            (0..3).for_each(|k| out[self.axes[k]] = vector[k]);
            out
        };
        let smallest = x.min(y);
        SurfacePoint {
            position: place(point.position.component_mul(&Vec3::new(x, y, 1.0))),
            normal: place(point.normal.component_div(&Vec3::new(x, y, 1.0)).normalize()),
            spacing: point.spacing,
            reach: smallest * point.reach,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_an_ellipsoid_are_on_it() {
        for semi_axes in [[1.0, 1.2, 3.0], [3.0, 1.0, 1.1], [1.0, 2.5, 0.9]] {
            let shape = Shape::Ellipsoid { semi_axes };
            for point in shape.sampler().points(0.4, 1.0) {
                let scaled = point.position.component_div(&Vec3::from(semi_axes));
                assert!((scaled.norm() - 1.0).abs() < 1e-14);
                let gradient = scaled.component_div(&Vec3::from(semi_axes)).normalize();
                assert!((gradient - point.normal).norm() < 1e-14);
            }
        }
    }
}
