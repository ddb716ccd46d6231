//! Contact with plane walls: energies and their derivatives, friction, and how far nodes may go.

mod common;

use common::Random;
use flagrs::Vec3;
use flagrs::contact::bodies::{Bodies, Body};
use flagrs::contact::friction::Friction;
use flagrs::contact::pair::Curvature;
use flagrs::contact::potential::{BarrierLaw, BarrierState, FrictionDerivative};
use flagrs::plane::Plane;

const DELTA: f64 = 0.05;
const RADIUS: f64 = 0.2;
const STIFFNESS: f64 = 3.0;

fn floor() -> Plane {
    Plane::new(Vec3::new(0.1, 0.0, -0.3), Vec3::new(1.0, 2.0, 5.0)).expect("a plane")
}

/// A chain of three edges, of which the last cannot touch, and a sphere at the first node; one floor, and one wall far away.
fn law() -> BarrierLaw {
    let far = Plane::new(Vec3::z() * 100.0, -Vec3::z()).expect("a plane");
    let edges = [[0, 1], [1, 2], [2, 3]];
    let bodies = Bodies::new(4, &edges, &[RADIUS; 3], &[1.0, 1.2, 1.0], &[true, true, false], &[(0, 0.5)], 2.0);
    let friction = Friction { coefficient: 0.4, smoothing_velocity: 0.7 };
    BarrierLaw::new(bodies.with_walls(vec![floor(), far]), DELTA, STIFFNESS).with_friction(friction)
}

/// Nodes in range of the floor: the sphere's and two ends; the last one is deep behind it, which nothing minds.
fn near(random: &mut Random) -> Vec<Vec3> {
    let plane = floor();
    let heights = [0.5, RADIUS, RADIUS, -3.0].map(|radius| radius * (1.0 + 0.8 * DELTA * random.vector(1.0).x));
    let along = plane.normal().cross(&Vec3::x()).normalize();
    let at = |(k, height): (usize, &f64)| plane.point() + along * (1.3 * k as f64) + plane.normal() * *height;
    heights.iter().enumerate().map(at).collect()
}

fn ready(law: &BarrierLaw, nodes: &[Vec3]) -> BarrierState {
    let mut state = law.state();
    law.ensure(&mut state, nodes);
    law.find_sliding(&mut state, nodes);
    state
}

/// The gradient of the energy, or of friction at these velocities, on all coordinates of all nodes.
fn gradient(law: &BarrierLaw, nodes: &[Vec3], velocities: Option<&[Vec3]>) -> Vec<f64> {
    let state = ready(law, nodes);
    let mut out = vec![0.0; 3 * nodes.len()];
    let mut add = |element: usize, gradient: &[f64], _: Option<&[f64]>| {
        for (&node, part) in state.stencil(element).iter().zip(gradient.chunks_exact(3)) {
            (0..3).for_each(|c| out[3 * node + c] += part[c]);
        }
    };
    match velocities {
        None => law.add(&state, nodes, None, &mut add),
        Some(velocities) => law.add_friction(&state, nodes, velocities, None, &mut add),
    }
    out
}

fn moved(nodes: &[Vec3], coordinate: usize, by: f64) -> Vec<Vec3> {
    let mut nodes = nodes.to_vec();
    nodes[coordinate / 3][coordinate % 3] += by;
    nodes
}

#[test]
fn the_gradient_is_that_of_the_energy() {
    let (law, mut random) = (law(), Random::new(1));
    for _ in 0..50 {
        let nodes = near(&mut random);
        let exact = gradient(&law, &nodes, None);
        let size = exact.iter().fold(0.0, |size: f64, entry| size.max(entry.abs()));
        assert!(size > 0.0);
        for k in 0..12 {
            let step = 1e-7;
            let energy = |by: f64| {
                let nodes = moved(&nodes, k, by);
                law.energy(&ready(&law, &nodes), &nodes)
            };
            let difference = (energy(step) - energy(-step)) / (2.0 * step);
            assert!((difference - exact[k]).abs() < 1e-5 * size, "{k}: {difference} {}", exact[k]);
        }
    }
}

#[test]
fn second_derivatives_with_friction_are_those_of_the_gradients() {
    let (law, mut random) = (law(), Random::new(2));
    for _ in 0..50 {
        let nodes = near(&mut random);
        let velocities: Vec<Vec3> = nodes.iter().map(|_| random.vector(1.0)).collect();
        let state = ready(&law, &nodes);
        let mut exact = vec![vec![0.0; 12]; 12];
        let mut add = |element: usize, _: &[f64], matrix: Option<&[f64]>| {
            let stencil = state.stencil(element);
            let width = 3 * stencil.len();
            let dof = |local: usize| 3 * stencil[local / 3] + local % 3;
            let matrix = matrix.expect("a matrix was asked for");
            for column in 0..width {
                for row in 0..width {
                    exact[dof(column)][dof(row)] += matrix[row + width * column];
                }
            }
        };
        law.add(&state, &nodes, Some(Curvature::Exact), &mut add);
        let rate = 11.0;
        let derivative = FrictionDerivative { rate, curvature: Curvature::Exact };
        law.add_friction(&state, &nodes, &velocities, Some(derivative), &mut add);
        let size = exact.iter().flatten().fold(0.0, |size: f64, entry| size.max(entry.abs()));
        for k in 0..12 {
            let step = 1e-7;
            let total = |by: f64| {
                // Velocities follow positions at the rate.
                let (nodes, velocities) = (moved(&nodes, k, by), moved(&velocities, k, rate * by));
                let friction = gradient(&law, &nodes, Some(&velocities));
                gradient(&law, &nodes, None).into_iter().zip(friction).map(|(a, b)| a + b).collect::<Vec<f64>>()
            };
            let (high, low) = (total(step), total(-step));
            for row in 0..12 {
                let difference = (high[row] - low[row]) / (2.0 * step);
                assert!((difference - exact[k][row]).abs() < 1e-4 * size, "{row}, {k}: {difference} {}", exact[k][row]);
            }
        }
    }
}

