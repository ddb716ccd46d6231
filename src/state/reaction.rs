//! What a clamp exerts on its filament.

use crate::Vec3;

/// Force, torque and power of a clamp.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reaction {
    /// Force, N.
    pub force: Vec3,
    /// Torque about the clamp's first node, N m.
    pub torque: Vec3,
    /// Power that the clamp spends, W.
    pub power: f64,
}

/// Numbers of one reaction.
pub const WIDTH: usize = 7;

impl Reaction {
    /// It as plain numbers.
    pub fn numbers(&self) -> [f64; WIDTH] {
        let (f, t) = (self.force, self.torque);
        [f.x, f.y, f.z, t.x, t.y, t.z, self.power]
    }

    /// The reaction of plain numbers.
    pub fn from_numbers(n: [f64; WIDTH]) -> Self {
        Self { force: Vec3::new(n[0], n[1], n[2]), torque: Vec3::new(n[3], n[4], n[5]), power: n[6] }
    }
}
