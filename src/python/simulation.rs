//! The simulation class: a scene's state and the steps that take it forward.

use std::sync::{Arc, Mutex, PoisonError};

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use super::arrays::{from_points, points, values};
use super::errors::{linear_error, model_error, scene_error, step_error, term_error};
use super::frame::{Reactions, frame_arrays, frame_error, reaction_arrays};
use super::inputs::InputsInput;
use super::rollout::{CaseInput, PlanInput};
use super::specification::SceneInput;
use super::state::{StateInput, state_arrays};
use crate::simulation as core;
use crate::simulation::failure::StepError;
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
        let frame = self.inner.frame_at(time).map_err(|error| frame_error(py, error))?;
        frame_arrays(py, &frame)
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
        angles_of(py, &self.inner)
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

    /// Energies of all terms that have one, J, by name.
    fn energies<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let energies = PyDict::new(py);
        for (name, energy) in self.inner.balanced(core::Simulation::energies).map_err(|error| step_error(py, error))? {
            energies.set_item(name, energy)?;
        }
        Ok(energies)
    }

    /// Elastic gradient, (ndof,).
    fn gradient<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (gradient, _) = self.inner.elastic_derivatives().map_err(|error| term_error(py, &error))?;
        Ok(PyArray1::from_vec(py, gradient))
    }

    /// Elastic Hessian: values, row indices and column starts of compressed columns.
    fn hessian<'py>(&mut self, py: Python<'py>) -> PyResult<Hessian<'py>> {
        let (_, hessian) = self.inner.elastic_derivatives().map_err(|error| term_error(py, &error))?;
        let pattern = self.inner.model().pattern();
        let indices = |values: &[usize]| PyArray1::from_iter(py, values.iter().map(|&value| value as i64));
        Ok((PyArray1::from_vec(py, hessian), indices(pattern.row_indices()), indices(pattern.column_starts())))
    }

    /// Resistance of the nodes, (3N, 3N), N s/m.
    fn resistance<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let size = 3 * self.inner.model().network().node_count();
        let inner = &mut self.inner;
        let flat = py.detach(|| inner.resistance()).map_err(|error| linear_error(py, &error))?;
        PyArray1::from_vec(py, flat).reshape_with_order([size, size], numpy::npyffi::NPY_ORDER::NPY_FORTRANORDER)
    }

    /// Everything a saved frame holds, as a mapping of arrays.
    fn frame<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let frame = self.inner.frame().map_err(|error| frame_error(py, error))?;
        frame_arrays(py, &frame)
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
        state_arrays(py, self.inner.state())
    }

    /// Takes over a state saved by `state()` of a simulation of the same scene.
    fn load_state(&mut self, py: Python<'_>, saved: StateInput<'_>) -> PyResult<()> {
        let state = saved.state(py, self.inner.model().dof_count())?;
        self.inner.adopt(state).map_err(|error| model_error(py, &error))
    }

    /// Drives the scene by other signals and flows from the next step on; as many of each as there are.
    fn set_inputs(&mut self, py: Python<'_>, inputs: InputsInput<'_>) -> PyResult<()> {
        let inputs = inputs.inputs(py, self.inner.model())?;
        self.inner.set_inputs(inputs);
        Ok(())
    }

    /// Where a point of the axis that a clamp turns about is now, m; none if it does not turn.
    fn clamp_center<'py>(&self, py: Python<'py>, clamp: usize) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let motion = self.inner.inputs().clamps().get(clamp);
        let center = motion.map_or(Ok(None), |motion| motion.center(self.inner.state().time));
        let center = center.map_err(|error| step_error(py, StepError::Signal(error)))?;
        Ok(center.map(|center| PyArray1::from_slice(py, center.as_slice())))
    }

    /// Forces (C, 3), torques (C, 3) and powers (C,) of the clamps in the last step.
    fn reactions<'py>(&mut self, py: Python<'py>) -> PyResult<Reactions<'py>> {
        let reactions = self.inner.balanced(|inner| inner.state().reactions.clone());
        reaction_arrays(py, &reactions.map_err(|error| step_error(py, error))?)
    }

    /// Takes many states of this simulation's model forward, side by side; see `flagrs.rollout`.
    fn rollout<'py>(
        &self,
        py: Python<'py>,
        cases: Vec<CaseInput<'py>>,
        plan: PlanInput,
    ) -> PyResult<Bound<'py, PyList>> {
        super::rollout::rollout(py, &self.inner, cases, &plan)
    }
}

/// Angles of the edges, rad.
fn angles_of<'py>(py: Python<'py>, inner: &core::Simulation) -> Bound<'py, PyArray1<f64>> {
    let state = inner.state();
    PyArray1::from_iter(py, inner.model().network().edge_dofs().iter().map(|&dof| state.q[dof]))
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
