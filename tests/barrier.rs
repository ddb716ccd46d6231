//! Barrier contact: derivatives, invariances, independence of the mesh, candidates, continuous detection and friction.

mod common;

use std::f64::consts::FRAC_PI_2;

use common::Random;
use flagrs::Vec3;
use flagrs::contact::barrier::Barrier;
use flagrs::contact::bodies::{Bodies, Body};
use flagrs::contact::broad_phase::{BroadPhase, Search};
use flagrs::contact::candidates::Candidates;
use flagrs::contact::continuous::safe_part;
use flagrs::contact::distance::segment_distance;
use flagrs::contact::exclusion::Exclusion;
use flagrs::contact::friction::{Friction, SlidingContact};
use flagrs::contact::pair::{Curvature, Pair};
use flagrs::contact::potential::{BarrierLaw, BarrierState, FrictionDerivative};

const DELTA: f64 = 0.05;
/// Sum of the radii of the pairs below, in units of their rest lengths of about 1.
const XI: f64 = 0.4;

/// From a right angle to nearly parallel, rad.
const ANGLES: [f64; 8] = [FRAC_PI_2, 0.7, 0.1, 0.03, 1e-2, 1e-3, 1e-4, 1e-6];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Features {
    Lines,
    EndOfA,
    EndOfB,
    Ends,
}

const FEATURES: [Features; 4] = [Features::Lines, Features::EndOfA, Features::EndOfB, Features::Ends];

fn unit(random: &mut Random) -> Vec3 {
    loop {
        let v = random.vector(1.0);
        if v.norm() > 0.2 {
            return v.normalize();
        }
    }
}

fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * 0.5 * (random.uniform() + 1.0)
}

/// A pair whose closest points are of a given kind, at a given angle, somewhere in the range of the barrier.
fn pair_at(random: &mut Random, features: Features, angle: f64) -> [Vec3; 4] {
    let along = unit(random);
    let side = along.cross(&unit(random)).normalize();
    let normal = along.cross(&side);
    let distance = XI * (1.0 + DELTA * between(random, -0.95, 0.95));
    let (a, b) = (between(random, 0.8, 1.2), between(random, 0.8, 1.2));
    let (s, t) = (between(random, 0.1, 0.9), between(random, 0.1, 0.9));
    // A leaves the plane of closest approach by `angle` where one of its ends is closest.
    let in_plane = along * angle.cos() + side * angle.sin();
    let out_of_plane = along * angle.cos() + (normal * 0.6 + side * 0.8) * angle.sin();
    match features {
        Features::Lines => {
            let (p, q) = (normal * distance, Vec3::zeros());
            [p - in_plane * (s * a), p + in_plane * ((1.0 - s) * a), q - along * (t * b), q + along * ((1.0 - t) * b)]
        }
        Features::EndOfA => {
            let p = normal * distance;
            [p, p + out_of_plane * a, -along * (t * b), along * ((1.0 - t) * b)]
        }
        Features::EndOfB => {
            let [b0, b1, a0, a1] = pair_at(random, Features::EndOfA, angle);
            [a0, a1, b0, b1]
        }
        Features::Ends => {
            // The gap leans along both segments, which lead away from each other.
            let p = (normal * 0.7 + along * 0.6 + side * 0.387).normalize() * distance;
            [p, p + in_plane * a, Vec3::zeros(), -along * b]
        }
    }
}

fn some_pair(random: &mut Random) -> Pair {
    let meeting = [1, 2, 3];
    let mut pick = || meeting[(between(random, 0.0, 3.0) as usize).min(2)];
    let meeting = [[pick(), pick()], [pick(), pick()]];
    Pair::of_edges(XI, DELTA, [1.0, 1.1], meeting)
}

/// The derivative of a function of the four nodes by the central difference of fourth order whose step agrees best.
///
/// The best step depends on angle and gap; a wrong derivative agrees with none.
fn worst_difference<const N: usize>(
    x: &[Vec3; 4],
    exact: impl Fn(usize) -> [f64; N],
    value: impl Fn(&[Vec3; 4]) -> [f64; N],
) -> f64 {
    let size = (0..12).flat_map(&exact).fold(0.0, |size: f64, entry| size.max(entry.abs()));
    let mut best = f64::INFINITY;
    for exponent in 6..22 {
        let step = 10f64.powf(-0.5 * exponent as f64);
        let at = |coordinate: usize, by: f64| {
            let mut moved = *x;
            moved[coordinate / 3][coordinate % 3] += by;
            value(&moved)
        };
        let mut worst: f64 = 0.0;
        for coordinate in 0..12 {
            let [m2, m1, p1, p2] = [-2.0, -1.0, 1.0, 2.0].map(|k| at(coordinate, k * step));
            let exact = exact(coordinate);
            for k in 0..N {
                let difference = (8.0 * (p1[k] - m1[k]) - (p2[k] - m2[k])) / (12.0 * step);
                let error = (difference - exact[k]).abs();
                worst = if error.is_nan() { f64::INFINITY } else { worst.max(error) };
            }
        }
        best = best.min(worst / size);
    }
    best
}

