//! Instants at which what drives a scene has a corner or a jump: adaptive steps end there, and begin anew.

use crate::signal::Signal;

/// Most corners within a step that are stepped to one by one; where there are more, a table samples a smooth function
/// finely, and its corners are not meant.
const MOST_CORNERS: usize = 4;
/// Corners this much weaker than the strongest one in reach are not counted among them.
const WEAK: f64 = 0.1;
/// Distance, in units of the last place of the time, within which two instants are the same.
const SAME: f64 = 8.0 * f64::EPSILON;

/// One such instant.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Break {
    time: f64,
    kind: Kind,
}

/// What happens there.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// The slope of an angular velocity jumps by so much, rad/s^3.
    Speed(f64),
    /// The slope of a torque, or of any other signal, jumps by so much, relative to its largest value, 1/s.
    Torque(f64),
    /// The user says that something does.
    Given,
}

impl Break {
    /// What a step across it would miss over a span, over what it may miss, rad.
    fn weight(&self, span: f64, tolerance: f64) -> f64 {
        match self.kind {
            Kind::Speed(jump) => 0.5 * jump * span * span / tolerance,
            Kind::Torque(jump) => jump * span / tolerance,
            Kind::Given => f64::INFINITY,
        }
    }
}

/// All of a scene's, in increasing order.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Breaks(Vec<Break>);

impl Breaks {
    /// Those of angular velocities that are prescribed, and of other signals: torques, loads, and clamps that move.
    pub fn new<'a>(speeds: impl Iterator<Item = &'a Signal>, others: impl Iterator<Item = &'a Signal>) -> Self {
        let speed = |(time, jump): (f64, f64)| {
            let kind = if jump.is_finite() { Kind::Speed(jump) } else { Kind::Given };
            Break { time, kind }
        };
        let relative = |signal: &Signal| {
            let largest = signal.magnitude();
            let corners = signal.corners().into_iter().map(move |(time, jump)| {
                let kind = if jump.is_finite() { Kind::Torque(jump / largest) } else { Kind::Given };
                Break { time, kind }
            });
            corners.collect::<Vec<_>>()
        };
        let mut all: Vec<Break> = speeds.flat_map(|signal| signal.corners().into_iter().map(speed)).collect();
        all.extend(others.flat_map(relative));
        all.sort_by(|a, b| a.time.total_cmp(&b.time));
        Self(all)
    }

    /// The first instant after `now`, within `span`, at which a step must end for its error in angles to stay below
    /// `tolerance`, rad.
    pub fn next(&self, now: f64, span: f64, tolerance: f64) -> Option<f64> {
        let apart = SAME * now.abs();
        let first = self.0.partition_point(|at| at.time <= now + apart);
        let end = self.0.partition_point(|at| at.time <= now + span);
        let window = self.0.get(first..end)?;
        let weight = |at: &Break| at.weight(span, tolerance);
        let strongest = window.iter().map(weight).filter(|weight| weight.is_finite()).fold(0.0, f64::max);
        let strong = |at: &&Break| weight(at) > (WEAK * strongest).max(1.0);
        let mut times: Vec<f64> = window.iter().filter(strong).map(|at| at.time).collect();
        times.dedup();
        if times.len() > MOST_CORNERS {
            return window.iter().find(|at| at.kind == Kind::Given).map(|at| at.time);
        }
        times.first().copied()
    }

    /// Whether a step of the given span that began before `now` and ended after it would have missed a break there.
    pub fn at(&self, now: f64, span: f64, tolerance: f64) -> bool {
        let apart = SAME * now.abs();
        let first = self.0.partition_point(|at| at.time < now - apart);
        let here = self.0[first..].iter().take_while(|at| at.time <= now + apart);
        here.into_iter().any(|at| at.weight(span, tolerance) > 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(times: Vec<f64>, values: Vec<f64>) -> Breaks {
        Breaks::new(std::iter::once(&Signal::Table { times, values }), std::iter::empty())
    }

    #[test]
    fn a_step_ends_at_each_corner_of_a_pulse_and_begins_there() {
        let pulse = of(vec![1.0, 1.001, 1.01, 1.011], vec![0.0, 20.0, 20.0, 0.0]);
        let mut now = 0.5;
        for corner in [1.0, 1.001, 1.01, 1.011] {
            assert_eq!(pulse.next(now, 10.0, 1e-4), Some(corner));
            assert!(pulse.at(corner, 1.0, 1e-4) && !pulse.at(corner + 1e-9, 1.0, 1e-4));
            now = corner;
        }
        assert_eq!(pulse.next(now, 10.0, 1e-4), None);
        assert_eq!(pulse.next(0.0, 0.9, 1e-4), None);
    }

    #[test]
    fn a_corner_that_moves_nothing_within_a_step_is_passed_over() {
        // The slope jumps by 1 rad/s^2: 0.5e-4 rad over a hundredth of a second.
        let bent = of(vec![0.0, 1.0, 2.0], vec![0.0, 1.0, 3.0]);
        assert_eq!(bent.next(0.995, 0.01, 1e-4), None);
        assert_eq!(bent.next(0.995, 0.01, 1e-5), Some(1.0));
    }

    #[test]
    fn a_finely_sampled_function_is_smooth_but_for_its_jump() {
        let mut times: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
        let mut values: Vec<f64> = times.iter().map(|t| (3.0 * t).sin()).collect();
        // The ends are corners of their own.
        assert_eq!(of(times.clone(), values.clone()).next(0.5, 0.3, 1e-9), None);
        times.extend([1.991, 3.0]);
        values.extend([7.0, 7.0]);
        assert_eq!(of(times, values).next(1.8, 0.3, 1e-9), Some(1.99));
    }

    #[test]
    fn what_the_user_says_is_a_break_at_any_tolerance() {
        let function = crate::signal::Function { value: std::sync::Arc::new(Ok), breaks: vec![1.0], resolution: 1.0 };
        let breaks = Breaks::new(std::iter::once(&Signal::Function(function)), std::iter::empty());
        assert_eq!(breaks.next(0.0, 2.0, 1e9), Some(1.0));
        assert!(breaks.at(1.0, 1e-9, 1e9));
    }
}
