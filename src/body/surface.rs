//! A body's surface as the flow sees it: point forces inside it, fitted to the velocity of points on it.
//!
//! With `S` the flow of the sources at the surface points and `P` its least-squares inverse, the forces `g = 8 pi mu P v` make the fluid
//! move with the velocities `v` of the surface as well as they can; what is left on other points of the surface tells how well.

use std::f64::consts::PI;

use nalgebra::{Matrix6, Vector6};

use super::point_force::stokeslet_matrix;
use super::rigid::{force_and_torque, velocities};
use super::rings::SurfacePoint;
use super::shape::{Sampler, Shape};
use crate::Vec3;
use crate::linear::LinearError;
use crate::linear::pseudo_inverse::pseudo_inverse;

/// Depth of a source below the surface: this many spacings, but not more than this part of the ball that fits in there.
/// Deeper ones fit smooth surfaces better, until the matrix is singular to working precision.
const DEPTH_IN_SPACINGS: f64 = 2.0;
const DEPTH_IN_REACHES: f64 = 0.6;
/// Spacing of fitted surface points over that of sources: twice as many of them.
const FITTED: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Spacing of the points on which the fit is judged.
const JUDGED: f64 = 0.6;
/// Pivots of the fit that count as zero, over the largest.
const CUT: f64 = 1e-12;
/// Spacing of sources over the reach of the surface, at first, and by what it is multiplied until the fit is good enough.
const COARSEST: f64 = 1.2;
const FINER: f64 = 0.84;
/// Most sources: beyond, the fit takes minutes.
const MOST_SOURCES: usize = 800;
/// Error of a resistance over the root-mean-square velocity left on the surface, and over its square.
///
/// What the sources miss of the traction is of the order of the velocity that they leave, and the two together make the error, at
/// most 5 times the square in what was tried (spheroids up to 5:1, capsule, rounded cylinders). In fine fits the surface points, which
/// are no exact quadrature, leave a part that is linear in it: at most 0.02 of it.
const RESISTANCE_PER_SLIP: f64 = 0.05;
const RESISTANCE_PER_SQUARE: f64 = 9.0;

/// A shape cannot be resolved as finely as is asked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// More sources would be needed than can be fitted.
    #[error(
        "an error of {asked:.1e} needs more than {MOST_SOURCES} sources inside the body: the next finer fit has {sources}, the finest \
         one leaves {reached:.1e}"
    )]
    Accuracy {
        /// Sources of the first fit that is too fine.
        sources: usize,
        /// Estimated error of the one before, infinite if there is none.
        reached: f64,
        /// The error that is asked for.
        asked: f64,
    },
    /// The fit itself failed.
    #[error(transparent)]
    Linear(#[from] LinearError),
}

/// Sources and surface points of a body in its own frame, and the matrix that fits the one to the other.
#[derive(Debug, Clone)]
pub struct Surface {
    /// Where the sources are, m.
    pub sources: Vec<Vec3>,
    /// The points of the surface that they are fitted to, m.
    pub points: Vec<Vec3>,
    /// `P`, 3 sources x 3 points by columns, m.
    pub fit: Vec<f64>,
    /// Estimated error of the resistance, relative to itself.
    pub error: f64,
    /// Root-mean-square velocity left on the surface over that of the surface, of the rigid motion where it is largest.
    pub slip: f64,
}

impl Surface {
    /// The coarsest surface of a shape whose resistance is estimated to be wrong by no more than `accuracy`, relative to itself.
    ///
    /// # Errors
    /// [`SurfaceError::Accuracy`] if there is none that can be computed.
    pub fn new(shape: &Shape, accuracy: f64) -> Result<Self, SurfaceError> {
        let sampler = shape.sampler();
        let (mut fineness, mut reached) = (COARSEST, f64::INFINITY);
        loop {
            let sources = sampler.points(fineness, 1.0).len();
            if sources > MOST_SOURCES {
                return Err(SurfaceError::Accuracy { sources, reached, asked: accuracy });
            }
            let surface = Self::with_fineness(&sampler, fineness)?;
            if surface.error <= accuracy {
                return Ok(surface);
            }
            reached = surface.error;
            fineness *= FINER;
        }
    }

    /// The surface whose sources are apart by `fineness` times the radius of a ball that fits in there.
    fn with_fineness(sampler: &Sampler, fineness: f64) -> Result<Self, SurfaceError> {
        let positions = |points: &[SurfacePoint]| points.iter().map(|point| point.position).collect::<Vec<Vec3>>();
        let depth = |point: &SurfacePoint| (DEPTH_IN_SPACINGS * point.spacing).min(DEPTH_IN_REACHES * point.reach);
        let inside = |point: &SurfacePoint| point.position - point.normal * depth(point);
        let sources: Vec<Vec3> = sampler.points(fineness, 1.0).iter().map(inside).collect();
        let points = positions(&sampler.points(fineness, FITTED));
        let matrix = stokeslet_matrix(&points, &sources);
        let fit = pseudo_inverse(&matrix, 3 * points.len(), 3 * sources.len(), CUT)?;
        let mut surface = Self { sources, points, fit, error: f64::INFINITY, slip: f64::INFINITY };
        surface.slip = surface.slip_on(&sampler.points(fineness, JUDGED));
        surface.error = surface.slip * (RESISTANCE_PER_SLIP + RESISTANCE_PER_SQUARE * surface.slip);
        Ok(surface)
    }

    /// Forces on the fluid, over `8 pi mu`, that move the fluid with the velocities (3 per point) of the surface.
    pub fn strengths(&self, velocity: &[f64]) -> Vec<f64> {
        multiply(&self.fit, 3 * self.sources.len(), velocity)
    }

