//! What a product refuses, and why.

use crate::Vec3;

/// Smallest relative error that can be asked for.
pub const SMALLEST_TOLERANCE: f64 = 1e-9;
/// Largest relative error that can be asked for.
pub const LARGEST_TOLERANCE: f64 = 1e-1;

/// Why there is no product.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FarFieldError {
    /// The tolerance is out of range.
    #[error("tolerance is {0:e}; it must lie between {SMALLEST_TOLERANCE:e} and {LARGEST_TOLERANCE:e}")]
    Tolerance(f64),
    /// A node or target is not finite.
    #[error("{field} {index} is {value:?}; its coordinates must be finite")]
    Position {
        /// "node" or "target".
        field: &'static str,
        /// Its number.
        index: usize,
        /// Its position, m.
        value: [f64; 3],
    },
    /// An edge has no length, joins a node to itself, or names a node that does not exist.
    #[error("edge {edge} joins nodes {ends:?}; they must be two of the {nodes} nodes, at different positions")]
    Edge {
        /// Its number.
        edge: usize,
        /// The nodes it names.
        ends: [usize; 2],
        /// How many nodes there are.
        nodes: usize,
    },
    /// A regularization length is not positive, or too small beside the scene.
    #[error("epsilon {edge} is {value:e} m; it must be finite and above {smallest:e} m in a scene of this size")]
    Epsilon {
        /// The number of its edge.
        edge: usize,
        /// Its value, m.
        value: f64,
        /// The smallest value allowed, m.
        smallest: f64,
    },
    /// An argument has the wrong length.
    #[error("{field} has {actual} entries; it must have {expected}")]
    Length {
        /// The argument.
        field: &'static str,
        /// How many entries it has.
        actual: usize,
        /// How many it must have.
        expected: usize,
    },
}

pub(super) fn check_length(field: &'static str, actual: usize, expected: usize) -> Result<(), FarFieldError> {
    if actual == expected { Ok(()) } else { Err(FarFieldError::Length { field, actual, expected }) }
}

pub(super) fn check_positions(field: &'static str, positions: &[Vec3]) -> Result<(), FarFieldError> {
    match positions.iter().position(|position| !position.iter().all(|c| c.is_finite())) {
        None => Ok(()),
        Some(index) => Err(FarFieldError::Position { field, index, value: positions[index].into() }),
    }
}
