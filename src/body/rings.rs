//! Points on rings around the axis of a surface of revolution, as dense as is wanted where.

use std::f64::consts::TAU;

use super::profile::{Profile, ProfilePoint};
use super::reach::reaches;
use crate::Vec3;

/// Points of a profile by which it is known.
const TABLE: usize = 2000;
/// Of these, one in so many is looked at for the reach, and the rest by interpolation.
const REACH_STRIDE: usize = 5;
/// How fast the spacing may change along the profile, so that neighbours have similar ones.
const SLOPE: f64 = 0.5;
/// Fewest points of a ring and fewest rings.
const FEWEST: usize = 3;
const FEWEST_RINGS: usize = 2;

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Where it is, m.
    pub position: Vec3,
    /// Outward unit normal.
    pub normal: Vec3,
    /// Distance of its neighbours, m.
    pub spacing: f64,
    /// Radius of the largest ball inside the surface that touches it there, m.
    pub reach: f64,
}

/// A profile, measured once.
pub struct Rings {
    profile: Box<dyn Profile>,
    /// Parts of the way along the profile, and lengths of arc up to there, m.
    parts: Vec<f64>,
    arc: Vec<f64>,
    reach: Vec<f64>,
}

impl Rings {
    /// Measures a profile.
    pub fn new(profile: Box<dyn Profile>) -> Self {
        let parts: Vec<f64> = (0..=TABLE).map(|k| k as f64 / TABLE as f64).collect();
        let points: Vec<ProfilePoint> = parts.iter().map(|&part| profile.point(part)).collect();
        let mut arc = vec![0.0];
        for pair in points.windows(2) {
            let step = (pair[1].radius - pair[0].radius).hypot(pair[1].height - pair[0].height);
            arc.push(arc[arc.len() - 1] + step);
        }
        let sparse: Vec<ProfilePoint> = points.iter().step_by(REACH_STRIDE).copied().collect();
        let places: Vec<f64> = arc.iter().step_by(REACH_STRIDE).copied().collect();
        let known = reaches(&sparse);
        let reach = arc.iter().map(|&s| interpolate(&places, &known, s)).collect();
        Self { profile, parts, arc, reach }
    }

    /// Points whose spacing is `fineness` times the reach of the surface, times `factor`.
    pub fn points(&self, fineness: f64, factor: f64) -> Vec<SurfacePoint> {
        let spacing: Vec<f64> = self.spacing(fineness).iter().map(|spacing| factor * spacing).collect();
        let mut counted = vec![0.0];
        for k in 1..self.arc.len() {
            let density = 0.5 * (1.0 / spacing[k] + 1.0 / spacing[k - 1]);
            counted.push(counted[k - 1] + density * (self.arc[k] - self.arc[k - 1]));
        }
        let all = counted[counted.len() - 1];
        let rings = (all.round() as usize).max(FEWEST_RINGS);
        let mut out = Vec::new();
        for ring in 0..rings {
            let s = interpolate(&counted, &self.arc, (ring as f64 + 0.5) * all / rings as f64);
            let ProfilePoint { radius, height, normal: [across, along] } =
                self.profile.point(interpolate(&self.arc, &self.parts, s));
            let here = interpolate(&self.arc, &spacing, s);
            let reach = interpolate(&self.arc, &self.reach, s);
            let count = ((TAU * radius / here).round() as usize).max(FEWEST);
            // Every other ring is turned by half a spacing.
            let turn = 0.5 * (ring % 2) as f64;
            out.extend((0..count).map(|k| {
                let (sine, cosine) = (TAU * (k as f64 + turn) / count as f64).sin_cos();
                SurfacePoint {
                    position: Vec3::new(radius * cosine, radius * sine, height),
                    normal: Vec3::new(across * cosine, across * sine, along),
                    spacing: here,
                    reach,
                }
            }));
        }
        out
    }

    /// `fineness` times the reach, made smooth along the profile.
    fn spacing(&self, fineness: f64) -> Vec<f64> {
        let mut spacing: Vec<f64> = self.reach.iter().map(|reach| fineness * reach).collect();
        for k in 1..spacing.len() {
            spacing[k] = spacing[k].min(spacing[k - 1] + SLOPE * (self.arc[k] - self.arc[k - 1]));
        }
        for k in (1..spacing.len()).rev() {
            spacing[k - 1] = spacing[k - 1].min(spacing[k] + SLOPE * (self.arc[k] - self.arc[k - 1]));
        }
        spacing
    }
}

/// The value at `x` of the line through points with ascending `places`.
fn interpolate(places: &[f64], values: &[f64], x: f64) -> f64 {
    let after = places.partition_point(|&place| place < x).clamp(1, places.len() - 1);
    let width = places[after] - places[after - 1];
    let part = if width > 0.0 { ((x - places[after - 1]) / width).clamp(0.0, 1.0) } else { 0.0 };
    values[after - 1] + part * (values[after] - values[after - 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::profile::Spheroid;

    #[test]
    fn points_are_on_the_surface_and_cover_it() {
        let (a, c) = (1.0, 2.0);
        let points = Rings::new(Box::new(Spheroid { equatorial: a, polar: c })).points(0.3, 1.0);
        let mut area = 0.0;
        for point in &points {
            let p = &point.position;
            assert!(((p.x * p.x + p.y * p.y) / (a * a) + p.z * p.z / (c * c) - 1.0).abs() < 1e-14);
            let gradient = Vec3::new(p.x / (a * a), p.y / (a * a), p.z / (c * c)).normalize();
            assert!((gradient - point.normal).norm() < 1e-14);
            area += point.spacing * point.spacing;
        }
        // 2 pi a^2 (1 + c / (a e) asin e), with the eccentricity e.
        let e = (1.0 - a * a / (c * c)).sqrt();
        let exact = TAU * a * a * (1.0 + c / (a * e) * e.asin());
        assert!((area / exact - 1.0).abs() < 0.05, "{area} {exact}");
    }
}
