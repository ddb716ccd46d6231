//! The fast product of the mobility against direct summation: error, invariance, threads, memory and bad input.

mod common;

use common::Random;
use flagrs::Vec3;
use flagrs::fluid::far_field::{FarField, FarFieldError};
use flagrs::fluid::stokeslet::velocity;
use proptest::prelude::*;

/// Memory for all blocks of close pairs.
const PLENTY: usize = 1 << 30;

struct Scene {
    nodes: Vec<Vec3>,
    edges: Vec<[usize; 2]>,
    epsilon: Vec<f64>,
}

impl Scene {
    fn empty() -> Self {
        Self { nodes: vec![], edges: vec![], epsilon: vec![] }
    }

    fn add_rod(&mut self, points: impl IntoIterator<Item = Vec3>, epsilon: f64) {
        let first = self.nodes.len();
        self.nodes.extend(points);
        self.edges.extend((first + 1..self.nodes.len()).map(|k| [k - 1, k]));
        self.epsilon.resize(self.edges.len(), epsilon);
    }

    /// A rod along x of 5 mm edges.
    fn rod(count: usize) -> Self {
        let mut scene = Self::empty();
        scene.add_rod((0..count).map(|k| Vec3::new(5e-3 * k as f64, 0.0, 0.0)), 1e-3);
        scene
    }

    /// Helices of 68 nodes, as those of the clamped flagella, anywhere in a cube and pointing anywhere.
    fn flagella(count: usize, side: f64, epsilon: f64, seed: u64) -> Self {
        let (mut scene, mut random) = (Self::empty(), Random::new(seed));
        for _ in 0..count {
            let origin = random.vector(0.5 * side);
            let axis = (random.vector(1.0) + Vec3::new(0.0, 0.0, 1e-3)).normalize();
            let across = axis.cross(&Vec3::new(axis.z, axis.x, -axis.y)).normalize();
            let third = axis.cross(&across);
            let phase = 3.0 * random.uniform();
            let point = |k: usize| {
                let along = 0.2 * k as f64 / 67.0;
                let (sine, cosine) = (along / 0.05 * std::f64::consts::TAU + phase).sin_cos();
                origin + axis * along + (across * cosine + third * sine) * 0.01
            };
            scene.add_rod((0..68).map(point), epsilon * (1.0 + 0.5 * random.uniform()));
        }
        scene
    }

    /// Random walks of edges from 0.2 to 1.8 times a length, each with its own regularization.
    fn walks(count: usize, length: usize, seed: u64) -> Self {
        let (mut scene, mut random) = (Self::empty(), Random::new(seed));
        for _ in 0..count {
            let mut at = random.vector(0.1);
            let mut points = vec![at];
            for _ in 1..length {
                at += (random.vector(1.0) + Vec3::new(0.0, 0.0, 1e-3)).normalize()
                    * 5e-3
                    * (1.0 + 0.8 * random.uniform());
                points.push(at);
            }
            scene.add_rod(points, 1e-3 * (1.0 + 0.9 * random.uniform()));
        }
        scene
    }

    fn density(&self, kind: usize, seed: u64) -> Vec<f64> {
        let mut random = Random::new(seed);
        match kind {
            0 => self.nodes.iter().flat_map(|_| [1.0, -0.5, 0.3]).collect(),
            1 => (0..3 * self.nodes.len()).map(|_| random.uniform()).collect(),
            _ => self.nodes.iter().flat_map(|x| [(40.0 * x.y).sin(), (40.0 * x.z).cos(), (60.0 * x.x).sin()]).collect(),
        }
    }

    fn product(&self, targets: Option<&[Vec3]>, tolerance: f64, density: &[f64]) -> Vec<f64> {
        let mut product = FarField::new(&self.nodes, &self.edges, &self.epsilon, targets, tolerance, PLENTY, None)
            .expect("a product");
        let mut out = vec![0.0; 3 * targets.map_or(self.nodes.len(), <[Vec3]>::len)];
        product.apply(density, &mut out, None).expect("lengths fit");
        out
    }

    fn direct(&self, targets: &[Vec3], density: &[f64]) -> Vec<f64> {
        let density: Vec<Vec3> = density.chunks_exact(3).map(Vec3::from_column_slice).collect();
        let mut out = vec![Vec3::zeros(); targets.len()];
        velocity(targets, &self.nodes, &self.edges, &density, &self.epsilon, &mut out, pool(2).as_ref());
        out.iter().flat_map(|u| [u.x, u.y, u.z]).collect()
    }
}

