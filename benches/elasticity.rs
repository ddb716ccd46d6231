//! Elastic energy, gradient and Hessian of a helical chain, per node, as Newton's method evaluates them.

#[path = "../tests/common/scenes.rs"]
mod scenes;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use flagrs::elastic::bending::Bending;
use flagrs::elastic::hinges::Hinges;
use flagrs::elastic::stretching::Stretching;
use flagrs::elastic::twisting::Twisting;
use flagrs::linear::pattern::Pattern;
use flagrs::rod::assembly::{Assembly, HingeElement};
use flagrs::rod::configuration::Configuration;
use flagrs::rod::network::Network;
use flagrs::rod::reference::ReferenceFrames;
use flagrs::rod::term::{Conservative, Term};
use flagrs::simulation::Simulation;
use flagrs::step::scheme::Scheme;

/// The elastic terms of a helix with workspace of their own: a simulation evaluates them only together.
struct Chain {
    network: Network,
    stretching: Stretching,
    hinges: Hinges,
    reference: ReferenceFrames,
    configuration: Configuration,
    q: Vec<f64>,
    gradient: Vec<f64>,
    hessian: Vec<f64>,
}

impl Chain {
    /// The terms of a simulation of the helix, in its state.
    fn of(simulation: &Simulation, nodes: usize) -> Self {
        let scene = scenes::helix(nodes);
        let network = Network::new(nodes, &scene.edges, &scene.hinges).expect("a chain is a network");
        let length = |edge: usize| (scene.nodes[edge + 1] - scene.nodes[edge]).norm();
        let rest_lengths: Vec<f64> = (0..nodes - 1).map(length).collect();
        let voronoi = |hinge: usize| 0.5 * (rest_lengths[hinge] + rest_lengths[hinge + 1]);
        let mut configuration = Configuration::new(&network, network.dof_count());
        let at_rest = Simulation::new(scene.clone(), Scheme::Overdamped, 1e-3, 1).expect("a valid scene");
        let placed = configuration.update(&network, &at_rest.state().q, &at_rest.state().frames, &[]);
        assert!(placed, "the helix is a configuration");
        let bending = (0..nodes - 2).map(|k| Bending {
            stiffness: scene.bending[k].map(|row| row.map(|entry| entry / voronoi(k))),
            natural: configuration.strain(k).kappa,
        });
        let twisting = (0..nodes - 2)
            .map(|k| Twisting { stiffness: scene.twisting[k] / voronoi(k), natural: configuration.strain(k).tau });
        let elements = (0..nodes - 2).map(|hinge| HingeElement::new(&network, hinge, None)).collect();
        let mut hinges = Hinges::new(elements, bending.collect(), twisting.collect());
        let mut stretching = Stretching::new(&network, scene.stretching.clone(), rest_lengths.clone());
        let stencils: Vec<Vec<usize>> = stretching.stencils().into_iter().chain(hinges.stencils()).collect();
        let pattern = Pattern::from_stencils(network.dof_count(), stencils.iter().map(Vec::as_slice));
        stretching.bind(&pattern);
        hinges.bind(&pattern);
        Self {
            stretching,
            hinges,
            reference: simulation.state().frames.clone(),
            q: simulation.state().q.clone(),
            gradient: vec![0.0; network.dof_count()],
            hessian: vec![0.0; pattern.entries()],
            configuration,
            network,
        }
    }

    fn place(&mut self) {
        let placed = self.configuration.update(&self.network, black_box(&self.q), &self.reference, &[]);
        assert!(placed, "the state is a configuration");
    }

    fn energy(&mut self) -> f64 {
        self.place();
        self.stretching.energy(&self.configuration)
            + self.hinges.bending_energy(&self.configuration)
            + self.hinges.twisting_energy(&self.configuration)
    }

    fn derive(&mut self, with_hessian: bool) {
        self.place();
        self.gradient.fill(0.0);
        let mut jacobian = None;
        if with_hessian {
            self.hessian.fill(0.0);
            jacobian = Some(self.hessian.as_mut_slice());
        }
        let mut out = Assembly { residual: &mut self.gradient, jacobian };
        self.stretching.add(&self.configuration, 0.0, &mut out).expect("edges have lengths");
        self.hinges.add(&self.configuration, 0.0, &mut out).expect("no hinge is folded");
    }
}

/// The helix moved by up to a fiftieth of an edge, and with its frames at their reference before that.
fn simulation(nodes: usize, moved: bool) -> Simulation {
    let mut simulation = Simulation::new(scenes::helix(nodes), Scheme::Overdamped, 1e-3, 1).expect("a valid scene");
    if moved {
        let mut state = simulation.state().clone();
        for (k, value) in state.q.iter_mut().enumerate() {
            *value += 1e-4 * (12.9898 * k as f64).sin();
        }
        simulation.restore(state);
    }
    simulation
}

fn elasticity(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("elasticity");
    for nodes in [59, 136, 1000] {
        let mut simulation_moved = simulation(nodes, true);
        let mut chain = Chain::of(&simulation_moved, nodes);
        let (gradient, hessian) = simulation_moved.elastic_derivatives().expect("a configuration");
        chain.derive(true);
        assert!(chain.gradient == gradient, "the bench evaluates the terms of a simulation");
        // A simulation's pattern has more entries, those of the other terms; the sum of all does not see them.
        let sum = |values: &[f64]| values.iter().map(|value| value.abs()).sum::<f64>();
        assert!((sum(&chain.hessian) / sum(&hessian) - 1.0).abs() < 1e-12, "and its Hessian");

        let size = format!("{nodes} nodes");
        group.throughput(Throughput::Elements(nodes as u64));
        group.bench_function(BenchmarkId::new("energy", &size), |bencher| bencher.iter(|| black_box(chain.energy())));
        group.bench_function(BenchmarkId::new("gradient", &size), |bencher| bencher.iter(|| chain.derive(false)));
        group.bench_function(BenchmarkId::new("gradient and Hessian", &size), |bencher| {
            bencher.iter(|| chain.derive(true));
        });
        let mut resting = Chain::of(&simulation(nodes, false), nodes);
        group.bench_function(BenchmarkId::new("gradient and Hessian at the reference frames", &size), |bencher| {
            bencher.iter(|| resting.derive(true));
        });
    }
    group.finish();
}

criterion_group!(elastic, elasticity);
criterion_main!(elastic);