#[test]
fn barrier_derivatives_agree_with_differences_and_keep_their_digits() {
    let barrier = Barrier::new(XI, DELTA);
    for part in [0.01, 0.1, 0.5, 0.9, 0.99] {
        let distance = barrier.least() + part * (barrier.most() - barrier.least());
        let at = barrier.at(distance);
        let step = 1e-4 * part * (1.0 - part) * (barrier.most() - barrier.least());
        let [m2, m1, p1, p2] = [-2.0, -1.0, 1.0, 2.0].map(|k| barrier.at(distance + k * step));
        let slope = (8.0 * (p1.value - m1.value) - (p2.value - m2.value)) / (12.0 * step);
        let curvature = (8.0 * (p1.slope - m1.slope) - (p2.slope - m2.slope)) / (12.0 * step);
        assert!((slope / at.slope - 1.0).abs() < 1e-9, "{part}: {slope} {}", at.slope);
        assert!((curvature / at.curvature - 1.0).abs() < 1e-9, "{part}: {curvature} {}", at.curvature);
    }
    // Near the end of the range b = e^3 / d to leading order; the textbook form has no digits left there.
    let barrier = Barrier::new(1.0, 0.5);
    let room = 2f64.powi(-40);
    let at = barrier.at(1.5 - room);
    for (value, leading) in [(at.value, room.powi(3)), (-at.slope, 3.0 * room * room), (at.curvature, 6.0 * room)] {
        assert!((value / leading - 1.0).abs() < 4.0 * room, "{value} {leading}");
    }
    assert_eq!(barrier.at(1.5).value, 0.0);
    assert_eq!(barrier.at(0.5).value, f64::INFINITY);
}

#[test]
fn pair_derivatives_agree_with_differences() {
    // Reached: gradient 1.3e-8, Hessian 1.2e-7 (1e-4 rad; elsewhere below 1e-7), limited by the differences.
    let mut random = Random::new(3);
    for features in FEATURES {
        for angle in ANGLES {
            for _ in 0..40 {
                let x = pair_at(&mut random, features, angle);
                let pair = some_pair(&mut random);
                let at = pair.evaluate(&x, Some(Curvature::Exact)).expect("in range");
                assert_eq!(at.energy, pair.energy(&x));
                assert!((at.hessian - at.hessian.transpose()).amax() <= 1e-14 * at.hessian.amax());
                let gradient = worst_difference(&x, |i| [at.gradient[i]], |x| [pair.energy(x)]);
                assert!(gradient < 1e-6, "{features:?} {angle}: {gradient}");
                let hessian = worst_difference(
                    &x,
                    |i| -> [f64; 12] { std::array::from_fn(|j| at.hessian[(i, j)]) },
                    |x| pair.evaluate(x, None).map_or([0.0; 12], |at| at.gradient.into()),
                );
                assert!(hessian < 1e-6, "{features:?} {angle}: {hessian}");
            }
        }
    }
}

#[test]
fn definite_matrix_is_the_exact_one_without_its_negative_part() {
    let mut random = Random::new(4);
    let mut indefinite = 0;
    for features in FEATURES {
        for angle in ANGLES {
            for _ in 0..20 {
                let x = pair_at(&mut random, features, angle);
                let pair = some_pair(&mut random);
                let [exact, definite] = [Curvature::Exact, Curvature::Definite]
                    .map(|curvature| pair.evaluate(&x, Some(curvature)).expect("in range").hessian);
                let size = exact.symmetric_eigenvalues().amax();
                assert!(definite.symmetric_eigenvalues().min() >= -1e-12 * size);
                let dropped = (definite - exact).symmetric_eigenvalues();
                assert!(dropped.min() >= -1e-12 * size);
                assert!((definite * (definite - exact)).amax() <= 1e-12 * size * size, "positive part changed");
                indefinite += usize::from(dropped.max() > 1e-6 * size);
            }
        }
    }
    assert!(indefinite > 300, "{indefinite}");
}

#[test]
fn energy_does_not_depend_on_the_unit() {
    let mut random = Random::new(5);
    for features in FEATURES {
        for angle in ANGLES {
            for _ in 0..20 {
                let x = pair_at(&mut random, features, angle);
                let here = Pair::of_edges(XI, DELTA, [1.0, 1.1], [[2, 1], [2, 2]]);
                let expected = here.evaluate(&x, Some(Curvature::Exact)).expect("in range");
                // From a millionth to a million, by powers of two, which are exact.
                for unit in [2f64.powi(-20), 2f64.powi(-10), 2f64.powi(20)] {
                    let there = Pair::of_edges(XI * unit, DELTA, [unit, 1.1 * unit], [[2, 1], [2, 2]]);
                    let at = there.evaluate(&x.map(|x| x * unit), Some(Curvature::Exact)).expect("in range");
                    assert_eq!(at.energy, expected.energy * unit.powi(3));
                    assert_eq!(at.gradient, expected.gradient * unit.powi(2));
                    assert_eq!(at.hessian, expected.hessian * unit);
                }
            }
        }
    }
}

#[test]
fn forces_have_neither_resultant_nor_torque() {
    let mut random = Random::new(6);
    for features in FEATURES {
        for angle in ANGLES {
            for _ in 0..50 {
                let x = pair_at(&mut random, features, angle);
                let at = some_pair(&mut random).evaluate(&x, None).expect("in range");
                let part = |node: usize| at.gradient.fixed_rows::<3>(3 * node).into_owned();
                let resultant: Vec3 = (0..4).map(part).sum();
                let torque: Vec3 = (0..4).map(|node| x[node].cross(&part(node))).sum();
                let size = at.gradient.norm();
                assert!(resultant.norm() < 1e-12 * size && torque.norm() < 1e-12 * size, "{features:?} {angle}");
            }
        }
    }
}

