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
//! * Know nothing of rods: [`linear`], matrices; [`nonlinear`], Newton's method; [`bdf`], backward differences; [`signal`], functions of
//!   time; [`plane`], a half-space; [`runtime`], threads and Ctrl-C.
//! * What acts on a filament: [`rod`], networks, frames, strains; [`kinematics`], clamps; [`elastic`], energies; [`forces`], motors, loads and
//!   fields; [`fluid`], drag models and the head; [`contact`], distances and contact forces;
//!   [`body`], rigid bodies in the flow.
//! * What moves it: [`model`], the constant part of a scene; [`state`], the changing one; [`inputs`], what drives; [`step`], the equations of
//!   one step; [`simulation`], step after step.
//! * Imports run one way: `linear, nonlinear, bdf, signal, plane, runtime <- rod, kinematics <- elastic, forces, fluid, contact, body <- model <- state,
//!   inputs <- step <- simulation <- rollout <- python`.
//! * [`simulation::Simulation`] is the way in; [`rollout`] takes many states of one model side by side.

#[cfg(test)]
extern crate self as flagrs;

pub mod bdf;
pub mod body;
pub mod contact;
pub mod elastic;
pub mod fluid;
pub mod forces;
pub mod inputs;
pub mod kinematics;
pub mod linear;
pub mod model;
pub mod nonlinear;
pub mod plane;
#[cfg(feature = "python")]
mod python;
pub mod rod;
pub mod rollout;
pub mod runtime;
pub mod signal;
pub mod simulation;
pub mod state;
pub mod step;

/// A point or vector in space.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3x3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
