//! The closest points of two segments, reliable for any length and any angle between them.
//!
//! parry's routine decides in absolute terms what is short (`length^2 < 2.2e-16`) and what is
//! parallel (`a e - b^2 < 2.2e-16`, in length^4), so in metres it mistakes every pair of segments
//! below 0.12 mm for parallel ones and reports up to 25 times the true distance. It is therefore
//! called on segments shifted to a local origin and scaled to O(1), and only when they are clearly
//! not parallel in the relative sense `|u x v|^2 >= 1e-6 |u|^2 |v|^2`, an angle of 1e-3 rad; its
//! answer is then polished by one Newton step. Below that angle `a e - b^2` has lost its digits,
//! and `Pair::nearly_parallel` takes over.
//!
//! Notation: `u = a1 - a0`, `v = b1 - b0`, `w = a0 - b0`; the gap vector is
//! `g(s, t) = w + s u - t v`, and `|g|^2` is a convex quadratic to be minimised over the unit square.

use parry3d_f64::math::Vector;
use parry3d_f64::query::details::closest_points_segment_segment_with_locations_nD;
use parry3d_f64::shape::SegmentPointLocation;

use crate::Vec3;

/// The closest points of two segments A and B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoints {
    /// Distance of the two centrelines (m), at least 0.
    pub distance: f64,
    /// Place on A in `[0, 1]`: the closest point is `a0 + s (a1 - a0)`.
    pub s: f64,
    /// Place on B in `[0, 1]`: the closest point is `b0 + t (b1 - b0)`.
    pub t: f64,
    /// Unit vector from the point on B to the point on A; where the centrelines cross, a direction
    /// perpendicular to A, and to B unless both are parallel.
    pub normal: Vec3,
}

/// `sin^2` of the angle below which two segments are treated as nearly parallel (1e-3 rad).
///
/// parry's answer is off by about `2.2e-16 / sin(angle)` of the segment length where the segments
/// cross: 2.0e-13 in the worst of 10^5 pairs above this angle, before it is polished.
const PARALLEL_SIN2: f64 = 1e-6;

/// Least `|u x v|^2` of the scaled segments (the longer one of length 1 to 3.5) handed to parry.
///
/// Far enough above parry's absolute threshold of 2.2e-16 that its rounding cannot meet it; reached
/// only by pairs whose lengths differ by more than a factor of about 1e3.
const PARRY_SAFE_CROSS2: f64 = 1e-12;

/// Round-off, relative to the segments, below which two distances are equal and a gap is closed.
///
/// The largest gap computed for 10^7 pairs of segments that cross exactly, at angles from 1e-9 rad
/// to 90 degrees and without the preference for the middle of an overlap, was 2.0 units of
/// round-off; this is eight times as much. A distance may exceed the minimum by it times
/// `D + sqrt(|u|^2 + |v|^2)`, which is 8.6e-15 of the larger of length and distance.
const ROUND_OFF: f64 = 16.0 * f64::EPSILON;

