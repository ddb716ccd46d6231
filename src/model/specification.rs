//! What a scene says, as plain data in SI units; the scene's description in Python fills it in.

use crate::contact::stiffness::Stiffness;
use crate::fluid::ambient::AmbientFlow;
use crate::fluid::ambient::function::{FlowFunction, GivenFlow};
use crate::fluid::ambient::linear::LinearFlow;
use crate::fluid::ambient::poiseuille::Poiseuille;
use crate::fluid::kernel::Boundary;
use crate::fluid::product::FarFieldChoice;
use crate::kinematics::clamp::Motion;
use crate::plane::Plane;
use crate::signal::Signal;
use crate::{Mat3, Vec3};

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
    /// Which coordinates of the nodes are held.
    pub axes: [bool; 3],
    /// How they move.
    pub motion: Motion,
}

/// What a wall is to the fluid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WallKind {
    /// The fluid is at rest on it.
    NoSlip,
    /// It bears no shear.
    FreeSurface,
    /// The fluid does not feel it; only contact does.
    Contact,
}

/// A plane wall; all is on the side its normal points to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallSpecification {
    /// Where it is.
    pub plane: Plane,
    /// What it is to the fluid.
    pub kind: WallKind,
}

impl WallSpecification {
    /// The boundary of the fluid that it is, if it is one.
    pub fn boundary(&self) -> Option<Boundary> {
        match self.kind {
            WallKind::NoSlip => Some(Boundary::NoSlip(self.plane)),
            WallKind::FreeSurface => Some(Boundary::FreeSurface(self.plane)),
            WallKind::Contact => None,
        }
    }
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

/// Which axes the components of a load refer to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frame {
    /// Fixed in space.
    Laboratory,
    /// The material frame `m1, m2, t` of an edge.
    Material,
}

/// Where a load acts.
#[derive(Debug, Clone)]
pub enum LoadKind {
    /// Force on a node, N; with components on the material frame of an edge that ends there.
    NodeForce {
        /// The node.
        node: usize,
        /// The edge whose frame counts, if it does.
        edge: usize,
    },
    /// Torque on an edge, N m.
    EdgeTorque {
        /// The edge.
        edge: usize,
    },
    /// Force per rest length, N/m.
    ForcePerLength {
        /// The edges.
        edges: Vec<usize>,
    },
    /// Torque per rest length, N.
    TorquePerLength {
        /// The edges.
        edges: Vec<usize>,
    },
}

/// A load whose components follow signals.
#[derive(Debug, Clone)]
pub struct LoadSpecification {
    /// Where it acts.
    pub kind: LoadKind,
    /// Which axes its components refer to.
    pub frame: Frame,
    /// Its components.
    pub signal: [Signal; 3],
}

impl LoadSpecification {
    /// A constant force on a node, N.
    pub fn force(node: usize, force: Vec3) -> Self {
        let signal = [force.x, force.y, force.z].map(Signal::Constant);
        Self { kind: LoadKind::NodeForce { node, edge: 0 }, frame: Frame::Laboratory, signal }
    }
}

/// Magnetised edges in a field.
#[derive(Debug, Clone)]
pub struct MagnetismSpecification {
    /// Edges and their moments on `m1, m2, t`, A m^2.
    pub moments: Vec<(usize, Vec3)>,
    /// Field at the origin, T.
    pub field: [Signal; 3],
    /// `dB_i/dx_j`, T/m.
    pub gradient: Mat3,
}

impl Specification {
    /// The boundary of the fluid, if there is one.
    pub fn boundary(&self) -> Option<Boundary> {
        self.walls.iter().find_map(WallSpecification::boundary)
    }
}

/// A background flow.
#[derive(Clone)]
pub enum FlowSpecification {
    /// `U(t) + s(t) G (x - c)`.
    Linear {
        /// Velocity at the center, m/s.
        velocity: [Signal; 3],
        /// `du_i/dx_j`, 1/s.
        gradient: Mat3,
        /// Factor on the gradient.
        strength: Signal,
        /// The center, m.
        center: Vec3,
    },
    /// Through a tube, or between plates with the given normal.
    Poiseuille {
        /// Unit vector along the flow.
        direction: Vec3,
        /// Unit normal of the plates; none for a tube.
        normal: Option<Vec3>,
        /// A point of the axis or the middle plane, m.
        center: Vec3,
        /// Radius, or half the distance of the plates, m.
        radius: f64,
        /// Speed at the middle, m/s.
        speed: Signal,
    },
    /// A function of points and time.
    Function {
        /// The function.
        function: FlowFunction,
        /// Distance of the differences for the vorticity, m.
        reach: f64,
    },
}

impl std::fmt::Debug for FlowSpecification {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            Self::Linear { .. } => "Linear",
            Self::Poiseuille { .. } => "Poiseuille",
            Self::Function { .. } => "Function",
        })
    }
}

impl FlowSpecification {
    /// The flow it describes.
    pub fn flow(&self) -> Box<dyn AmbientFlow> {
        match self.clone() {
            Self::Linear { velocity, gradient, strength, center } => {
                Box::new(LinearFlow::new(velocity, gradient, strength, center))
            }
            Self::Poiseuille { direction, normal, center, radius, speed } => {
                Box::new(Poiseuille::new(direction, normal, center, radius, speed))
            }
            Self::Function { function, reach } => Box::new(GivenFlow::new(function, reach)),
        }
    }
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
    /// Loads.
    pub loads: Vec<LoadSpecification>,
    /// Magnetised edges and the field they are in.
    pub magnetism: Option<MagnetismSpecification>,
    /// Plane walls.
    pub walls: Vec<WallSpecification>,
    /// Background flows; they add up.
    pub flows: Vec<FlowSpecification>,
    /// Gravity, m/s^2.
    pub gravity: Vec3,
    /// Reynolds number of every node over its speed, s/m: density times size over viscosity, zero for dry ones; may be empty.
    pub reynolds: Vec<f64>,
    /// Fluid.
    pub fluid: Option<FluidSpecification>,
    /// Contact.
    pub contact: Option<ContactSpecification>,
}