/// A straight rod of `count` edges.
fn rod(centre: Vec3, direction: Vec3, length: f64, count: usize) -> Vec<Vec3> {
    (0..=count).map(|k| centre + direction * (length * (k as f64 / count as f64 - 0.5))).collect()
}

/// Edges of several chains one after the other, and their lengths.
fn edges_of(rods: &[Vec<Vec3>]) -> (Vec<[usize; 2]>, Vec<f64>) {
    let (mut edges, mut lengths, mut start) = (Vec::new(), Vec::new(), 0);
    for rod in rods {
        edges.extend((1..rod.len()).map(|k| [start + k - 1, start + k]));
        lengths.extend(rod.windows(2).map(|ends| (ends[1] - ends[0]).norm()));
        start += rod.len();
    }
    (edges, lengths)
}

/// Rods of radius `XI / 2` as one scene.
fn scene_of(rods: &[Vec<Vec3>]) -> (Vec<Vec3>, BarrierLaw, BarrierState) {
    let nodes = rods.concat();
    let (edges, lengths) = edges_of(rods);
    let (radius, colliding) = (vec![0.5 * XI; edges.len()], vec![true; edges.len()]);
    let bodies = Bodies::new(nodes.len(), &edges, &radius, &lengths, &colliding, &[], FRAC_PI_2);
    let law = BarrierLaw::new(bodies, DELTA, 1.0);
    let mut state = law.state();
    law.ensure(&mut state, &nodes);
    (nodes, law, state)
}

fn gradient_of(law: &BarrierLaw, state: &BarrierState, nodes: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); nodes.len()];
    let stencils: Vec<_> = state.stencils().collect();
    law.add(state, nodes, None, |element, gradient, _| {
        for (k, &node) in stencils[element].iter().enumerate() {
            out[node] += Vec3::from_column_slice(&gradient[3 * k..3 * k + 3]);
        }
    });
    out
}

/// Force along z between two rods, the first one above.
fn force_between(upper: Vec<Vec3>, lower: Vec<Vec3>) -> f64 {
    let count = upper.len();
    let (nodes, law, state) = scene_of(&[upper, lower]);
    -gradient_of(&law, &state, &nodes)[..count].iter().map(|part| part.z).sum::<f64>()
}

/// Force of the barrier along two straight rods of length `length` whose centres cross, by integration.
fn integrated_force(distance: f64, angle: f64, length: f64) -> f64 {
    let barrier = Barrier::new(XI, DELTA);
    let in_range = (barrier.most().powi(2) - distance * distance).sqrt();
    let half = in_range.min(0.5 * length * angle.sin());
    if half == 0.0 {
        return -barrier.at(distance).slope * length;
    }
    let count = 2000;
    let at = |k: usize| {
        let across = half * (2.0 * (k as f64 + 0.5) / count as f64 - 1.0);
        let away = distance.hypot(across);
        -barrier.at(away).slope * distance / away
    };
    (0..count).map(at).sum::<f64>() * 2.0 * half / (count as f64 * angle.sin())
}

#[test]
fn parallel_rods_push_with_the_same_force_on_any_mesh() {
    let length = 24.0;
    for gap in [0.96, 1.0, 1.04] {
        let expected = -Barrier::new(XI, DELTA).at(gap * XI).slope * length;
        for count in [6, 12, 24, 60, 120] {
            let upper = rod(Vec3::z() * (gap * XI), Vec3::x(), length, count);
            // Nodes opposite each other, nodes anywhere, very unequal meshes.
            for other in [count, count + 1, count + count / 3, 10] {
                let force = force_between(upper.clone(), rod(Vec3::zeros(), Vec3::x(), length, other));
                assert!(
                    (force / expected - 1.0).abs() < 1e-10,
                    "gap {gap}, {count} against {other}: {}",
                    force / expected
                );
            }
            // Shifted along each other by a part of an edge: only the ends tell.
            let edge = length / count as f64;
            let overlap = 1.0 - 0.4 * edge / length;
            let force = force_between(upper, rod(Vec3::x() * (0.4 * edge), Vec3::x(), length, count));
            let error = (force / expected - overlap).abs();
            assert!(error <= 0.5 * edge / length, "gap {gap}, {count} edges shifted: {error}");
        }
    }
}

#[test]
fn nearly_parallel_rods_push_with_the_integrated_force_on_any_mesh() {
    let length = 24.0;
    for angle in [1e-6f64, 1e-5, 1e-4, 1e-3, 1e-2] {
        let expected = integrated_force(XI, angle, length);
        for count in [15, 30, 60, 240] {
            let lower = rod(Vec3::zeros(), Vec3::new(angle.cos(), angle.sin(), 0.0), length, count + 7);
            let force = force_between(rod(Vec3::z() * XI, Vec3::x(), length, count), lower);
            assert!((force / expected - 1.0).abs() < 0.01, "{angle}, {count} edges: {}", force / expected);
        }
    }
}

#[test]
fn crossing_rods_push_alike_on_any_mesh_wherever_their_nodes_are() {
    for angle in [0.03f64, 0.1, 0.3, 1.0, FRAC_PI_2] {
        let length = 24.0;
        let expected = integrated_force(XI, angle, length);
        let along = Vec3::new(angle.cos(), angle.sin(), 0.0);
        for count in [15, 30, 60, 120, 240] {
            let edge = length / count as f64;
            let force = |slide: f64| {
                let lower = rod(along * (slide * edge), along, length, count);
                force_between(rod(Vec3::z() * XI, Vec3::x(), length, count), lower)
            };
            for slide in [0.0, 0.2, 0.5, 0.7] {
                let ratio = force(slide) / expected;
                assert!((ratio - 1.0).abs() < 0.06, "{angle}, {count} edges, {slide}: {ratio}");
            }
        }
    }
}

