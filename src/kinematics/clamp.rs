//! A clamp: nodes and edge angles that are held, or move as a motion of signals prescribes.
//!
//! From `t0` to `t1` a clamp moves its nodes by the integral of a velocity and by the change of a displacement, turns nodes and frames
//! like a rigid body about an axis, and spins edges about their own tangent:
//!
//! ```text
//!   x(t1) = c + R (x(t0) - c) + int v dt + d(t1) - d(t0),      R = exp([a] (int w dt + phi(t1) - phi(t0)))
//! ```
//!
//! with a center `c` that moves along. The frame of a turned edge is `R` times what it was: its angle follows from the frame that
//! parallel transport in time would give.

use nalgebra::{Rotation3, Unit};

use crate::Vec3;
use crate::rod::configuration::node;
use crate::rod::frames::{signed_angle, transport_through};
use crate::rod::reference::ReferenceFrames;
use crate::signal::{Signal, SignalError};

/// A turn about an axis fixed in space.
#[derive(Debug, Clone)]
pub struct Turning {
    /// Unit vector along the axis.
    pub axis: Vec3,
    /// A point of the axis at time zero, m.
    pub center: Vec3,
    /// Angular velocity about the axis, rad/s.
    pub rate: Signal,
    /// Angle about the axis on top of the turn that the rate gives, rad.
    pub angle: Signal,
}

/// How a clamp moves.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Velocity, m/s.
    pub velocity: [Signal; 3],
    /// Displacement on top of what the velocity gives, m.
    pub displacement: [Signal; 3],
    /// Rigid rotation.
    pub turning: Option<Turning>,
    /// Spin of the edges about their tangents, rad/s.
    pub spin: Signal,
}

impl Motion {
    /// A clamp that holds still.
    pub fn still() -> Self {
        let zero = || [Signal::Constant(0.0), Signal::Constant(0.0), Signal::Constant(0.0)];
        Self { velocity: zero(), displacement: zero(), turning: None, spin: Signal::Constant(0.0) }
    }

    /// The signals that move nodes.
    pub fn shifts(&self) -> impl Iterator<Item = &Signal> {
        let turning = self.turning.iter().flat_map(|turning| [&turning.rate, &turning.angle]);
        self.velocity.iter().chain(&self.displacement).chain(turning)
    }

    /// Displacement from one time to another, later or earlier.
    fn shift(&self, t0: f64, t1: f64) -> Result<Vec3, SignalError> {
        let mut shift = Vec3::zeros();
        for c in 0..3 {
            shift[c] = integral(&self.velocity[c], t0, t1)?;
            // A constant displacement moves nothing, and the difference of a constant is exactly zero.
            shift[c] += self.displacement[c].value(t1)? - self.displacement[c].value(t0)?;
        }
        Ok(shift)
    }

    /// A point of the axis at a time; none if the clamp does not turn.
    ///
    /// # Errors
    /// What a user's function fails with.
    pub fn center(&self, time: f64) -> Result<Option<Vec3>, SignalError> {
        let Some(turning) = &self.turning else { return Ok(None) };
        Ok(Some(turning.center + self.shift(0.0, time)?))
    }

    /// Rotation from `t0` to `t1`, and the center at `t0`; none if the clamp does not turn.
    fn turn(&self, t0: f64, t1: f64) -> Result<Option<(Rotation3<f64>, Vec3)>, SignalError> {
        let Some(turning) = &self.turning else { return Ok(None) };
        let angle = integral(&turning.rate, t0, t1)? + turning.angle.value(t1)? - turning.angle.value(t0)?;
        let rotation = Rotation3::from_axis_angle(&Unit::new_normalize(turning.axis), angle);
        Ok(Some((rotation, turning.center + self.shift(0.0, t0)?)))
    }
}

fn integral(signal: &Signal, t0: f64, t1: f64) -> Result<f64, SignalError> {
    if t0 <= t1 { signal.integral(t0, t1) } else { Ok(-signal.integral(t1, t0)?) }
}

/// An edge of a clamp: its angle, and its index where it turns with the clamp's nodes.
#[derive(Debug, Clone, Copy)]
pub struct ClampedEdge {
    /// Degree of freedom of its angle.
    pub dof: usize,
    /// Its index among all edges.
    pub edge: usize,
    /// Whether the clamp moves both its nodes in all directions.
    pub rigid: bool,
}

/// A clamp, by degrees of freedom.
#[derive(Debug, Clone)]
pub struct Clamp {
    /// First degree of freedom of every node.
    pub nodes: Vec<usize>,
    /// Which coordinates of the nodes are prescribed; the others are free.
    pub axes: [bool; 3],
    /// The edges.
    pub edges: Vec<ClampedEdge>,
}

