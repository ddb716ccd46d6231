//! The guess Newton's method starts from: extrapolation of past states, of the order that has served best.

/// Past states kept: enough for cubic extrapolation.
const DEPTH: usize = 3;

/// States before the present one, newest first, and the order of the next extrapolation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct History {
    /// Times of the past states, s.
    pub times: Vec<f64>,
    /// Their degrees of freedom.
    pub states: Vec<Vec<f64>>,
    /// How many of them the next guess uses: 0 stands still, 1 extrapolates linearly, 2 by a parabola, 3 by a cubic.
    pub order: usize,
}

impl History {
    /// Fills `out` with the extrapolation of the given order from the present state to time `to`.
    fn extrapolate(&self, order: usize, now: f64, q: &[f64], to: f64, out: &mut [f64]) {
        let time = |k: usize| if k == 0 { now } else { self.times[k - 1] };
        out.fill(0.0);
        for j in 0..=order {
            let weight: f64 = (0..=order).filter(|&k| k != j).map(|k| (to - time(k)) / (time(j) - time(k))).product();
            let state = if j == 0 { q } else { &self.states[j - 1] };
            out.iter_mut().zip(state).for_each(|(value, sample)| *value += weight * sample);
        }
    }

    /// Fills `out` with the guess for time `to`, given the present state.
    pub fn predict(&self, now: f64, q: &[f64], to: f64, out: &mut [f64]) {
        self.extrapolate(self.order.min(self.states.len()), now, q, to, out);
    }

    /// Takes in an accepted state: chooses the order that would have predicted it best, and keeps the state it replaces.
    ///
    /// `force_weight` turns each residual into a force; its inverse turns each degree of freedom into a length.
    pub fn accept(&mut self, now: f64, old: &[f64], to: f64, new: &[f64], force_weight: &[f64], work: &mut [f64]) {
        let mut best = (f64::INFINITY, 0);
        for order in 0..=self.states.len() {
            self.extrapolate(order, now, old, to, work);
            let error = (0..new.len()).map(|k| (work[k] - new[k]).abs() / force_weight[k]).fold(0.0, f64::max);
            if error < best.0 {
                best = (error, order);
            }
        }
        // One more past state is known now: let the order grow with it as long as the highest one wins.
        self.order = if best.1 == self.states.len() { best.1 + 1 } else { best.1 };
        let mut reused = if self.states.len() == DEPTH { self.states.pop() } else { None }.unwrap_or_default();
        self.times.truncate(DEPTH - 1);
        reused.clear();
        reused.extend_from_slice(old);
        self.states.insert(0, reused);
        self.times.insert(0, now);
        self.order = self.order.min(self.states.len());
    }
}
