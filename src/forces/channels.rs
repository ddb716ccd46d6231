//! Signals that loads follow: each is a channel, evaluated once at the end of a step and the same for every iterate.

use crate::Vec3;

/// Index of one signal among those of a scene's loads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Channel(usize);

/// Three channels: the components of a vector.
pub type VectorChannels = [Channel; 3];

/// Numbers channels in the order in which loads ask for them.
#[derive(Debug, Clone, Default)]
pub struct Channels {
    count: usize,
}

impl Channels {
    /// A new channel.
    pub fn take(&mut self) -> Channel {
        self.count += 1;
        Channel(self.count - 1)
    }

    /// Three new channels.
    pub fn take_vector(&mut self) -> VectorChannels {
        [(); 3].map(|()| self.take())
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }
}

impl Channel {
    /// This channel's value.
    pub fn of(self, values: &[f64]) -> f64 {
        values[self.0]
    }
}

/// The vector of three channels.
pub fn vector(channels: VectorChannels, values: &[f64]) -> Vec3 {
    Vec3::from_fn(|c, _| channels[c].of(values))
}
