//! Past states: extrapolated to the guess Newton's method starts from, differenced to rates, interpolated for output.

/// Past states kept besides the present one: extrapolation of third order and the error estimate of the order above.
pub(crate) const DEPTH: usize = 4;

/// Highest order of the guess for Newton's method.
pub(crate) const GUESS_ORDER: usize = 3;

/// What is remembered of an accepted state.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sample {
    /// Time, s.
    pub time: f64,
    /// Degrees of freedom.
    pub q: Vec<f64>,
    /// Their rates.
    pub velocity: Vec<f64>,
    /// Force density on the fluid at the immersed nodes, N/m; empty without nonlocal fluid.
    pub density: Vec<f64>,
}

/// States before the present one, newest first, and the order of the next guess.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct History {
    /// Past states.
    pub past: Vec<Sample>,
    /// How many of them the next guess uses: 0 stands still, 1 extrapolates linearly, 2 by a parabola, 3 by a cubic.
    pub order: usize,
}

/// Weights of Lagrange interpolation at `to` through the times.
fn interpolation_weights(times: &[f64], to: f64) -> impl Iterator<Item = f64> + '_ {
    (0..times.len())
        .map(move |j| (0..times.len()).filter(|&k| k != j).map(|k| (to - times[k]) / (times[j] - times[k])).product())
}

/// Weights of the derivative at `times[0]` of the polynomial through the times.
pub fn derivative_weights(times: &[f64]) -> Vec<f64> {
    let mut weights: Vec<f64> = (1..times.len())
        .map(|j| {
            let others = (1..times.len()).filter(|&k| k != j);
            let product: f64 = others.map(|k| (times[0] - times[k]) / (times[j] - times[k])).product();
            product / (times[j] - times[0])
        })
        .collect();
    let own = -weights.iter().sum::<f64>();
    weights.insert(0, own);
    weights
}

impl History {
    /// Times of the present state and of as many past ones as there are, newest first.
    pub fn times(&self, now: f64, count: usize) -> Vec<f64> {
        std::iter::once(now).chain(self.past.iter().map(|sample| sample.time)).take(count).collect()
    }

    /// Extrapolates (or interpolates) the given order from the present vector, of which `part` picks the past values.
    pub fn extrapolate(
        &self,
        order: usize,
        (now, present): (f64, &[f64]),
        part: impl Fn(&Sample) -> &[f64],
        to: f64,
        out: &mut [f64],
    ) {
        let times = self.times(now, order + 1);
        out.fill(0.0);
        for (j, weight) in interpolation_weights(&times, to).enumerate() {
            let values = if j == 0 { present } else { part(&self.past[j - 1]) };
            out.iter_mut().zip(values).for_each(|(value, sample)| *value += weight * sample);
        }
    }

    /// The order of the next guess, as far as there are states for it.
    pub fn guess_order(&self) -> usize {
        self.order.min(self.past.len())
    }

    /// Errors `max weight |q - extrapolation|` with which each order would have predicted an accepted state: relative to the size
    /// of the filament, with the weights of the model.
    pub fn prediction_errors(
        &self,
        (now, old): (f64, &[f64]),
        (to, new): (f64, &[f64]),
        weights: &[f64],
        work: &mut [f64],
    ) -> Vec<f64> {
        (0..=self.past.len())
            .map(|order| {
                self.extrapolate(order, (now, old), |sample| &sample.q, to, work);
                (0..new.len()).map(|k| (work[k] - new[k]).abs() * weights[k]).fold(0.0, f64::max)
            })
            .collect()
    }

    /// Keeps the state that an accepted one replaces; `errors` are those of [`Self::prediction_errors`].
    pub fn accept(&mut self, replaced: Sample, errors: &[f64]) {
        let mut best = 0;
        for (order, error) in errors.iter().enumerate() {
            if *error < errors[best] {
                best = order;
            }
        }
        // One more past state is known now: the order grows with it as long as the highest one wins.
        let grown = if best + 1 == errors.len() { best + 1 } else { best };
        self.past.truncate(DEPTH - 1);
        self.past.insert(0, replaced);
        self.order = grown.min(self.past.len()).min(GUESS_ORDER);
    }
}