#[test]
fn sum_of_pair_forces_is_the_force() {
    // Pairs that pull, where many pairs share one crossing, stay a few percent: friction may take every pair by itself.
    for angle in [1e-3f64, 0.03, 0.1, 0.3, 1.0, FRAC_PI_2] {
        for count in [15, 30, 60, 120, 240] {
            let lower = rod(Vec3::zeros(), Vec3::new(angle.cos(), angle.sin(), 0.0), 24.0, count);
            let upper = rod(Vec3::new(0.07, 0.0, XI), Vec3::x(), 24.0, count);
            let force = force_between(upper.clone(), lower.clone());
            let (nodes, law, state) = scene_of(&[upper, lower]);
            let sum: f64 = law.forces(&state, &nodes).iter().map(|force| force.contact.force).sum();
            assert!((sum / force - 1.0).abs() < 0.05, "{angle} {count}: {}", sum / force);
        }
    }
}

/// Greatest change of energy and of its gradient between neighbouring ones of `samples + 1` states of a motion, with the greatest
/// energy and gradient met.
fn greatest_change(rods: impl Fn(f64) -> Vec<Vec<Vec3>>, samples: usize) -> [f64; 2] {
    // Rest lengths are those of the start, as for a real rod.
    let (_, law, mut state) = scene_of(&rods(0.0));
    let (mut changes, mut sizes) = ([0.0f64; 2], [0.0f64; 2]);
    let mut last: Option<(f64, Vec<Vec3>)> = None;
    for k in 0..=samples {
        let nodes = rods(k as f64 / samples as f64).concat();
        law.ensure(&mut state, &nodes);
        let now = (law.energy(&state, &nodes), gradient_of(&law, &state, &nodes));
        sizes = [sizes[0].max(now.0), now.1.iter().map(|part| part.norm()).fold(sizes[1], f64::max)];
        if let Some(last) = last {
            let turn = now.1.iter().zip(&last.1).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            changes = [changes[0].max((now.0 - last.0).abs()), changes[1].max(turn)];
        }
        last = Some(now);
    }
    assert!(sizes.iter().all(|size| *size > 0.0 && size.is_finite()), "{sizes:?}");
    [changes[0] / sizes[0], changes[1] / sizes[1]]
}

#[test]
fn energy_and_force_are_continuous_across_features_and_nodes() {
    // A bent rod of 5 edges and a straight one.
    let bent = |shift: Vec3| -> Vec<Vec3> {
        let arc = |k: usize| Vec3::new(k as f64, 0.06 * (k as f64 - 2.0).powi(2), 0.0004 * (k as f64 - 2.0).powi(3));
        (0..6).map(|k| arc(k) + shift).collect()
    };
    let at_angle = |angle: f64, centre: Vec3| rod(centre, Vec3::new(angle.cos(), angle.sin(), 0.0), 3.0, 3);
    type Motion = Box<dyn Fn(f64) -> Vec<Vec<Vec3>>>;
    let motions: [(&str, Motion); 4] = [
        (
            "slides across",
            Box::new(move |t| vec![bent(Vec3::zeros()), at_angle(1.2, Vec3::new(0.2 + 4.0 * t, 0.2, -XI))]),
        ),
        (
            "slides along",
            Box::new(move |t| vec![bent(Vec3::zeros()), at_angle(0.02, Vec3::new(-1.0 + 7.0 * t, 0.0, -XI))]),
        ),
        (
            "turns through parallel",
            Box::new(move |t| vec![rod(Vec3::zeros(), Vec3::x(), 4.0, 4), at_angle(t - 0.5, Vec3::new(0.3, 0.01, XI))]),
        ),
        (
            "passes end by end",
            Box::new(move |t| {
                vec![
                    rod(Vec3::zeros(), Vec3::x(), 4.0, 4),
                    rod(Vec3::new(3.44 + 0.3 * t, 0.3 * t - 0.2, 0.45), Vec3::new(0.9, 0.2, 0.3).normalize(), 3.0, 3),
                ]
            }),
        ),
    ];
    for (name, rods) in &motions {
        let coarse = greatest_change(rods, 4000);
        let fine = greatest_change(rods, 32_000);
        for (coarse, fine, what) in [(coarse[0], fine[0], "energy"), (coarse[1], fine[1], "force")] {
            // Eight times the samples make every change an eighth; a jump would stay.
            assert!(fine < 0.16 * coarse, "{name}: {what} changes by {coarse:e} and {fine:e}");
        }
    }
}

