//! What drives and loads a filament: motors, weight, inertia; forces, torques and magnetic moments that follow signals of time.
//!
//! * [`motors`]: prescribed angle or torque of a shaft against its housing (equation 4, corrected).
//! * [`inertia`], [`weight`]: masses, and forces that do not depend on the state.
//! * [`channels`]: the signals of a scene's loads, evaluated once a step.
//! * [`edge_vector`]: a vector fixed in the material frame of an edge, with its derivatives.
//! * [`laboratory`]: forces on nodes and torques on edges, fixed in the laboratory.
//! * [`follower`]: forces and torques fixed in the material frame.
//! * [`magnetic`]: magnetised edges in a magnetic field.
//! * [`outside`]: forces that a caller gives at the beginning of every step.

pub mod channels;
pub mod edge_vector;
pub mod follower;
pub mod inertia;
pub mod laboratory;
pub mod magnetic;
pub mod motors;
pub mod outside;
pub mod weight;
