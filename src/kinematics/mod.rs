//! Degrees of freedom: the spaces they live in, what they move, and those whose motion is prescribed.
//!
//! * [`manifold`]: how increments are added and differences taken, in a vector space and of rotations.
//! * [`points`]: positions and velocities of what they move, and forces back.
//! * [`clamp`]: nodes and edge angles that are held, moved, or turned like a rigid body.

pub mod clamp;
pub mod manifold;
pub mod points;