/// A fork of three arms, a chain that comes back on it, and two spheres, one on the end of the chain.
fn fork_with_spheres() -> (Vec<Vec3>, BarrierLaw) {
    let mut nodes = vec![Vec3::zeros()];
    let mut edges = Vec::new();
    for direction in [Vec3::new(1.0, 0.0, 0.002), Vec3::new(-0.5, 0.85, 0.0), Vec3::new(-0.5, -0.85, 0.0)] {
        for k in 1..=3 {
            edges.push([if k == 1 { 0 } else { nodes.len() - 1 }, nodes.len()]);
            nodes.push(direction * k as f64);
        }
    }
    let start = nodes.len();
    for k in 0..5 {
        nodes.push(Vec3::new(-0.45 + 0.9 * k as f64, 0.1 - 0.07 * k as f64, 0.99 * XI));
        if k > 0 {
            edges.push([start + k - 1, start + k]);
        }
    }
    // The first sphere touches an arm, the second one the first.
    let head = nodes.len();
    nodes.push(Vec3::new(1.7, 0.0, -0.71));
    nodes.push(Vec3::new(1.7, 0.9, -0.71));
    let lengths: Vec<f64> = edges.iter().map(|&[i, j]: &[usize; 2]| (nodes[j] - nodes[i]).norm()).collect();
    let radius = vec![0.5 * XI; edges.len()];
    let colliding = vec![true; edges.len()];
    let spheres = [(head, 0.54), (head + 1, 0.35)];
    let bodies = Bodies::new(nodes.len(), &edges, &radius, &lengths, &colliding, &spheres, FRAC_PI_2);
    (nodes, BarrierLaw::new(bodies, DELTA, 7.0))
}

#[test]
fn assembled_derivatives_agree_with_differences() {
    let (nodes, law) = fork_with_spheres();
    let mut state = law.state();
    assert!(law.ensure(&mut state, &nodes) && law.first_overlap(&nodes).is_none());
    let widths: Vec<usize> = state.stencils().map(<[usize]>::len).collect();
    assert!([2, 3, 4].iter().all(|width| widths.contains(width)));
    let mut touching = [false; 5];
    law.add(&state, &nodes, None, |element, _, _| touching[widths[element]] = true);
    assert!(touching[2] && touching[3] && touching[4], "an edge pair, a sphere and an edge, two spheres: {touching:?}");

    let size = 3 * nodes.len();
    let stencils: Vec<Vec<usize>> = state.stencils().map(<[usize]>::to_vec).collect();
    let mut matrix = vec![vec![0.0; size]; size];
    law.add(&state, &nodes, Some(Curvature::Exact), |element, gradient, block| {
        let (stencil, block, width) = (&stencils[element], block.expect("asked for"), gradient.len());
        for i in 0..width {
            for j in 0..width {
                matrix[3 * stencil[i / 3] + i % 3][3 * stencil[j / 3] + j % 3] += block[j * width + i];
            }
        }
    });
    let gradient = gradient_of(&law, &state, &nodes);
    let largest = gradient.iter().map(|part| part.norm()).fold(0.0, f64::max);
    let stiffest = matrix.iter().flatten().fold(0.0, |most: f64, entry| most.max(entry.abs()));
    let step = 1e-6;
    for i in 0..size {
        let moved = |by: f64| {
            let mut nodes = nodes.clone();
            nodes[i / 3][i % 3] += by;
            nodes
        };
        let difference = (law.energy(&state, &moved(step)) - law.energy(&state, &moved(-step))) / (2.0 * step);
        assert!((difference - gradient[i / 3][i % 3]).abs() < 1e-7 * largest, "{i}");
        let (after, before) = (gradient_of(&law, &state, &moved(step)), gradient_of(&law, &state, &moved(-step)));
        for j in 0..size {
            let difference = (after[j / 3][j % 3] - before[j / 3][j % 3]) / (2.0 * step);
            assert!((difference - matrix[i][j]).abs() < 1e-6 * stiffest, "{i} {j}: {difference} {}", matrix[i][j]);
        }
    }
}

/// Tangled random chains in a box.
fn tangle(random: &mut Random, chains: usize, count: usize) -> Vec<Vec<Vec3>> {
    let mut chain = || {
        let mut nodes = vec![random.vector(2.0)];
        for _ in 0..count {
            let step = unit(random) * 0.7;
            nodes.push(nodes[nodes.len() - 1] + step);
        }
        nodes
    };
    (0..chains).map(|_| chain()).collect()
}

#[test]
fn candidates_are_those_of_brute_force_and_stay_until_half_the_skin_is_used() {
    let mut random = Random::new(8);
    let mut kept = 0;
    for round in 0..30 {
        let rods = tangle(&mut random, 4, 9);
        let mut nodes = rods.concat();
        let (edges, lengths) = edges_of(&rods);
        let radius: Vec<f64> = (0..edges.len()).map(|_| between(&mut random, 0.05, 0.15)).collect();
        let colliding: Vec<bool> = (0..edges.len()).map(|_| random.uniform() > -0.8).collect();
        let bodies = Bodies::new(nodes.len(), &edges, &radius, &lengths, &colliding, &[(3, 0.4), (17, 0.3)], FRAC_PI_2);
        let near = |nodes: &[Vec3], reach: f64| -> Vec<[usize; 2]> {
            let count = bodies.radius().len();
            let all = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
            all.filter(|&[a, b]| {
                let x = bodies.corners([a, b], nodes);
                let range = (1.0 + DELTA) * (bodies.radius()[a] + bodies.radius()[b]) + reach;
                bodies.may_touch(a, b) && segment_distance(&x[0], &x[1], &x[2], &x[3]).distance < range
            })
            .collect()
        };
        let skin = 0.2;
        let search = if round % 2 == 0 { Search::Tree } else { Search::BruteForce };
        let mut candidates = Candidates::new(&bodies, DELTA, skin).with_search(search);
        for _ in 0..20 {
            let before = candidates.pairs().to_vec();
            let anchor = candidates.anchor().to_vec();
            let changed = candidates.ensure(&bodies, &nodes);
            assert_eq!(changed, before != candidates.pairs());
            if candidates.anchor() != anchor {
                assert_eq!(candidates.pairs(), near(&nodes, skin));
            } else {
                kept += 1;
                assert!(!changed);
                assert!(near(&nodes, 0.0).iter().all(|pair| candidates.pairs().contains(pair)));
            }
            for node in &mut nodes {
                *node += random.vector(0.02);
            }
        }
    }
    assert!(kept > 100, "{kept}");
}