impl Clamp {
    /// The signals of a motion that move it.
    pub fn signals<'a>(&self, motion: &'a Motion) -> impl Iterator<Item = &'a Signal> {
        motion.shifts().chain((!self.edges.is_empty()).then_some(&motion.spin))
    }

    /// Sets the clamped degrees of freedom as a motion does by `t1`, later or earlier, from those at `t0` and the frames there; `spin` is the
    /// integral of that signal.
    ///
    /// # Errors
    /// What a user's function fails with.
    pub fn advance(
        &self,
        motion: &Motion,
        (t0, q): (f64, &[f64]),
        frames: &ReferenceFrames,
        (t1, spin): (f64, f64),
        target: &mut [f64],
    ) -> Result<(), SignalError> {
        let shift = motion.shift(t0, t1)?;
        let turn = motion.turn(t0, t1)?;
        for &dof in &self.nodes {
            let from = node(q, dof);
            let to = turn.map_or(from, |(rotation, center)| center + rotation * (from - center)) + shift;
            (0..3).filter(|&c| self.axes[c]).for_each(|c| target[dof + c] = to[c]);
        }
        for clamped in &self.edges {
            let turned = turn.filter(|_| clamped.rigid).map_or(0.0, |(rotation, _)| {
                let (t, director) = (frames.tangents[clamped.edge], frames.directors[clamped.edge]);
                let tangent = rotation * t;
                signed_angle(&transport_through(&director, &t, &tangent), &(rotation * director), &tangent)
            });
            target[clamped.dof] = q[clamped.dof] + spin + turned;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn constant(values: [f64; 3]) -> [Signal; 3] {
        values.map(Signal::Constant)
    }

    fn frames(t: Vec3, director: Vec3) -> ReferenceFrames {
        ReferenceFrames { tangents: vec![t], directors: vec![director], twists: vec![] }
    }

    fn clamp() -> Clamp {
        // One edge: nodes at 0 and 4, its angle at 3.
        let edges = vec![ClampedEdge { dof: 3, edge: 0, rigid: true }];
        Clamp { nodes: vec![0, 4], axes: [true; 3], edges }
    }

    const START: [f64; 7] = [1.0, 0.0, 0.0, 0.2, 2.0, 0.0, 0.0];

    fn moved(clamp: &Clamp, motion: &Motion, t0: f64, t1: f64) -> [f64; 7] {
        let mut target = START;
        clamp.advance(motion, (t0, &START), &frames(Vec3::x(), Vec3::y()), (t1, 0.0), &mut target).unwrap();
        target
    }

    #[test]
    fn velocity_moves_by_its_integral_and_displacement_by_its_change() {
        let table = |values: [f64; 2]| Signal::Table { times: vec![0.0, 2.0], values: values.to_vec() };
        let motion = Motion {
            velocity: constant([0.5, 0.0, 0.0]),
            displacement: [Signal::Constant(7.0), table([0.0, 4.0]), Signal::Constant(0.0)],
            ..Motion::still()
        };
        let found = moved(&clamp(), &motion, 0.5, 1.5);
        assert_eq!(found, [1.5, 2.0, 0.0, 0.2, 2.5, 2.0, 0.0]);
    }

    #[test]
    fn a_turn_about_the_edge_is_a_spin_of_its_frame() {
        let turning = Turning {
            axis: Vec3::x(),
            center: Vec3::zeros(),
            rate: Signal::Constant(0.3),
            angle: Signal::Constant(0.0),
        };
        let found = moved(&clamp(), &Motion { turning: Some(turning), ..Motion::still() }, 0.0, 2.0);
        let expected = [1.0, 0.0, 0.0, 0.8, 2.0, 0.0, 0.0];
        found.iter().zip(expected).for_each(|(a, b)| assert!((a - b).abs() < 1e-15, "{found:?}"));
    }

    #[test]
    fn a_turn_across_the_edge_carries_its_frame_without_spin() {
        let turning = Turning {
            axis: Vec3::z(),
            center: Vec3::zeros(),
            rate: Signal::Constant(0.0),
            angle: Signal::Table { times: vec![0.0, 1.0], values: vec![0.0, std::f64::consts::FRAC_PI_2] },
        };
        let found = moved(&clamp(), &Motion { turning: Some(turning), ..Motion::still() }, 0.0, 1.0);
        let expected = [0.0, 1.0, 0.0, 0.2, 0.0, 2.0, 0.0];
        found.iter().zip(expected).for_each(|(a, b)| assert!((a - b).abs() < 1e-15, "{found:?}"));
    }

    #[test]
    fn free_coordinates_keep_what_they_are() {
        let motion = Motion { velocity: constant([1.0, 1.0, 1.0]), ..Motion::still() };
        let slider = Clamp { axes: [false, true, true], ..clamp() };
        assert_eq!(moved(&slider, &motion, 0.0, 1.0), [1.0, 1.0, 1.0, 0.2, 2.0, 1.0, 1.0]);
    }
}
