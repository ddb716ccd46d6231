//! Curves that surfaces of revolution turn about the z axis.

use std::f64::consts::{FRAC_PI_2, PI};

/// A point of such a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfilePoint {
    /// Distance from the axis, m.
    pub radius: f64,
    /// Place along the axis, m.
    pub height: f64,
    /// Outward unit normal, away from the axis and along it.
    pub normal: [f64; 2],
}

/// A curve from the upper pole of a closed surface to its lower one.
pub trait Profile {
    /// The point at the part `u` of the way, 0 at the upper pole, 1 at the lower one.
    fn point(&self, u: f64) -> ProfilePoint;
}

/// An ellipsoid of revolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spheroid {
    /// Half the width across the axis, m.
    pub equatorial: f64,
    /// Half the length along the axis, m.
    pub polar: f64,
}

impl Profile for Spheroid {
    fn point(&self, u: f64) -> ProfilePoint {
        let (sine, cosine) = (PI * u).sin_cos();
        let (across, along) = (self.polar * sine, self.equatorial * cosine);
        let size = across.hypot(along);
        ProfilePoint {
            radius: self.equatorial * sine,
            height: self.polar * cosine,
            normal: [across / size, along / size],
        }
    }
}

/// A cylinder whose edges are rounded; a capsule where they are rounded by its whole radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoundedCylinder {
    /// Radius, m.
    pub radius: f64,
    /// Length from end to end, m.
    pub length: f64,
    /// Radius of the rounding, at most the radius and half the length, m.
    pub edge_radius: f64,
}

impl Profile for RoundedCylinder {
    fn point(&self, u: f64) -> ProfilePoint {
        let upper = u <= 0.5;
        let flat = self.radius - self.edge_radius;
        let arc = self.edge_radius * FRAC_PI_2;
        let half_side = 0.5 * self.length - self.edge_radius;
        let along = (if upper { u } else { 1.0 - u }) * 2.0 * (flat + arc + half_side);
        let (radius, below_end, normal) = if along < flat {
            (along, 0.0, [0.0, 1.0])
        } else if along < flat + arc {
            let (sine, cosine) = ((along - flat) / self.edge_radius).sin_cos();
            (flat + self.edge_radius * sine, self.edge_radius * (1.0 - cosine), [sine, cosine])
        } else {
            (self.radius, self.edge_radius + (along - flat - arc), [1.0, 0.0])
        };
        let height = 0.5 * self.length - below_end;
        let sign = if upper { 1.0 } else { -1.0 };
        ProfilePoint { radius, height: sign * height, normal: [normal[0], sign * normal[1]] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_closed_and_normal(profile: &dyn Profile) {
        let count = 4000;
        let point = |k: usize| profile.point(k as f64 / f64::from(count));
        assert!(point(0).radius < 1e-15 && point(count as usize).radius < 1e-12);
        for k in 1..count as usize {
            let (before, at, after) = (point(k - 1), point(k), point(k + 1));
            let along = [after.radius - before.radius, after.height - before.height];
            let size = along[0].hypot(along[1]);
            let off = (along[0] * at.normal[0] + along[1] * at.normal[1]) / size;
            assert!(off.abs() < 2e-2, "{k}: {off}");
            // From the upper pole down, the outside is on the left of the way.
            assert!(at.normal[0] * along[1] - at.normal[1] * along[0] < 0.0);
            assert!((at.normal[0].hypot(at.normal[1]) - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn profiles_are_closed_and_their_normals_point_outwards() {
        is_closed_and_normal(&Spheroid { equatorial: 1.0, polar: 3.0 });
        is_closed_and_normal(&RoundedCylinder { radius: 1.0, length: 3.0, edge_radius: 0.3 });
        is_closed_and_normal(&RoundedCylinder { radius: 1.0, length: 3.0, edge_radius: 1.0 });
    }

    #[test]
    fn a_rounded_cylinder_has_the_given_size() {
        let cylinder = RoundedCylinder { radius: 2.0, length: 5.0, edge_radius: 0.5 };
        let middle = cylinder.point(0.5);
        assert!((middle.radius - 2.0).abs() < 1e-15 && middle.height.abs() < 1e-12);
        assert_eq!((cylinder.point(0.0).height, cylinder.point(1.0).height), (2.5, -2.5));
    }
}
