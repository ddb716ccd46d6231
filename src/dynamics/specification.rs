//! What a scene says, as plain data in SI units; the scene's description in Python fills it in.

use crate::Vec3;
use crate::contact::stiffness::Stiffness;
use crate::elastic::signal::Signal;
use crate::fluid::product::FarFieldChoice;

/// A motor at a hinge.
#[derive(Debug, Clone)]
pub struct MotorSpecification {
    /// Index of the hinge.
    pub hinge: usize,
    /// Whether the shaft is the hinge's second edge.
    pub shaft_second: bool,
    /// Whether the signal is a torque (N m) instead of a relative angular velocity (rad/s).
    pub by_torque: bool,
    /// The driving signal.
    pub signal: Signal,
}

/// The robot's head.
#[derive(Debug, Clone)]
pub struct HeadSpecification {
    /// Its node.
    pub node: usize,
    /// The edges at that node that are fixed to it, one to [`crate::fluid::head::MOST_EDGES`].
    pub edges: Vec<usize>,
    /// `C_t 6 pi mu r_h`, N s/m.
    pub translation: f64,
    /// `C_r 8 pi mu r_h^3`, N m s.
    pub rotation: f64,
    /// Mass on top of the rod's, kg.
    pub mass: f64,
}

/// Nodes and edge angles that move as prescribed.
#[derive(Debug, Clone)]
pub struct ClampSpecification {
    /// Nodes held.
    pub nodes: Vec<usize>,
    /// Edges whose angle is held.
    pub edges: Vec<usize>,
    /// Angular velocity of these edges about their tangent, rad/s.
    pub angular_velocity: Signal,
    /// Velocity of these nodes, m/s.
    pub velocity: Vec3,
}

/// The drag model on the immersed edges.
#[derive(Debug, Clone)]
pub enum FluidModelSpecification {
    /// Drag per length along and across every edge, N s/m^2.
    ResistiveForce {
        /// One pair per edge.
        coefficients: Vec<[f64; 2]>,
    },
    /// Regularized Stokeslet segments.
    StokesletSegments {
        /// Regularization of every edge, m.
        epsilon: Vec<f64>,
        /// When the mobility is multiplied without its matrix.
        far_field: FarFieldChoice,
    },
}

/// The fluid.
#[derive(Debug, Clone)]
pub struct FluidSpecification {
    /// Dynamic viscosity, Pa s.
    pub viscosity: f64,
    /// Drag model.
    pub model: FluidModelSpecification,
    /// The edges it acts on.
    pub immersed: Vec<bool>,
    /// Whether edges resist spinning about their centreline.
    pub twist_drag: bool,
    /// Density for buoyancy, kg/m^3.
    pub density: f64,
}

/// How penetration is prevented.
#[derive(Debug, Clone)]
pub enum ContactMethodSpecification {
    /// By the method of Spillmann and Teschner.
    SpillmannTeschner {
        /// Deepest penetration left, as a fraction of the sum of radii.
        tolerance: f64,
        /// Largest number of passes in a step.
        max_iterations: usize,
    },
    /// By a potential that grows without bound.
    Barrier {
        /// Tolerance `delta`: contact acts between `1 - delta` and `1 + delta` sums of radii.
        tolerance: f64,
        /// Stiffness of every pair.
        stiffness: Stiffness,
        /// Coefficient of friction.
        friction: f64,
        /// Velocity from which on contacts of every body, edges before spheres, slide, m/s; the larger of two counts.
        slip_velocities: Vec<f64>,
        /// Node and radius (m) of every sphere.
        spheres: Vec<(usize, f64)>,
    },
}

/// Contact.
#[derive(Debug, Clone)]
pub struct ContactSpecification {
    /// The method and its parameters.
    pub method: ContactMethodSpecification,
    /// Excluded rest arc length, in sums of radii.
    pub exclusion: f64,
    /// The edges that can touch others.
    pub colliding: Vec<bool>,
}

/// A whole scene.
#[derive(Debug, Clone)]
pub struct Specification {
    /// Initial positions, m.
    pub nodes: Vec<Vec3>,
    /// Rest shape, m.
    pub rest_nodes: Vec<Vec3>,
    /// Pairs of nodes.
    pub edges: Vec<[usize; 2]>,
    /// Pairs of edges.
    pub hinges: Vec<[usize; 2]>,
    /// Initial angle of every edge, rad.
    pub theta: Vec<f64>,
    /// Direction of the first material director on some edges.
    pub directors: Vec<(usize, Vec3)>,
    /// Radius of every edge, m.
    pub radius: Vec<f64>,
    /// Density of every edge, kg/m^3.
    pub density: Vec<f64>,
    /// EA of every edge, N.
    pub stretching: Vec<f64>,
    /// EI of every hinge, N m^2.
    pub bending: Vec<[[f64; 2]; 2]>,
    /// GJ of every hinge, N m^2.
    pub twisting: Vec<f64>,
    /// Integrated natural curvature where it is not the rest shape's.
    pub natural_curvature: Vec<Option<[f64; 2]>>,
    /// Natural twist where it is not the rest shape's, rad.
    pub natural_twist: Vec<Option<f64>>,
    /// Motors.
    pub motors: Vec<MotorSpecification>,
    /// Head.
    pub head: Option<HeadSpecification>,
    /// Clamps.
    pub clamps: Vec<ClampSpecification>,
    /// Point loads, N.
    pub loads: Vec<(usize, Vec3)>,
    /// Gravity, m/s^2.
    pub gravity: Vec3,
    /// Reynolds number of every node over its speed, s/m: density times size over viscosity, zero for dry ones; may be empty.
    pub reynolds: Vec<f64>,
    /// Fluid.
    pub fluid: Option<FluidSpecification>,
    /// Contact.
    pub contact: Option<ContactSpecification>,
}
