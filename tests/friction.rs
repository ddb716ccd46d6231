//! Friction at the state that is sought: how its forces change with positions and velocities, against finite differences.

mod common;

use common::Random;
use flagrs::Vec3;
use flagrs::contact::bodies::Bodies;
use flagrs::contact::friction::{Friction, SlidingContact};
use flagrs::contact::pair::{Curvature, Pair};
use flagrs::contact::potential::{BarrierLaw, FrictionDerivative};

const DELTA: f64 = 0.05;
const XI: f64 = 0.4;

/// Two edges about `XI` apart, in range of each other: crossing at the angle inside both, or one beyond the other's end.
fn edges(random: &mut Random, angle: f64, beyond: bool) -> [Vec3; 4] {
    let gap = XI * (1.0 + 0.8 * DELTA * random.vector(1.0).x);
    let along = Vec3::new(angle.cos(), angle.sin(), 0.0);
    let start = if beyond { Vec3::x() * 0.02 } else { Vec3::x() * -0.45 };
    let x = [start, start + Vec3::x(), along * -0.6 + Vec3::z() * gap, along * 0.5 + Vec3::z() * gap];
    x.map(|node| node + random.vector(2e-3))
}

/// The largest entry of `exact - difference` over the largest of `exact`, at the best of several steps.
fn worst<const N: usize>(x: &[Vec3; 4], exact: &[[f64; N]; 12], value: impl Fn(&[Vec3; 4]) -> [f64; N]) -> f64 {
    let size = exact.iter().flatten().fold(0.0, |size: f64, entry| size.max(entry.abs()));
    let steps = (8..14).map(|exponent| 10f64.powf(-0.5 * f64::from(exponent)));
    let errors = steps.map(|step| {
        let mut worst: f64 = 0.0;
        for (k, exact) in exact.iter().enumerate() {
            let at = |by: f64| {
                let mut moved = *x;
                moved[k / 3][k % 3] += by;
                value(&moved)
            };
            let (low, high) = (at(-step), at(step));
            for i in 0..N {
                worst = worst.max(((high[i] - low[i]) / (2.0 * step) - exact[i]).abs());
            }
        }
        worst
    });
    errors.fold(f64::INFINITY, f64::min) / size
}

#[test]
fn push_and_its_places_have_exact_derivatives() {
    let mut random = Random::new(3);
    for round in 0..400 {
        let angle = [1.5, 0.7, 0.2, 0.05][round % 4];
        let x = edges(&mut random, angle, round % 3 == 0);
        let pair = Pair::of_edges(XI, DELTA, [1.0, 1.1], [[2, 1], [2, 2]]);
        let Some((push, variation)) = pair.push_with_variation(&x) else { continue };
        assert_eq!(Some(push), pair.push(&x), "{round}");
        let exact: [[f64; 5]; 12] = std::array::from_fn(|k| {
            let force = variation.force.column(k);
            [force[0], force[1], force[2], variation.places[0][k], variation.places[1][k]]
        });
        let value = |x: &[Vec3; 4]| {
            let push = pair.push(x).expect("still in range");
            [push.force.x, push.force.y, push.force.z, push.places[0], push.places[1]]
        };
        // Force and places have different units: each is compared by itself.
        let part = |keep: &[usize]| {
            let mask =
                |all: [f64; 5]| -> [f64; 5] { std::array::from_fn(|i| if keep.contains(&i) { all[i] } else { 0.0 }) };
            worst(&x, &exact.map(mask), |x| mask(value(x)))
        };
        assert!(part(&[0, 1, 2]) < 1e-5, "{round}: {}", part(&[0, 1, 2]));
        assert!(part(&[3, 4]) < 1e-5 || exact.iter().all(|e| e[3] == 0.0 && e[4] == 0.0), "{round}: {}", part(&[3, 4]));
    }
}

#[test]
fn friction_changes_with_the_positions_as_its_derivative_says() {
    let mut random = Random::new(5);
    let (friction, stiffness) = (Friction { coefficient: 0.4, smoothing_velocity: 0.3 }, 7.0);
    let pair = Pair::of_edges(XI, DELTA, [1.0, 1.1], [[2, 1], [2, 2]]);
    let contact_at = |x: &[Vec3; 4]| {
        let push = pair.push(x).expect("in range");
        let [s, t] = push.places;
        SlidingContact {
            nodes: [0, 1, 2, 3],
            weights: [1.0 - s, s, t - 1.0, -t],
            normal: push.force.normalize(),
            force: stiffness * push.force.norm(),
        }
    };
    let mut seen = 0;
    for round in 0..400 {
        let x = edges(&mut random, [1.5, 0.7, 0.2, 0.05][round % 4], round % 3 == 0);
        let Some((_, variation)) = pair.push_with_variation(&x) else { continue };
        // Sticking and sliding, with motion along the normal as well.
        let speed = if round % 2 == 0 { 0.1 } else { 2.0 };
        let velocities: [Vec3; 4] = std::array::from_fn(|_| random.vector(speed));
        let matrix = contact_at(&x).position_derivative(&friction, &velocities, &variation, stiffness);
        let exact: [[f64; 12]; 12] = std::array::from_fn(|column| std::array::from_fn(|row| matrix[(row, column)]));
        let error = worst(&x, &exact, |x| contact_at(x).gradient(&friction, &velocities).into());
        assert!(error < 1e-5, "{round}: {error}");
        seen += 1;
    }
    assert!(seen > 300, "{seen}");
}

