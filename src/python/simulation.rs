//! The simulation class: a scene's state and the steps that take it forward.

use std::sync::{Arc, Mutex, PoisonError};

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::{from_flat, from_points, points, values};
use super::errors::{linear_error, model_error, scene_error, step_error};
use super::specification::SceneInput;
use crate::bdf::control::{Control, NO_CEILING};
use crate::bdf::history::{History, Sample};
use crate::rod::reference::ReferenceFrames;
use crate::simulation as core;
use crate::simulation::failure::StepError;
use crate::state::State;
use crate::state::account::Account;
use crate::step::scheme::Scheme;

/// A running simulation; the class `flagrs.Simulation` wraps it.
#[pyclass(module = "flagrs._flagrs")]
pub struct Simulation {
    inner: core::Simulation,
}

type Hessian<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<i64>>);

#[pymethods]
impl Simulation {
    #[new]
    fn new(py: Python<'_>, scene: SceneInput<'_>, scheme: &str, dt: f64, threads: usize) -> PyResult<Self> {
        let scheme = Scheme::from_name(scheme)
            .ok_or_else(|| scene_error(py, "scheme", scheme, "one of explicit, implicit, overdamped"))?;
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(scene_error(py, "dt", &dt.to_string(), "> 0 s"));
        }
        let specification = scene.specification(py)?;
        let inner = core::Simulation::new(specification, scheme, dt, threads).map_err(|e| model_error(py, &e))?;
        Ok(Self { inner })
    }

    /// Asks a function for forces at the beginning of every step; None: no longer.
    fn set_force(&mut self, function: Option<Py<PyAny>>) {
        self.inner.set_force(function.map(super::force::force_function));
    }

    fn __repr__(&self) -> String {
        let network = self.inner.model().network();
        format!(
            "Simulation({} nodes, {} edges, scheme={:?}, dt={:e} s, time={} s)",
            network.node_count(),
            network.edges().len(),
            self.inner.scheme().name(),
            self.inner.dt(),
            self.inner.state().time
        )
    }

    /// Makes `count` steps of `dt`.
    fn step(&mut self, py: Python<'_>, count: u64) -> PyResult<()> {
        interruptible(py, &mut self.inner, |inner| (0..count).try_for_each(|_| inner.step()))
    }

    /// Local error, relative to the size of each filament, that adaptive steps keep to; fixed steps without.
    #[pyo3(signature = (tolerance=None))]
    fn set_tolerance(&mut self, tolerance: Option<f64>) {
        self.inner.set_tolerance(tolerance);
    }

    /// Makes adaptive steps until `time` is reached or passed, none beyond `limit`.
    fn advance_past(&mut self, py: Python<'_>, time: f64, limit: f64) -> PyResult<()> {
        interruptible(py, &mut self.inner, |inner| {
            while inner.state().time < time {
                inner.adaptive_step(limit)?;
            }
            Ok(())
        })
    }

    /// The frame at a time within the last step, interpolated as far as contact allows.
    fn frame_at<'py>(&mut self, py: Python<'py>, time: f64) -> PyResult<Bound<'py, PyDict>> {
        let present = self.inner.state().clone();
        let then = self.inner.frame_state(time).map_err(|error| step_error(py, error))?;
        self.inner.restore(then);
        let frame = self.frame(py);
        self.inner.restore(present);
        frame
    }

    /// Advances by `duration` seconds in one step.
    fn advance(&mut self, py: Python<'_>, duration: f64) -> PyResult<()> {
        interruptible(py, &mut self.inner, |inner| inner.advance(duration))
    }

    #[getter]
    fn time(&self) -> f64 {
        self.inner.state().time
    }

    #[getter]
    fn dt(&self) -> f64 {
        self.inner.dt()
    }

    #[setter]
    fn set_dt(&mut self, py: Python<'_>, dt: f64) -> PyResult<()> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(scene_error(py, "dt", &dt.to_string(), "> 0 s"));
        }
        self.inner.set_dt(dt);
        Ok(())
    }

    #[getter]
    fn minimum_gap(&mut self) -> f64 {
        self.inner.smallest_gap().unwrap_or(f64::INFINITY)
    }

    #[getter]
    fn scheme(&self) -> &'static str {
        self.inner.scheme().name()
    }

    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        from_points(py, &self.inner.positions())
    }

    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        from_points(py, &self.inner.velocities())
    }

    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let state = self.inner.state();
        PyArray1::from_iter(py, self.inner.model().network().edge_dofs().iter().map(|&dof| state.q[dof]))
    }

    /// Degrees of freedom and their rates, in the interleaved numbering.
    #[getter]
    fn velocity_vector<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.state().velocity)
    }

    #[getter]
    fn dof_of_node<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.inner.model().network().node_dofs().iter().map(|&dof| dof as i64))
    }

    #[getter]
    fn dof_of_edge<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.inner.model().network().edge_dofs().iter().map(|&dof| dof as i64))
    }

    #[getter]
    fn dof_count(&self) -> usize {
        self.inner.model().dof_count()
    }

    #[getter]
    fn mass<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.model().mass())
    }

    #[getter]
    fn terms(&self) -> Vec<&'static str> {
        self.inner.model().term_names()
    }

    /// Moves nodes and edge angles; at rest.
    #[pyo3(signature = (nodes, theta=None))]
    fn place(
        &mut self,
        py: Python<'_>,
        nodes: PyReadonlyArray2<'_, f64>,
        theta: Option<PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<()> {
        let network = self.inner.model().network();
        let (count, edges) = (network.node_count(), network.edges().len());
        let nodes = points(py, "nodes", &nodes)?;
        let theta = theta.as_ref().map(values);
        if nodes.len() != count {
            return Err(scene_error(
                py,
                "nodes",
                &format!("shape ({}, 3)", nodes.len()),
                &format!("of shape ({count}, 3)"),
            ));
        }
        if let Some(theta) = theta.as_ref().filter(|theta| theta.len() != edges || theta.iter().any(|t| !t.is_finite()))
        {
            let allowed = format!("{edges} finite angles");
            return Err(scene_error(py, "theta", &format!("{theta:?}"), &allowed));
        }
        self.inner.place(&nodes, theta.as_deref()).map_err(|error| model_error(py, &error))
    }

    /// Energies of stretching, bending and twisting, J.
    fn energies(&mut self) -> [f64; 3] {
        self.inner.energies()
    }

    /// Elastic gradient, (ndof,).
    fn gradient<'py>(&mut self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.inner.elastic_derivatives().0)
    }

    /// Elastic Hessian: values, row indices and column starts of compressed columns.
    fn hessian<'py>(&mut self, py: Python<'py>) -> Hessian<'py> {
        let (_, hessian) = self.inner.elastic_derivatives();
        let pattern = self.inner.model().pattern();
        let indices = |values: &[usize]| PyArray1::from_iter(py, values.iter().map(|&value| value as i64));
        (PyArray1::from_vec(py, hessian), indices(pattern.row_indices()), indices(pattern.column_starts()))
    }

    /// Resistance of the nodes, (3N, 3N), N s/m.
    fn resistance<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let size = 3 * self.inner.model().network().node_count();
        let inner = &mut self.inner;
        let flat = py.detach(|| inner.resistance()).map_err(|error| linear_error(py, &error))?;
        PyArray1::from_vec(py, flat).reshape_with_order([size, size], numpy::npyffi::NPY_ORDER::NPY_FORTRANORDER)
    }

    /// Everything a saved frame holds but the time, as a mapping of arrays.
    fn frame<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let frame = PyDict::new(py);
        let speeds = self.inner.motor_speeds().map_err(|error| step_error(py, StepError::Signal(error)))?;
        let density = self.inner.force_density().map_err(|error| linear_error(py, &error))?;
        frame.set_item("time", self.inner.state().time)?;
        frame.set_item("nodes", self.nodes(py)?)?;
        frame.set_item("theta", self.theta(py))?;
        frame.set_item("velocities", self.velocities(py)?)?;
        frame.set_item("force_density", from_flat(py, density, 3)?)?;
        frame.set_item("motor_angle", PyArray1::from_slice(py, &self.inner.state().motor_angles))?;
        frame.set_item("motor_speed", PyArray1::from_vec(py, speeds))?;
        frame.set_item("motor_torque", PyArray1::from_vec(py, self.inner.motor_torques()))?;
        frame.set_item("minimum_gap", self.inner.smallest_gap().unwrap_or(f64::INFINITY))?;
        frame.set_item("contacts", self.inner.state().contacts.len())?;
        frame.set_item("account", self.account(py))?;
        frame.set_item("energy", PyArray1::from_slice(py, &self.inner.energies()))?;
        Ok(frame)
    }

    /// Energies, balances and extremes so far, as `flagrs.budget` reads them.
    fn account<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.state().account.numbers())
    }

    /// Counts and times since the start.
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (statistics, out) = (self.inner.statistics(), PyDict::new(py));
        out.set_item("steps", statistics.steps)?;
        out.set_item("rejected_steps", statistics.rejected_steps)?;
        out.set_item("newton_iterations", statistics.newton_iterations)?;
        out.set_item("krylov_iterations", statistics.krylov_iterations)?;
        out.set_item("dense_solves", statistics.dense_solves)?;
        out.set_item("contact_iterations", statistics.contact_iterations)?;
        out.set_item("contact_searches", statistics.contact_searches)?;
        out.set_item("seconds_fluid", statistics.seconds_fluid)?;
        out.set_item("seconds_assembly", statistics.seconds_assembly)?;
        out.set_item("seconds_linear", statistics.seconds_linear)?;
        out.set_item("seconds_contact", statistics.seconds_contact)?;
        out.set_item("seconds_total", statistics.seconds_total)?;
        Ok(out)
    }

    /// The whole state as a mapping of arrays, exact to the last bit.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (state, out) = (self.inner.state(), PyDict::new(py));
        let pairs = state.contacts.iter().flat_map(|(pair, _)| pair.map(i64::from));
        out.set_item("time", PyArray1::from_slice(py, &[state.time]))?;
        out.set_item("steps", PyArray1::from_slice(py, &[state.steps]))?;
        out.set_item("q", PyArray1::from_slice(py, &state.q))?;
        out.set_item("velocity", PyArray1::from_slice(py, &state.velocity))?;
        let past = &state.history.past;
        let rows = |part: fn(&Sample) -> &Vec<f64>, width: usize| {
            PyArray1::from_vec(py, past.iter().flat_map(part).copied().collect::<Vec<f64>>())
                .reshape([past.len(), width])
        };
        out.set_item("density", PyArray1::from_slice(py, &state.density))?;
        out.set_item("tensions", PyArray1::from_slice(py, &state.tensions))?;
        out.set_item("control_step", PyArray1::from_slice(py, &control_numbers(&state.control)))?;
        out.set_item("control_order", PyArray1::from_slice(py, &[state.control.order as u64]))?;
        out.set_item("history_times", PyArray1::from_iter(py, past.iter().map(|sample| sample.time)))?;
        out.set_item("history_states", rows(|sample| &sample.q, state.q.len())?)?;
        out.set_item("history_velocities", rows(|sample| &sample.velocity, state.q.len())?)?;
        out.set_item("history_densities", rows(|sample| &sample.density, state.density.len())?)?;
        out.set_item("history_order", PyArray1::from_slice(py, &[state.history.order as u64]))?;
        out.set_item("tangents", from_points(py, &state.frames.tangents)?)?;
        out.set_item("directors", from_points(py, &state.frames.directors)?)?;
        out.set_item("twists", PyArray1::from_slice(py, &state.frames.twists))?;
        out.set_item("motor_angles", PyArray1::from_slice(py, &state.motor_angles))?;
        out.set_item("contact_pairs", PyArray1::from_iter(py, pairs).reshape([state.contacts.len(), 2])?)?;
        out.set_item("contact_anchor", from_points(py, &state.contact_anchor)?)?;
        out.set_item("account", PyArray1::from_slice(py, &state.account.numbers()))?;
        out.set_item("contact_forces", PyArray1::from_iter(py, state.contacts.iter().map(|(_, force)| *force)))?;
        Ok(out)
    }

    /// Takes over a state saved by `state()` of a simulation of the same scene.
    fn load_state(&mut self, py: Python<'_>, saved: StateInput<'_>) -> PyResult<()> {
        saved.check_shapes(py, self.inner.model().dof_count())?;
        let account = Account::from_numbers(&values(&saved.account))
            .ok_or_else(|| scene_error(py, "state", "an account of another length", "what state() returned"))?;
        let state = State {
            time: first(&saved.time),
            steps: saved.steps.as_array().first().copied().unwrap_or(0),
            q: values(&saved.q),
            velocity: values(&saved.velocity),
            density: values(&saved.density),
            tensions: values(&saved.tensions),
            control: control(&saved),
            history: History { past: past(&saved), order: whole(&saved.history_order) },
            frames: ReferenceFrames {
                tangents: points(py, "tangents", &saved.tangents)?,
                directors: points(py, "directors", &saved.directors)?,
                twists: values(&saved.twists),
            },
            motor_angles: values(&saved.motor_angles),
            contacts: contacts(py, &saved)?,
            account,
            contact_anchor: points(py, "contact_anchor", &saved.contact_anchor)?,
        };
        self.inner.adopt(state).map_err(|error| model_error(py, &error))
    }
}

