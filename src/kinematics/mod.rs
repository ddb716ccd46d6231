//! Degrees of freedom whose motion is prescribed.
//!
//! * [`clamp`]: nodes and edge angles that are held, moved, or turned like a rigid body.

pub mod clamp;
