//! Regularized Stokeslet segments: the mobility matrix per pair of target and edge, on one thread and on all.

#[path = "../tests/common/scenes.rs"]
mod scenes;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use flagrs::fluid::stokeslet::mobility;
use flagrs::runtime::threads;

fn assembly(criterion: &mut Criterion) {
    let available = threads::thread_count(None);
    let mut counts = vec![1, available];
    counts.dedup();
    let mut group = criterion.benchmark_group("RSS assembly");
    for nodes in [59, 136, 600] {
        let scene = scenes::helix(nodes);
        let epsilon = scenes::epsilon(&scene);
        let mut out = vec![0.0; 9 * nodes * nodes];
        group.throughput(Throughput::Elements((nodes * scene.edges.len()) as u64));
        for &count in &counts {
            let pool = threads::pool(count);
            let name = if count == 1 { "1 thread".to_owned() } else { format!("{count} threads") };
            group.bench_function(BenchmarkId::new(name, format!("{nodes} nodes")), |bencher| {
                bencher.iter(|| {
                    let nodes = black_box(&scene.nodes);
                    mobility(nodes, nodes, &scene.edges, &epsilon, &mut out, pool.as_deref());
                    black_box(&mut out);
                });
            });
        }
    }
    group.finish();
}

criterion_group!(fluid, assembly);
criterion_main!(fluid);
