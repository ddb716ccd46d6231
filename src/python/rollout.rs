//! Many states of one model side by side: cases from mappings, outcomes as lists.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use super::errors::{model_error, scene_error};
use super::frame::{frame_arrays, frame_error};
use super::inputs::InputsInput;
use super::state::{StateInput, state_arrays};
use crate::rollout::{Case, CaseError, Extent, Outcome, Plan};
use crate::runtime::threads::Threads;
use crate::simulation::Simulation;

/// How often Ctrl-C is looked for.
const LOOK: Duration = Duration::from_millis(50);

/// One case: its state and what has driven it, those of the simulation without; and what drives it from here on, if that is something else.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct CaseInput<'py> {
    state: Option<StateInput<'py>>,
    inputs: Option<InputsInput<'py>>,
    changed: Option<InputsInput<'py>>,
}

/// How all cases are taken forward: so many steps, or with frames at these times.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct PlanInput {
    steps: Option<u64>,
    times: Vec<f64>,
    threads: usize,
}

/// For every case a tuple: its frames, its last state, its error; of the first two or the last there is none.
pub fn rollout<'py>(
    py: Python<'py>,
    simulation: &Simulation,
    cases: Vec<CaseInput<'py>>,
    plan: &PlanInput,
) -> PyResult<Bound<'py, PyList>> {
    let cases = cases.into_iter().map(|case| case.case(py, simulation)).collect::<PyResult<Vec<_>>>()?;
    let extent = plan.steps.map_or_else(|| Extent::Times(plan.times.clone()), Extent::Steps);
    let (scheme, dt, tolerance) = (simulation.scheme(), simulation.dt(), simulation.tolerance());
    let native = Plan { scheme, dt, tolerance, extent };
    let (model, threads) = (simulation.shared_model(), Threads(plan.threads));
    let stop = Arc::new(AtomicBool::new(false));
    let mut raised = None;
    let outcomes = py.detach(|| {
        std::thread::scope(|scope| {
            let (done, ended) = channel();
            let (native, stopping) = (&native, &stop);
            scope.spawn(move || done.send(crate::rollout::rollout(&model, cases, native, threads, stopping)));
            loop {
                match ended.recv_timeout(LOOK) {
                    Ok(outcomes) => break outcomes,
                    Err(RecvTimeoutError::Disconnected) => break Vec::new(),
                    Err(RecvTimeoutError::Timeout) => {
                        if let Err(error) = Python::attach(|py| py.check_signals()) {
                            raised = Some(error);
                            stop.store(true, Ordering::Relaxed);
                        }
                    }
                }
            }
        })
    });
    if let Some(error) = raised {
        return Err(error);
    }
    let list = PyList::empty(py);
    for outcome in outcomes {
        list.append(told(py, outcome)?)?;
    }
    Ok(list)
}

type Told<'py> = (Option<Bound<'py, PyList>>, Option<Bound<'py, PyDict>>, Option<PyErr>);

fn told<'py>(py: Python<'py>, outcome: Result<Outcome, CaseError>) -> PyResult<Told<'py>> {
    match outcome {
        Ok(Outcome { frames, state }) => {
            let rows = frames.iter().map(|frame| frame_arrays(py, frame)).collect::<PyResult<Vec<_>>>()?;
            Ok((Some(PyList::new(py, rows)?), Some(state_arrays(py, &state)?), None))
        }
        Err(CaseError::Model(error)) => Ok((None, None, Some(model_error(py, &error)))),
        Err(CaseError::Frame(error)) => Ok((None, None, Some(frame_error(py, error)))),
    }
}

impl CaseInput<'_> {
    fn case(self, py: Python<'_>, simulation: &Simulation) -> PyResult<Case> {
        let model = simulation.model();
        let state = match self.state {
            Some(state) => state.state(py, model.dof_count())?,
            None => simulation.state().clone(),
        };
        let inputs = match self.inputs {
            Some(inputs) => inputs.inputs(py, model)?,
            None => simulation.inputs().clone(),
        };
        if !state.time.is_finite() {
            return Err(scene_error(py, "state.time", &state.time.to_string(), "finite"));
        }
        let changed = self.changed.map(|inputs| inputs.inputs(py, model)).transpose()?;
        Ok(Case { state, inputs, changed })
    }
}
