//! The canonical scenes of tests and benches, read from files that `tests/scenes/make_scenes.py` writes.
#![allow(dead_code)]

use std::path::Path;

use flagrs::contact::stiffness::Stiffness;
use flagrs::fluid::product::FarFieldChoice;
use flagrs::kinematics::clamp::Motion;
use flagrs::model::specification::{
    ClampSpecification, ContactMethodSpecification, ContactSpecification, FlowSpecification, FluidModelSpecification,
    FluidSpecification, Frame, HeadSpecification, LoadKind, LoadSpecification, MagnetismSpecification,
    MotorSpecification, Specification,
};
use flagrs::signal::Signal;
use flagrs::{Mat3, Vec3};
use serde::Deserialize;

/// Every scene, by the name of its file.
pub const NAMES: [&str; 13] = [
    "robot",
    "robot_of_pitch_5",
    "robot_of_pitch_9",
    "one_clamped_flagellum",
    "two_clamped_flagella",
    "five_clamped_flagella",
    "free_helix",
    "free_fibre",
    "branched_network",
    "torque_motor",
    "loads",
    "friction_rail",
    "rail_by_passes",
];

/// A scene and the step when none is asked for, s.
pub struct Canonical {
    pub specification: Specification,
    pub dt: f64,
}

/// The scene of a name.
pub fn read(name: &str) -> Canonical {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes").join(name).with_extension("json");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let file: File = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    file.scene()
}

/// A free flagellum of the robot, without contact, of any number of nodes up to a thousand.
pub fn helix(nodes: usize) -> Specification {
    let mut scene = read("free_helix").specification;
    assert!(nodes <= scene.nodes.len(), "the file has {} nodes", scene.nodes.len());
    let (edges, hinges) = (nodes - 1, nodes - 2);
    scene.nodes.truncate(nodes);
    scene.rest_nodes.truncate(nodes);
    scene.reynolds.truncate(nodes);
    scene.edges.truncate(edges);
    scene.hinges.truncate(hinges);
    for values in [&mut scene.theta, &mut scene.radius, &mut scene.density, &mut scene.stretching] {
        values.truncate(edges);
    }
    scene.bending.truncate(hinges);
    scene.twisting.truncate(hinges);
    scene.natural_curvature.truncate(hinges);
    scene.natural_twist.truncate(hinges);
    let fluid = scene.fluid.as_mut().expect("a helix in a fluid");
    fluid.immersed.truncate(edges);
    match &mut fluid.model {
        FluidModelSpecification::StokesletSegments { epsilon, .. } => epsilon.truncate(edges),
        FluidModelSpecification::ResistiveForce { .. } => panic!("the helix is in a fluid of segments"),
    }
    scene
}

/// Regularization of every edge of a scene, m.
pub fn epsilon(scene: &Specification) -> Vec<f64> {
    match &scene.fluid.as_ref().expect("a scene in a fluid").model {
        FluidModelSpecification::StokesletSegments { epsilon, .. } => epsilon.clone(),
        FluidModelSpecification::ResistiveForce { .. } => panic!("a fluid without regularization"),
    }
}

/// What a file holds; an array with a single entry has it everywhere.
#[derive(Deserialize)]
struct File {
    nodes: Vec<[f64; 3]>,
    rest_nodes: Option<Vec<[f64; 3]>>,
    edges: Vec<[usize; 2]>,
    hinges: Vec<[usize; 2]>,
    theta: Vec<f64>,
    directors: Vec<(usize, [f64; 3])>,
    radius: Vec<f64>,
    density: Vec<f64>,
    stretching: Vec<f64>,
    bending: Vec<[[f64; 2]; 2]>,
    twisting: Vec<f64>,
    natural_curvature: Vec<[Option<f64>; 2]>,
    natural_twist: Vec<Option<f64>>,
    motors: Vec<Motor>,
    head: Option<Head>,
    clamps: Vec<Clamp>,
    loads: Vec<Load>,
    magnetism: Option<Magnetism>,
    flows: Vec<Flow>,
    gravity: [f64; 3],
    reynolds: Vec<f64>,
    fluid: Option<Fluid>,
    contact: Option<Contact>,
    dt: f64,
}

