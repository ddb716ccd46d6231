//! Rods as networks of nodes, edges and hinges: numbering, frames, strains and their derivatives.
//!
//! * [`network`]: topology and the numbering of the degrees of freedom.
//! * [`fault`]: why positions are not a configuration, and where.
//! * [`frames`]: parallel transport in space and time, reference twist, holonomy.
//! * [`strain`]: curvature and twist of one hinge with exact first and second derivatives.
//! * [`mod@reference`]: frames that trial states are transported from.
//! * [`configuration`]: everything about a trial state that several terms need, computed once.
//! * [`assembly`]: how a term hands its gradient and Hessian blocks to the solver; [`term`]: what all terms have.

pub mod assembly;
pub mod configuration;
pub mod fault;
pub mod frames;
pub mod network;
pub mod reference;
pub mod strain;
pub mod term;
