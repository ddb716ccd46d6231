//! The canonical scenes of tests and benches: a helix, the robot, and clamped flagella (docs/theory, "Scenes").
#![allow(dead_code)]

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use flagrs::Vec3;
use flagrs::contact::stiffness::Stiffness;
use flagrs::fluid::product::FarFieldChoice;
use flagrs::kinematics::clamp::Motion;
use flagrs::model::specification::{
    ClampSpecification, ContactMethodSpecification, ContactSpecification, FluidModelSpecification, FluidSpecification,
    HeadSpecification, MotorSpecification, Specification,
};
use flagrs::signal::Signal;

/// Least arc length of an edge of the flagella, m.
const EDGE_LENGTH: f64 = 5e-3;
/// Turn of the motor or clamp in a step of the implicit schemes, rad; the default of the Python package.
const TURN_PER_STEP: f64 = 0.05;

/// Speed of the clamped flagella, rad/s.
const CLAMP_SPEED: f64 = 15.0;

/// A helix: radius of the centreline, advance per turn and total advance, m.
#[derive(Clone, Copy)]
struct Helix {
    radius: f64,
    pitch: f64,
    axial_length: f64,
}

impl Helix {
    fn contour(&self) -> f64 {
        self.axial_length / self.pitch * (TAU * self.radius).hypot(self.pitch)
    }

    fn edge_count(&self) -> usize {
        (self.contour() / EDGE_LENGTH) as usize
    }

    /// Nodes about +x, from the axial position 0; `hand` is 1 for a right-handed helix and -1 for a left-handed one.
    fn nodes(&self, edges: usize, hand: f64) -> Vec<Vec3> {
        (0..=edges)
            .map(|k| {
                let along = self.axial_length * k as f64 / edges as f64;
                let (sine, cosine) = (TAU * along / self.pitch).sin_cos();
                Vec3::new(along, self.radius * cosine, hand * self.radius * sine)
            })
            .collect()
    }
}

/// The robot's flagellum for a pitch given in helix radii.
fn robot_flagellum(normalized_pitch: f64) -> Helix {
    Helix { radius: 6.36e-3, pitch: normalized_pitch * 6.36e-3, axial_length: 95.4e-3 }
}

const CLAMPED_FLAGELLUM: Helix = Helix { radius: 10e-3, pitch: 50e-3, axial_length: 200e-3 };

/// What the rods of a scene are made of, and what is around them.
struct Substance {
    youngs_modulus: f64,
    poisson_ratio: f64,
    density: f64,
    radius: f64,
    viscosity: f64,
    epsilon: f64,
}

const ROBOT: Substance = Substance {
    youngs_modulus: 1.255e6,
    poisson_ratio: 0.5,
    density: 1260.0,
    radius: 1.6e-3,
    viscosity: 1.0,
    epsilon: 1.65e-3,
};

const CLAMPED: Substance = Substance {
    youngs_modulus: 3e6,
    poisson_ratio: 0.5,
    density: 1000.0,
    radius: 1e-3,
    viscosity: 0.1,
    epsilon: 1.02e-3,
};

/// Round rods at rest in their natural shape, immersed in a fluid of Stokeslet segments with twist drag.
fn rods(chains: Vec<Vec<Vec3>>, substance: &Substance) -> Specification {
    let (mut nodes, mut edges, mut hinges) = (Vec::new(), Vec::new(), Vec::new());
    for chain in chains {
        let (first_node, first_edge) = (nodes.len(), edges.len());
        edges.extend((0..chain.len() - 1).map(|k| [first_node + k, first_node + k + 1]));
        hinges.extend((0..chain.len() - 2).map(|k| [first_edge + k, first_edge + k + 1]));
        nodes.extend(chain);
    }
    let (e, h) = (edges.len(), hinges.len());
    let area = PI * substance.radius.powi(2);
    let second_moment = 0.25 * area * substance.radius.powi(2);
    let bending = substance.youngs_modulus * second_moment;
    let shear_modulus = substance.youngs_modulus / (2.0 * (1.0 + substance.poisson_ratio));
    Specification {
        rest_nodes: nodes.clone(),
        nodes,
        edges,
        hinges,
        theta: vec![0.0; e],
        directors: vec![],
        radius: vec![substance.radius; e],
        density: vec![substance.density; e],
        stretching: vec![substance.youngs_modulus * area; e],
        bending: vec![[[bending, 0.0], [0.0, bending]]; h],
        twisting: vec![2.0 * shear_modulus * second_moment; h],
        natural_curvature: vec![None; h],
        natural_twist: vec![None; h],
        motors: vec![],
        head: None,
        clamps: vec![],
        loads: vec![],
        magnetism: None,
        walls: vec![],
        flows: vec![],
        gravity: Vec3::zeros(),
        reynolds: vec![],
        fluid: Some(FluidSpecification {
            viscosity: substance.viscosity,
            model: FluidModelSpecification::StokesletSegments {
                epsilon: vec![substance.epsilon; e],
                far_field: FarFieldChoice::NEVER,
            },
            immersed: vec![true; e],
            twist_drag: true,
            density: 0.0,
        }),
        contact: None,
    }
}

