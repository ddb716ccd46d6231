//! Constants, tables and functions of time that drive motors, clamps, loads, fields and flows; knows nothing of rods.
//!
//! * [`quadrature`]: integrals of functions of time.

pub mod quadrature;

use std::cmp::Ordering;
use std::sync::Arc;

use quadrature::Course;

/// What a user's function may fail with.
pub type SignalError = Box<dyn std::error::Error + Send + Sync>;

/// A user's function of time.
pub type TimeFunction = Arc<dyn Fn(f64) -> Result<f64, SignalError> + Send + Sync>;

/// A user's function of time, and what is known of it.
#[derive(Clone)]
pub struct Function {
    /// The function.
    pub value: TimeFunction,
    /// Instants, s, in increasing order, at which it may jump or have a corner; it is taken to be smooth between them.
    pub breaks: Vec<f64>,
    /// Length, s, below which nothing of it needs to be found by itself.
    pub resolution: f64,
}

/// A scalar function of time.
#[derive(Clone)]
pub enum Signal {
    /// The same value always.
    Constant(f64),
    /// Linear between samples, constant before the first and after the last.
    Table {
        /// Strictly increasing times, s.
        times: Vec<f64>,
        /// Values at these times.
        values: Vec<f64>,
    },
    /// A function supplied by the user.
    Function(Function),
}

impl std::fmt::Debug for Signal {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Constant(value) => write!(out, "Constant({value})"),
            Self::Table { times, .. } => write!(out, "Table({} samples)", times.len()),
            Self::Function(_) => write!(out, "Function"),
        }
    }
}

/// Largest ratio of a corner of a sampled smooth function to its neighbours.
const ALIKE: f64 = 3.0;
/// Part of a span by which values are taken inside its ends, so that a jump at an end belongs to the right side of it.
const INSIDE: f64 = 1e-7;

impl Signal {
    /// Value at time `t`.
    ///
    /// # Errors
    /// What the user's function fails with, or that its value is not finite.
    pub fn value(&self, t: f64) -> Result<f64, SignalError> {
        let value = match self {
            Self::Constant(value) => *value,
            Self::Table { times, values } => {
                let after = times.partition_point(|&sample| sample <= t);
                if after == 0 {
                    values[0]
                } else if after == times.len() {
                    values[after - 1]
                } else {
                    let (t0, t1) = (times[after - 1], times[after]);
                    let weight = (t - t0) / (t1 - t0);
                    values[after - 1] * (1.0 - weight) + values[after] * weight
                }
            }
            Self::Function(function) => (function.value)(t)?,
        };
        if value.is_finite() {
            Ok(value)
        } else {
            Err(format!("the function of time gave {value} at t = {t} s").into())
        }
    }

    /// Values at the beginning and at the end of a span, both seen from within it.
    ///
    /// # Errors
    /// As [`Self::value`].
    pub fn ends(&self, t0: f64, t1: f64) -> Result<[f64; 2], SignalError> {
        match self {
            Self::Function(_) => {
                let inside = INSIDE * (t1 - t0);
                Ok([self.value(t0 + inside)?, self.value(t1 - inside)?])
            }
            _ => Ok([self.value(t0)?, self.value(t1)?]),
        }
    }

    /// What the signal does from `t0` to a later `t1`: exact for constants and tables, by adaptive quadrature for functions.
    ///
    /// # Errors
    /// As [`Self::value`].
    pub fn course(&self, t0: f64, t1: f64) -> Result<Course, SignalError> {
        match self {
            Self::Constant(value) => Ok(Course { integral: value * (t1 - t0), ..Course::default() }),
            Self::Table { times, .. } => {
                let first = times.partition_point(|&sample| sample <= t0);
                let last = times.partition_point(|&sample| sample < t1).max(first);
                let mut reached = Vec::with_capacity(last - first + 1);
                let (mut from, mut total) = (t0, 0.0);
                for &to in times[first..last].iter().chain(std::iter::once(&t1)) {
                    total += self.value(0.5 * (from + to))? * (to - from);
                    reached.push((to, total));
                    from = to;
                }
                let departure = match reached.len() {
                    1 => 0.0,
                    _ => quadrature::departure(&reached, (t0, t1 - t0), self.ends(t0, t1)?, total),
                };
                Ok(Course { integral: total, departure, ..Course::default() })
            }
            Self::Function(function) => {
                let ends = self.ends(t0, t1)?;
                quadrature::course(&mut |t| self.value(t), (t0, t1), ends, function.resolution)
            }
        }
    }

