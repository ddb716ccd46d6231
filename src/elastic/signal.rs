//! Constants, tables and functions of time that drive motors and clamps.

use std::sync::Arc;

/// What a user's function may fail with.
pub type SignalError = Box<dyn std::error::Error + Send + Sync>;

/// A user's function of time.
pub type TimeFunction = Arc<dyn Fn(f64) -> Result<f64, SignalError> + Send + Sync>;

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
    Function(TimeFunction),
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

/// Nodes and weights of three-point Gauss-Legendre quadrature on [0, 1], exact to fifth order.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

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
            Self::Function(function) => function(t)?,
        };
        if value.is_finite() {
            Ok(value)
        } else {
            Err(format!("the function of time gave {value} at t = {t} s").into())
        }
    }

    /// Integral from `t0` to `t1`: exact for constants and tables, three-point Gauss quadrature for functions.
    ///
    /// # Errors
    /// As [`Self::value`].
    pub fn integral(&self, t0: f64, t1: f64) -> Result<f64, SignalError> {
        match self {
            Self::Constant(value) => Ok(value * (t1 - t0)),
            Self::Table { times, .. } => {
                let inner = times.iter().copied().filter(|&sample| sample > t0 && sample < t1);
                let stops: Vec<f64> = std::iter::once(t0).chain(inner).chain(std::iter::once(t1)).collect();
                let mut total = 0.0;
                for pair in stops.windows(2) {
                    total += self.value(0.5 * (pair[0] + pair[1]))? * (pair[1] - pair[0]);
                }
                Ok(total)
            }
            Self::Function(_) => {
                let span = t1 - t0;
                let mut total = 0.0;
                for (point, weight) in GAUSS {
                    total += weight * self.value(t0 + point * span)?;
                }
                Ok(total * span)
            }
        }
    }
}