fn pool(threads: usize) -> Option<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

/// Largest difference over the largest component of the reference.
fn error(values: &[f64], reference: &[f64]) -> f64 {
    assert_eq!(values.len(), reference.len());
    assert!(values.iter().all(|value| value.is_finite()));
    let difference: Vec<f64> = values.iter().zip(reference).map(|(value, exact)| value - exact).collect();
    largest(&difference) / largest(reference)
}

fn assert_within(scene: &Scene, tolerance: f64, label: &str) {
    for kind in 0..3 {
        let density = scene.density(kind, 5);
        let found = error(&scene.product(None, tolerance, &density), &scene.direct(&scene.nodes, &density));
        assert!(found <= tolerance, "{label}, density {kind}: {found:e} for {tolerance:e}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn error_is_within_the_tolerance_in_random_scenes(
        count in 1_usize..30, side in 0.02_f64..1.0, epsilon in -5.0_f64..-2.0, exponent in -8.0_f64..-2.0, seed: u64,
    ) {
        assert_within(&Scene::flagella(count, side, 10_f64.powf(epsilon), seed), 10_f64.powf(exponent), "flagella");
    }

    #[test]
    fn error_is_within_the_tolerance_among_uneven_edges(
        count in 1_usize..12, length in 2_usize..150, exponent in -8.0_f64..-2.0, seed: u64,
    ) {
        assert_within(&Scene::walks(count, length, seed), 10_f64.powf(exponent), "walks");
    }

    #[test]
    fn error_is_within_the_tolerance_at_targets_of_their_own(
        count in 1_usize..20, targets in 1_usize..500, exponent in -8.0_f64..-2.0, seed: u64,
    ) {
        let scene = Scene::flagella(count, 0.3, 1e-3, seed);
        let mut random = Random::new(seed);
        // Anywhere, next to nodes, and on edges.
        let targets: Vec<Vec3> = (0..targets)
            .map(|k| match k % 3 {
                0 => random.vector(0.4),
                1 => scene.nodes[k % scene.nodes.len()] + random.vector(1e-3),
                _ => scene.nodes[k % 60].lerp(&scene.nodes[k % 60 + 1], 0.5 + 0.5 * random.uniform()),
            })
            .collect();
        let (tolerance, density) = (10_f64.powf(exponent), scene.density(1, seed));
        let found = error(&scene.product(Some(&targets), tolerance, &density), &scene.direct(&targets, &density));
        prop_assert!(found <= tolerance, "{found:e} for {tolerance:e}");
    }
}

/// Sources and targets on one line and forces all alike: nothing averages out.
#[test]
fn error_is_within_the_tolerance_along_a_straight_rod() {
    for exponent in [-2, -4, -6, -9] {
        assert_within(&Scene::rod(4000), 10_f64.powi(exponent), "rod");
    }
}

#[test]
fn error_is_within_the_tolerance_where_the_regularization_exceeds_the_edges() {
    for epsilon in [5e-3, 2e-2, 0.1] {
        for exponent in [-2, -4, -6, -8] {
            assert_within(&Scene::flagella(40, 0.6, epsilon, 3), 10_f64.powi(exponent), "thick flagella");
        }
    }
}

#[test]
fn regularization_may_differ_from_edge_to_edge_by_orders_of_magnitude() {
    let mut scene = Scene::flagella(30, 0.5, 1e-3, 8);
    for (k, epsilon) in scene.epsilon.iter_mut().enumerate() {
        *epsilon *= [1.0, 1e-3, 30.0][k % 3];
    }
    for exponent in [-2, -4, -6, -8] {
        assert_within(&scene, 10_f64.powi(exponent), "mixed regularization");
    }
}

#[test]
fn one_long_edge_among_many_short_ones_is_taken_as_it_is() {
    let mut scene = Scene::flagella(20, 0.3, 1e-3, 4);
    scene.add_rod([Vec3::new(-1.0, 0.01, 0.02), Vec3::new(1.0, -0.02, 0.01)], 1e-3);
    for exponent in [-2, -5, -8] {
        assert_within(&scene, 10_f64.powi(exponent), "long edge");
    }
}

#[test]
fn expansions_and_not_only_near_pairs_are_used_above_a_few_thousand_nodes() {
    let scene = Scene::flagella(60, 1.0, 1e-3, 2);
    let product =
        FarField::new(&scene.nodes, &scene.edges, &scene.epsilon, None, 1e-4, PLENTY, None).expect("a product");
    let summary = product.summary();
    assert!(summary.far_pairs > 1000, "{summary:?}");
    assert!(summary.near_pairs < scene.nodes.len() * scene.edges.len(), "{summary:?}");
    assert_eq!(summary.kept_pairs, summary.close_pairs);
}

#[test]
fn tiny_scenes_are_summed_to_the_tolerance() {
    for count in 2..12 {
        assert_within(&Scene::rod(count), 1e-8, "tiny rod");
    }
}

#[test]
fn scenes_without_edges_or_targets_have_no_flow() {
    let scene = Scene { nodes: vec![Vec3::zeros(); 3], edges: vec![], epsilon: vec![] };
    assert_eq!(scene.product(None, 1e-4, &[1.0; 9]), [0.0; 9]);
    assert!(Scene::rod(100).product(Some(&[]), 1e-4, &[1.0; 300]).is_empty());
    assert!(Scene::empty().product(None, 1e-4, &[]).is_empty());
}

#[test]
fn coincident_targets_and_coincident_rods_are_no_exception() {
    let mut scene = Scene::rod(400);
    let again = scene.nodes.clone();
    scene.add_rod(again, 2e-3);
    assert_within(&scene, 1e-6, "coincident rods");
    let targets = vec![scene.nodes[7]; 500];
    let density = scene.density(1, 1);
    let product = scene.product(Some(&targets), 1e-6, &density);
    assert!(error(&product, &scene.direct(&targets, &density)) <= 1e-6);
    assert!(product.chunks_exact(3).all(|flow| flow == &product[..3]));
}

#[test]
fn result_is_the_same_to_the_last_bit_on_any_number_of_threads() {
    let scene = Scene::flagella(60, 0.8, 1e-3, 6);
    let density = scene.density(1, 2);
    let reference = scene.product(None, 1e-5, &density);
    let mut with_little_memory: Option<Vec<f64>> = None;
    for threads in [1, 2, 3, 5] {
        let pool = pool(threads);
        // Some of the blocks kept: which ones must not depend on the threads either.
        for memory in [PLENTY, 400_000] {
            let mut product =
                FarField::new(&scene.nodes, &scene.edges, &scene.epsilon, None, 1e-5, memory, pool.as_ref())
                    .expect("a product");
            let mut out = vec![0.0; reference.len()];
            product.apply(&density, &mut out, pool.as_ref()).expect("lengths fit");
            let mut alone = out.clone();
            product.apply(&density, &mut alone, None).expect("lengths fit");
            assert_eq!(out, alone);
            let kept = product.summary().kept_pairs;
            assert!(kept > 0 && (kept == product.summary().close_pairs) == (memory == PLENTY));
            if memory == PLENTY {
                assert_eq!(out, reference, "{threads} threads");
            } else {
                assert_eq!(&out, with_little_memory.get_or_insert(out.clone()), "{threads} threads");
            }
        }
    }
}

#[test]
fn memory_changes_the_time_and_not_the_result() {
    let scene = Scene::flagella(20, 0.3, 1e-3, 9);
    let density = scene.density(1, 3);
    let all = scene.product(None, 1e-7, &density);
    for memory in [0, 100_000] {
        let mut product =
            FarField::new(&scene.nodes, &scene.edges, &scene.epsilon, None, 1e-7, memory, None).expect("a product");
        let summary = product.summary();
        assert!(summary.kept_pairs < summary.close_pairs, "{summary:?}");
        let mut out = vec![0.0; all.len()];
        product.apply(&density, &mut out, None).expect("lengths fit");
        assert!(error(&out, &all) < 1e-13, "{:e}", error(&out, &all));
    }
}

#[test]
fn the_same_scene_in_metres_and_micrometres_has_the_same_product() {
    let scene = Scene::flagella(20, 0.3, 1e-3, 10);
    let density = scene.density(1, 4);
    let reference = scene.product(None, 1e-5, &density);
    let scaled = |factor: f64| {
        let nodes = scene.nodes.iter().map(|x| x * factor).collect();
        let epsilon = scene.epsilon.iter().map(|e| e * factor).collect();
        Scene { nodes, edges: scene.edges.clone(), epsilon }
    };
    for factor in [1e-6, 1e-3, 1e3, 1e9] {
        // Cells may be halved differently where coordinates tie, and round-off is not scaled by a power of ten.
        let found = error(&scaled(factor).product(None, 1e-5, &density), &reference);
        assert!(found < 2e-5, "{factor:e}: {found:e}");
    }
    assert_eq!(scaled(2_f64.powi(-20)).product(None, 1e-5, &density), reference);
}

#[test]
fn a_shifted_scene_has_the_same_product() {
    let scene = Scene::flagella(20, 0.3, 1e-3, 11);
    let density = scene.density(2, 4);
    let reference = scene.product(None, 1e-5, &density);
    let nodes: Vec<Vec3> = scene.nodes.iter().map(|x| x + Vec3::new(3.0, -40.0, 0.7)).collect();
    let shifted = Scene { nodes, edges: scene.edges.clone(), epsilon: scene.epsilon.clone() };
    let found = error(&shifted.product(None, 1e-5, &density), &reference);
    assert!(found < 2e-5, "{found:e}");
}

#[test]
fn a_moved_product_is_that_of_the_new_place() {
    let (scene, other) = (Scene::flagella(20, 0.3, 1e-3, 12), Scene::flagella(20, 0.5, 1e-3, 13));
    let mut product =
        FarField::new(&scene.nodes, &scene.edges, &scene.epsilon, None, 1e-5, PLENTY, None).expect("a product");
    let density = scene.density(1, 1);
    let mut out = vec![0.0; density.len()];
    product.apply(&density, &mut out, None).expect("lengths fit");
    product.update(&other.nodes, None, None).expect("a product");
    product.apply(&density, &mut out, None).expect("lengths fit");
    let moved = Scene { nodes: other.nodes, edges: scene.edges, epsilon: scene.epsilon };
    assert_eq!(out, moved.product(None, 1e-5, &density));
}

#[test]
fn bad_input_is_named_and_leaves_the_product_as_it_was() {
    let scene = Scene::rod(10);
    let build = |nodes: &[Vec3], edges: &[[usize; 2]], epsilon: &[f64], tolerance: f64| {
        FarField::new(nodes, edges, epsilon, None, tolerance, PLENTY, None).err().map(|error| error.to_string())
    };
    let Scene { nodes, edges, epsilon } = &scene;
    let message = |given: Option<String>| given.expect("an error");
    for tolerance in [0.0, -1.0, 1e-12, 0.5, f64::NAN] {
        assert!(message(build(nodes, edges, epsilon, tolerance)).contains("tolerance"));
    }
    for value in [0.0, -1e-3, f64::NAN, f64::INFINITY, 1e-30] {
        let mut epsilon = epsilon.clone();
        epsilon[4] = value;
        assert!(message(build(nodes, edges, &epsilon, 1e-4)).contains("epsilon 4"));
    }
    for ends in [[3, 3], [3, 10]] {
        let mut edges = edges.clone();
        edges[5] = ends;
        assert!(message(build(nodes, &edges, epsilon, 1e-4)).contains("edge 5"));
    }
    let mut broken = nodes.clone();
    broken[3].y = f64::NAN;
    assert!(message(build(&broken, edges, epsilon, 1e-4)).contains("node 3"));
    broken[3] = broken[2];
    assert!(message(build(&broken, edges, epsilon, 1e-4)).contains("edge 2"));
    assert!(message(build(nodes, edges, &epsilon[1..], 1e-4)).contains("epsilon has 8 entries; it must have 9"));

    let mut product = FarField::new(nodes, edges, epsilon, None, 1e-4, PLENTY, None).expect("a product");
    let (mut before, mut after) = ([0.0; 30], [0.0; 30]);
    product.apply(&[1.0; 30], &mut before, None).expect("lengths fit");
    assert!(product.update(&broken, None, None).is_err());
    assert!(product.update(&nodes[1..], None, None).is_err());
    assert!(product.update(nodes, Some(nodes), None).is_err());
    assert!(matches!(product.apply(&[1.0; 29], &mut after, None), Err(FarFieldError::Length { field: "density", .. })));
    assert!(matches!(
        product.apply(&[1.0; 30], &mut after[1..], None),
        Err(FarFieldError::Length { field: "out", .. })
    ));
    product.apply(&[1.0; 30], &mut after, None).expect("lengths fit");
    assert_eq!(before, after);
}
