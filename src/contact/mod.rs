//! Contact: which edges of the rods touch, where, and along which direction.
//!
//! Every edge is a capsule, the set of points within its radius of a straight centreline. The room
//! is pure geometry and runs in one direction: [`exclusion`] decides once, from the rest shape,
//! which pairs of edges are neighbours along a rod and so can never count; [`broad_phase`] lists,
//! for given node positions, the remaining pairs whose bounding boxes overlap; [`distance`]
//! measures one pair, and is the only file that calls parry's segment-segment routine. Contact
//! models stand on top of these three and add the mechanics. Lengths are in metres, but every
//! decision is relative to the sizes at hand: nothing depends on the unit.
//!
//! There are two models. [`spillmann`] turns overlaps into forces, pass by pass, until they are
//! within a tolerance. The other one is a potential that grows without bound before rods touch
//! each other's cores: [`potential`] is the way in. Below it, [`bodies`] numbers what can touch;
//! [`candidates`] keeps the near pairs; [`pair`] is the energy of one of them, made of a
//! [`barrier`] on each [`separation`], weighted by their [`angle`]; [`continuous`] cuts a step before
//! a core is reached; [`friction`] acts on each contact with its [`push`]; [`stiffness`] says how stiff a pair is. [`wall`] keeps nodes on their side of a plane; an
//! `element` is either a pair or a node at a wall.

pub mod angle;
pub mod barrier;
pub mod bodies;
pub mod broad_phase;
pub mod candidates;
pub mod continuous;
pub mod distance;
mod element;
pub mod exclusion;
pub mod friction;
pub mod pair;
pub mod potential;
pub mod push;
pub mod separation;
pub mod spillmann;
pub mod stiffness;
pub mod wall;
