//! The account a simulation keeps of itself: energy in, out and stored, the balance of outer forces, and how near its limits it came.
//!
//! Energies of a step are its powers at the end times its length; at orders above the first, the mean of both ends counts.

/// What gives energy: motors, clamps, loads (with fields and background flows), gravity; then what takes it: fluid, twist drag, head, contact, other terms.
pub const CHANNELS: usize = 9;
/// How many of them give.
pub const SOURCES: usize = 4;
pub(crate) const MOTORS: usize = 0;
pub(crate) const CLAMPS: usize = 1;
pub(crate) const LOADS: usize = 2;
pub(crate) const GRAVITY: usize = 3;
pub(crate) const FLUID: usize = 4;
pub(crate) const TWIST: usize = 5;
pub(crate) const HEAD: usize = 6;
pub(crate) const CONTACT: usize = 7;
pub(crate) const OTHER: usize = 8;

/// The largest a quantity has been, where, and when.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Extreme {
    /// Its value.
    pub value: f64,
    /// Hinge, edge or node.
    pub place: usize,
    /// Time, s.
    pub time: f64,
}

impl Extreme {
    pub(crate) fn meet(&mut self, (value, place): (f64, usize), time: f64) {
        if value > self.value {
            *self = Self { value, place, time };
        }
    }
}

/// Energies, balances and extremes up to a state; part of it, so that a run that goes on goes on with its account.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Account {
    /// Time up to which it goes, s.
    pub time: f64,
    /// Energy through each channel since the start, J.
    pub energy: [f64; CHANNELS],
    /// Power of each channel in the last step, W.
    pub power: [f64; CHANNELS],
    /// Elastic, contact and kinetic energy, J.
    pub stored: [f64; 3],
    /// Their sum at the start, J; `None` before the first step.
    pub start: Option<f64>,
    /// Largest elastic, contact and kinetic energy together so far, J.
    pub most_stored: f64,
    /// Largest outer force and torque left over on a free part, relative to the sums of their sizes.
    pub imbalance: [f64; 2],
    /// Largest sums of the sizes of outer forces (N) and of their torques (N m).
    pub outer: [f64; 2],
    /// Bending of a hinge away from its natural shape (rad), strain of an edge, regularization over length of an immersed
    /// edge, Reynolds number of a node.
    pub extremes: [Extreme; 4],
}

/// Length of an account as plain numbers.
pub const WIDTH: usize = 2 * CHANNELS + 24;

impl Account {
    /// All of it as plain numbers, to be saved and read back by [`Self::from_numbers`].
    pub fn numbers(&self) -> [f64; WIDTH] {
        let mut out = [0.0; WIDTH];
        let head = [self.time].into_iter().chain(self.energy).chain(self.power).chain(self.stored);
        let start = [self.start.unwrap_or(0.0), f64::from(u8::from(self.start.is_some())), self.most_stored];
        let extremes = self.extremes.iter().flat_map(|e| [e.value, e.place as f64, e.time]);
        let all = head.chain(start).chain(self.imbalance).chain(self.outer).chain(extremes);
        out.iter_mut().zip(all).for_each(|(out, value)| *out = value);
        out[WIDTH - 1] = WIDTH as f64;
        out
    }

    /// The account of numbers; `None` if they are none.
    pub fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let numbers: &[f64; WIDTH] = numbers.try_into().ok()?;
        if numbers[WIDTH - 1] != WIDTH as f64 || numbers.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let mut next = numbers.iter().copied();
        let mut take = || next.next().unwrap_or(0.0);
        Some(Self {
            time: take(),
            energy: std::array::from_fn(|_| take()),
            power: std::array::from_fn(|_| take()),
            stored: std::array::from_fn(|_| take()),
            start: {
                let start = take();
                (take() != 0.0).then_some(start)
            },
            most_stored: take(),
            imbalance: [take(), take()],
            outer: [take(), take()],
            extremes: std::array::from_fn(|_| Extreme { value: take(), place: take() as usize, time: take() }),
        })
    }

    /// Whether all of it are numbers.
    pub(crate) fn is_finite(&self) -> bool {
        self.numbers().iter().all(|number| number.is_finite())
    }

    /// Begins at a state with these energies.
    pub(crate) fn begin(&mut self, time: f64, stored: [f64; 3]) {
        let start: f64 = stored.iter().sum();
        *self = Self { time, stored, start: Some(start), most_stored: start.abs(), ..*self };
    }

    /// Takes in the powers at the end of a step of the given length and order.
    pub(crate) fn add(&mut self, dt: f64, order: usize, power: [f64; CHANNELS]) {
        for ((energy, old), new) in self.energy.iter_mut().zip(&self.power).zip(&power) {
            *energy += dt * if order == 1 { *new } else { 0.5 * (old + new) };
        }
        self.power = power;
        self.time += dt;
    }
}
