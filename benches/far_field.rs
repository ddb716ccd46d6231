//! The fast product of the mobility beside direct summation: time, error and cost per node, from 60 to 100,000 nodes.
//!
//! `cargo bench --bench far_field [-- TOLERANCE [MOST_NODES]]`, 1e-4 and 100,000 unless said otherwise. Errors are over the
//! largest component, at all nodes or 2000 of them, the worst of a random and a uniform density; times are the least of several.
//! Direct summation of more than 10,000 nodes is timed on these 2000 targets and scaled.

#[path = "../tests/common/mod.rs"]
mod common;

use std::f64::consts::{PI, TAU};
use std::hint::black_box;
use std::time::Instant;

use common::Random;
use flagrs::Vec3;
use flagrs::dynamics::threads;
use flagrs::fluid::far_field::FarField;
use flagrs::fluid::stokeslet::{mobility, velocity};

const EPSILON: f64 = 1.02e-3;
const SAMPLE: usize = 2000;
/// Nodes up to which direct summation is timed in full.
const MOST_DIRECT: usize = 10_000;
/// Nodes up to which the matrix is stored, 0.65 GB.
const MOST_STORED: usize = 3000;

type Network = (Vec<Vec3>, Vec<[usize; 2]>);

/// Helices like those of the clamped flagella (68 nodes, 0.2 m long) in a cube with `spacing^3` for each.
fn flagella(nodes: usize, spacing: f64) -> Network {
    let (mut points, mut edges, mut random) = (Vec::new(), Vec::new(), Random::new(1));
    let side = (nodes as f64 / 68.0).cbrt() * spacing;
    while points.len() < nodes {
        let (first, origin) = (points.len(), random.vector(0.5 * side));
        let axis = random.vector(1.0).normalize();
        let across = axis.cross(&Vec3::new(axis.z, axis.x, -axis.y)).normalize();
        let third = axis.cross(&across);
        for k in 0..68.min(nodes - first) {
            let along = 0.2 * k as f64 / 67.0;
            let (sine, cosine) = (along / 0.05 * TAU).sin_cos();
            points.push(origin + axis * along + (across * cosine + third * sine) * 0.01);
        }
        edges.extend((first + 1..points.len()).map(|k| [k - 1, k]));
    }
    (points, edges)
}

fn rod(nodes: usize) -> Network {
    let points = (0..nodes).map(|k| Vec3::new(5e-3 * k as f64, 0.0, 0.0)).collect();
    (points, (1..nodes).map(|k| [k - 1, k]).collect())
}

/// Least time of some repeats, s.
fn least(repeats: usize, mut work: impl FnMut()) -> f64 {
    let time = |work: &mut dyn FnMut()| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..repeats).map(|_| time(&mut work)).fold(f64::INFINITY, f64::min)
}

/// Product of a matrix stored by columns, a column at a time.
fn multiply(matrix: &[f64], density: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    for (column, factor) in matrix.chunks_exact(out.len()).zip(density) {
        out.iter_mut().zip(column).for_each(|(out, entry)| *out += factor * entry);
    }
}

fn study(label: &str, (nodes, edges): &Network, tolerance: f64, pool: Option<&rayon::ThreadPool>) {
    let (count, epsilon) = (nodes.len(), vec![EPSILON; edges.len()]);
    let build = || FarField::new(nodes, edges, &epsilon, None, tolerance, 4 << 30, pool).expect("a valid scene");
    let mut product = build();
    let geometry = least(2, || product.update(nodes, None, pool).expect("the same scene"));
    let size = if count <= MOST_DIRECT { count } else { SAMPLE };
    let sample: Vec<usize> = (0..size).map(|k| k * count / size).collect();
    let targets: Vec<Vec3> = sample.iter().map(|&k| nodes[k]).collect();
    let mut random = Random::new(7);
    let (mut error, mut apply, mut direct) = (0.0_f64, f64::INFINITY, f64::INFINITY);
    let mut out = vec![0.0; 3 * count];
    for uniform in [true, false] {
        let density: Vec<Vec3> =
            (0..count).map(|_| if uniform { Vec3::new(1.0, 0.5, -0.3) } else { random.vector(1.0) }).collect();
        let flat: Vec<f64> = density.iter().flat_map(|f| [f.x, f.y, f.z]).collect();
        apply = apply.min(least(if count < 5000 { 40 } else { 5 }, || {
            product.apply(&flat, black_box(&mut out), pool).expect("lengths fit");
        }));
        let mut exact = vec![Vec3::zeros(); targets.len()];
        direct = direct.min(least(2, || {
            velocity(&targets, nodes, edges, &density, 0.125 / PI, &epsilon, black_box(&mut exact), pool);
        }));
        let size = out.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
        for (&k, exact) in sample.iter().zip(&exact) {
            error = error.max((Vec3::from_column_slice(&out[3 * k..3 * k + 3]) - exact).amax() / size);
        }
    }
    direct *= count as f64 / targets.len() as f64;
    let stored = (count <= MOST_STORED).then(|| {
        let mut matrix = vec![0.0; 9 * count * count];
        mobility(nodes, nodes, edges, &epsilon, &mut matrix, pool);
        let density = vec![1.0; 3 * count];
        least(5, || multiply(&matrix, &density, black_box(&mut out)))
    });
    let summary = product.summary();
    println!(
        "{label:>8} {count:>7} {:>11.2} {:>11.2} {:>11.2} {:>11} {:>9.1e} {:>9.3} {:>6.0} {:>9} {:>11}",
        1e3 * geometry,
        1e3 * apply,
        1e3 * direct,
        stored.map_or("-".to_owned(), |time| format!("{:.2}", 1e3 * time)),
        error,
        1e6 * apply / count as f64,
        summary.bytes as f64 / 1e6,
        summary.far_pairs,
        summary.near_pairs,
    );
}

fn main() {
    // Cargo adds `--bench`.
    let numbers: Vec<f64> = std::env::args().skip(1).filter_map(|argument| argument.parse().ok()).collect();
    let tolerance = numbers.first().copied().unwrap_or(1e-4);
    let most = numbers.get(1).map_or(100_000, |&most| most as usize);
    let count = threads::thread_count(None);
    let pool = threads::pool(count);
    println!(
        "tolerance {tolerance:e}, {count} threads; times in ms, cost in us per node, memory in MB; one core for stored"
    );
    println!(
        "{:>8} {:>7} {:>11} {:>11} {:>11} {:>11} {:>9} {:>9} {:>6} {:>9} {:>11}",
        "scene", "nodes", "geometry", "product", "direct", "stored", "error", "cost", "memory", "far", "near"
    );
    for nodes in [60, 136, 300, 1000, 3000, 10_000, 30_000, 100_000].into_iter().filter(|&nodes| nodes <= most) {
        study("sparse", &flagella(nodes, 0.15), tolerance, pool.as_deref());
        study("dense", &flagella(nodes, 0.06), tolerance, pool.as_deref());
        study("rod", &rod(nodes), tolerance, pool.as_deref());
    }
}
