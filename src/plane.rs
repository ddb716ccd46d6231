//! A plane that bounds a half-space.

use crate::Vec3;

/// A plane through a point; the half-space is on the side its normal points to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    point: Vec3,
    normal: Vec3,
}

impl Plane {
    /// The plane through `point` (m) with the given normal, of any length.
    ///
    /// `None` unless all is finite and the normal has a direction.
    pub fn new(point: Vec3, normal: Vec3) -> Option<Self> {
        let normal = normal / normal.amax();
        let normal = normal / normal.norm();
        let finite = point.iter().chain(normal.iter()).all(|value| value.is_finite());
        finite.then_some(Self { point, normal })
    }

    /// A point of the plane, m.
    pub fn point(&self) -> &Vec3 {
        &self.point
    }

    /// Unit normal, into the half-space.
    pub fn normal(&self) -> &Vec3 {
        &self.normal
    }

    /// Height above the plane, m; negative on the other side.
    pub fn height(&self, at: &Vec3) -> f64 {
        self.normal.dot(&(at - self.point))
    }

    /// The mirror image of a point.
    pub fn mirror(&self, at: &Vec3) -> Vec3 {
        at - self.normal * (2.0 * self.height(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirroring_turns_heights_round_and_keeps_the_foot() {
        let plane = Plane::new(Vec3::new(1.0, -2.0, 0.5), Vec3::new(3e200, 0.0, 4e200)).expect("a plane");
        assert!((plane.normal().norm() - 1.0).abs() < 1e-15);
        let at = Vec3::new(2.0, 7.0, 1.0);
        let image = plane.mirror(&at);
        assert!((plane.height(&at) - 1.0).abs() < 1e-15 && (plane.height(&image) + 1.0).abs() < 1e-15);
        assert!((at - image).cross(plane.normal()).norm() < 1e-15);
    }

    #[test]
    fn a_normal_without_direction_is_no_plane() {
        for normal in [Vec3::zeros(), Vec3::new(f64::NAN, 0.0, 1.0), Vec3::new(f64::INFINITY, 0.0, 1.0)] {
            assert_eq!(Plane::new(Vec3::zeros(), normal), None);
        }
    }
}
