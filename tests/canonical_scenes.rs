//! The canonical scenes are those of Lim et al. and of the bundling benchmark: node counts, sizes; and each of them moves.

#[path = "common/scenes.rs"]
mod scenes;

use flagrs::Vec3;
use flagrs::model::specification::{ContactMethodSpecification, Specification};
use flagrs::simulation::Simulation;
use flagrs::step::scheme::Scheme;

fn read(name: &str) -> Specification {
    scenes::read(name).specification
}

fn edge_lengths(scene: &Specification) -> Vec<f64> {
    scene.edges.iter().map(|&[i, j]| (scene.nodes[j] - scene.nodes[i]).norm()).collect()
}

#[test]
fn robots_have_the_published_node_counts() {
    let robots = ["robot_of_pitch_5", "robot", "robot_of_pitch_9"];
    let counts = robots.map(|name| read(name).nodes.len());
    assert_eq!(counts, [69, 59, 55]);
}

#[test]
fn every_clamped_flagellum_has_68_nodes() {
    let bundles = ["one_clamped_flagellum", "two_clamped_flagella", "five_clamped_flagella"];
    assert_eq!(bundles.map(|name| read(name).nodes.len()), [68, 136, 340]);
}

#[test]
fn flagella_of_the_robot_are_28_mm_apart_and_95_mm_long_beyond_the_axis_points() {
    let scene = read("robot");
    let head = scene.head.as_ref().expect("the robot has a head").node;
    let (axis_1, axis_2) = (scene.nodes[head - 3], scene.nodes[head + 3]);
    assert_eq!(axis_2 - axis_1, Vec3::new(0.0, 28e-3, 0.0));
    for tip in [scene.nodes[0], scene.nodes[58]] {
        assert!((tip.x - axis_1.x - 95.4e-3).abs() < 1e-15, "a tip at x = {}", tip.x);
    }
    // The axis point's radial edge is as long as the helix radius, and normal to the axis.
    for radial in [scene.nodes[head - 4] - axis_1, scene.nodes[head + 4] - axis_2] {
        assert!((radial - Vec3::new(0.0, 6.36e-3, 0.0)).norm() < 1e-15, "{radial}");
    }
}

#[test]
fn robot_feels_the_fluid_outside_its_head_only() {
    let scene = read("robot");
    let head = scene.head.as_ref().expect("the robot has a head").node;
    let immersed = &scene.fluid.as_ref().expect("the robot is in a fluid").immersed;
    let dry: Vec<usize> = (0..immersed.len()).filter(|&edge| !immersed[edge]).collect();
    assert_eq!(dry, (head - 3..head + 3).collect::<Vec<_>>());
}

#[test]
fn two_clamped_flagella_stand_30_mm_apart_and_advance_200_mm() {
    let scene = read("two_clamped_flagella");
    assert!(((scene.nodes[68] - scene.nodes[0]).norm() - 30e-3).abs() < 1e-15);
    assert!((scene.nodes[67].x - 200e-3).abs() < 1e-15, "the tip is at x = {}", scene.nodes[67].x);
    // The clamped edge points along +x and is an edge of the helix long.
    let clamped = scene.nodes[1] - scene.nodes[0];
    let arc = (200e-3 / 50e-3) * (std::f64::consts::TAU * 10e-3).hypot(50e-3) / 64.0;
    assert!((clamped - Vec3::new(arc, 0.0, 0.0)).norm() < 1e-15, "{clamped}");
}

#[test]
fn helix_of_26_nodes_is_a_flagellum_of_the_robot() {
    let (helix, robot) = (scenes::helix(26), read("robot"));
    let own = edge_lengths(&helix);
    let flagellum = &edge_lengths(&robot)[33..];
    assert_eq!(own.len(), flagellum.len());
    for (a, b) in own.iter().zip(flagellum) {
        assert!((a - b).abs() < 1e-15, "edges of {a} and {b} m");
    }
}

#[test]
fn contact_is_as_stiff_as_what_bends_the_flagella_asks() {
    // Soft flagella: the force per length that curves one to its helix radius, over the slope of the barrier in its middle.
    let ContactMethodSpecification::Barrier { stiffness, tolerance, .. } =
        read("two_clamped_flagella").contact.expect("flagella that touch").method
    else {
        panic!("the default is the barrier")
    };
    let found = stiffness.of([0, 1], 2e-3, tolerance);
    assert!((found - 1076.0).abs() < 1.0, "{found} Pa");
}

#[test]
fn scenes_take_steps_in_every_scheme() {
    for name in scenes::NAMES {
        let scenes::Canonical { specification, dt } = scenes::read(name);
        if specification.nodes.len() > 200 {
            // Their step is that of smaller scenes of the same kind, and takes long.
            continue;
        }
        let passes = name.ends_with("by_passes");
        for (scheme, dt) in [(Scheme::Overdamped, dt), (Scheme::Implicit, dt), (Scheme::Explicit, dt.min(1e-5))] {
            let mut simulation = Simulation::new(specification.clone(), scheme, dt, 1).expect("a valid scene");
            let before = simulation.state().q.clone();
            for _ in 0..3 {
                if let Err(error) = simulation.step() {
                    panic!("{name}, {}: {error}", scheme.name());
                }
            }
            let moved = before.iter().zip(&simulation.state().q).any(|(before, now)| before != now);
            assert!(moved, "{name}, {}", scheme.name());
            assert!(passes || simulation.statistics().rejected_steps == 0, "{name}, {}", scheme.name());
        }
    }
}