#[test]
fn list_is_made_anew_before_rods_that_approach_each_other_are_in_range() {
    let range = (1.0 + DELTA) * XI;
    let skin = 0.1;
    let at = |upper: f64, middle: f64, lower: f64| {
        let across = |height: f64| rod(Vec3::z() * height, Vec3::y(), 4.0, 2);
        [across(upper), rod(Vec3::z() * middle, Vec3::x(), 4.0, 2), across(lower)].concat()
    };
    let start = at(range + 0.9 * skin, 0.0, -range - 1.1 * skin);
    let rods: Vec<Vec<Vec3>> = start.chunks(3).map(<[Vec3]>::to_vec).collect();
    let (_, law, _) = scene_of(&rods);
    let law = law.with_skin(skin);
    let mut state = law.state();
    assert!(law.ensure(&mut state, &start));
    assert_eq!(state.stencils().count(), 4, "the upper rod and the middle one");

    // The rod outside the list is the closest one while the list still serves.
    let approached = at(range + 1.35 * skin, 0.0, -range - 0.65 * skin);
    assert!(!law.ensure(&mut state, &approached));
    let closest = law.smallest_gap(&mut state, &approached).expect("rods may touch");
    assert!((closest.distance - range - 0.65 * skin).abs() < 1e-14);

    // Both move, by little more than half the skin each: in range.
    let met = at(range + 0.9 * skin, -0.6 * skin, -range - 0.55 * skin);
    assert!(law.ensure(&mut state, &met));
    assert!(law.energy(&state, &met) > 0.0);
}

#[test]
fn fast_crossing_pairs_never_meet() {
    let mut random = Random::new(9);
    let mut stopped = 0;
    for _ in 0..10_000 {
        let thickness = 10f64.powf(between(&mut random, -2.0, -0.3));
        let least = (1.0 - DELTA) * thickness;
        let from: [Vec3; 4] = loop {
            let x = std::array::from_fn(|_| random.vector(1.0));
            if segment_distance(&x[0], &x[1], &x[2], &x[3]).distance > least {
                break x;
            }
        };
        // From a hundredth of the segments to a thousand times their length in one step, rigid or not.
        let speed = 10f64.powf(between(&mut random, -2.0, 3.0));
        let (rigid_a, rigid_b) = (random.vector(speed), random.vector(speed));
        let wobble = if random.uniform() > 0.0 { speed } else { 0.01 };
        let to: [Vec3; 4] =
            std::array::from_fn(|i| from[i] + if i < 2 { rigid_a } else { rigid_b } + random.vector(wobble));
        let part = safe_part(&from, &to, least, 1.0);
        stopped += usize::from(part < 1.0);
        let distance_at = |time: f64| {
            let x: [Vec3; 4] = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * time);
            segment_distance(&x[0], &x[1], &x[2], &x[3]).distance
        };
        let kept = 0.1 * (distance_at(0.0) - least);
        for k in 0..=200 {
            let distance = distance_at(part * k as f64 / 200.0);
            assert!(distance - least >= 0.999 * kept, "{distance} {least} at {k}");
        }
        assert!(part > 0.0);
        // No shorter than it must be: the gap is nearly used up.
        if part < 1.0 {
            assert!(distance_at(part) - least <= 1.2 * kept, "{part}");
        }
    }
    assert!(stopped > 1000, "{stopped}");
}

#[test]
fn whole_steps_of_any_size_keep_every_gap() {
    let mut random = Random::new(10);
    let mut cut = 0;
    for _ in 0..60 {
        let rods = tangle(&mut random, 3, 6);
        let (nodes, law, mut state) = scene_of_thin(&rods);
        let Some(start) = law.smallest_gap(&mut state, &nodes) else { continue };
        if law.first_overlap(&nodes).is_some() {
            continue;
        }
        let least =
            |approach: flagrs::contact::potential::Approach| approach.distance - (1.0 - DELTA) * approach.thickness;
        for size in [0.004, 0.05, 1.0, 100.0] {
            let to: Vec<Vec3> = nodes.iter().map(|x| x + random.vector(size)).collect();
            let part = law.step_limit(&mut state, &nodes, &to);
            cut += usize::from(part < 1.0);
            for k in 1..=50 {
                let between: Vec<Vec3> =
                    nodes.iter().zip(&to).map(|(from, to)| from + (to - from) * (part * k as f64 / 50.0)).collect();
                assert!(law.first_overlap(&between).is_none());
                let smallest = law.smallest_gap(&mut state, &between).expect("rods may touch");
                assert!(least(smallest) >= 0.099 * least(start), "size {size}");
            }
        }
    }
    assert!(cut > 60, "{cut}");
}

/// Thin rods, of which most random ones do not overlap.
fn scene_of_thin(rods: &[Vec<Vec3>]) -> (Vec<Vec3>, BarrierLaw, BarrierState) {
    let nodes = rods.concat();
    let (edges, lengths) = edges_of(rods);
    let (radius, colliding) = (vec![0.01; edges.len()], vec![true; edges.len()]);
    let bodies = Bodies::new(nodes.len(), &edges, &radius, &lengths, &colliding, &[], FRAC_PI_2);
    let law = BarrierLaw::new(bodies, DELTA, 1.0);
    let mut state = law.state();
    law.ensure(&mut state, &nodes);
    (nodes, law, state)
}

