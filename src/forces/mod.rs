//! What loads a filament from outside: forces, torques and magnetic moments that follow signals of time.
//!
//! * [`inputs`]: the signals of a scene's loads, evaluated once a step.
//! * [`edge_vector`]: a vector fixed in the material frame of an edge, with its derivatives.
//! * [`laboratory`]: forces on nodes and torques on edges, fixed in the laboratory.
//! * [`follower`]: forces and torques fixed in the material frame.
//! * [`magnetic`]: magnetised edges in a magnetic field.
//! * [`outside`]: forces that a caller gives at the beginning of every step.

pub mod edge_vector;
pub mod follower;
pub mod inputs;
pub mod laboratory;
pub mod magnetic;
pub mod outside;
