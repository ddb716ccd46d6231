//! Dense LU of the mobility matrix: factorization, and the back-substitution that applies the resistance once.

#[path = "../tests/common/scenes.rs"]
mod scenes;

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, SamplingMode, criterion_group, criterion_main};
use flagrs::fluid::stokeslet::mobility;
use flagrs::linear::dense::DenseLu;

fn mobility_of_helix(nodes: usize) -> Vec<f64> {
    let scene = scenes::helix(nodes);
    let epsilon = scenes::epsilon(&scene);
    let mut matrix = vec![0.0; 9 * nodes * nodes];
    mobility(&scene.nodes, &scene.nodes, &scene.edges, &epsilon, &mut matrix, None);
    matrix
}

fn dense_lu(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dense LU");
    group.sample_size(20).sampling_mode(SamplingMode::Flat);
    for nodes in [59, 136, 600] {
        let matrix = mobility_of_helix(nodes);
        let mut lu = DenseLu::new(3 * nodes);
        group.bench_function(BenchmarkId::new("factorization", format!("{} rows", 3 * nodes)), |bencher| {
            // The factors overwrite the matrix; copying it back is not part of the time.
            bencher.iter_custom(|iterations| {
                let mut spent = Duration::ZERO;
                for _ in 0..iterations {
                    lu.matrix_mut().copy_from_slice(&matrix);
                    let start = Instant::now();
                    lu.factor().expect("a mobility matrix is regular");
                    spent += start.elapsed();
                }
                spent
            });
        });
        let load: Vec<f64> = (0..3 * nodes).map(|k| (k as f64).sin()).collect();
        let mut solution = load.clone();
        group.bench_function(BenchmarkId::new("back-substitution", format!("{} rows", 3 * nodes)), |bencher| {
            bencher.iter(|| {
                solution.copy_from_slice(&load);
                lu.solve(black_box(&mut solution)).expect("a factored matrix solves");
            });
        });
    }
    group.finish();
}

criterion_group!(linear, dense_lu);
criterion_main!(linear);