#[test]
fn smallest_gap_is_that_of_brute_force() {
    let mut random = Random::new(11);
    for _ in 0..100 {
        let rods = tangle(&mut random, 3, 6);
        let (mut nodes, law, mut state) = scene_of_thin(&rods);
        for node in &mut nodes {
            *node += random.vector(0.002);
        }
        let bodies = law.bodies();
        let mut expected = f64::INFINITY;
        for a in 0..bodies.radius().len() {
            for b in a + 1..bodies.radius().len() {
                let x = bodies.corners([a, b], &nodes);
                if bodies.may_touch(a, b) {
                    expected = expected.min(segment_distance(&x[0], &x[1], &x[2], &x[3]).distance - 0.02);
                }
            }
        }
        assert_eq!(law.smallest_gap(&mut state, &nodes).expect("rods may touch").gap(), expected);
    }
}

#[test]
fn overlap_at_the_start_is_found_and_named() {
    let upper = |height: f64| rod(Vec3::new(0.1, 0.2, height), Vec3::y(), 4.0, 4);
    let lower = rod(Vec3::zeros(), Vec3::x(), 4.0, 4);
    let (nodes, law, state) = scene_of(&[lower.clone(), upper(0.96 * XI)]);
    assert_eq!(law.first_overlap(&nodes), None);
    assert!(law.energy(&state, &nodes).is_finite());
    let (nodes, law, mut state) = scene_of(&[lower, upper(0.94 * XI)]);
    let overlap = law.first_overlap(&nodes).expect("closer than 0.95");
    assert_eq!(overlap.bodies, [Body::Edge(2), Body::Edge(5)]);
    assert!((overlap.distance - 0.94 * XI).abs() < 1e-15);
    assert_eq!(law.energy(&state, &nodes), f64::INFINITY);
    assert_eq!(law.step_limit(&mut state, &nodes, &nodes), 0.0);
}

#[test]
fn rods_do_not_push_themselves_nor_their_head() {
    // A circle of a radius somewhat larger than the rod's, open by a quarter, and a head at its start.
    let count = 40;
    let circle: Vec<Vec3> = (0..=count)
        .map(|k| 1.05 * 0.5 * XI * k as f64 / count as f64 * 1.5 * std::f64::consts::PI)
        .map(|arc| arc / (1.05 * 0.5 * XI))
        .map(|turn| Vec3::new(turn.cos(), turn.sin(), 0.0) * (1.05 * 0.5 * XI))
        .collect();
    let (edges, lengths) = edges_of(std::slice::from_ref(&circle));
    let (radius, colliding) = (vec![0.5 * XI; count], vec![true; count]);
    let bodies =
        |spheres: &[(usize, f64)]| Bodies::new(circle.len(), &edges, &radius, &lengths, &colliding, spheres, FRAC_PI_2);
    assert!(bodies(&[(0, 2.0 * XI)]).may_touch(0, 39), "three quarters of a turn away");
    assert!(!bodies(&[(0, 2.0 * XI)]).may_touch(0, 40), "the head sits on the first node");
    // Neighbours never count, however fine the mesh.
    let straight = rod(Vec3::zeros(), Vec3::x(), 3.0, 200);
    let (nodes, law, state) = scene_of(&[straight]);
    assert_eq!(law.energy(&state, &nodes), 0.0);
    assert!(law.forces(&state, &nodes).is_empty());
}

#[test]
fn sphere_pushes_a_rod_alike_wherever_its_nodes_are() {
    let (length, radius, head) = (8.0, 0.5 * XI, 0.9);
    let distance = 1.01 * (radius + head);
    let thickness = radius + head;
    let expected = -thickness * (2.0 * DELTA).sqrt() * Barrier::new(thickness, DELTA).at(distance).slope;
    for count in [2, 8, 40, 160] {
        let mut nodes = rod(Vec3::zeros(), Vec3::x(), length, count);
        let (edges, lengths) = edges_of(std::slice::from_ref(&nodes));
        nodes.push(Vec3::zeros());
        let (radii, colliding) = (vec![radius; count], vec![true; count]);
        let spheres = [(count + 1, head)];
        let bodies = Bodies::new(nodes.len(), &edges, &radii, &lengths, &colliding, &spheres, FRAC_PI_2);
        let law = BarrierLaw::new(bodies, DELTA, 1.0);
        let mut state = law.state();
        for k in 0..50 {
            nodes[count + 1] = Vec3::new(-1.0 + 0.04 * k as f64, 0.0, distance);
            law.ensure(&mut state, &nodes);
            let force = -gradient_of(&law, &state, &nodes)[count + 1];
            assert!((force - Vec3::z() * expected).norm() < 1e-11 * expected, "{count} edges, {k}: {force}");
        }
    }
}