    /// Forces of the sources on the fluid, N, as the body moves with `(U, Omega)` in m/s and rad/s, in a fluid of the given viscosity (Pa s).
    pub fn forces(&self, motion: &Vector6<f64>, viscosity: f64) -> Vec<Vec3> {
        let strengths = self.strengths(&velocities(motion, &self.points));
        strengths.chunks_exact(3).map(|g| 8.0 * PI * viscosity * Vec3::new(g[0], g[1], g[2])).collect()
    }

    /// The resistance of the body about its centre in a fluid of the given viscosity (Pa s): force and torque on the fluid, in N and N m,
    /// by `(U, Omega)` in m/s and rad/s.
    pub fn resistance(&self, viscosity: f64) -> Matrix6<f64> {
        let mut out = Matrix6::zeros();
        for k in 0..6 {
            let strengths = self.strengths(&velocities(&unit(k), &self.points));
            out.set_column(k, &(8.0 * PI * viscosity * force_and_torque(&strengths, &self.sources)));
        }
        out
    }

    /// What is left of the velocity of a rigid surface at other points of it, as [`Self::slip`] says.
    fn slip_on(&self, others: &[SurfacePoint]) -> f64 {
        let positions: Vec<Vec3> = others.iter().map(|point| point.position).collect();
        let flow = stokeslet_matrix(&positions, &self.sources);
        let relative = |k: usize| {
            let found = multiply(&flow, 3 * positions.len(), &self.strengths(&velocities(&unit(k), &self.points)));
            let wanted = velocities(&unit(k), &positions);
            let (mut left, mut all) = (0.0, 0.0);
            for (i, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
                let area = others[i / 3].spacing.powi(2);
                left += area * (found - wanted).powi(2);
                all += area * wanted.powi(2);
            }
            (left / all).sqrt()
        };
        (0..6).map(relative).fold(0.0, f64::max)
    }
}

fn unit(k: usize) -> Vector6<f64> {
    Vector6::from_fn(|row, _| if row == k { 1.0 } else { 0.0 })
}

/// `A x` of a matrix by columns.
fn multiply(matrix: &[f64], rows: usize, x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; rows];
    for (column, x) in matrix.chunks_exact(rows).zip(x) {
        out.iter_mut().zip(column).for_each(|(out, entry)| *out += entry * x);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::profile::RoundedCylinder;

    const DRAG: f64 = 6.0 * PI;
    const TORQUE: f64 = 8.0 * PI;

    fn resistance(shape: Shape, accuracy: f64) -> Matrix6<f64> {
        Surface::new(&shape, accuracy).expect("it can be resolved").resistance(1.0)
    }

    #[test]
    fn a_sphere_is_as_exact_as_is_asked_for() {
        let mut sources = 0;
        for accuracy in [1e-2, 1e-4, 1e-6, 1e-8] {
            let shape = Shape::Ellipsoid { semi_axes: [2.0; 3] };
            let surface = Surface::new(&shape, accuracy).expect("a sphere can");
            let found = surface.resistance(1.0);
            for k in 0..3 {
                let drag = found[(k, k)] / (2.0 * DRAG) - 1.0;
                let torque = found[(3 + k, 3 + k)] / (8.0 * TORQUE) - 1.0;
                assert!(drag.abs() < accuracy && torque.abs() < accuracy, "{accuracy}: {drag} {torque}");
            }
            assert!(surface.sources.len() >= sources);
            sources = surface.sources.len();
        }
    }

    /// Drag of a prolate spheroid over `6 pi mu b U`, along and across its axis (Chwang and Wu 1975).
    fn spheroid_drag(aspect: f64) -> [f64; 2] {
        let e = (1.0 - 1.0 / (aspect * aspect)).sqrt();
        let logarithm = ((1.0 + e) / (1.0 - e)).ln();
        let along = 8.0 / 3.0 * e.powi(3) / ((1.0 + e * e) * logarithm - 2.0 * e);
        let across = 16.0 / 3.0 * e.powi(3) / (2.0 * e + (3.0 * e * e - 1.0) * logarithm);
        [aspect * along, aspect * across]
    }

    #[test]
    fn spheroids_along_any_axis_have_the_drag_of_chwang_and_wu() {
        let accuracy = 1e-3;
        for (aspect, axis) in [(2.0, 0), (2.0, 1), (3.0, 2)] {
            let mut semi_axes = [1.0; 3];
            semi_axes[axis] = aspect;
            let found = resistance(Shape::Ellipsoid { semi_axes }, accuracy);
            let [along, across] = spheroid_drag(aspect);
            for k in 0..3 {
                let exact = if k == axis { along } else { across };
                assert!((found[(k, k)] / (DRAG * exact) - 1.0).abs() < accuracy, "{aspect} {axis} {k}");
            }
        }
    }

    #[test]
    fn resistances_are_symmetric_and_scale_with_size() {
        let shape =
            |size: f64| Shape::Cylinder(RoundedCylinder { radius: size, length: 4.0 * size, edge_radius: size });
        let (large, small) = (resistance(shape(1.0), 1e-3), resistance(shape(1e-6), 1e-3));
        assert!((large - large.transpose()).norm() < 1e-3 * large.norm());
        for (row, column, power) in [(0, 0, 1), (2, 2, 1), (3, 3, 3), (5, 5, 3)] {
            let scaled = small[(row, column)] / 1e-6_f64.powi(power);
            assert!((scaled / large[(row, column)] - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn more_than_can_be_resolved_is_refused() {
        let needle = Shape::Cylinder(RoundedCylinder { radius: 1.0, length: 2.0, edge_radius: 0.02 });
        assert!(matches!(Surface::new(&needle, 1e-9), Err(SurfaceError::Accuracy { .. })));
    }
}
