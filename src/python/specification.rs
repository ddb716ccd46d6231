//! A scene's plain data from a mapping of arrays, as `flagrs.assemble` makes it.

use std::sync::Arc;

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

use super::arrays::{pairs, points, values};
use super::errors::scene_error;
use super::loads::{FlowInput, LoadInput, MagnetismInput};
use super::walls::WallInput;
use crate::Vec3;
use crate::contact::stiffness::Stiffness;
use crate::fluid::product::FarFieldChoice;
use crate::kinematics::clamp::{Motion, Turning};
use crate::model::specification::{
    ClampSpecification, ContactMethodSpecification, ContactSpecification, FluidModelSpecification, FluidSpecification,
    HeadSpecification, MotorSpecification, Specification,
};
use crate::signal::{Function, Signal, SignalError};

/// A signal: a number, a pair of arrays (times, values), or a function with its breaks (s), its resolution (s) and the path of
/// its field.
#[derive(FromPyObject)]
pub(super) enum SignalInput<'py> {
    Constant(f64),
    Table(PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>),
    Function(Py<PyAny>, PyReadonlyArray1<'py, f64>, f64, String),
}

impl SignalInput<'_> {
    pub(super) fn signal(self) -> Signal {
        match self {
            Self::Constant(value) => Signal::Constant(value),
            Self::Table(times, samples) => Signal::Table { times: values(&times), values: values(&samples) },
            Self::Function(function, breaks, resolution, field) => {
                let call = move |time| Python::attach(|py| called(py, &function, time, &field));
                Signal::Function(Function { value: Arc::new(call), breaks: values(&breaks), resolution })
            }
        }
    }
}

/// Value of a user's function of time: any error of it, and any value that is not a finite number, names field, time and value.
fn called(py: Python<'_>, function: &Py<PyAny>, time: f64, field: &str) -> Result<f64, SignalError> {
    let refused = |given: &str, cause: Option<PyErr>| {
        let error = scene_error(py, field, &format!("{given} at t = {time} s"), "a finite number at every time");
        error.set_cause(py, cause);
        Box::new(error) as SignalError
    };
    let value = match function.call1(py, (time,)) {
        Ok(value) => value.into_bound(py),
        // Ctrl-C and the like are nobody's mistake.
        Err(error) if !error.is_instance_of::<PyException>(py) => return Err(Box::new(error)),
        Err(error) => return Err(refused(&format!("a function that raised {error}"), Some(error))),
    };
    match value.extract::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => {
            let shown = value.repr().map_or_else(|_| "a value without a repr".to_owned(), |text| text.to_string());
            Err(refused(&format!("a function that gave {}", shown.chars().take(60).collect::<String>()), None))
        }
    }
}

/// A motor, by its hinge.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(super) struct MotorInput<'py> {
    hinge: usize,
    shaft_second: bool,
    by_torque: bool,
    signal: SignalInput<'py>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct HeadInput {
    node: usize,
    edges: Vec<usize>,
    translation: f64,
    rotation: f64,
    mass: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct TurningInput<'py> {
    axis: [f64; 3],
    center: [f64; 3],
    rate: SignalInput<'py>,
    angle: SignalInput<'py>,
}

/// A clamp, by what it holds and how it moves.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(super) struct ClampInput<'py> {
    nodes: Vec<usize>,
    edges: Vec<usize>,
    axes: [bool; 3],
    angular_velocity: SignalInput<'py>,
    velocity: [SignalInput<'py>; 3],
    displacement: [SignalInput<'py>; 3],
    turning: Option<TurningInput<'py>>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct FluidInput<'py> {
    viscosity: f64,
    immersed: Vec<bool>,
    twist_drag: bool,
    density: f64,
    epsilon: Option<PyReadonlyArray1<'py, f64>>,
    far_field_error: f64,
    far_field_nodes: usize,
    coefficients: Option<PyReadonlyArray2<'py, f64>>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct ContactInput {
    barrier: bool,
    tolerance: f64,
    max_iterations: usize,
    stiffness: Option<f64>,
    driven: Vec<f64>,
    bent: Vec<f64>,
    friction: f64,
    slip_velocities: Vec<f64>,
    spheres: Vec<(usize, f64)>,
    exclusion: f64,
    colliding: Vec<bool>,
}

impl MotorInput<'_> {
    /// What drives it.
    pub fn signal(self) -> Signal {
        self.signal.signal()
    }
}

impl ClampInput<'_> {
    /// How it moves.
    pub fn motion(self) -> Motion {
        Motion {
            velocity: self.velocity.map(SignalInput::signal),
            displacement: self.displacement.map(SignalInput::signal),
            turning: self.turning.map(|turning| Turning {
                axis: Vec3::from(turning.axis),
                center: Vec3::from(turning.center),
                rate: turning.rate.signal(),
                angle: turning.angle.signal(),
            }),
            spin: self.angular_velocity.signal(),
        }
    }
}

