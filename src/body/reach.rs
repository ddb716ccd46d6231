//! How large a ball fits inside a surface of revolution where it touches a given point: the local size of a body, which sets how
//! finely the surface is to be resolved there and how deep below it sources may lie.

use super::profile::ProfilePoint;

/// Radius of the largest ball inside the surface that touches it at each point of its profile, m.
///
/// A ball of radius `R` that touches the surface at `p` has its centre at `p - R n`; another point `q` of the surface is outside it if
/// `|p - q|^2 >= 2 R n . (p - q)`. The ball's centre is on the plane through the axis, so that points of that plane are enough.
pub fn reaches(profile: &[ProfilePoint]) -> Vec<f64> {
    profile.iter().map(|point| profile.iter().map(|other| limit(point, other)).fold(f64::INFINITY, f64::min)).collect()
}

fn limit(point: &ProfilePoint, other: &ProfilePoint) -> f64 {
    let on_side = |radius: f64| {
        let apart = [point.radius - radius, point.height - other.height];
        let squared = apart[0] * apart[0] + apart[1] * apart[1];
        let depth = apart[0] * point.normal[0] + apart[1] * point.normal[1];
        // Of neighbours, and on flat parts, the depth is round-off.
        if depth > 1e-7 * squared.sqrt() { squared / (2.0 * depth) } else { f64::INFINITY }
    };
    on_side(other.radius).min(on_side(-other.radius))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::profile::{Profile, RoundedCylinder, Spheroid};

    fn table(profile: &dyn Profile) -> Vec<ProfilePoint> {
        (0..=400).map(|k| profile.point(f64::from(k) / 400.0)).collect()
    }

    #[test]
    fn balls_inside_a_sphere_are_the_sphere() {
        let reach = reaches(&table(&Spheroid { equatorial: 2.0, polar: 2.0 }));
        assert!(reach.iter().all(|reach| (reach - 2.0).abs() < 1e-6));
    }

    #[test]
    fn the_tip_of_a_spheroid_is_as_sharp_as_its_curvature() {
        let reach = reaches(&table(&Spheroid { equatorial: 1.0, polar: 2.0 }));
        assert!((reach[0] - 0.5).abs() < 1e-3 && (reach[200] - 1.0).abs() < 1e-6, "{} {}", reach[0], reach[200]);
    }

    #[test]
    fn a_flat_disc_is_as_small_as_it_is_thick() {
        let reach = reaches(&table(&RoundedCylinder { radius: 5.0, length: 0.8, edge_radius: 0.4 }));
        assert!((reach[0] - 0.4).abs() < 1e-12 && (reach[200] - 0.4).abs() < 1e-3);
    }
}
