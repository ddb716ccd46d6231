//! Whole steps of the robot and of two clamped flagella in every scheme, and where their time goes.

#[path = "../tests/common/scenes.rs"]
mod scenes;

use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, SamplingMode};
use flagrs::model::specification::Specification;
use flagrs::simulation::Simulation;
use flagrs::state::State;
use flagrs::step::scheme::Scheme;
use flagrs::step::statistics::Statistics;

/// Simulated time before the state all schemes start from, s: any, and long after the clamped flagella first touch, at
/// about 4 s.
const APART: f64 = 0.5;
const BUNDLED: f64 = 10.0;
/// Steps after a change of scheme that are not measured.
const SETTLING: usize = 50;
/// Steps between returns to the start, so that every sample measures the same motion.
const BLOCK: usize = 60;
/// Blocks of the table by part.
const BLOCKS: usize = 15;

/// A scene in one scheme, and the state its measurements start from.
struct Case {
    scene: &'static str,
    scheme: Scheme,
    simulation: Simulation,
    start: State,
}

impl Case {
    fn new(scene: &'static str, specification: &Specification, from: &State, scheme: Scheme, dt: f64) -> Self {
        let mut simulation = Simulation::new(specification.clone(), scheme, dt, 1).expect("a valid scene");
        simulation.restore(from.clone());
        make_steps(&mut simulation, SETTLING);
        let start = simulation.state().clone();
        Self { scene, scheme, simulation, start }
    }

    fn label(&self) -> String {
        format!("{} at {:.3} ms", self.scheme.name(), 1e3 * self.simulation.dt())
    }

    /// Time of this many steps at the mean pace of whole blocks: steps of a block differ, above all in contact.
    fn time(&mut self, steps: u64) -> Duration {
        let blocks = steps.div_ceil(BLOCK as u64);
        let spent: Duration = (0..blocks).map(|_| self.block()).sum();
        spent.mul_f64(steps as f64 / (blocks * BLOCK as u64) as f64)
    }

    /// Time of a block of steps from the start.
    fn block(&mut self) -> Duration {
        self.simulation.restore(self.start.clone());
        let begun = Instant::now();
        make_steps(&mut self.simulation, BLOCK);
        begun.elapsed()
    }

    /// What a step of one block takes, by part.
    fn profile(&mut self) -> Profile {
        let before = self.simulation.statistics();
        self.block();
        Profile::between(&before, &self.simulation.statistics())
    }
}

fn make_steps(simulation: &mut Simulation, count: usize) {
    for _ in 0..count {
        if let Err(error) = simulation.step() {
            panic!("{}: {error}", simulation.scheme().name());
        }
    }
}

/// Milliseconds of a step: in all, fluid matrix, residuals and derivatives, linear systems, contact, the rest; then Newton,
/// Krylov and contact iterations of a step.
struct Profile([f64; 9]);

impl Profile {
    fn between(before: &Statistics, after: &Statistics) -> Self {
        let seconds = |part: fn(&Statistics) -> f64| 1e3 * (part(after) - part(before)) / BLOCK as f64;
        let count = |part: fn(&Statistics) -> u64| (part(after) - part(before)) as f64 / BLOCK as f64;
        let total = seconds(|s| s.seconds_total);
        let parts = [
            seconds(|s| s.seconds_fluid),
            seconds(|s| s.seconds_assembly),
            seconds(|s| s.seconds_linear),
            seconds(|s| s.seconds_contact),
        ];
        let [fluid, assembly, linear, contact] = parts;
        let rest = total - parts.iter().sum::<f64>();
        let newton = count(|s| s.newton_iterations);
        let krylov = count(|s| s.krylov_iterations);
        let passes = count(|s| s.contact_iterations);
        Self([total, fluid, assembly, linear, contact, rest, newton, krylov, passes])
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (name, scene, approach) in [
        ("robot", "robot", APART),
        ("two clamped flagella, apart", "two_clamped_flagella", APART),
        ("two clamped flagella, in contact", "two_clamped_flagella", BUNDLED),
    ] {
        let scenes::Canonical { specification, dt } = scenes::read(scene);
        let mut start = Simulation::new(specification.clone(), Scheme::Overdamped, dt, 1).expect("a valid scene");
        make_steps(&mut start, (approach / dt) as usize);
        let schemes =
            [(Scheme::Overdamped, dt), (Scheme::Implicit, dt), (Scheme::Explicit, 1e-3), (Scheme::Explicit, 1e-4)];
        cases.extend(schemes.map(|(scheme, dt)| Case::new(name, &specification, start.state(), scheme, dt)));
    }
    cases
}

fn whole_steps(criterion: &mut Criterion, cases: &mut [Case]) {
    for case in cases {
        let mut group = criterion.benchmark_group("whole step");
        group.sample_size(20).sampling_mode(SamplingMode::Flat);
        group.bench_function(BenchmarkId::new(case.scene, case.label()), |bencher| {
            bencher.iter_custom(|iterations| case.time(iterations));
        });
        group.finish();
    }
}

/// Prints where a step's time goes: medians over blocks taken in turn, so that a busy moment falls on every case.
fn print_table(cases: &mut [Case]) {
    let mut profiles: Vec<Vec<Profile>> = cases.iter().map(|_| Vec::new()).collect();
    for _ in 0..BLOCKS {
        for (case, profiles) in cases.iter_mut().zip(&mut profiles) {
            profiles.push(case.profile());
        }
    }
    println!("Milliseconds of a step on one thread, medians of {BLOCKS} blocks of {BLOCK} steps:\n");
    println!(
        "| scene | scheme | step | least | fluid matrix | assembly | linear | contact | rest | Newton | Krylov | passes |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (case, profiles) in cases.iter().zip(&profiles) {
        let column = |k: usize| median(profiles.iter().map(|profile| profile.0[k]).collect());
        let least = profiles.iter().map(|profile| profile.0[0]).fold(f64::INFINITY, f64::min);
        let parts: Vec<String> = (1..6).map(|k| format!("{:.3}", column(k))).collect();
        let iterations: Vec<String> = (6..9).map(|k| format!("{:.1}", column(k))).collect();
        let (label, step) = (case.label(), column(0));
        let (parts, iterations) = (parts.join(" | "), iterations.join(" | "));
        println!("| {} | {label} | {step:.3} | {least:.3} | {parts} | {iterations} |", case.scene);
    }
}

fn main() {
    let mut cases = cases();
    let mut criterion = Criterion::default().configure_from_args();
    whole_steps(&mut criterion, &mut cases);
    criterion.final_summary();
    print_table(&mut cases);
}
