//! A vector fixed in the material frame of an edge, as a function of the edge's two nodes and its angle.
//!
//! With the edge vector `e = l t`, its angle `theta` and components `b1, b2, b3` the vector is `b = b1 m1 + b2 m2 + b3 t`. Directors are
//! moved by parallel transport from the present tangent, and spin by `d theta + d beta`, where `beta` is the holonomy of transport from the
//! last accepted state. With `v = b1 m1 + b2 m2` and `P = I - t t^T`
//!
//! ```text
//!   db/de = (b3 P - t v^T) / l + (t x v) (d beta/de)^T,      db/dtheta = t x v,
//! ```
//!
//! and for the scalar `phi = c . b` of a constant vector `c`, at constant holonomy, with `w = P c`,
//!
//! ```text
//!   l^2 d2phi/de2     = (c.t) (t v^T + v t^T) - (v w^T + w v^T) / 2 - b3 (t w^T + w t^T + (c.t) P)
//!   l d2phi/de dtheta = -(c.t) t x v,      d2phi/dtheta2 = -c.v.
//! ```
//!
//! Derivation: docs/theory/loads.md.

use crate::rod::configuration::Configuration;
use crate::rod::frames::Holonomy;
use crate::rod::network::Network;
use crate::{Mat3, Vec3};
use nalgebra::{SMatrix, SVector};

/// Gradient in the edge's own variables: first node in 0..3, angle at 3, last node in 4..7.
pub type Gradient7 = SVector<f64, 7>;
/// Hessian in the edge's own variables.
pub type Hessian7 = SMatrix<f64, 7, 7>;

/// Row of the angle in the edge's own variables.
pub const ANGLE: usize = 3;
/// First row of the last node.
pub const LAST: usize = 4;

/// Degrees of freedom of an edge: first node, angle, last node.
pub fn edge_dofs(network: &Network, edge: usize) -> Vec<usize> {
    let [i, j] = network.edges()[edge].map(|node| network.node_dofs()[node]);
    vec![i, i + 1, i + 2, network.edge_dofs()[edge], j, j + 1, j + 2]
}

/// A vector fixed in the material frame, at one configuration.
#[derive(Debug, Clone, Copy)]
pub struct EdgeVector {
    /// Its value in the laboratory.
    pub value: Vec3,
    across: Vec3,
    along: f64,
    t: Vec3,
    length: f64,
    holonomy: Holonomy,
}

impl EdgeVector {
    /// The vector with the given components on `m1, m2, t`.
    pub fn new(configuration: &Configuration, edge: usize, components: Vec3) -> Self {
        let [m1, m2] = configuration.material(edge);
        let t = configuration.tangent(edge);
        let across = m1 * components.x + m2 * components.y;
        Self {
            value: across + t * components.z,
            across,
            along: components.z,
            t,
            length: configuration.length(edge),
            holonomy: configuration.holonomy(edge),
        }
    }

    /// Derivative with respect to the edge vector, 1/m.
    pub fn by_edge(&self) -> Mat3 {
        let normal = Mat3::identity() - self.t * self.t.transpose();
        (normal * self.along - self.t * self.across.transpose()) / self.length
            + self.by_angle() * self.holonomy.gradient.transpose()
    }

    /// Derivative with respect to the angle.
    pub fn by_angle(&self) -> Vec3 {
        self.t.cross(&self.across)
    }

    /// Gradient of `c . b` in the edge's own variables.
    pub fn gradient(&self, c: &Vec3) -> Gradient7 {
        spread(&(self.by_edge().transpose() * c), c.dot(&self.by_angle()))
    }

    /// Hessian of `c . b` in the edge's own variables.
    pub fn hessian(&self, c: &Vec3) -> Hessian7 {
        let Self { across: v, along, t, length, holonomy, .. } = self;
        let ct = c.dot(t);
        let w = c - t * ct;
        let both = |a: &Vec3, b: &Vec3| a * b.transpose() + b * a.transpose();
        let normal = Mat3::identity() - t * t.transpose();
        let spin = c.dot(&self.by_angle());
        let by_both = self.by_angle() * (-ct / length);
        let by_angle = -c.dot(v);
        let edge = (both(t, v) * ct - both(v, &w) * 0.5 - (both(t, &w) + normal * ct) * *along) / (length * length)
            + both(&by_both, &holonomy.gradient)
            + holonomy.gradient * holonomy.gradient.transpose() * by_angle
            + holonomy.hessian * spin;
        let mixed = by_both + holonomy.gradient * by_angle;
        let mut out = Hessian7::zeros();
        for (row, row_sign) in [(0, -1.0), (LAST, 1.0)] {
            for (column, column_sign) in [(0, -1.0), (LAST, 1.0)] {
                out.fixed_view_mut::<3, 3>(row, column).copy_from(&(edge * (row_sign * column_sign)));
            }
            out.fixed_view_mut::<3, 1>(row, ANGLE).copy_from(&(mixed * row_sign));
            out.fixed_view_mut::<1, 3>(ANGLE, row).copy_from(&(mixed.transpose() * row_sign));
        }
        out[(ANGLE, ANGLE)] = by_angle;
        out
    }
}

/// From derivatives by edge vector and angle to those by first node, angle and last node.
pub fn spread(by_edge: &Vec3, by_angle: f64) -> Gradient7 {
    let mut out = Gradient7::zeros();
    out.fixed_rows_mut::<3>(0).copy_from(&-by_edge);
    out[ANGLE] = by_angle;
    out.fixed_rows_mut::<3>(LAST).copy_from(by_edge);
    out
}

/// Derivative of the holonomy's gradient with respect to the edge vector, 1/m^2: the spin that a turn of the edge brings is not the
/// differential of any angle, so that beside the symmetric second derivative there is the curvature of the sphere,
/// `-[t]x / (2 l^2)`.
///
/// A torque is no gradient of an energy, and sees both parts; an energy sees the symmetric one alone.
pub fn spin_derivative(configuration: &Configuration, edge: usize) -> Mat3 {
    let (t, length) = (configuration.tangent(edge), configuration.length(edge));
    configuration.holonomy(edge).hessian - t.cross_matrix() / (2.0 * length * length)
}