    /// Integral from `t0` to `t1`, as in [`Self::course`].
    ///
    /// # Errors
    /// As [`Self::value`].
    pub fn integral(&self, t0: f64, t1: f64) -> Result<f64, SignalError> {
        match t0.total_cmp(&t1) {
            Ordering::Equal => Ok(0.0),
            Ordering::Less => Ok(self.course(t0, t1)?.integral),
            Ordering::Greater => Ok(-self.course(t1, t0)?.integral),
        }
    }

    /// Instants, s, at which the signal is not smooth, and by how much its slope jumps there: infinite where only the user
    /// knows. A corner between two that bend the same way, about as strongly, is none: there a table samples a smooth function.
    pub fn corners(&self) -> Vec<(f64, f64)> {
        match self {
            Self::Constant(_) => Vec::new(),
            Self::Table { times, values } => {
                let between = times.windows(2).zip(values.windows(2)).map(|(t, v)| (v[1] - v[0]) / (t[1] - t[0]));
                let slopes: Vec<f64> = std::iter::once(0.0).chain(between).chain(std::iter::once(0.0)).collect();
                let jumps: Vec<f64> = slopes.windows(2).map(|pair| pair[1] - pair[0]).collect();
                let alike = |a: f64, b: f64| a * b > 0.0 && a.abs() < ALIKE * b.abs();
                let sampled = |k: usize| {
                    (1..jumps.len() - 1).contains(&k) && alike(jumps[k], jumps[k - 1]) && alike(jumps[k], jumps[k + 1])
                };
                let corners = (0..jumps.len()).filter(|&k| jumps[k] != 0.0 && !sampled(k));
                corners.map(|k| (times[k], jumps[k].abs())).collect()
            }
            Self::Function(function) => function.breaks.iter().map(|&time| (time, f64::INFINITY)).collect(),
        }
    }

    /// Largest magnitude of a table's values; zero where it is not known.
    pub fn magnitude(&self) -> f64 {
        match self {
            Self::Constant(value) => value.abs(),
            Self::Table { values, .. } => values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs())),
            Self::Function(_) => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Signal {
        Signal::Table { times: vec![1.0, 2.0, 4.0], values: vec![0.0, 3.0, 1.0] }
    }

    #[test]
    fn the_integral_of_a_table_is_exact_across_its_samples() -> Result<(), SignalError> {
        // 0 before 1; 1.5 to 2; 4 to 4; 1 a second after.
        for (t0, t1, expected) in [(0.0, 1.0, 0.0), (0.0, 6.0, 7.5), (1.5, 3.0, 1.125 + 2.5), (5.0, 7.0, 2.0)] {
            assert!((table().integral(t0, t1)? - expected).abs() < 1e-14, "{t0} to {t1}");
            assert!((table().integral(t1, t0)? + expected).abs() < 1e-14, "{t1} to {t0}");
        }
        Ok(())
    }

    #[test]
    fn a_table_has_corners_where_its_slope_jumps_its_ends_included() {
        assert_eq!(table().corners(), vec![(1.0, 3.0), (2.0, 4.0), (4.0, 1.0)]);
        let straight = Signal::Table { times: vec![0.0, 1.0, 2.0], values: vec![5.0; 3] };
        assert_eq!(straight.corners(), Vec::new());
    }
}
