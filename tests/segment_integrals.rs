//! The regularized Stokeslet segment against high-precision quadrature, its limits and its symmetries.

use flagrs::fluid::lanes::Path;
use flagrs::fluid::segment::{segment_blocks, segment_blocks_on};
use flagrs::fluid::stokeslet::{HatWeights, mobility, velocity};
use flagrs::{Mat3, Vec3};

/// One row of tests/data/segment_blocks.csv.
struct Case {
    label: String,
    target: Vec3,
    start: Vec3,
    end: Vec3,
    epsilon: f64,
    m1: Mat3,
    m2: Mat3,
}

fn reference_table() -> Vec<Case> {
    include_str!("data/segment_blocks.csv")
        .lines()
        .skip(1)
        .map(|line| {
            let (label, numbers) = line.split_once(',').expect("a label and numbers");
            let v: Vec<f64> = numbers.split(',').map(|n| n.parse().expect("a number")).collect();
            assert_eq!(v.len(), 22, "{line}");
            let symmetric = |b: &[f64]| Mat3::new(b[0], b[1], b[2], b[1], b[3], b[4], b[2], b[4], b[5]);
            Case {
                label: label.to_owned(),
                target: Vec3::from_column_slice(&v[0..3]),
                start: Vec3::from_column_slice(&v[3..6]),
                end: Vec3::from_column_slice(&v[6..9]),
                epsilon: v[9],
                m1: symmetric(&v[10..16]),
                m2: symmetric(&v[16..22]),
            }
        })
        .collect()
}

/// Largest difference over the largest entry of the reference.
fn relative_error(value: &Mat3, reference: &Mat3) -> f64 {
    (value - reference).amax() / reference.amax()
}

/// Points on a deterministic low-discrepancy walk over the unit sphere.
fn directions(count: usize) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |k| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
        let (angle, radius) = (2.399_963_229_728_653 * k as f64, (1.0 - z * z).sqrt());
        Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
    })
}

/// A helix of `count` nodes, 5 mm apart, on a 1 cm radius: the nodes, the edges and 1 mm of regularization.
fn helix(count: usize) -> (Vec<Vec3>, Vec<[usize; 2]>, Vec<f64>) {
    let nodes = (0..count)
        .map(|k| {
            let phase = 0.39 * k as f64;
            Vec3::new(3.2e-3 * k as f64, 1e-2 * phase.cos(), 1e-2 * phase.sin())
        })
        .collect();
    (nodes, (1..count).map(|k| [k - 1, k]).collect(), vec![1e-3; count - 1])
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool")
}

#[test]
fn blocks_agree_with_high_precision_quadrature_on_every_path() {
    let cases = reference_table();
    assert!(cases.len() >= 600, "only {} cases", cases.len());
    for path in Path::ALL.into_iter().filter(|path| path.is_available()) {
        let mut worst = std::collections::BTreeMap::new();
        for case in &cases {
            let (m1, m2) = segment_blocks_on(path, &case.target, &case.start, &case.end, case.epsilon);
            for (name, value, reference) in [("M1", m1, case.m1), ("M2", m2, case.m2)] {
                let error = relative_error(&value, &reference);
                assert!(
                    error < 1e-12,
                    "{path:?} {} {name}: {error:e} at target {:?} start {:?} end {:?} epsilon {:e}",
                    case.label,
                    case.target,
                    case.start,
                    case.end,
                    case.epsilon
                );
                let entry = worst.entry(case.label.as_str()).or_insert(0.0_f64);
                *entry = entry.max(error);
            }
        }
        println!("{path:?}: worst relative error by kind of case: {worst:?}");
    }
}

