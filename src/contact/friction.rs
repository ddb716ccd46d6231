//! Coulomb friction of a contact: dissipative whatever its force and direction are.
//!
//! A contact that pushes with the force `lambda` along `n`, with weights `w_i` of its nodes, slides with the velocity
//! `tau = (I - n n^T) sum_i w_i v_i`. Its dissipation potential is
//!
//! ```text
//!   Phi = mu lambda f(|tau|),     f(y) = y^2 (1 - y / 3 nu) / nu + nu / 3  for  y < nu,  else y
//! ```
//!
//! with the smoothing velocity `nu`, below which the contact sticks in the sense that it creeps. The force on node i is
//! `-dPhi/dv_i = -mu lambda w_i f'(y) tau / y`, at most `mu lambda`, its power `-mu lambda f' y` is never positive, and the second
//! derivative is positive semidefinite since f is convex and grows. Source: Li et al. (2020), section 5, with a velocity for the
//! displacement of a step; there forces and directions are those of the step before, here those of the state that is sought, so that
//! the derivative has a part for how they change with the positions, which is not symmetric.

use super::push::PushVariation;
use super::separation::{Gradient12, Hessian12};
use crate::{Mat3, Vec3};

/// Coefficients of friction; constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Force of friction over normal force.
    pub coefficient: f64,
    /// Velocity from which on a contact slides with the full force, m/s; below it sticks.
    pub smoothing_velocity: f64,
}

/// A contact as it is when friction is applied to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlidingContact {
    /// Nodes `a0, a1, b0, b1`; those of a sphere are the same.
    pub nodes: [usize; 4],
    /// How the relative velocity follows from that of the nodes: `(1 - s, s, t - 1, -t)`.
    pub weights: [f64; 4],
    /// Unit vector from B to A.
    pub normal: Vec3,
    /// Normal force, N; not negative.
    pub force: f64,
}

/// The smoothed modulus: `f`, `f' / y` and `(f' / y)' / y`.
fn smoothed(y: f64, nu: f64) -> [f64; 3] {
    if y < nu {
        [
            y * y * (1.0 - y / (3.0 * nu)) / nu + nu / 3.0,
            (2.0 - y / nu) / nu,
            if y > 0.0 { -1.0 / (nu * nu * y) } else { 0.0 },
        ]
    } else {
        [y, 1.0 / y, -1.0 / (y * y * y)]
    }
}

impl SlidingContact {
    /// Sliding velocity (m/s) when the nodes `a0, a1, b0, b1` have these velocities.
    pub fn sliding(&self, velocities: &[Vec3; 4]) -> Vec3 {
        let relative: Vec3 = velocities.iter().zip(self.weights).map(|(v, w)| v * w).sum();
        relative - self.normal * self.normal.dot(&relative)
    }

    /// Dissipation potential, W.
    pub fn potential(&self, friction: &Friction, velocities: &[Vec3; 4]) -> f64 {
        let [value, ..] = smoothed(self.sliding(velocities).norm(), friction.smoothing_velocity);
        friction.coefficient * self.force * value
    }

    /// Derivative of the potential with respect to the velocities, N: minus the forces on the nodes.
    pub fn gradient(&self, friction: &Friction, velocities: &[Vec3; 4]) -> Gradient12 {
        let sliding = self.sliding(velocities);
        let [_, ratio, _] = smoothed(sliding.norm(), friction.smoothing_velocity);
        let drag = sliding * (friction.coefficient * self.force * ratio);
        Gradient12::from_fn(|row, _| self.weights[row / 3] * drag[row % 3])
    }

    /// Second derivative of the potential, N s/m; symmetric and positive semidefinite.
    pub fn hessian(&self, friction: &Friction, velocities: &[Vec3; 4]) -> Hessian12 {
        let sliding = self.sliding(velocities);
        let [_, ratio, change] = smoothed(sliding.norm(), friction.smoothing_velocity);
        let across = Mat3::identity() - self.normal * self.normal.transpose();
        let core = (across * ratio + sliding * sliding.transpose() * change) * (friction.coefficient * self.force);
        Hessian12::from_fn(|row, column| self.weights[row / 3] * self.weights[column / 3] * core[(row % 3, column % 3)])
    }

    /// Derivative of [`Self::gradient`] with respect to the positions of the nodes at fixed velocities, N/m; not symmetric.
    ///
    /// `variation` says how the contact's force and places change, at the force `stiffness` (Pa) times the push.
    pub fn position_derivative(
        &self,
        friction: &Friction,
        velocities: &[Vec3; 4],
        variation: &PushVariation,
        stiffness: f64,
    ) -> Hessian12 {
        let relative: Vec3 = velocities.iter().zip(self.weights).map(|(v, w)| v * w).sum();
        let along = self.normal.dot(&relative);
        let sliding = relative - self.normal * along;
        let [_, ratio, change] = smoothed(sliding.norm(), friction.smoothing_velocity);
        let drag = sliding * (friction.coefficient * self.force * ratio);
        let across = Mat3::identity() - self.normal * self.normal.transpose();
        let core =
            (Mat3::identity() * ratio + sliding * sliding.transpose() * change) * (friction.coefficient * self.force);
        let [on_a, on_b] = [velocities[1] - velocities[0], velocities[2] - velocities[3]];
        let mut derivative = Hessian12::zeros();
        for column in 0..12 {
            let force: Vec3 = variation.force.column(column) * stiffness;
            let (ds, dt) = (variation.places[0][column], variation.places[1][column]);
            let turn = across * force / self.force;
            let slip = across * (on_a * ds + on_b * dt) - turn * along - self.normal * turn.dot(&relative);
            let change = sliding * (friction.coefficient * ratio * self.normal.dot(&force)) + core * slip;
            for (node, shift) in [-ds, ds, dt, -dt].into_iter().enumerate() {
                let rows = change * self.weights[node] + drag * shift;
                derivative.fixed_view_mut::<3, 1>(3 * node, column).copy_from(&rows);
            }
        }
        derivative
    }
}
