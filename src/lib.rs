//! flagrs: soft helical filaments swimming at low Reynolds number.
//!
//! # The problem
//!
//! A robot or bacterium is a network of nodes `x` and edge angles `theta` with elastic energy `E(x, theta)`: stretching,
//! bending and twisting of a discrete elastic rod. The fluid around it obeys the Stokes equations, so that forces on
//! the filaments and their velocities are linear in each other. With the resistance `Res` of the present geometry, motors that
//! prescribe relative angles, and contact forces `F_c >= 0` that keep filaments apart, one step from `q_n` to `q` solves
//!
//! ```text
//!   dE/dq (q) + Res (q - q_n) / dt + head(q, q_n) = F_loads + F_c          (inertia added where it is asked for)
//! ```
//!
//! by Newton's method with exact derivatives.
//!
//! # The map
//!
//! * [`rod`]: networks, frames, strains; [`elastic`]: energies and motors; [`fluid`]: drag models and the head;
//!   [`forces`]: loads and fields; [`kinematics`]: clamps; [`contact`]: distances and contact forces; [`body`]: rigid bodies in the flow; [`dynamics`]: model, state, schemes, Newton; [`linear`]: matrices.
//! * Imports run one way: `rod <- elastic, fluid, forces, kinematics, contact <- dynamics <- python`; `linear` and `body` know nothing of rods.
//! * [`dynamics::simulation::Simulation`] is the way in.

pub mod body;
pub mod contact;
pub mod dynamics;
pub mod elastic;
pub mod fluid;
pub mod forces;
pub mod kinematics;
pub mod linear;
#[cfg(feature = "python")]
mod python;
pub mod rod;

/// A point or vector in space.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3x3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