/// Contact with the default options of the Python package, the stiffness (Pa) as it takes it from the scene.
fn contact(colliding: Vec<bool>, stiffness: f64) -> ContactSpecification {
    let method = ContactMethodSpecification::Barrier {
        tolerance: 0.05,
        stiffness: Stiffness::Uniform(stiffness),
        friction: 0.0,
        slip_velocities: Vec::new(),
        spheres: Vec::new(),
    };
    ContactSpecification { method, exclusion: FRAC_PI_2, colliding }
}

/// Regularization of the robot's fluid, m.
pub const ROBOT_EPSILON: f64 = ROBOT.epsilon;

/// A free flagellum of the robot (pitch 7 helix radii), continued to any number of nodes; no contact.
pub fn helix(nodes: usize) -> Specification {
    let flagellum = robot_flagellum(7.0);
    let share = (nodes - 1) as f64 / flagellum.edge_count() as f64;
    let continued = Helix { axial_length: flagellum.axial_length * share, ..flagellum };
    rods(vec![continued.nodes(nodes - 1, -1.0)], &ROBOT)
}

/// The robot: two flagella, two motors, one head.
pub fn robot(normalized_pitch: f64, rpm: f64) -> Specification {
    let flagellum = robot_flagellum(normalized_pitch);
    let flagellum: Vec<Vec3> = flagellum
        .nodes(flagellum.edge_count(), -1.0)
        .into_iter()
        .map(|node| node + Vec3::new(2.0 * EDGE_LENGTH, 0.0, 0.0))
        .collect();
    let aside = Vec3::new(0.0, 14e-3, 0.0);
    let shaft = |edges: f64| Vec3::new(edges * EDGE_LENGTH, 0.0, 0.0);
    let base = flagellum.len() - 1;
    let mut nodes: Vec<Vec3> = flagellum.iter().rev().map(|node| node - aside).collect();
    nodes.extend([shaft(2.0) - aside, shaft(1.0) - aside, -aside, Vec3::zeros()]);
    nodes.extend([aside, shaft(1.0) + aside, shaft(2.0) + aside]);
    nodes.extend(flagellum.iter().map(|node| node + aside));
    let mut scene = rods(vec![nodes], &ROBOT);

    // The six edges between the two axis points lie in the head.
    let outside: Vec<bool> = (0..scene.edges.len()).map(|edge| !(base + 1..base + 7).contains(&edge)).collect();
    let speed = Signal::Constant(rpm * TAU / 60.0);
    let motor =
        |hinge, shaft_second| MotorSpecification { hinge, shaft_second, by_torque: false, signal: speed.clone() };
    scene.motors = vec![motor(base + 1, false), motor(base + 5, true)];
    let head_radius = 31e-3_f64;
    scene.head = Some(HeadSpecification {
        node: base + 4,
        edges: vec![base + 3, base + 4],
        translation: 4.1 * 6.0 * PI * ROBOT.viscosity * head_radius,
        rotation: 0.9 * 8.0 * PI * ROBOT.viscosity * head_radius.powi(3),
        mass: 0.0,
    });
    if let Some(fluid) = &mut scene.fluid {
        fluid.immersed.clone_from(&outside);
    }
    scene.contact = Some(contact(outside, 4.94e3));
    scene
}

/// Step of the implicit schemes for the robot, s.
pub fn robot_step(rpm: f64) -> f64 {
    TURN_PER_STEP / (rpm * TAU / 60.0)
}

/// Flagella clamped on a regular polygon with sides of 30 mm, turned against their handedness at 15 rad/s.
pub fn clamped_flagella(count: usize) -> Specification {
    let helix = CLAMPED_FLAGELLUM;
    let edges = helix.edge_count();
    let edge = helix.contour() / edges as f64;
    let lead_in = (2.0_f64.sqrt() * helix.radius / edge) as usize;
    let mut flagellum = vec![Vec3::new(-edge - helix.radius, 0.0, 0.0)];
    flagellum.extend((0..lead_in).map(|k| {
        let along = helix.radius * k as f64 / lead_in as f64;
        Vec3::new(along - helix.radius, along, 0.0)
    }));
    flagellum.extend(helix.nodes(edges, 1.0));
    let circumradius = if count == 1 { 0.0 } else { 30e-3 / (2.0 * (PI / count as f64).sin()) };
    let chains = (0..count)
        .map(|k| {
            let (sine, cosine) = (TAU * k as f64 / count as f64).sin_cos();
            let corner = Vec3::new(0.0, circumradius * cosine, circumradius * sine);
            flagellum.iter().map(|node| node + corner).collect()
        })
        .collect();
    let mut scene = rods(chains, &CLAMPED);
    scene.clamps = (0..count)
        .map(|k| ClampSpecification {
            nodes: vec![k * flagellum.len(), k * flagellum.len() + 1],
            edges: vec![k * (flagellum.len() - 1)],
            axes: [true; 3],
            motion: Motion { spin: Signal::Constant(-CLAMP_SPEED), ..Motion::still() },
        })
        .collect();
    scene.contact = Some(contact(vec![true; scene.edges.len()], 1.076e4));
    scene
}

/// Step of the implicit schemes for the clamped flagella, s.
pub fn clamped_step() -> f64 {
    TURN_PER_STEP / CLAMP_SPEED
}