/// Closest points of the segments `a0 a1` and `b0 b1` (m).
///
/// The distance is the true minimum, and the same with A and B exchanged, to 1e-14 of the larger of
/// segment length and distance, for every angle and for segments of any length, zero included
/// (worst of 3 10^6 pairs: 8.5e-15). Where the closest points are not unique to round-off, because
/// the segments are parallel and overlap, the middle of the overlap is returned, so that a contact
/// does not jump from end to end while the rods slide. Coordinates that are not finite give a
/// distance that is not finite.
///
/// ```
/// use flagrs::{Vec3, contact::distance::segment_distance};
/// let x = 1e-6; // a crossing of two micrometre segments
/// let pair = segment_distance(
///     &Vec3::new(-x, 0.0, 0.0), &Vec3::new(x, 0.0, 0.0),
///     &Vec3::new(0.0, -x, -1e-8), &Vec3::new(0.0, x, -1e-8));
/// assert!((pair.distance - 1e-8).abs() < 1e-20 && pair.normal.z == 1.0);
/// ```
///
/// Source: C. Ericson, Real-Time Collision Detection (2005), section 5.1.9, as implemented in
/// parry.
pub fn segment_distance(a0: &Vec3, a1: &Vec3, b0: &Vec3, b1: &Vec3) -> ClosestPoints {
    let (u, v, w) = (a1 - a0, b1 - b0, a0 - b0);
    let (scale, unit) = power_of_two_scale(&u, &v, &w);
    let pair = Pair::new(u * scale, v * scale, w * scale);

    let (s, t) = if pair.cross2 >= PARALLEL_SIN2 * pair.uu * pair.vv && pair.cross2 >= PARRY_SAFE_CROSS2 {
        pair.at_an_angle()
    } else if pair.uu > 0.0 && pair.vv > 0.0 {
        pair.nearly_parallel()
    } else {
        pair.with_a_point()
    };

    let gap = pair.gap(s, t);
    let length = gap.norm();
    let normal = if length * length <= ROUND_OFF * ROUND_OFF * (pair.uu + pair.vv) {
        pair.perpendicular()
    } else {
        gap * (1.0 / length)
    };
    ClosestPoints { distance: length * unit, s, t, normal }
}

/// The power of two that brings the longer segment to O(1), and its inverse: scaling itself then
/// never rounds.
///
/// Segments of no length leave the distance `w` as the only size; keeping the scaled `w` below
/// 2^400 leaves room for its square.
#[inline(always)]
fn power_of_two_scale(u: &Vec3, v: &Vec3, w: &Vec3) -> (f64, f64) {
    const ROOM: f64 = f64::from_bits((1023 - 400) << 52); // 2^-400
    let size = u.amax().max(v.amax()).max(w.amax() * ROOM);
    // The exponent field of a double holds the power of two plus 1023; 0 and above 2045 have no
    // inverse of this form.
    let exponent = (size.to_bits() >> 52).clamp(1, 2045);
    (f64::from_bits((2046 - exponent) << 52), f64::from_bits(exponent << 52))
}

/// Two scaled segments and the products every branch needs.
struct Pair {
    u: Vec3,
    v: Vec3,
    w: Vec3,
    uu: f64,
    vv: f64,
    uv: f64,
    /// `u x v` and its square, which unlike `uu vv - uv^2` keeps its digits at small angles.
    cross: Vec3,
    cross2: f64,
}

impl Pair {
    #[inline(always)]
    fn new(u: Vec3, v: Vec3, w: Vec3) -> Self {
        let cross = u.cross(&v);
        Self { uu: u.norm_squared(), vv: v.norm_squared(), uv: u.dot(&v), cross2: cross.norm_squared(), cross, u, v, w }
    }

    #[inline(always)]
    fn gap(&self, s: f64, t: f64) -> Vec3 {
        self.w + self.u * s - self.v * t
    }

    /// Place on A nearest to the point `t` of B, within the segment.
    #[inline(always)]
    fn nearest_on_a(&self, t: f64) -> f64 {
        (-self.u.dot(&(self.w - self.v * t)) / self.uu).clamp(0.0, 1.0)
    }

    /// parry's answer, polished where both points are inside their segments; elsewhere one of them
    /// is an end, the other its projection, and nothing has been lost.
    #[inline(always)]
    fn at_an_angle(&self) -> (f64, f64) {
        let vector = |p: &Vec3| Vector::new(p.x, p.y, p.z);
        let (origin, b0) = (Vector::ZERO, -vector(&self.w));
        let (on_a, on_b) = closest_points_segment_segment_with_locations_nD(
            (&origin, &vector(&self.u)),
            (&b0, &(b0 + vector(&self.v))),
        );
        let (s, t) = (parameter(on_a), parameter(on_b));
        if s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0 { self.newton(s, t) } else { (s, t) }
    }