/// A number, or times and samples.
#[derive(Deserialize)]
#[serde(untagged)]
enum Course {
    Constant(f64),
    Table(Vec<f64>, Vec<f64>),
}

#[derive(Deserialize)]
struct Motor {
    hinge: usize,
    shaft_second: bool,
    by_torque: bool,
    signal: Course,
}

#[derive(Deserialize)]
struct Head {
    node: usize,
    edges: Vec<usize>,
    translation: f64,
    rotation: f64,
    mass: f64,
}

#[derive(Deserialize)]
struct Clamp {
    nodes: Vec<usize>,
    edges: Vec<usize>,
    axes: [bool; 3],
    angular_velocity: Course,
    velocity: [Course; 3],
    displacement: [Course; 3],
    /// No canonical scene has one.
    turning: Option<()>,
}

#[derive(Deserialize)]
struct Load {
    kind: String,
    material: bool,
    nodes: Vec<usize>,
    edges: Vec<usize>,
    signal: [Course; 3],
}

#[derive(Deserialize)]
struct Magnetism {
    moments: Vec<(usize, [f64; 3])>,
    field: [Course; 3],
    gradient: [[f64; 3]; 3],
}

/// The linear one is the only kind that canonical scenes have.
#[derive(Deserialize)]
struct Flow {
    velocity: [Course; 3],
    gradient: [[f64; 3]; 3],
    strength: Course,
    center: [f64; 3],
}

#[derive(Deserialize)]
struct Fluid {
    viscosity: f64,
    immersed: Vec<bool>,
    twist_drag: bool,
    density: f64,
    far_field_error: f64,
    far_field_nodes: usize,
    epsilon: Option<Vec<f64>>,
    coefficients: Option<Vec<[f64; 2]>>,
}

#[derive(Deserialize)]
struct Contact {
    barrier: bool,
    tolerance: f64,
    max_iterations: usize,
    stiffness: Option<f64>,
    driven: Vec<f64>,
    /// Null is infinite.
    bent: Vec<Option<f64>>,
    friction: f64,
    slip_velocities: Vec<f64>,
    spheres: Vec<(usize, f64)>,
    exclusion: f64,
    colliding: Vec<bool>,
}

/// An array of so many entries.
fn filled<T: Clone>(values: Vec<T>, count: usize) -> Vec<T> {
    let all = if values.len() == 1 { vec![values[0].clone(); count] } else { values };
    assert_eq!(all.len(), count);
    all
}

fn matrix(rows: [[f64; 3]; 3]) -> Mat3 {
    Mat3::from_fn(|row, column| rows[row][column])
}

impl Course {
    fn signal(self) -> Signal {
        match self {
            Self::Constant(value) => Signal::Constant(value),
            Self::Table(times, values) => Signal::Table { times, values },
        }
    }
}

impl File {
    fn scene(self) -> Canonical {
        let (n, e, h) = (self.nodes.len(), self.edges.len(), self.hinges.len());
        let points = |rows: &[[f64; 3]]| rows.iter().map(|&row| Vec3::from(row)).collect::<Vec<_>>();
        let curvature = |[first, second]: [Option<f64>; 2]| first.zip(second).map(|(first, second)| [first, second]);
        let specification = Specification {
            rest_nodes: points(self.rest_nodes.as_ref().unwrap_or(&self.nodes)),
            nodes: points(&self.nodes),
            theta: filled(self.theta, e),
            directors: self.directors.into_iter().map(|(edge, director)| (edge, Vec3::from(director))).collect(),
            radius: filled(self.radius, e),
            density: filled(self.density, e),
            stretching: filled(self.stretching, e),
            bending: filled(self.bending, h),
            twisting: filled(self.twisting, h),
            natural_curvature: filled(self.natural_curvature, h).into_iter().map(curvature).collect(),
            natural_twist: filled(self.natural_twist, h),
            motors: self.motors.into_iter().map(Motor::specification).collect(),
            head: self.head.map(Head::specification),
            clamps: self.clamps.into_iter().map(Clamp::specification).collect(),
            loads: self.loads.into_iter().map(Load::specification).collect(),
            magnetism: self.magnetism.map(Magnetism::specification),
            walls: Vec::new(),
            flows: self.flows.into_iter().map(Flow::specification).collect(),
            gravity: Vec3::from(self.gravity),
            reynolds: filled(self.reynolds, n),
            fluid: self.fluid.map(|fluid| fluid.specification(e)),
            contact: self.contact.map(|contact| contact.specification(e)),
            edges: self.edges,
            hinges: self.hinges,
        };
        Canonical { specification, dt: self.dt }
    }
}

