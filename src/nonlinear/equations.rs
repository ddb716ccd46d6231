//! What Newton's method needs to know of a system of equations `F(x) = 0`.
//!
//! A system is a stateful evaluator: [`Equations::evaluate`] moves it to a point, and what follows (the linearization, directions,
//! corrections) is meant at the point of the last evaluation. What unknowns are is the system's own business: they may be vectors or
//! elements of a manifold, which [`Equations::advance`] moves along a direction.

use crate::linear::LinearError;

/// Where Newton's method stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// Largest residual, relative to a scale of the system's own.
    Residual(f64),
    /// Largest correction of the unknowns, relative to a scale of the system's own, that may be left. Residuals of stiff directions may
    /// then be large, as long as the unknowns are where they should be.
    Correction(f64),
}

/// Size of a residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// Largest entry, in the system's unit.
    pub norm: f64,
    /// Largest entry over its own target: solved at 1.
    pub excess: f64,
    /// Root of the sum of squares, each weighted as [`Equations::weigh`] last did, for the line search.
    pub merit: f64,
    /// Number of the entry that is largest over its target.
    pub worst: usize,
}

/// What is still to be corrected of a trial solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correction {
    /// Its size, linear in the correction: what a line search reduces.
    pub size: f64,
    /// Whether it no longer matters.
    pub negligible: bool,
}

/// Why a point has no residual.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// Number of the unknown where that shows, if it is known.
    pub place: Option<usize>,
    /// What is wrong there.
    pub reason: String,
}

/// A system of equations.
pub trait Equations {
    /// A point in the space of unknowns; directions have the same type.
    type Point: Clone;

    /// Sets what residuals are measured by in a solve to a goal from a point.
    fn aim(&mut self, goal: Goal, from: &Self::Point);

    /// Moves to a point and measures the residual there; `None` if there is none.
    fn evaluate(&mut self, at: &Self::Point) -> Option<Size>;

    /// Moves to a point without its residual; whether there is one.
    fn place(&mut self, at: &Self::Point) -> bool;

    /// Why [`Self::evaluate`] has found no residual at a point.
    fn obstacle(&self, at: &Self::Point) -> Obstacle;

    /// Weights merits by what the last residual still lacks where; its merit in these weights.
    fn weigh(&mut self) -> f64;

    /// Linearizes at the point of the last residual, and prepares linear systems.
    ///
    /// # Errors
    /// If the derivative cannot be factored.
    fn linearize(&mut self, at: &Self::Point) -> Result<(), LinearError>;

    /// Newton's direction for the last residual; `tolerance` is the relative residual of the linear system.
    ///
    /// # Errors
    /// If the linear system cannot be solved.
    fn direction(&mut self, at: &Self::Point, tolerance: f64, out: &mut Self::Point) -> Result<(), LinearError>;

    /// How the last residual would be corrected with the factors of the last linearization, as far as that is cheap to find; nothing below
    /// `tolerance` matters.
    ///
    /// # Errors
    /// If the linear system cannot be solved.
    fn correction(&mut self, tolerance: f64) -> Result<Correction, LinearError>;

    /// The correction that was measured last, as a direction.
    ///
    /// # Errors
    /// If it cannot be completed.
    fn last_correction(&mut self, at: &Self::Point, out: &mut Self::Point) -> Result<(), LinearError>;

    /// The point `part` of the way along a direction (a retraction).
    fn advance(&self, from: &Self::Point, direction: &Self::Point, part: f64, out: &mut Self::Point);

    /// The direction that leads from one point to another: what [`Self::advance`] undoes.
    fn difference(&self, from: &Self::Point, to: &Self::Point, out: &mut Self::Point);

    /// Part of the way between two points that may be gone, 1 if all of it.
    fn longest_step(&mut self, from: &Self::Point, to: &Self::Point) -> f64;

    /// Makes the matrix definite until the end of the solve, for directions that lead downhill; whether that is new.
    fn use_definite_matrix(&mut self) -> bool;

    /// Whether the caller wants to stop.
    fn stop_requested(&mut self) -> bool;
}
