//! Signals that loads follow: each is a channel, evaluated once at the end of a step and the same for every iterate.

use crate::signal::{Signal, SignalError};

/// Index of one signal among a scene's inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Channel(usize);

/// Three channels: the components of a vector.
pub type VectorChannels = [Channel; 3];

/// All signals of a scene's loads.
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    signals: Vec<Signal>,
}

impl Inputs {
    /// Takes a signal in; its channel.
    pub fn add(&mut self, signal: Signal) -> Channel {
        self.signals.push(signal);
        Channel(self.signals.len() - 1)
    }

    /// Takes three signals in.
    pub fn add_vector(&mut self, signals: [Signal; 3]) -> VectorChannels {
        signals.map(|signal| self.add(signal))
    }

    /// The signals, by channel.
    pub fn signals(&self) -> impl Iterator<Item = &Signal> {
        self.signals.iter()
    }

    /// A vanishing value for every channel.
    pub fn zero(&self) -> Vec<f64> {
        vec![0.0; self.signals.len()]
    }

    /// The value of every channel at a time.
    ///
    /// # Errors
    /// What a user's function fails with.
    pub fn values(&self, time: f64) -> Result<Vec<f64>, SignalError> {
        self.signals.iter().map(|signal| signal.value(time)).collect()
    }
}

impl Channel {
    /// This channel's value.
    pub fn of(self, values: &[f64]) -> f64 {
        values[self.0]
    }
}

/// The vector of three channels.
pub fn vector(channels: VectorChannels, values: &[f64]) -> crate::Vec3 {
    crate::Vec3::from_fn(|c, _| channels[c].of(values))
}