#[test]
fn exchanging_the_ends_exchanges_the_blocks() {
    let (start, end) = (Vec3::new(3.0, -7.0, 5.5), Vec3::new(3.4, -6.2, 5.1));
    for (k, direction) in directions(200).enumerate() {
        let target = start + direction * 10.0_f64.powf(-4.0 + 0.05 * k as f64);
        let epsilon = 10.0_f64.powi(-6 + (k % 8) as i32);
        let (m1, m2) = segment_blocks(&target, &start, &end, epsilon);
        let (n2, n1) = segment_blocks(&target, &end, &start, epsilon);
        assert!(relative_error(&n1, &m1) < 1e-13 && relative_error(&n2, &m2) < 1e-13, "target {target:?}");
    }
}

#[test]
fn blocks_are_symmetric_and_positive_definite() {
    let (start, end) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.5, 1.0, 3.5));
    for (k, direction) in directions(100).enumerate() {
        let target = start + direction * 10.0_f64.powf(-3.0 + 0.06 * k as f64);
        let (m1, m2) = segment_blocks(&target, &start, &end, 1e-3);
        for m in [m1, m2] {
            assert_eq!(m, m.transpose());
            assert!(m.symmetric_eigenvalues().min() > 0.0, "target {target:?}");
        }
    }
}

/// Third differences over steps of 1e-9 straddling each switch: a smooth function leaves eight times its round-off, a jump
/// from formula to formula up to three times itself.
#[test]
fn blocks_are_continuous_across_the_switches_of_formula() {
    let (start, end, epsilon) = (Vec3::new(4.0, 0.5, -9.0), Vec3::new(4.8, 0.5, -8.4), 0.2);
    let (centre, half) = (0.5 * (start + end), 0.5 * (end - start).norm());
    let at = |direction: &Vec3, d: f64| {
        // sqrt(distance^2 + epsilon^2) = d half-lengths
        let distance = ((d * half).powi(2) - epsilon * epsilon).sqrt();
        segment_blocks(&(centre + direction * distance), &start, &end, epsilon)
    };
    for direction in directions(30).chain([(end - start) / (2.0 * half)]) {
        for switch in [9.1, 46.0] {
            let step = 1e-9;
            let [a, b, c, d] = [-1.5, -0.5, 0.5, 1.5].map(|k: f64| at(&direction, switch * (1.0 + k * step)));
            for [a, b, c, d] in [[a.0, b.0, c.0, d.0], [a.1, b.1, c.1, d.1]] {
                // Each formula is good to 2e-14, so a jump may reach 4e-14; the third differences reach 6e-14.
                let third = (d - c * 3.0 + b * 3.0 - a).amax() / a.amax();
                assert!(third < 1e-13, "third difference {third:e} at D = {switch} towards {direction:?}");
            }
        }
    }
}

#[test]
fn far_segment_flows_like_a_regularized_stokeslet_at_its_centroid() {
    let (start, end, epsilon) = (Vec3::new(-0.1, 0.2, 0.3), Vec3::new(0.2, 0.1, -0.1), 0.5);
    let length = (end - start).norm();
    for direction in directions(40) {
        let mut previous = f64::INFINITY;
        for distance in [10.0, 100.0, 1000.0] {
            let target = direction * distance;
            let (m1, m2) = segment_blocks(&target, &start, &end, epsilon);
            // Weights 1 - a and a have the mass L/2 and their centroids at 1/3 and 2/3.
            let mut error: f64 = 0.0;
            for (m, a) in [(m1, 1.0 / 3.0), (m2, 2.0 / 3.0)] {
                let d = target - (start + a * (end - start));
                let r = (d.norm_squared() + epsilon * epsilon).sqrt();
                let stokeslet =
                    Mat3::identity() * (1.0 / r + epsilon * epsilon / r.powi(3)) + d * d.transpose() / r.powi(3);
                error = error.max(relative_error(&m, &(stokeslet * (0.5 * length))));
            }
            // The next term of the expansion is the second moment of the weight, L^2/18, over the distance squared.
            assert!(error < 0.3 * (length / distance).powi(2), "{error:e} at {distance}");
            assert!(error < 0.02 * previous, "second-order decay, {error:e} after {previous:e}");
            previous = error;
        }
    }
}