impl Motor {
    fn specification(self) -> MotorSpecification {
        let Self { hinge, shaft_second, by_torque, signal } = self;
        MotorSpecification { hinge, shaft_second, by_torque, signal: signal.signal() }
    }
}

impl Head {
    fn specification(self) -> HeadSpecification {
        let Self { node, edges, translation, rotation, mass } = self;
        HeadSpecification { node, edges, translation, rotation, mass }
    }
}

impl Clamp {
    fn specification(self) -> ClampSpecification {
        assert!(self.turning.is_none(), "canonical scenes have no clamp that turns");
        let motion = Motion {
            velocity: self.velocity.map(Course::signal),
            displacement: self.displacement.map(Course::signal),
            turning: None,
            spin: self.angular_velocity.signal(),
        };
        ClampSpecification { nodes: self.nodes, edges: self.edges, axes: self.axes, motion }
    }
}

impl Load {
    fn specification(self) -> LoadSpecification {
        let kind = match self.kind.as_str() {
            "node force" => LoadKind::NodeForce { node: self.nodes[0], edge: self.edges[0] },
            "edge torque" => LoadKind::EdgeTorque { edge: self.edges[0] },
            "force per length" => LoadKind::ForcePerLength { edges: self.edges },
            "torque per length" => LoadKind::TorquePerLength { edges: self.edges },
            other => panic!("a load of unknown kind {other}"),
        };
        let frame = if self.material { Frame::Material } else { Frame::Laboratory };
        LoadSpecification { kind, frame, signal: self.signal.map(Course::signal) }
    }
}

impl Magnetism {
    fn specification(self) -> MagnetismSpecification {
        MagnetismSpecification {
            moments: self.moments.into_iter().map(|(edge, moment)| (edge, Vec3::from(moment))).collect(),
            field: self.field.map(Course::signal),
            gradient: matrix(self.gradient),
        }
    }
}

impl Flow {
    fn specification(self) -> FlowSpecification {
        FlowSpecification::Linear {
            velocity: self.velocity.map(Course::signal),
            gradient: matrix(self.gradient),
            strength: self.strength.signal(),
            center: Vec3::from(self.center),
        }
    }
}

impl Fluid {
    fn specification(self, edges: usize) -> FluidSpecification {
        let far_field = FarFieldChoice { from: self.far_field_nodes, error: self.far_field_error };
        let model = match (self.epsilon, self.coefficients) {
            (Some(epsilon), None) => {
                FluidModelSpecification::StokesletSegments { epsilon: filled(epsilon, edges), far_field }
            }
            (None, Some(coefficients)) => {
                FluidModelSpecification::ResistiveForce { coefficients: filled(coefficients, edges) }
            }
            _ => panic!("a fluid has either regularizations or coefficients"),
        };
        FluidSpecification {
            viscosity: self.viscosity,
            model,
            immersed: filled(self.immersed, edges),
            twist_drag: self.twist_drag,
            density: self.density,
        }
    }
}

impl Contact {
    fn specification(self, edges: usize) -> ContactSpecification {
        let bodies = edges + self.spheres.len();
        let driven = filled(self.driven, bodies);
        let bent = filled(self.bent, bodies).into_iter().map(|force| force.unwrap_or(f64::INFINITY)).collect();
        let method = if self.barrier {
            ContactMethodSpecification::Barrier {
                tolerance: self.tolerance,
                stiffness: self.stiffness.map_or(Stiffness::Typical { driven, bent }, Stiffness::Uniform),
                friction: self.friction,
                slip_velocities: filled(self.slip_velocities, bodies),
                spheres: self.spheres,
            }
        } else {
            ContactMethodSpecification::SpillmannTeschner {
                tolerance: self.tolerance,
                max_iterations: self.max_iterations,
            }
        };
        ContactSpecification { method, exclusion: self.exclusion, colliding: filled(self.colliding, edges) }
    }
}
