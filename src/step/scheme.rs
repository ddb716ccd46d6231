//! The time-stepping schemes of physics section 3, all first order.

/// How a step treats inertia and the fluid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// Inertia and elasticity implicit, fluid forces from the velocities of the last step (the seed's scheme).
    Explicit,
    /// Inertia, elasticity and fluid implicit.
    Implicit,
    /// No inertia; elasticity and fluid implicit.
    Overdamped,
}

impl Scheme {
    /// The scheme of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "explicit" => Some(Self::Explicit),
            "implicit" => Some(Self::Implicit),
            "overdamped" => Some(Self::Overdamped),
            _ => None,
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Explicit => "explicit",
            Self::Implicit => "implicit",
            Self::Overdamped => "overdamped",
        }
    }

    /// Whether mass counts.
    pub fn has_inertia(self) -> bool {
        self != Self::Overdamped
    }

    /// Highest order of the backward differences: that of third order is not stable for oscillations without damping, which
    /// inertia allows.
    pub fn highest_order(self) -> usize {
        if self.has_inertia() { 2 } else { crate::bdf::control::HIGHEST_ORDER }
    }

    /// Whether the fluid resists the new velocities.
    pub fn fluid_is_implicit(self) -> bool {
        self != Self::Explicit
    }
}
