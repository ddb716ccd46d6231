//! Curvature and twist of one hinge, with exact first and second derivatives in the hinge's own eight variables.
//!
//! The variables are `(e, theta_e, f, theta_f)`: the edge vectors that meet at the hinge, both pointing from its first
//! to its last node, and the angles of their material frames. Derivatives hold the reference frames of the present
//! configuration, moved by parallel transport; [`super::assembly`] adds the holonomy of transport from the last accepted state.
//! Curvature is measured in the material frame halfway through the twist, a unit frame, and not against the mean of the two
//! edges' directors, which shrinks with it: formulas and reasons in docs/theory, "Strains".

use nalgebra::{SMatrix, SVector};

use super::frames::one_plus_cosine;
use crate::{Mat3, Vec3};

/// Gradient in the hinge's variables: `e` in 0..3, `theta_e` at 3, `f` in 4..7, `theta_f` at 7.
pub type Gradient8 = SVector<f64, 8>;
/// Hessian in the hinge's variables.
pub type Hessian8 = SMatrix<f64, 8, 8>;

/// Row of `theta_e` in the hinge's variables.
pub const THETA_E: usize = 3;
/// First row of the edge vector `f`.
pub const EDGE_F: usize = 4;
/// Row of `theta_f`.
pub const THETA_F: usize = 7;

/// Directors and tangent of one edge as the hinge sees them.
#[derive(Debug, Clone, Copy)]
pub struct EdgeFrame {
    /// Unit tangent.
    pub t: Vec3,
    /// First material director.
    pub m1: Vec3,
    /// Second material director, `t x m1`.
    pub m2: Vec3,
    /// Length of the edge, m.
    pub length: f64,
}

impl EdgeFrame {
    /// The frame turned about its tangent by the angle of this sine and cosine.
    #[inline]
    pub fn turned(&self, (sine, cosine): (f64, f64)) -> Self {
        Self { m1: self.m1 * cosine + self.m2 * sine, m2: self.m2 * cosine - self.m1 * sine, ..*self }
    }
}

/// Geometry and strains of a hinge in one configuration.
#[derive(Debug, Clone, Copy)]
pub struct HingeStrain {
    /// The incoming edge, its frame turned on by half the twist.
    e: EdgeFrame,
    /// The outgoing edge, its frame turned back by half the twist: that of `e`, moved by parallel transport.
    f: EdgeFrame,
    /// Curvature binormal (equation 1).
    kb: Vec3,
    /// Integrated curvature in the frame halfway through the twist.
    pub kappa: [f64; 2],
    /// Integrated twist (equation 3), motor angle taken off (equation 4), rad.
    pub tau: f64,
    chi: f64,
    mean_tangent: Vec3,
    mean_m1: Vec3,
    mean_m2: Vec3,
}

fn skew(v: &Vec3) -> Mat3 {
    v.cross_matrix()
}

fn symmetric_outer(a: &Vec3, b: &Vec3) -> Mat3 {
    let outer = a * b.transpose();
    outer + outer.transpose()
}

impl HingeStrain {
    /// Strains from the material frames of the two edges and the twist between them, whole turns included.
    pub fn new(e: EdgeFrame, f: EdgeFrame, tau: f64) -> Self {
        let (sine, cosine) = (0.5 * tau).sin_cos();
        let (e, f) = (e.turned((sine, cosine)), f.turned((-sine, cosine)));
        let chi = one_plus_cosine(&e.t, &f.t);
        let kb = e.t.cross(&f.t) * (2.0 / chi);
        let (sum_m1, sum_m2) = (e.m1 + f.m1, e.m2 + f.m2);
        Self {
            e,
            f,
            kb,
            kappa: [0.5 * kb.dot(&sum_m2), -0.5 * kb.dot(&sum_m1)],
            tau,
            chi,
            mean_tangent: (e.t + f.t) / chi,
            mean_m1: sum_m1 / chi,
            mean_m2: sum_m2 / chi,
        }
    }

    /// Gradients of `kappa_1` and `kappa_2`.
    pub fn curvature_gradients(&self) -> [Gradient8; 2] {
        let Self { e, f, kappa, mean_tangent, .. } = self;
        let mut first = Gradient8::zeros();
        let mut second = Gradient8::zeros();
        let along_e = |k: f64, cross: Vec3| (-k * mean_tangent + cross) / e.length;
        let along_f = |k: f64, cross: Vec3| (-k * mean_tangent + cross) / f.length;
        first.fixed_rows_mut::<3>(0).copy_from(&along_e(kappa[0], f.t.cross(&self.mean_m2)));
        first.fixed_rows_mut::<3>(EDGE_F).copy_from(&along_f(kappa[0], -e.t.cross(&self.mean_m2)));
        second.fixed_rows_mut::<3>(0).copy_from(&along_e(kappa[1], -f.t.cross(&self.mean_m1)));
        second.fixed_rows_mut::<3>(EDGE_F).copy_from(&along_f(kappa[1], e.t.cross(&self.mean_m1)));
        // Either angle turns the frame halfway by half as much.
        for angle in [THETA_E, THETA_F] {
            first[angle] = 0.5 * kappa[1];
            second[angle] = -0.5 * kappa[0];
        }
        [first, second]
    }