#[test]
fn blocks_do_not_depend_on_the_unit_of_length() {
    let (target, start, end, epsilon) =
        (Vec3::new(0.3, 0.1, -0.2), Vec3::new(0.25, 0.1, -0.25), Vec3::new(0.31, 0.1, -0.21), 1e-3);
    let (m1, m2) = segment_blocks(&target, &start, &end, epsilon);
    for unit in [1e-6, 1e-3, 1e3] {
        // Blocks have no dimension.
        let (n1, n2) = segment_blocks(&(target * unit), &(start * unit), &(end * unit), epsilon * unit);
        assert!(relative_error(&n1, &m1) < 1e-13 && relative_error(&n2, &m2) < 1e-13, "unit {unit}");
    }
}

#[test]
fn mobility_holds_the_blocks_by_columns_and_sums_them_at_shared_nodes() {
    let (nodes, edges, epsilon) = helix(5);
    let targets = [Vec3::new(0.01, 0.0, 0.0), nodes[2], Vec3::new(0.0, 0.5, 0.0)];
    let mut matrix = vec![f64::NAN; 9 * targets.len() * nodes.len()];
    mobility(&targets, &nodes, &edges, &epsilon, &mut matrix, None);
    for (t, target) in targets.iter().enumerate() {
        for n in 0..nodes.len() {
            let mut expected = Mat3::zeros();
            for (&[i, j], &epsilon) in edges.iter().zip(&epsilon) {
                let (m1, m2) = segment_blocks(target, &nodes[i], &nodes[j], epsilon);
                expected += m1 * f64::from(u8::from(i == n)) + m2 * f64::from(u8::from(j == n));
            }
            for row in 0..3 {
                for column in 0..3 {
                    let value = matrix[(3 * n + column) * 3 * targets.len() + 3 * t + row];
                    assert_eq!(value, expected[(row, column)], "target {t} node {n} entry ({row}, {column})");
                }
            }
        }
    }
}

#[test]
fn mobility_is_bit_identical_on_any_number_of_threads() {
    let (nodes, chain, _) = helix(121);
    // A ring with a branch, numbered so that edges cross from task to task.
    let ring: Vec<[usize; 2]> = (0..120).map(|k| [(7 * k) % 120, (7 * k + 7) % 120]).chain([[30, 120]]).collect();
    for edges in [chain, ring] {
        let epsilon: Vec<f64> = (0..edges.len()).map(|k| 1e-3 * (1.0 + 0.01 * k as f64)).collect();
        let mut serial = vec![0.0; 9 * 121 * 121];
        mobility(&nodes, &nodes, &edges, &epsilon, &mut serial, None);
        for threads in [1, 2, 3, 8] {
            let mut parallel = vec![f64::NAN; serial.len()];
            mobility(&nodes, &nodes, &edges, &epsilon, &mut parallel, Some(&pool(threads)));
            assert!(serial == parallel, "{threads} threads");
        }
    }
}

#[test]
fn velocity_is_the_mobility_times_the_density_on_any_number_of_threads() {
    let (nodes, edges, epsilon) = helix(40);
    let density: Vec<Vec3> = directions(nodes.len()).collect();
    let points: Vec<Vec3> =
        directions(150).enumerate().map(|(k, d)| d * (1e-3 * k as f64)).chain(nodes.clone()).collect();
    let mut matrix = vec![0.0; 9 * points.len() * nodes.len()];
    mobility(&points, &nodes, &edges, &epsilon, &mut matrix, None);
    let mut serial = vec![Vec3::repeat(f64::NAN); points.len()];
    velocity(&points, &nodes, &edges, &density, &epsilon, &mut serial, None);
    for (p, u) in serial.iter().enumerate() {
        let mut expected = Vec3::zeros();
        for (n, f) in density.iter().enumerate() {
            for c in 0..3 {
                let at = (3 * n + c) * 3 * points.len() + 3 * p;
                expected += Vec3::from_column_slice(&matrix[at..at + 3]) * f[c];
            }
        }
        // Eighty terms of order one that partly cancel.
        assert!((u - expected).amax() < 1e-13 * serial.iter().map(Vec3::amax).fold(0.0, f64::max), "point {p}");
    }
    for threads in [2, 5] {
        let mut parallel = vec![Vec3::zeros(); points.len()];
        velocity(&points, &nodes, &edges, &density, &epsilon, &mut parallel, Some(&pool(threads)));
        assert!(serial == parallel, "{threads} threads");
    }
}