/// Lets `steps` run without the interpreter's lock, looking for Ctrl-C; what a signal handler raised comes out of it.
fn interruptible(
    py: Python<'_>,
    inner: &mut core::Simulation,
    steps: impl FnOnce(&mut core::Simulation) -> Result<(), StepError> + Send,
) -> PyResult<()> {
    let raised = Arc::new(Mutex::new(None));
    let report = Arc::clone(&raised);
    inner.set_interrupt(Some(Box::new(move || match Python::attach(|py| py.check_signals()) {
        Ok(()) => false,
        Err(error) => {
            *report.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            true
        }
    })));
    let done = py.detach(|| steps(inner));
    inner.set_interrupt(None);
    let raised = raised.lock().unwrap_or_else(PoisonError::into_inner).take();
    match (raised, done) {
        (Some(error), _) => Err(error),
        (None, Err(error)) => Err(step_error(py, error)),
        (None, Ok(())) => py.check_signals(),
    }
}

/// A saved state.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct StateInput<'py> {
    time: PyReadonlyArray1<'py, f64>,
    steps: PyReadonlyArray1<'py, u64>,
    q: PyReadonlyArray1<'py, f64>,
    velocity: PyReadonlyArray1<'py, f64>,
    density: PyReadonlyArray1<'py, f64>,
    tensions: PyReadonlyArray1<'py, f64>,
    control_step: PyReadonlyArray1<'py, f64>,
    control_order: PyReadonlyArray1<'py, u64>,
    history_times: PyReadonlyArray1<'py, f64>,
    history_states: PyReadonlyArray2<'py, f64>,
    history_velocities: PyReadonlyArray2<'py, f64>,
    history_densities: PyReadonlyArray2<'py, f64>,
    history_order: PyReadonlyArray1<'py, u64>,
    tangents: PyReadonlyArray2<'py, f64>,
    directors: PyReadonlyArray2<'py, f64>,
    twists: PyReadonlyArray1<'py, f64>,
    motor_angles: PyReadonlyArray1<'py, f64>,
    contact_pairs: PyReadonlyArray2<'py, i64>,
    contact_forces: PyReadonlyArray1<'py, f64>,
    contact_anchor: PyReadonlyArray2<'py, f64>,
    account: PyReadonlyArray1<'py, f64>,
}

