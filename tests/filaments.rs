//! Filaments are the parts that move on their own, and what is solved on one does not depend on what is elsewhere.

#[path = "common/mod.rs"]
mod common;
#[path = "common/scenes.rs"]
mod scenes;

use common::{chain_edges, chain_hinges, scene};
use flagrs::Vec3;
use flagrs::kinematics::clamp::Motion;
use flagrs::model::Model;
use flagrs::model::filaments::Filament;
use flagrs::model::specification::{ClampSpecification, FluidModelSpecification, FluidSpecification, Specification};
use flagrs::simulation::Simulation;
use flagrs::step::scheme::Scheme;

fn filaments(specification: Specification) -> (Vec<usize>, Vec<Filament>) {
    let model = Model::new(specification).expect("the scene is valid");
    (model.filaments().of_dof().to_vec(), model.filaments().all().to_vec())
}

fn hold(specification: &mut Specification, nodes: Vec<usize>, edges: Vec<usize>) {
    specification.clamps.push(ClampSpecification { nodes, edges, axes: [true; 3], motion: Motion::still() });
}

fn straight(count: usize, edge: f64) -> Specification {
    let nodes = (0..count).map(|k| Vec3::new(k as f64 * edge, 0.0, 0.0)).collect();
    scene(nodes, chain_edges(count), chain_hinges(count))
}

#[test]
fn the_robot_is_one_filament_and_clamped_flagella_are_one_each_beside_what_holds_them() {
    let (_, robot) = filaments(scenes::read("robot").specification);
    assert_eq!(robot.iter().map(|filament| filament.held).collect::<Vec<_>>(), [false]);
    let (of_dof, flagella) = filaments(scenes::read("two_clamped_flagella").specification);
    let free: Vec<_> = flagella.iter().filter(|filament| !filament.held).collect();
    assert_eq!((free.len(), flagella.len()), (2, 4));
    assert_eq!(of_dof.len(), 2 * (3 * 68 + 67));
    // A helix of 10 mm on 67 edges: a twentieth of the length is more than that, the shaft's held end included.
    let scene = scenes::read("one_clamped_flagellum").specification;
    let length: f64 = scene.edges.iter().map(|&[i, j]| (scene.nodes[j] - scene.nodes[i]).norm()).sum();
    assert!(free.iter().all(|filament| (filament.length - length).abs() < 1e-12), "{free:?}");
    assert!(free.iter().all(|filament| (filament.size - length / 20.0).abs() < 1e-12), "{free:?}");
    assert!((free[0].size - free[1].size).abs() < 1e-15);
}

#[test]
fn what_is_held_parts_a_rod_and_does_not_count_for_its_size() {
    // 41 nodes 10 mm apart, of which the last five are free: with the two held ones they bend against, 60 mm.
    let mut rail = straight(41, 0.01);
    hold(&mut rail, (0..36).collect(), (0..35).collect());
    let (of_dof, all) = filaments(rail);
    let tail = all[*of_dof.last().expect("there are degrees of freedom")];
    assert!(!tail.held && (tail.length - 0.06).abs() < 1e-12, "{tail:?}");
    assert!((tail.size - 0.06 / 20.0).abs() < 1e-12);
    assert_eq!(all.iter().filter(|filament| filament.held).count(), 1);
    // Held in the middle by two nodes and the edge between, the two ends are filaments of their own.
    let mut parted = straight(21, 0.01);
    hold(&mut parted, vec![10, 11], vec![10]);
    assert_eq!(filaments(parted).1.iter().filter(|filament| !filament.held).count(), 2);
    // By one node alone they bend against each other.
    let mut hinged = straight(21, 0.01);
    hold(&mut hinged, vec![10], vec![]);
    assert_eq!(filaments(hinged).1.iter().filter(|filament| !filament.held).count(), 1);
}

#[test]
fn the_length_of_a_star_is_the_longest_way_and_not_the_sum_of_its_arms() {
    let arms = 16;
    let mut nodes = vec![Vec3::zeros()];
    let mut edges = Vec::new();
    for arm in 0..arms {
        let (sine, cosine) = (std::f64::consts::TAU * arm as f64 / arms as f64).sin_cos();
        for k in 1..=5 {
            edges.push([if k == 1 { 0 } else { nodes.len() - 1 }, nodes.len()]);
            nodes.push(Vec3::new(cosine, sine, 0.0) * (0.005 * k as f64));
        }
    }
    let hinges = (0..arms).flat_map(|arm| (0..4).map(move |k| [5 * arm + k, 5 * arm + k + 1])).collect();
    let (_, all) = filaments(scene(nodes, edges, hinges));
    assert_eq!(all.len(), 1);
    assert!((all[0].length - 0.05).abs() < 1e-12, "{:?}", all[0]);
}

/// A bent soft rod, whose rest shape is straight, in local drag; beside it, if wanted, a held one a million times as stiff.
fn relaxing(with_rail: bool) -> Specification {
    let count = 11;
    let arch = |k: usize| Vec3::new(0.01 * k as f64, 0.02 * (0.314_159 * k as f64).sin(), 0.0);
    let mut nodes: Vec<Vec3> = (0..count).map(arch).collect();
    let mut rest: Vec<Vec3> = (0..count).map(|k| Vec3::new(0.01 * k as f64, 0.0, 0.0)).collect();
    let (mut edges, mut hinges) = (chain_edges(count), chain_hinges(count));
    if with_rail {
        let rail = (0..count).map(|k| Vec3::new(5.0 + 0.2 * k as f64, 0.0, 0.0));
        nodes.extend(rail.clone());
        rest.extend(rail);
        edges.extend(chain_edges(count).iter().map(|&[i, j]| [i + count, j + count]));
        hinges.extend(chain_hinges(count).iter().map(|&[e, f]| [e + count - 1, f + count - 1]));
    }
    let mut specification = scene(nodes, edges, hinges);
    specification.rest_nodes = rest;
    let edges = specification.edges.len();
    for k in count - 1..edges {
        specification.stretching[k] *= 1e6;
    }
    for k in count - 2..specification.hinges.len() {
        specification.bending[k] = specification.bending[k].map(|row| row.map(|ei| ei * 1e6));
        specification.twisting[k] *= 1e6;
    }
    if with_rail {
        hold(&mut specification, vec![count, count + 1], vec![count - 1]);
    }
    specification.fluid = Some(FluidSpecification {
        viscosity: 1.0,
        model: FluidModelSpecification::ResistiveForce { coefficients: vec![[1.0, 2.0]; edges] },
        immersed: vec![true; edges],
        twist_drag: true,
        density: 0.0,
    });
    specification
}

#[test]
fn a_soft_rod_relaxes_the_same_beside_a_held_one_a_million_times_as_stiff() {
    for tolerance in [None, Some(1e-4)] {
        let positions = [false, true].map(|with_rail| {
            let scheme = Scheme::from_name("overdamped").expect("a scheme");
            let mut simulation = Simulation::new(relaxing(with_rail), scheme, 1e-6, 1).expect("the scene is valid");
            simulation.set_tolerance(tolerance);
            (0..20).for_each(|_| simulation.step().expect("the step converges"));
            simulation.positions()[..11].to_vec()
        });
        let start = relaxing(false).nodes;
        let moved = positions[0].iter().zip(&start).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        let apart = positions[0].iter().zip(&positions[1]).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(moved > 0.0 && apart <= 1e-9 * moved, "{apart} m apart after moving by {moved} m");
    }
}
