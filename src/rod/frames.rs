//! Directors on edges: parallel transport, reference twist, and the holonomy of transport in time.

use crate::{Mat3, Vec3};

/// Two edges of a hinge whose `1 + cos` of the turning angle is below this have folded onto each other: no configuration.
pub const FOLDED: f64 = 1e-10;

/// `1 + a . b` of unit vectors, to more digits where they are nearly antiparallel.
#[inline]
pub fn one_plus_cosine(a: &Vec3, b: &Vec3) -> f64 {
    0.5 * (a + b).norm_squared()
}

/// Transports `v` from unit tangent `from` to unit tangent `to` by the smallest rotation that takes one to the other.
///
/// Not defined for antiparallel tangents; see [`transport_through`].
#[inline]
pub fn parallel_transport(v: &Vec3, from: &Vec3, to: &Vec3) -> Vec3 {
    let axis = from.cross(to);
    v * from.dot(to) + axis.cross(v) + axis * (axis.dot(v) / one_plus_cosine(from, to))
}

/// Like [`parallel_transport`], but defined for every pair: tangents that no hinge could have are reached through a
/// perpendicular one, chosen by `from` alone.
pub fn transport_through(v: &Vec3, from: &Vec3, to: &Vec3) -> Vec3 {
    if one_plus_cosine(from, to) > FOLDED {
        return parallel_transport(v, from, to);
    }
    let middle = any_perpendicular(from);
    parallel_transport(&parallel_transport(v, from, &middle), &middle, to)
}

/// A unit vector perpendicular to `t`, continuous almost everywhere.
pub fn any_perpendicular(t: &Vec3) -> Vec3 {
    let axis = if t.x.abs() <= t.y.abs() && t.x.abs() <= t.z.abs() {
        Vec3::x()
    } else if t.y.abs() <= t.z.abs() {
        Vec3::y()
    } else {
        Vec3::z()
    };
    t.cross(&axis).normalize()
}

/// Removes what round-off has added along `t` and to the length of the director `d`.
pub fn orthonormalised(d: &Vec3, t: &Vec3) -> Vec3 {
    (d - t * d.dot(t)).normalize()
}

/// Signed angle from `from` to `to` about the unit vector `axis`, in (-pi, pi].
#[inline]
pub fn signed_angle(from: &Vec3, to: &Vec3, axis: &Vec3) -> f64 {
    axis.dot(&from.cross(to)).atan2(from.dot(to))
}

/// Reference twist between two edges: the angle about `tangent_f` from the space-parallel transport of `director_e`
/// to `director_f`, on the branch nearest to `previous` so that it may grow past pi without a jump.
#[inline]
pub fn reference_twist(director_e: &Vec3, tangent_e: &Vec3, director_f: &Vec3, tangent_f: &Vec3, previous: f64) -> f64 {
    let transported = parallel_transport(director_e, tangent_e, tangent_f);
    let angle = signed_angle(&transported, director_f, tangent_f);
    let turn = std::f64::consts::TAU;
    angle + turn * ((previous - angle) / turn).round()
}

/// How a director that is transported in time from `reference` spins about its tangent when the tangent moves.
///
/// Parallel transport is path dependent: relative to transport from the present tangent `t`, a director that always
/// comes from `reference` turns by `beta(t')`, minus the signed area of the spherical triangle `(reference, t, t')`. Its first
/// and second derivatives with respect to the edge vector make gradient and Hessian exact away from the reference
/// (docs/theory, "Frames").
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holonomy {
    /// Derivative of the spin with respect to the edge vector, 1/m.
    pub gradient: Vec3,
    /// Second derivative, 1/m^2.
    pub hessian: Mat3,
}

impl Holonomy {
    /// No spin: the edge stands at its reference.
    pub const NONE: Self = Self {
        gradient: Vec3::new(0.0, 0.0, 0.0),
        hessian: Mat3::from_array_storage(nalgebra::ArrayStorage([[0.0; 3]; 3])),
    };

    /// Derivatives at an edge of unit tangent `t` and the given length.
    pub fn new(reference: &Vec3, t: &Vec3, length: f64) -> Self {
        let normal = t.cross(reference);
        let half = one_plus_cosine(reference, t);
        let slope = normal / half;
        // d2 beta/dt2 = -(n (t + u)^T + (t + u) n^T) / (2 half^2) with n = t x u, projected on the plane normal to t, plus the curvature of
        // the unit sphere, -(g t^T + t g^T) / length^2 with g the slope.
        let projected = (reference + t) - t * half;
        let outer = normal * projected.transpose();
        let radial = slope * t.transpose();
        let squared = length * length;
        Self {
            gradient: slope / length,
            hessian: -(outer + outer.transpose()) / (2.0 * half * half * squared)
                - (radial + radial.transpose()) / squared,
        }
    }
}