#[test]
fn swept_search_finds_every_pair_that_comes_into_range() {
    let mut random = Random::new(13);
    let mut met = 0;
    for _ in 0..40 {
        let rods = tangle(&mut random, 4, 6);
        let (edges, _) = edges_of(&rods);
        let from = rods.concat();
        let speed = 10f64.powf(between(&mut random, -2.0, 1.0));
        let to: Vec<Vec3> = from.iter().map(|x| x + random.vector(speed)).collect();
        let radius: Vec<f64> = (0..edges.len()).map(|_| between(&mut random, 0.02, 0.1)).collect();
        let exclusion = Exclusion::new(from.len(), &edges, &vec![0.7; edges.len()], &radius, FRAC_PI_2);
        let phase = BroadPhase::new(&edges, None, exclusion.clone());
        let found = phase.clone().with_search(Search::BruteForce).swept(&from, &to, &radius).to_vec();
        assert_eq!(found, phase.with_search(Search::Tree).swept(&from, &to, &radius));
        for k in 0..=20 {
            let x: Vec<Vec3> = from.iter().zip(&to).map(|(a, b)| a + (b - a) * (k as f64 / 20.0)).collect();
            for a in 0..edges.len() {
                for b in a + 1..edges.len() {
                    let ([a0, a1], [b0, b1]) = (edges[a], edges[b]);
                    let distance = segment_distance(&x[a0], &x[a1], &x[b0], &x[b1]).distance;
                    if distance < radius[a] + radius[b] && !exclusion.excludes(a, b) {
                        met += 1;
                        assert!(found.contains(&[a as u32, b as u32]));
                    }
                }
            }
        }
    }
    assert!(met > 1000, "{met}");
}

#[test]
fn friction_opposes_sliding_and_has_exact_derivatives() {
    let mut random = Random::new(12);
    let friction = Friction { coefficient: 0.3, smoothing_velocity: 0.2 };
    for round in 0..2000 {
        let (s, t) = (between(&mut random, 0.0, 1.0), between(&mut random, 0.0, 1.0));
        let contact = SlidingContact {
            nodes: [0, 1, 2, 3],
            weights: [1.0 - s, s, t - 1.0, -t],
            normal: unit(&mut random),
            force: between(&mut random, 0.0, 5.0),
        };
        let speed = 10f64.powf(between(&mut random, -4.0, 1.0));
        let velocities: [Vec3; 4] = std::array::from_fn(|_| random.vector(speed));
        let gradient = contact.gradient(&friction, &velocities);
        let power: f64 = (0..4).map(|i| -velocities[i].dot(&gradient.fixed_rows::<3>(3 * i))).sum();
        assert!(power <= 0.0, "{round}: {power}");
        let sliding = contact.sliding(&velocities);
        let on_a: Vec3 = -(gradient.fixed_rows::<3>(0) + gradient.fixed_rows::<3>(3));
        let on_b: Vec3 = -(gradient.fixed_rows::<3>(6) + gradient.fixed_rows::<3>(9));
        let most = friction.coefficient * contact.force;
        assert!(on_a.norm() <= most * (1.0 + 1e-14));
        assert!((on_a + on_b).norm() <= 1e-15 * most && on_a.dot(&contact.normal).abs() <= 1e-13 * most);
        if sliding.norm() >= friction.smoothing_velocity {
            assert!((on_a + sliding.normalize() * most).norm() <= 1e-14 * most);
        }
        let hessian = contact.hessian(&friction, &velocities);
        assert!(hessian.symmetric_eigenvalues().min() >= -1e-14 * hessian.amax());
        let error = worst_difference(&velocities, |i| [gradient[i]], |v| [contact.potential(&friction, v)]);
        assert!(error < 1e-6, "{round}: {error}");
        let error = worst_difference(
            &velocities,
            |i| -> [f64; 12] { std::array::from_fn(|j| hessian[(i, j)]) },
            |v| contact.gradient(&friction, v).into(),
        );
        assert!(error < 1e-6, "{round}: {error}");
    }
}

#[test]
fn friction_of_parallel_rods_is_the_coefficient_times_the_normal_force() {
    let (length, gap, coefficient) = (8.0, 0.98, 0.4);
    let upper = rod(Vec3::z() * (gap * XI), Vec3::x(), length, 8);
    let (nodes, law, _) = scene_of(&[upper, rod(Vec3::zeros(), Vec3::x(), length, 11)]);
    let law = law.with_friction(Friction { coefficient, smoothing_velocity: 1e-3 });
    // The elements of a state carry the friction of the law that made it.
    let mut state = law.state();
    law.ensure(&mut state, &nodes);
    law.find_sliding(&mut state, &nodes);
    let velocities: Vec<Vec3> = (0..nodes.len()).map(|k| if k < 9 { Vec3::x() } else { Vec3::zeros() }).collect();
    let derivative = Some(FrictionDerivative { rate: 1.0, curvature: Curvature::Exact });
    let total = |state: &BarrierState| {
        let stencils: Vec<Vec<usize>> = state.stencils().map(<[usize]>::to_vec).collect();
        let mut on_upper = Vec3::zeros();
        law.add_friction(state, &nodes, &velocities, derivative, |element, gradient, matrix| {
            assert_eq!(matrix.expect("asked for").len(), gradient.len() * gradient.len());
            for (k, &node) in stencils[element].iter().enumerate() {
                if node < 9 {
                    on_upper -= Vec3::from_column_slice(&gradient[3 * k..3 * k + 3]);
                }
            }
        });
        on_upper
    };
    let expected = Vec3::x() * (coefficient * Barrier::new(XI, DELTA).at(gap * XI).slope * length);
    assert!((total(&state) - expected).norm() < 1e-10 * expected.norm());
    assert!((law.friction_potential(&state, &velocities) + expected.x).abs() < 1e-3 * expected.norm());
    let apart: Vec<Vec3> =
        nodes.iter().enumerate().map(|(k, x)| x + Vec3::z() * if k < 9 { 1.0 } else { 0.0 }).collect();
    law.ensure(&mut state, &apart);
    law.find_sliding(&mut state, &apart);
    assert_eq!(total(&state), Vec3::zeros());
}
