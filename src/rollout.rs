//! Many states of one shared model, each taken forward by itself, side by side on the threads of a pool.
//!
//! Every case is a simulation of its own with one thread: it goes the same way, to the last bit, whatever the others do and however many
//! threads there are.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

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

/// Takes all cases forward, in their order; `stop` ends every one within its present step.
pub fn rollout(
    model: &Arc<Model>,
    cases: Vec<Case>,
    plan: &Plan,
    threads: Threads,
    stop: &Arc<AtomicBool>,
) -> Vec<Result<Outcome, CaseError>> {
    let one = |case: Case| run(model, case, plan, stop);
    match threads.pool() {
        Some(pool) => pool.install(|| cases.into_par_iter().with_max_len(1).map(one).collect()),
        None => cases.into_iter().map(one).collect(),
    }
}

fn run(model: &Arc<Model>, case: Case, plan: &Plan, stop: &Arc<AtomicBool>) -> Result<Outcome, CaseError> {
    let Case { state, inputs, changed } = case;
    let mut simulation = Simulation::from_model(Arc::clone(model), inputs, state, plan.scheme, plan.dt, 1)?;
    if let Some(inputs) = changed {
        simulation.set_inputs(inputs);
    }
    simulation.set_tolerance(plan.tolerance);
    let asked = Arc::clone(stop);
    simulation.set_interrupt(Some(Box::new(move || asked.load(Ordering::Relaxed))));
    let frames = match &plan.extent {
        Extent::Steps(count) => {
            (0..*count).try_for_each(|_| simulation.step())?;
            vec![simulation.frame()?]
        }
        Extent::Times(times) => frames(&mut simulation, times, plan)?,
    };
    Ok(Outcome { frames, state: simulation.state().clone() })
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
