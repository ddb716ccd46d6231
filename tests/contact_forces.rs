//! Contact forces of Spillmann and Teschner: third law, tolerance, and the size of a known force.

mod common;

use common::{Random, chain_edges, chain_hinges, scene};
use flagrs::Vec3;
use flagrs::contact::exclusion::Exclusion;
use flagrs::contact::spillmann::{ContactLaw, ContactSolver};
use flagrs::kinematics::clamp::Motion;
use flagrs::model::specification::{
    ClampSpecification, ContactMethodSpecification, ContactSpecification, FluidModelSpecification, FluidSpecification,
    LoadSpecification, Specification,
};
use flagrs::simulation::Simulation;
use flagrs::step::scheme::Scheme;

const TOLERANCE: f64 = 1e-3;

/// Two crossed rods of ten edges, a diameter apart, both ends of the lower one held.
fn crossed_rods(gap: f64) -> Specification {
    let nodes_of = |direction: Vec3, height: f64| {
        (0..11).map(move |k| direction * (k as f64 - 5.0) * 0.1 + Vec3::new(0.013, 0.021, height))
    };
    let nodes: Vec<Vec3> = nodes_of(Vec3::x(), 0.0).chain(nodes_of(Vec3::y(), gap)).collect();
    let shift = |pairs: Vec<[usize; 2]>, by: usize| pairs.into_iter().map(move |pair| pair.map(|k| k + by));
    let edges: Vec<[usize; 2]> = chain_edges(11).into_iter().chain(shift(chain_edges(11), 11)).collect();
    let hinges: Vec<[usize; 2]> = chain_hinges(11).into_iter().chain(shift(chain_hinges(11), 10)).collect();
    let mut specification = scene(nodes, edges, hinges);
    specification.radius.fill(0.02);
    specification.stretching.fill(1e3);
    specification.fluid = Some(FluidSpecification {
        viscosity: 1.0,
        model: FluidModelSpecification::ResistiveForce { coefficients: vec![[2.0, 4.0]; 20] },
        immersed: vec![true; 20],
        twist_drag: true,
        density: 0.0,
    });
    specification.clamps =
        vec![ClampSpecification { nodes: vec![0, 10], edges: vec![], axes: [true; 3], motion: Motion::still() }];
    specification.contact = Some(ContactSpecification {
        method: ContactMethodSpecification::SpillmannTeschner { tolerance: TOLERANCE, max_iterations: 500 },
        exclusion: std::f64::consts::FRAC_PI_2,
        colliding: vec![true; 20],
    });
    specification
}

#[test]
fn forces_have_neither_resultant_nor_torque() {
    let mut random = Random::new(5);
    let edges = [[0, 1], [2, 3]];
    let mut pushed = 0;
    for _ in 0..2000 {
        let nodes: Vec<Vec3> = (0..4).map(|_| random.vector(1.0)).collect();
        let radius = [0.2, 0.35];
        let exclusion = Exclusion::new(4, &edges, &[1.0, 1.0], &radius, 1.0);
        let law = ContactLaw::new(&edges, &radius, exclusion, &[true, true], TOLERANCE, 10);
        let mut solver = ContactSolver::new(&law);
        let pass = solver.pass(&law, &nodes, &[1.0, 2.0, 3.0, 4.0]);
        pushed += pass.pushing;
        let mut forces = [Vec3::zeros(); 4];
        solver.spread(&law, &nodes, |node, force| forces[node] += force);
        let size: f64 = forces.iter().map(Vec3::norm).sum();
        let resultant: Vec3 = forces.iter().sum();
        let torque: Vec3 = forces.iter().zip(&nodes).map(|(force, node)| node.cross(force)).sum();
        // Sums of four terms of order one: round-off is a few units in the last place of the largest.
        assert!(resultant.norm() <= 1e-15 * size, "resultant {resultant}");
        assert!(torque.norm() <= 1e-14 * size, "torque {torque}");
    }
    assert!(pushed > 200, "only {pushed} of the random pairs touched");
}

#[test]
fn a_pressed_rod_rests_on_the_other_within_the_tolerance() {
    let mut specification = crossed_rods(0.045);
    // Load on the free rod's middle edge, over the crossing.
    specification.loads = vec![
        LoadSpecification::force(15, Vec3::new(0.0, 0.0, -0.2)),
        LoadSpecification::force(16, Vec3::new(0.0, 0.0, -0.2)),
    ];
    let mut sim = Simulation::new(specification, Scheme::Overdamped, 5e-3, 1).unwrap();
    let mut touched = 0;
    for _ in 0..400 {
        sim.step().unwrap();
        let gap = sim.smallest_gap().unwrap();
        assert!(gap >= -TOLERANCE * 0.04, "overlap {gap:e} m");
        touched += usize::from(!sim.state().contacts.is_empty());
    }
    assert!(touched > 200, "the rods touched in {touched} steps only");
}

#[test]
fn the_contact_force_carries_the_load() {
    let mut specification = crossed_rods(0.041);
    let load = 0.1;
    specification.loads = vec![
        LoadSpecification::force(15, Vec3::new(0.0, 0.0, -0.5 * load)),
        LoadSpecification::force(16, Vec3::new(0.0, 0.0, -0.5 * load)),
    ];
    let mut sim = Simulation::new(specification, Scheme::Overdamped, 1e-2, 1).unwrap();
    for _ in 0..2000 {
        sim.step().unwrap();
    }
    // At rest the free rod hangs over the other: one contact carries its whole load.
    let total: f64 = sim.state().contacts.iter().map(|(_, force)| force).sum();
    let speed = sim.velocities().iter().map(|v| v.norm()).fold(0.0, f64::max);
    let drag = 4.0 * 1.0 * speed;
    assert!((total - load).abs() < 0.01 * load + drag, "contact force {total} for a load of {load}, speed {speed:e}");
}

#[test]
fn without_contact_the_same_rods_pass_through_each_other() {
    let mut specification = crossed_rods(0.045);
    specification.loads = vec![
        LoadSpecification::force(15, Vec3::new(0.0, 0.0, -0.2)),
        LoadSpecification::force(16, Vec3::new(0.0, 0.0, -0.2)),
    ];
    specification.contact = None;
    let mut sim = Simulation::new(specification, Scheme::Overdamped, 5e-3, 1).unwrap();
    for _ in 0..400 {
        sim.step().unwrap();
    }
    let nodes = sim.positions();
    assert!(nodes[16].z < nodes[5].z, "the loaded rod stayed above: the contact tests would pass without contact");
}