#[test]
fn no_targets_and_no_edges_are_no_work() {
    let nodes = [Vec3::zeros(), Vec3::x()];
    mobility(&[], &nodes, &[[0, 1]], &[0.1], &mut [], None);
    let mut matrix = [1.0; 36];
    mobility(&nodes, &nodes, &[], &[], &mut matrix, None);
    assert_eq!(matrix, [0.0; 36]);
    let mut flow = [Vec3::repeat(1.0); 2];
    velocity(&nodes, &nodes, &[], &nodes, &[], &mut flow, None);
    assert_eq!(flow, [Vec3::zeros(); 2]);
}

#[test]
fn hat_weights_keep_total_force_and_torque_of_the_linear_density() {
    let (mut nodes, mut edges, _) = helix(12);
    nodes.push(Vec3::new(0.02, 0.03, 0.01));
    edges.push([5, 12]);
    let density: Vec<Vec3> = directions(nodes.len()).collect();
    let flat: Vec<f64> = density.iter().flat_map(|f| f.iter().copied()).collect();
    let mut force = vec![0.0; flat.len()];
    HatWeights::new(&nodes, &edges).apply(&flat, &mut force);

    let (mut total, mut torque) = (Vec3::zeros(), Vec3::zeros());
    for (x, f) in nodes.iter().zip(force.chunks_exact(3)) {
        let f = Vec3::from_column_slice(f);
        total += f;
        torque += x.cross(&f);
    }
    // Position and density are linear, so Simpson's rule integrates their product exactly.
    let (mut exact_total, mut exact_torque) = (Vec3::zeros(), Vec3::zeros());
    for &[i, j] in &edges {
        let length = (nodes[j] - nodes[i]).norm();
        for (a, w) in [(0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0)] {
            let (x, f) = (nodes[i].lerp(&nodes[j], a), density[i].lerp(&density[j], a));
            exact_total += f * (w * length);
            exact_torque += x.cross(&f) * (w * length);
        }
    }
    assert!((total - exact_total).amax() < 1e-14 * exact_total.amax());
    assert!((torque - exact_torque).amax() < 1e-14 * exact_torque.amax());
}

#[test]
fn hat_weights_multiply_a_matrix_column_by_column_and_follow_the_nodes() {
    let (nodes, edges, _) = helix(6);
    let stretched: Vec<Vec3> = nodes.iter().map(|x| x * 2.5).collect();
    let mut weights = HatWeights::new(&nodes, &edges);
    weights.update(&stretched);
    let n = 3 * weights.node_count();
    let matrix: Vec<f64> = (0..n * 4).map(|k| (k as f64).sin()).collect();
    let (mut product, mut column) = (matrix.clone(), vec![0.0; n]);
    weights.left_multiply(&mut product, &mut column);
    for (values, product) in matrix.chunks_exact(n).zip(product.chunks_exact(n)) {
        HatWeights::new(&stretched, &edges).apply(values, &mut column);
        assert_eq!(product, column);
    }
    // Every row sums to half the length of the node's edges.
    let mut sums = vec![0.0; n];
    weights.apply(&vec![1.0; n], &mut sums);
    assert!((sums[0] - 0.5 * (stretched[1] - stretched[0]).norm()).abs() < 1e-16);
}