/// The mapping that describes a scene.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct SceneInput<'py> {
    nodes: PyReadonlyArray2<'py, f64>,
    rest_nodes: PyReadonlyArray2<'py, f64>,
    edges: PyReadonlyArray2<'py, i64>,
    hinges: PyReadonlyArray2<'py, i64>,
    theta: PyReadonlyArray1<'py, f64>,
    directors: Vec<(usize, [f64; 3])>,
    radius: PyReadonlyArray1<'py, f64>,
    density: PyReadonlyArray1<'py, f64>,
    stretching: PyReadonlyArray1<'py, f64>,
    bending: PyReadonlyArray3<'py, f64>,
    twisting: PyReadonlyArray1<'py, f64>,
    natural_curvature: PyReadonlyArray2<'py, f64>,
    natural_twist: PyReadonlyArray1<'py, f64>,
    motors: Vec<MotorInput<'py>>,
    head: Option<HeadInput>,
    clamps: Vec<ClampInput<'py>>,
    loads: Vec<LoadInput<'py>>,
    magnetism: Option<MagnetismInput<'py>>,
    walls: Vec<WallInput>,
    flows: Vec<FlowInput<'py>>,
    gravity: [f64; 3],
    reynolds: PyReadonlyArray1<'py, f64>,
    fluid: Option<FluidInput<'py>>,
    contact: Option<ContactInput>,
}

impl SceneInput<'_> {
    /// The specification of this scene; NaN in natural curvature and twist stands for the rest shape's.
    pub fn specification(self, py: Python<'_>) -> PyResult<Specification> {
        let nodes = points(py, "nodes", &self.nodes)?;
        let edges = pairs(py, "edges", &self.edges, nodes.len())?;
        let hinges = pairs(py, "hinges", &self.hinges, edges.len())?;
        let stiffness = self.bending.as_array();
        let curvature = self.natural_curvature.as_array();
        Ok(Specification {
            rest_nodes: points(py, "rest_nodes", &self.rest_nodes)?,
            theta: values(&self.theta),
            directors: self.directors.into_iter().map(|(edge, d)| (edge, Vec3::from(d))).collect(),
            radius: values(&self.radius),
            density: values(&self.density),
            stretching: values(&self.stretching),
            bending: stiffness.outer_iter().map(|ei| [[ei[[0, 0]], ei[[0, 1]]], [ei[[1, 0]], ei[[1, 1]]]]).collect(),
            twisting: values(&self.twisting),
            natural_curvature: curvature.rows().into_iter().map(|k| (!k[0].is_nan()).then_some([k[0], k[1]])).collect(),
            natural_twist: values(&self.natural_twist).into_iter().map(|t| (!t.is_nan()).then_some(t)).collect(),
            motors: self
                .motors
                .into_iter()
                .map(|motor| MotorSpecification {
                    hinge: motor.hinge,
                    shaft_second: motor.shaft_second,
                    by_torque: motor.by_torque,
                    signal: motor.signal(),
                })
                .collect(),
            head: self.head.map(|head| HeadSpecification {
                node: head.node,
                edges: head.edges,
                translation: head.translation,
                rotation: head.rotation,
                mass: head.mass,
            }),
            clamps: self
                .clamps
                .into_iter()
                .map(|clamp| ClampSpecification {
                    nodes: clamp.nodes.clone(),
                    edges: clamp.edges.clone(),
                    axes: clamp.axes,
                    motion: clamp.motion(),
                })
                .collect(),
            loads: self.loads.into_iter().map(LoadInput::specification).collect::<PyResult<_>>()?,
            magnetism: self.magnetism.map(MagnetismInput::specification),
            walls: self.walls.into_iter().map(|wall| wall.specification(py)).collect::<PyResult<_>>()?,
            flows: self.flows.into_iter().map(FlowInput::specification).collect(),
            gravity: Vec3::from(self.gravity),
            reynolds: values(&self.reynolds),
            fluid: self.fluid.map(fluid),
            contact: self.contact.map(contact),
            nodes,
            edges,
            hinges,
        })
    }
}

fn contact(input: ContactInput) -> ContactSpecification {
    let ContactInput { tolerance, max_iterations, friction, slip_velocities, spheres, driven, bent, .. } = input;
    let stiffness = input.stiffness.map_or(Stiffness::Typical { driven, bent }, Stiffness::Uniform);
    ContactSpecification {
        method: if input.barrier {
            ContactMethodSpecification::Barrier { tolerance, stiffness, friction, slip_velocities, spheres }
        } else {
            ContactMethodSpecification::SpillmannTeschner { tolerance, max_iterations }
        },
        exclusion: input.exclusion,
        colliding: input.colliding,
    }
}

fn fluid(input: FluidInput<'_>) -> FluidSpecification {
    let coefficients = input
        .coefficients
        .as_ref()
        .map(|array| array.as_array().rows().into_iter().map(|row| [row[0], row[1]]).collect());
    let epsilon = input.epsilon.as_ref().map(values).unwrap_or_default();
    let far_field = FarFieldChoice { from: input.far_field_nodes, error: input.far_field_error };
    FluidSpecification {
        viscosity: input.viscosity,
        model: match coefficients {
            Some(coefficients) => FluidModelSpecification::ResistiveForce { coefficients },
            None => FluidModelSpecification::StokesletSegments { epsilon, far_field },
        },
        immersed: input.immersed,
        twist_drag: input.twist_drag,
        density: input.density,
    }
}