#[test]
fn friction_opposes_sliding_and_is_at_most_its_coefficient_times_the_push() {
    let (law, mut random) = (law(), Random::new(3));
    for _ in 0..50 {
        let nodes = near(&mut random);
        let velocities: Vec<Vec3> = nodes.iter().map(|_| random.vector(5.0)).collect();
        let (push, friction) = (gradient(&law, &nodes, None), gradient(&law, &nodes, Some(&velocities)));
        let n = *floor().normal();
        for node in 0..3 {
            let of = |values: &[f64]| Vec3::from_column_slice(&values[3 * node..3 * node + 3]);
            let (push, friction) = (of(&push), of(&friction));
            let sliding = velocities[node] - n * n.dot(&velocities[node]);
            assert!(push.dot(&n) <= 0.0 && push.cross(&n).norm() < 1e-12 * push.norm());
            assert!(friction.dot(&velocities[node]) >= 0.0 && friction.dot(&n).abs() < 1e-12 * push.norm());
            let most = 0.4 * push.norm();
            assert!(friction.norm() <= most * (1.0 + 1e-12));
            if sliding.norm() > 0.7 {
                assert!((friction.norm() - most).abs() < 1e-12 * most);
            }
        }
    }
}

#[test]
fn the_force_per_length_of_a_rod_that_lies_on_a_wall_does_not_depend_on_the_mesh() {
    let totals = [1, 3, 10].map(|count: usize| {
        let edges: Vec<[usize; 2]> = (0..count).map(|k| [k, k + 1]).collect();
        let length = 2.0 / count as f64;
        let at = |k: usize| Vec3::x() * (length * k as f64) + Vec3::z() * RADIUS;
        let nodes: Vec<Vec3> = (0..=count).map(at).collect();
        let bodies =
            Bodies::new(count + 1, &edges, &vec![RADIUS; count], &vec![length; count], &vec![true; count], &[], 2.0);
        let plane = Plane::new(Vec3::zeros(), Vec3::z()).expect("a plane");
        let law = BarrierLaw::new(bodies.with_walls(vec![plane]), DELTA, STIFFNESS);
        gradient(&law, &nodes, None).chunks_exact(3).map(|force| -force[2]).sum::<f64>()
    });
    assert!(totals[0] > 0.0);
    assert!(totals.iter().all(|total| (total / totals[0] - 1.0).abs() < 1e-12), "{totals:?}");
}

#[test]
fn no_node_is_let_past_its_least_height() {
    let (law, mut random) = (law(), Random::new(4));
    let plane = floor();
    let least = [0.5 * (1.0 - DELTA), RADIUS * (1.0 - DELTA), RADIUS * (1.0 - DELTA)];
    let mut cut = 0;
    for _ in 0..200 {
        let from = near(&mut random);
        let to: Vec<Vec3> = from.iter().map(|node| node + random.vector(1.0)).collect();
        let mut state = ready(&law, &from);
        let limit = law.step_limit(&mut state, &from, &to);
        assert!((0.0..=1.0).contains(&limit));
        for node in 0..3 {
            let at = from[node] + (to[node] - from[node]) * limit;
            let (gap, first) = (plane.height(&at) - least[node], plane.height(&from[node]) - least[node]);
            assert!(gap >= 0.0999 * first, "{node}: {gap} of {first}");
        }
        cut += usize::from(limit < 1.0);
    }
    assert!(cut > 50, "only {cut} ways were cut");
}

#[test]
fn the_nearest_wall_is_among_the_gaps_and_an_overlap_with_it_is_found() {
    let (law, mut random) = (law(), Random::new(5));
    let nodes = near(&mut random);
    let mut state = ready(&law, &nodes);
    let closest = law.smallest_gap(&mut state, &nodes).expect("walls may touch");
    assert!(matches!(closest.bodies, [_, Body::Wall(0)]), "{closest:?}");
    assert_eq!(law.first_overlap(&nodes), None);
    let sunk: Vec<Vec3> = nodes.iter().map(|node| node - floor().normal() * 0.1).collect();
    let overlap = law.first_overlap(&sunk).expect("an overlap");
    assert!(matches!(overlap.bodies[1], Body::Wall(0)) && overlap.gap() < 0.0, "{overlap:?}");
    assert_eq!(law.bodies().index(Body::Wall(1)), law.bodies().count() - 1);
    assert!(law.forces(&state, &nodes).iter().all(|contact| contact.force.dot(floor().normal()) > 0.0));
}
