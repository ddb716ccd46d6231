//! Rigid bodies in the flow: their shapes, the points that stand for their surface, and what the fluid does to them.
//!
//! A body's flow is that of point forces inside it, fitted to no slip on its surface (docs/theory/bodies.md).
//!
//! * [`shape`]: what shapes there are; [`profile`]: curves that surfaces of revolution turn about their axis.
//! * [`reach`]: how far a surface is from its own other side, which says how finely it is to be resolved.
//! * [`rings`]: points on rings around an axis, as dense as is wanted where.
//! * [`surface`]: sources and surface points of a shape, fitted to each other as well as is asked for.
//! * [`rigid`]: velocities of points that move with a body, and forces on them as force and torque on it.
//! * [`point_force`]: the flow of a point force.

pub mod point_force;
pub mod profile;
pub mod reach;
pub mod rigid;
pub mod rings;
pub mod shape;
pub mod surface;