    /// The minimum for segments within about 1e-3 rad of parallel, or of very unequal length.
    ///
    /// All points of the overlap are then about equally close. One Newton step from the middle of
    /// the overlap finds the minimum; the middle itself is kept when it is as close to round-off:
    /// at a distance `D`, when the segments are skew by less than about `1.7e-7 sqrt(D / length)`
    /// or inclined towards each other by less than about 1e-14.
    fn nearly_parallel(&self) -> (f64, f64) {
        // Places on A level with the ends of B, in the order of A.
        let (p, q) = (-self.u.dot(&self.w) / self.uu, -self.u.dot(&(self.w - self.v)) / self.uu);
        let (from, to) = (p.min(q).max(0.0), p.max(q).min(1.0));
        let middle = (0.5 * (from + to)).clamp(0.0, 1.0);
        let level = self.v.dot(&(self.w + self.u * middle)) / self.vv;
        let best = self.newton(middle, level);
        if from > to {
            return best;
        }
        let middle = (middle, level.clamp(0.0, 1.0));
        let (shortest, at_middle) = (self.gap(best.0, best.1).norm(), self.gap(middle.0, middle.1).norm());
        let size = shortest + (self.uu + self.vv).sqrt();
        if at_middle <= shortest + ROUND_OFF * size { middle } else { best }
    }

    /// The constrained minimum from a starting point: one Newton step for `s` on `min over t of
    /// |g|^2`, then Ericson's clamping.
    ///
    /// The step uses `u` less its part along `v`, and the gap at the start rather than `w`, so its
    /// error is `eps (|u| sin + |g|) / sin^2`: at a crossing (`g -> 0`) the excess distance stays
    /// at round-off for any angle. Clamping `s`, projecting, and re-projecting when `t` is clamped
    /// is exact because `|g|^2` is convex.
    #[inline(always)]
    fn newton(&self, s: f64, t: f64) -> (f64, f64) {
        let across = self.u - self.v * (self.uv / self.vv);
        let across2 = across.norm_squared();
        // Exactly parallel: every s of the overlap is as good.
        let s = if across2 > 0.0 { (s - self.gap(s, t).dot(&across) / across2).clamp(0.0, 1.0) } else { s };
        let t = self.v.dot(&(self.w + self.u * s)) / self.vv;
        if (0.0..=1.0).contains(&t) {
            (s, t)
        } else {
            let t = t.clamp(0.0, 1.0);
            (self.nearest_on_a(t), t)
        }
    }

    /// The minimum when at least one segment is a point.
    fn with_a_point(&self) -> (f64, f64) {
        if self.uu > 0.0 {
            (self.nearest_on_a(0.0), 0.0)
        } else if self.vv > 0.0 {
            (0.0, (self.v.dot(&self.w) / self.vv).clamp(0.0, 1.0))
        } else {
            (0.0, 0.0)
        }
    }

    /// A unit vector perpendicular to both segments, or to the longer one when they are parallel.
    fn perpendicular(&self) -> Vec3 {
        if self.cross2 > ROUND_OFF * ROUND_OFF * self.uu * self.vv {
            return self.cross / self.cross2.sqrt();
        }
        let along = if self.uu >= self.vv { self.u } else { self.v };
        // The coordinate axis most across the segment gives the best conditioned product.
        let mut axis = Vec3::zeros();
        axis[along.iamin()] = 1.0;
        along.cross(&axis).try_normalize(0.0).unwrap_or_else(Vec3::x)
    }
}

/// Place along the segment of a location as parry states it.
#[inline(always)]
fn parameter(location: SegmentPointLocation) -> f64 {
    match location {
        SegmentPointLocation::OnVertex(0) => 0.0,
        SegmentPointLocation::OnVertex(_) => 1.0,
        SegmentPointLocation::OnEdge([_, t]) => t,
    }
}
