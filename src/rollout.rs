//! Many states of one shared model, each taken forward by itself, side by side on the threads of a pool.
//!
//! Every case is a simulation of its own with one thread: it goes the same way, to the last bit, whatever the others do and however many
//! threads there are.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::inputs::Inputs;
use crate::model::{Model, ModelError};
use crate::runtime::threads::Threads;
use crate::simulation::Simulation;
use crate::simulation::failure::StepError;
use crate::simulation::frame::{Frame, FrameError};
use crate::state::State;
use crate::step::scheme::Scheme;

/// Share of a fixed step by which a span may be longer than whole steps.
const SLIVER: f64 = 1e-9;

/// Where one case begins, and what drives it.
#[derive(Clone)]
pub struct Case {
    /// The state.
    pub state: State,
    /// What has driven it so far.
    pub inputs: Inputs,
    /// What drives it from here on, if that is something else.
    pub changed: Option<Inputs>,
}

/// How far all cases go.
#[derive(Debug, Clone)]
pub enum Extent {
    /// So many steps, and a frame at the end.
    Steps(u64),
    /// Up to the last of these times, s, with a frame at each; later than every case's beginning.
    Times(Vec<f64>),
}

/// How all cases are taken forward.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The scheme.
    pub scheme: Scheme,
    /// Length of a fixed step, scale of the first adaptive one, s.
    pub dt: f64,
    /// Local error of adaptive steps; fixed steps without.
    pub tolerance: Option<f64>,
    /// How far.
    pub extent: Extent,
}

/// What became of a case.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The frames asked for.
    pub frames: Vec<Frame>,
    /// The last state.
    pub state: State,
}

/// Why a case could not go on.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// Its state does not belong to the model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A step was not possible, or a frame cannot be told.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

impl From<StepError> for CaseError {
    fn from(error: StepError) -> Self {
        Self::Frame(FrameError::Step(error))
    }
}

/// Takes all cases forward; `stop` ends every one within its present step. The outcomes are in the order of the cases.
pub fn rollout(
    model: &Arc<Model>,
    cases: Vec<Case>,
    plan: &Plan,
    threads: Threads,
    stop: &Arc<AtomicBool>,
) -> Vec<Result<Outcome, CaseError>> {
    let count = cases.len();
    let work = Work { model, plan, stop, cases: cases.into_iter().map(|case| Mutex::new(Some(case))).collect() };
    let outcomes: Vec<Mutex<Option<_>>> = (0..count).map(|_| Mutex::new(None)).collect();
    let next = AtomicUsize::new(0);
    // Whoever is free takes the next case; a thread keeps its workspace from case to case.
    let worker = || {
        let mut workspace = None;
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let (Some(case), Some(outcome)) = (work.take(number), outcomes.get(number)) else { break };
            *outcome.lock().unwrap_or_else(PoisonError::into_inner) = Some(work.run(&mut workspace, case));
        }
    };
    match threads.pool() {
        Some(pool) => pool.scope(|scope| (0..threads.0.min(count)).for_each(|_| scope.spawn(|_| worker()))),
        None => worker(),
    }
    let outcomes = outcomes.into_iter().map(|outcome| outcome.into_inner().unwrap_or_else(PoisonError::into_inner));
    outcomes.map(|outcome| outcome.unwrap_or(Err(CaseError::from(StepError::Interrupted)))).collect()
}

/// What all threads share.
struct Work<'a> {
    model: &'a Arc<Model>,
    plan: &'a Plan,
    stop: &'a Arc<AtomicBool>,
    cases: Vec<Mutex<Option<Case>>>,
}

impl Work<'_> {
    fn take(&self, number: usize) -> Option<Case> {
        self.cases.get(number)?.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Takes one case forward in the workspace of a thread; one in which a case failed is not used again.
    fn run(&self, workspace: &mut Option<Simulation>, case: Case) -> Result<Outcome, CaseError> {
        let Case { state, inputs, changed } = case;
        let mut simulation = match workspace.take() {
            Some(mut simulation) => {
                simulation.set_inputs(inputs);
                simulation.adopt(state)?;
                simulation
            }
            None => self.workspace(inputs, state)?,
        };
        if let Some(inputs) = changed {
            simulation.set_inputs(inputs);
        }
        let frames = match &self.plan.extent {
            Extent::Steps(count) => {
                (0..*count).try_for_each(|_| simulation.step())?;
                vec![simulation.frame()?]
            }
            Extent::Times(times) => frames(&mut simulation, times, self.plan)?,
        };
        let state = simulation.state().clone();
        *workspace = Some(simulation);
        Ok(Outcome { frames, state })
    }

    fn workspace(&self, inputs: Inputs, state: State) -> Result<Simulation, CaseError> {
        let Plan { scheme, dt, tolerance, .. } = *self.plan;
        let mut simulation = Simulation::from_model(Arc::clone(self.model), inputs, state, scheme, dt, 1)?;
        simulation.set_tolerance(tolerance);
        let stop = Arc::clone(self.stop);
        simulation.set_interrupt(Some(Box::new(move || stop.load(Ordering::Relaxed))));
        Ok(simulation)
    }
}

fn frames(simulation: &mut Simulation, times: &[f64], plan: &Plan) -> Result<Vec<Frame>, CaseError> {
    let end = times.last().copied().unwrap_or_default();
    let mut frames = Vec::with_capacity(times.len());
    for &time in times {
        if plan.tolerance.is_some() {
            while simulation.state().time < time {
                simulation.adaptive_step(end)?;
            }
            frames.push(simulation.frame_at(time)?);
        } else {
            reach(simulation, time, plan.dt)?;
            frames.push(simulation.frame()?);
        }
    }
    Ok(frames)
}

/// Steps to a time exactly, in equal steps no longer than `dt`.
fn reach(simulation: &mut Simulation, time: f64, dt: f64) -> Result<(), StepError> {
    let span = time - simulation.state().time;
    let count = (span / dt - SLIVER).ceil().max(1.0);
    simulation.set_dt(span / count);
    let done = (0..count as u64).try_for_each(|_| simulation.step());
    simulation.set_dt(dt);
    done
}