fn first(array: &PyReadonlyArray1<'_, f64>) -> f64 {
    array.as_array().first().copied().unwrap_or(f64::NAN)
}

fn whole(array: &PyReadonlyArray1<'_, u64>) -> usize {
    array.as_array().first().map_or(0, |&value| value as usize)
}

/// What [`control`] reads, but for the order.
fn control_numbers(control: &Control) -> [f64; 3] {
    [control.dt, control.ceiling, f64::from(u8::from(control.at_jump))]
}

/// Size and order of the next step; files of before there was a ceiling have none.
fn control(saved: &StateInput<'_>) -> Control {
    let number = |k: usize| saved.control_step.as_array().get(k).copied();
    Control {
        dt: first(&saved.control_step),
        order: whole(&saved.control_order),
        ceiling: number(1).filter(|ceiling| *ceiling > 0.0).map_or(NO_CEILING, |ceiling| ceiling.min(NO_CEILING)),
        at_jump: number(2).is_some_and(|flag| flag != 0.0),
    }
}

fn past(saved: &StateInput<'_>) -> Vec<Sample> {
    let (states, velocities) = (saved.history_states.as_array(), saved.history_velocities.as_array());
    let densities = saved.history_densities.as_array();
    saved
        .history_times
        .as_array()
        .iter()
        .zip(states.rows())
        .zip(velocities.rows())
        .zip(densities.rows())
        .map(|(((&time, q), velocity), density)| Sample {
            time,
            q: q.to_vec(),
            velocity: velocity.to_vec(),
            density: density.to_vec(),
        })
        .collect()
}