#[test]
fn the_matrix_of_friction_is_the_derivative_of_its_forces_in_a_step() {
    // x -> (x, rate (x - x0)): the derivative of both parts together, as Newton's method needs it.
    let mut random = Random::new(7);
    let ends = [[0, 1], [2, 3]];
    let bodies = Bodies::new(4, &ends, &[0.2, 0.2], &[1.0, 1.1], &[true, true], &[], 0.0);
    let friction = Friction { coefficient: 0.4, smoothing_velocity: 0.3 };
    let law = BarrierLaw::new(bodies, DELTA, 7.0).with_friction(friction).with_slip_velocities(vec![0.1, 0.3]);
    let rate = 3.0;
    for round in 0..100 {
        let x = edges(&mut random, 0.7, false);
        let start: [Vec3; 4] = std::array::from_fn(|i| x[i] - random.vector(0.1));
        let forces = |x: &[Vec3; 4], curvature: Option<Curvature>| {
            let mut state = law.state();
            law.ensure(&mut state, x);
            law.find_sliding(&mut state, x);
            let velocities: Vec<Vec3> = (0..4).map(|i| (x[i] - start[i]) * rate).collect();
            let (mut gradient, mut matrix) = ([0.0; 12], [0.0; 144]);
            let derivative = curvature.map(|curvature| FrictionDerivative { rate, curvature });
            law.add_friction(&state, x, &velocities, derivative, |_, g, m| {
                gradient.copy_from_slice(g);
                if let Some(m) = m {
                    matrix.copy_from_slice(m);
                }
            });
            (gradient, matrix)
        };
        let (gradient, matrix) = forces(&x, Some(Curvature::Exact));
        assert!(gradient.iter().any(|g| *g != 0.0), "{round}");
        let exact: [[f64; 12]; 12] = std::array::from_fn(|j| std::array::from_fn(|i| matrix[12 * j + i]));
        let error = worst(&x, &exact, |x| forces(x, None).0);
        assert!(error < 1e-5, "{round}: {error}");
        // The other matrix is symmetric, and misses what the exact one has.
        let definite = forces(&x, Some(Curvature::Definite)).1;
        let size = definite.iter().fold(0.0, |size: f64, m| size.max(m.abs()));
        for i in 0..12 {
            for j in 0..12 {
                assert!((definite[12 * j + i] - definite[12 * i + j]).abs() <= 1e-14 * size);
            }
        }
        assert!((0..144).any(|k| (definite[k] - matrix[k]).abs() > 1e-3 * size));
    }
}

#[test]
fn the_reach_of_friction_is_the_velocity_that_it_can_turn_round_over_the_smoothing_one() {
    let mut random = Random::new(11);
    let bodies = Bodies::new(4, &[[0, 1], [2, 3]], &[0.2, 0.2], &[1.0, 1.1], &[true, true], &[], 0.0);
    let friction = Friction { coefficient: 0.4, smoothing_velocity: 0.3 };
    let law = BarrierLaw::new(bodies, DELTA, 7.0).with_friction(friction).with_slip_velocities(vec![0.1, 0.3]);
    let mobility = [0.5, 2.0, 0.0, 3.0];
    for round in 0..20 {
        let x = edges(&mut random, 0.7, false);
        let mut state = law.state();
        law.ensure(&mut state, &x);
        law.find_sliding(&mut state, &x);
        // The forces of full sliding, moving the nodes by their mobilities, change the sliding velocity by half the reach.
        let [contact] = law.forces(&state, &x)[..] else { panic!("one pair touches") };
        let fast = contact.contact.normal.cross(&Vec3::x()).normalize() * 5.0;
        let velocities: Vec<Vec3> = (0..4).map(|i| if i < 2 { fast } else { Vec3::zeros() }).collect();
        let mut moved = [Vec3::zeros(); 4];
        law.add_friction(&state, &x, &velocities, None, |_, gradient, _| {
            (0..4).for_each(|i| moved[i] = Vec3::from_column_slice(&gradient[3 * i..3 * i + 3]) * mobility[i]);
        });
        let expected = 2.0 * contact.contact.sliding(&moved).norm() / 0.3;
        let reach = law.friction_reach(&state, &mobility);
        assert!((reach - expected).abs() < 1e-12 * expected && reach > 0.0, "{round}: {reach} {expected}");
        state.widen_friction(8.0);
        assert!((law.friction_reach(&state, &mobility) - expected / 8.0).abs() < 1e-12 * expected);
    }
}