    /// Gradient of the twist.
    pub fn twist_gradient(&self) -> Gradient8 {
        let mut gradient = Gradient8::zeros();
        gradient.fixed_rows_mut::<3>(0).copy_from(&(self.kb / (2.0 * self.e.length)));
        gradient.fixed_rows_mut::<3>(EDGE_F).copy_from(&(self.kb / (2.0 * self.f.length)));
        gradient[THETA_E] = -1.0;
        gradient[THETA_F] = 1.0;
        gradient
    }

    /// Adds `weights[0] H(kappa_1) + weights[1] H(kappa_2)`, given [`Self::curvature_gradients`].
    pub fn add_curvature_hessian(&self, weights: [f64; 2], slopes: &[Gradient8; 2], out: &mut Hessian8) {
        let Self { e, f, kb, kappa, chi, mean_tangent, .. } = self;
        // The second curvature is the first with (m2, m1, +) exchanged for (m1, m2, -): the weighted sum needs only sums of
        // directors.
        let weighted = weights[0] * kappa[0] + weights[1] * kappa[1];
        let mean = self.mean_m2 * weights[0] - self.mean_m1 * weights[1];
        // The frame halfway turns with the twist, and that with the edges: the terms with kb kb^T.
        let with_twist = kb * (weighted / 32.0);
        let own_e = (e.m2 * weights[0] - e.m1 * weights[1]) * 0.25 + with_twist;
        let own_f = (f.m2 * weights[0] - f.m1 * weights[1]) * 0.25 + with_twist;

        let across_f = f.t.cross(&mean);
        let across_e = e.t.cross(&mean);
        let mean_outer = mean_tangent * mean_tangent.transpose();
        let identity = Mat3::identity();

        let block_ee = (mean_outer * (2.0 * weighted)
            - symmetric_outer(&across_f, mean_tangent)
            - (identity - e.t * e.t.transpose()) * (weighted / chi)
            + symmetric_outer(kb, &own_e))
            / (e.length * e.length);
        let block_ff = (mean_outer * (2.0 * weighted) + symmetric_outer(&across_e, mean_tangent)
            - (identity - f.t * f.t.transpose()) * (weighted / chi)
            + symmetric_outer(kb, &own_f))
            / (f.length * f.length);
        let block_ef = (mean_outer * (2.0 * weighted) - across_f * mean_tangent.transpose()
            + mean_tangent * across_e.transpose()
            - (identity + e.t * f.t.transpose()) * (weighted / chi)
            + kb * with_twist.transpose() * 2.0
            - skew(&mean))
            / (e.length * f.length);
        add_block(out, 0, 0, &block_ee);
        add_block(out, EDGE_F, EDGE_F, &block_ff);
        add_block(out, 0, EDGE_F, &block_ef);
        add_block(out, EDGE_F, 0, &block_ef.transpose());

        // d kappa_1 / d theta = kappa_2 / 2 and d kappa_2 / d theta = -kappa_1 / 2, for either angle.
        let column = (slopes[1] * weights[0] - slopes[0] * weights[1]) * 0.5;
        for angle in [THETA_E, THETA_F] {
            add_mixed(out, 0, angle, &column);
            add_mixed(out, EDGE_F, angle, &column);
            out[(angle, THETA_E)] -= 0.25 * weighted;
            out[(angle, THETA_F)] -= 0.25 * weighted;
        }
    }

    /// Adds `weight H(tau)`.
    pub fn add_twist_hessian(&self, weight: f64, out: &mut Hessian8) {
        let Self { e, f, kb, chi, mean_tangent, .. } = self;
        let block_ee = symmetric_outer(kb, &(e.t + mean_tangent)) * (-0.25 * weight / (e.length * e.length));
        let block_ff = symmetric_outer(kb, &(f.t + mean_tangent)) * (-0.25 * weight / (f.length * f.length));
        let block_ef =
            (skew(&e.t) * (2.0 / chi) - kb * mean_tangent.transpose()) * (0.5 * weight / (e.length * f.length));
        add_block(out, 0, 0, &block_ee);
        add_block(out, EDGE_F, EDGE_F, &block_ff);
        add_block(out, 0, EDGE_F, &block_ef);
        add_block(out, EDGE_F, 0, &block_ef.transpose());
    }
}

fn add_block(out: &mut Hessian8, row: usize, column: usize, block: &Mat3) {
    let mut target = out.fixed_view_mut::<3, 3>(row, column);
    target += block;
}

fn add_mixed(out: &mut Hessian8, row: usize, angle: usize, column: &Gradient8) {
    for k in row..row + 3 {
        out[(k, angle)] += column[k];
        out[(angle, k)] += column[k];
    }
}