fn contacts(py: Python<'_>, saved: &StateInput<'_>) -> PyResult<Vec<([u32; 2], f64)>> {
    let (pairs, forces) = (saved.contact_pairs.as_array(), saved.contact_forces.as_array());
    let index = |value: i64| {
        u32::try_from(value)
            .map_err(|_| scene_error(py, "state.contact_pairs", &value.to_string(), "indices of bodies"))
    };
    pairs.rows().into_iter().zip(forces).map(|(pair, &force)| Ok(([index(pair[0])?, index(pair[1])?], force))).collect()
}

impl StateInput<'_> {
    /// Checks the shapes that converting takes for granted; the core checks everything else.
    fn check_shapes(&self, py: Python<'_>, dofs: usize) -> PyResult<()> {
        let past = self.history_times.as_array().len();
        let flow = self.density.as_array().len();
        let forces = self.contact_forces.as_array().len();
        let wanted = [
            ("time", self.time.shape(), vec![1]),
            ("steps", self.steps.shape(), vec![1]),
            ("control_step", self.control_step.shape(), vec![if self.control_step.len() == 1 { 1 } else { 3 }]),
            ("control_order", self.control_order.shape(), vec![1]),
            ("history_order", self.history_order.shape(), vec![1]),
            ("history_states", self.history_states.shape(), vec![past, dofs]),
            ("history_velocities", self.history_velocities.shape(), vec![past, dofs]),
            ("history_densities", self.history_densities.shape(), vec![past, flow]),
            ("contact_pairs", self.contact_pairs.shape(), vec![forces, 2]),
        ];
        match wanted.iter().find(|(_, shape, wanted)| shape != wanted) {
            Some((name, shape, wanted)) => {
                let (found, allowed) = (format!("shape {shape:?}"), format!("of shape {wanted:?}"));
                Err(scene_error(py, &format!("state.{name}"), &found, &allowed))
            }
            None => Ok(()),
        }
    }
}
