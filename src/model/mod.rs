//! The constant part of a simulation, built once from a specification: topology, stiffness, and the terms a scene needs.
//!
//! * [`specification`]: a scene as plain data.
//! * [`contact`]: how rods are kept apart.
//! * `check`: what must hold of it; `scene_terms`: the terms that it asks for.
//! * [`filaments`]: the parts of a scene that move on their own, and their sizes; `round_off`: how exactly forces are known.
//! * `parts`: connected parts.
//! * `storage`: where the derivative of the force balance is stored.

mod check;
pub mod contact;
pub mod filaments;
mod parts;
pub(crate) mod round_off;
pub(crate) mod scene_terms;
pub mod specification;
pub(crate) mod storage;

use crate::Vec3;
use crate::contact::potential::BarrierLaw;
use crate::elastic::bending::Bending;
use crate::elastic::hinges::Hinges;
use crate::elastic::stretching::Stretching;
use crate::elastic::twisting::Twisting;
use crate::fluid::product::FarFieldChoice;
use crate::fluid::rft::ResistiveForce;
use crate::fluid::rss::StokesletSegments;
use crate::fluid::{FluidModel, immersed_part};
use crate::forces::channels::Channels;
use crate::forces::inertia::Inertia;
use crate::forces::motors::{Drive, Motor, MotorTorques};
use crate::kinematics::clamp::{Clamp, ClampedEdge};
use crate::linear::LinearError;
use crate::linear::pattern::Pattern;
use crate::model::check::check;
use crate::model::contact::{ContactModel, Overlap};
use crate::model::filaments::Filaments;
use crate::model::parts::parts;
use crate::model::round_off::RoundOff;
use crate::model::scene_terms::{dissipative_terms, load_terms, masses, regularization, spin_resistances, weights};
use crate::model::specification::{FluidModelSpecification, Specification};
use crate::model::storage::Storage;
use crate::rod::assembly::{Assembly, HingeElement, Increment};
use crate::rod::configuration::{Configuration, ShaftAngle};
use crate::rod::network::{Network, NetworkError};
use crate::rod::reference::ReferenceFrames;
use crate::rod::term::{Conservative, External, Term, TermError};
use std::f64::consts::PI;

/// A model cannot be built from its specification.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The topology is not valid.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// An array has the wrong length.
    #[error("{field}: length {length} is not allowed; must be {expected}")]
    Length {
        /// Which array.
        field: &'static str,
        /// Its length.
        length: usize,
        /// What it should be.
        expected: usize,
    },
    /// A value is out of range.
    #[error("{field}: {value} is not allowed; must be {allowed}")]
    Value {
        /// Which quantity.
        field: String,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A shape cannot be a configuration: an edge without length, or two edges of a hinge folded onto each other.
    #[error("{shape}: an edge without length, or two edges folded onto each other, are not allowed")]
    Shape {
        /// Which shape.
        shape: &'static str,
    },
    /// Two bodies are closer than contact can start from.
    #[error("{0}")]
    Overlap(Overlap),
    /// A matrix of the model cannot be analysed.
    #[error(transparent)]
    Linear(#[from] LinearError),
}

/// Everything about a scene that does not change.
pub struct Model {
    pub(crate) network: Network,
    pub(crate) dof_count: usize,
    pub(crate) stretching: Stretching,
    pub(crate) hinges: Hinges,
    /// Terms without an energy, but for inertia.
    pub(crate) external: Vec<Box<dyn External>>,
    pub(crate) inertia: Inertia,
    pub(crate) motors: Vec<Motor>,
    pub(crate) clamps: Vec<Clamp>,
    pub(crate) prescribed: Vec<bool>,
    pub(crate) storage: Storage,
    pub(crate) filaments: Filaments,
    /// Turns residuals into forces: 1 for positions, one over a length for angles.
    pub(crate) force_weight: Vec<f64>,
    /// Turns errors of degrees of freedom into those relative to the size of a filament; 0 for what is prescribed.
    pub(crate) error_weight: Vec<f64>,
    pub(crate) round_off: RoundOff,
    pub(crate) mass: Vec<f64>,
    pub(crate) contact: Option<ContactModel>,
    /// Number of signals that loads follow.
    pub(crate) load_channels: usize,
    /// Weights less buoyancy on every degree of freedom, N.
    pub(crate) weights: Vec<f64>,
    /// Connected part of every node, and which parts nothing holds.
    pub(crate) part_of_node: Vec<usize>,
    pub(crate) free_parts: Vec<bool>,
    /// Regularization of the immersed edges, m; zero for others.
    pub(crate) regularization: Vec<f64>,
    pub(crate) specification: Specification,
}

impl Model {
    /// Builds the model.
    ///
    /// # Errors
    /// [`ModelError`] naming what is not valid.
    pub fn new(specification: Specification) -> Result<Self, ModelError> {
        let network = Network::new(specification.nodes.len(), &specification.edges, &specification.hinges)?;
        check(&specification)?;
        let dof_count = network.dof_count() + specification.motors.iter().filter(|motor| motor.by_torque).count();
        let motors = motors(&specification, network.dof_count());
        let rest = RestShape::new(&specification, &network)?;
        let elements = (0..network.hinges().len())
            .map(|hinge| HingeElement::new(&network, hinge, free_angle(&motors, hinge)))
            .collect();
        let mut stretching = Stretching::new(&network, specification.stretching.clone(), rest.lengths.clone());
        let mut hinges = Hinges::new(elements, rest.bending(&specification), rest.twisting(&specification));
        let mass = masses(&specification, &network, dof_count, &rest.lengths);
        let mut inertia = Inertia::new(mass.clone());
        let mut external = dissipative_terms(&specification, &network, dof_count, &rest.lengths);
        let mut channels = Channels::default();
        external.extend(load_terms(&specification, &network, &rest.lengths, &mut channels));
        external.extend(MotorTorques::new(&motors).map(|term| Box::new(term) as Box<dyn External>));
        let mut stencils: Vec<Vec<usize>> = stretching.stencils();
        stencils.extend(hinges.stencils());
        stencils.extend(external.iter().flat_map(|term| term.stencils()));
        let pattern = Pattern::from_stencils(dof_count, stencils.iter().map(Vec::as_slice));
        stretching.bind(&pattern);
        hinges.bind(&pattern);
        inertia.bind(&pattern);
        external.iter_mut().for_each(|term| term.bind(&pattern));

        let (clamps, prescribed) = clamps(&specification, &network, dof_count);
        let filaments = Filaments::new(&specification, &network, &stencils, &prescribed, &rest.lengths);
        let force_weight = filaments.force_weights(&network);
        let spin = spin_resistances(&specification, &rest.lengths);
        let round_off = RoundOff::new(&specification, &network, dof_count, (&rest.lengths, &rest.voronoi), &spin);
        let contact = specification
            .contact
            .as_ref()
            .map(|contact| ContactModel::new(contact, &specification, &network, &rest.lengths));
        let held: Vec<bool> = (0..network.node_count()).map(|k| prescribed[network.node_dofs()[k]]).collect();
        let (part_of_node, mut free_parts) = parts(network.edges(), &held, contact.is_some());
        let turned = network.edges().iter().zip(network.edge_dofs()).filter(|(_, dof)| prescribed[**dof]);
        turned.for_each(|(&[i, _], _)| free_parts[part_of_node[i]] = false);
        let immersed = immersed_nodes(&specification);
        let fluid_dofs = immersed.iter().map(|&node| network.node_dofs()[node]).collect();
        let model = Self {
            storage: Storage::new(pattern, network.node_dofs(), fluid_dofs, &prescribed)?,
            weights: weights(&specification, &network, dof_count, &rest.lengths),
            part_of_node,
            free_parts,
            regularization: regularization(&specification),
            dof_count,
            stretching,
            hinges,
            external,
            inertia,
            motors,
            clamps,
            prescribed,
            mass,
            error_weight: filaments.error_weights(&force_weight),
            filaments,
            round_off,
            force_weight,
            contact,
            network,
            load_channels: channels.count(),
            specification,
        };
        Ok(model)
    }

    /// The deepest overlap of nodes (m) from which contact cannot go on.
    pub(crate) fn overlap(&self, nodes: &[Vec3]) -> Option<Overlap> {
        self.contact.as_ref()?.overlap(nodes)
    }

    /// The law of barrier contact, if there is any.
    pub(crate) fn barrier(&self) -> Option<&BarrierLaw> {
        self.contact.as_ref().and_then(ContactModel::barrier)
    }

    /// The terms that have an energy; stretching comes first.
    pub fn conservative(&self) -> impl Iterator<Item = &dyn Conservative> {
        let elastic: [&dyn Conservative; 2] = [&self.stretching, &self.hinges];
        elastic.into_iter()
    }

    /// Largest displacement, relative to the size of its filament.
    pub(crate) fn relative_size(&self, moved: &[f64]) -> f64 {
        moved.iter().zip(&self.error_weight).map(|(moved, weight)| moved.abs() * weight).fold(0.0, f64::max)
    }

    /// Adds the residual of the terms without an energy at a configuration at rest, under given values of the loads' signals.
    pub(crate) fn add_at_rest(
        &self,
        time: f64,
        inputs: &[f64],
        configuration: &Configuration,
        residual: &mut [f64],
    ) -> Result<(), TermError> {
        let zero = vec![0.0; self.dof_count];
        let increment = Increment {
            time,
            rate: 0.0,
            previous: &zero,
            drift: &zero,
            velocity: &zero,
            velocity_drift: &zero,
            inputs,
            motor_torques: &vec![0.0; self.motors.len()],
            background: None,
        };
        let mut out = Assembly { residual, jacobian: None };
        self.external.iter().try_for_each(|term| term.add(configuration, &increment, &mut out))
    }

    /// Topology and numbering.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// The parts that move on their own.
    pub fn filaments(&self) -> &Filaments {
        &self.filaments
    }

    /// Number of bodies that contact knows: edges, and with barrier contact spheres and walls.
    pub fn body_count(&self) -> usize {
        self.barrier().map_or(self.network.edges().len(), |law| law.bodies().count())
    }

    /// Number of degrees of freedom, free motor angles last.
    pub fn dof_count(&self) -> usize {
        self.dof_count
    }

    /// Mass of every degree of freedom: kg for positions, kg m^2 for angles.
    pub fn mass(&self) -> &[f64] {
        &self.mass
    }

    /// Sparsity pattern of the derivative.
    pub fn pattern(&self) -> &Pattern {
        &self.storage.pattern
    }

    /// Names of the active terms.
    pub fn term_names(&self) -> Vec<&'static str> {
        let mut names: Vec<&'static str> = self.conservative().map(|term| term.name()).collect();
        names.extend(self.external.iter().map(|term| term.name()));
        names
    }

    /// Angles of all shafts.
    pub(crate) fn shafts(&self, angles: &[f64], q: &[f64]) -> Vec<ShaftAngle> {
        self.motors.iter().zip(angles).map(|(motor, &angle)| motor.shaft(angle, q)).collect()
    }

    /// A fresh drag model, with its own workspace.
    pub(crate) fn fluid(&self) -> Result<Option<Box<dyn FluidModel>>, LinearError> {
        self.fluid_with(None)
    }

    /// A fresh drag model with a choice of its own on when there is no matrix.
    pub(crate) fn fluid_with(
        &self,
        choice: Option<&FarFieldChoice>,
    ) -> Result<Option<Box<dyn FluidModel>>, LinearError> {
        let Some(fluid) = self.specification.fluid.as_ref() else { return Ok(None) };
        let (edges, nodes) = (self.network.edges(), &self.specification.nodes);
        if !fluid.immersed.iter().any(|&immersed| immersed) {
            return Ok(None);
        }
        Ok(Some(match &fluid.model {
            FluidModelSpecification::ResistiveForce { coefficients } => {
                Box::new(ResistiveForce::new(edges, &fluid.immersed, coefficients))
            }
            FluidModelSpecification::StokesletSegments { epsilon, far_field } => {
                let local = preconditioner_drag(fluid.viscosity, &self.specification, epsilon);
                let (immersed, far_field) = (&fluid.immersed, choice.unwrap_or(far_field));
                let model =
                    StokesletSegments::new(nodes, edges, immersed, epsilon, fluid.viscosity, &local, far_field)?;
                Box::new(match self.specification.boundary() {
                    Some(boundary) => model.with_boundary(boundary),
                    None => model,
                })
            }
        }))
    }
}

/// Ascending nodes of the immersed edges.
fn immersed_nodes(specification: &Specification) -> Vec<usize> {
    specification.fluid.as_ref().map_or_else(Vec::new, |fluid| immersed_part(&specification.edges, &fluid.immersed).0)
}

/// Slender-body coefficients with the logarithm of the mean edge's aspect ratio: a guess good enough to precondition with.
fn preconditioner_drag(viscosity: f64, specification: &Specification, epsilon: &[f64]) -> Vec<[f64; 2]> {
    specification
        .edges
        .iter()
        .zip(epsilon)
        .map(|(&[i, j], &epsilon)| {
            let length = (specification.nodes[j] - specification.nodes[i]).norm();
            let logarithm = (1.0 + 4.0 * length / epsilon).ln();
            let across = 4.0 * PI * viscosity / (logarithm + 0.5);
            [0.5 * across, across]
        })
        .collect()
}

struct RestShape {
    lengths: Vec<f64>,
    voronoi: Vec<f64>,
    curvatures: Vec<[f64; 2]>,
    twists: Vec<f64>,
}

impl RestShape {
    fn new(specification: &Specification, network: &Network) -> Result<Self, ModelError> {
        let nodes = &specification.rest_nodes;
        let lengths: Vec<f64> = network.edges().iter().map(|&[i, j]| (nodes[j] - nodes[i]).norm()).collect();
        let frames = shape_frames(specification, network, nodes);
        let mut configuration = Configuration::new(network, network.dof_count());
        let q = coordinates(network, nodes, &vec![0.0; lengths.len()], network.dof_count());
        if !configuration.update(network, &q, &frames, &[]) {
            return Err(ModelError::Shape { shape: "rest_nodes" });
        }
        let strains = (0..network.hinges().len()).map(|k| *configuration.strain(k));
        Ok(Self {
            voronoi: network
                .hinges()
                .iter()
                .map(|hinge| 0.5 * (lengths[hinge.edges[0]] + lengths[hinge.edges[1]]))
                .collect(),
            curvatures: strains.clone().map(|strain| strain.kappa).collect(),
            twists: strains.map(|strain| strain.tau).collect(),
            lengths,
        })
    }

    fn bending(&self, specification: &Specification) -> Vec<Bending> {
        (0..self.voronoi.len())
            .map(|k| Bending {
                stiffness: specification.bending[k].map(|row| row.map(|entry| entry / self.voronoi[k])),
                natural: specification.natural_curvature[k].unwrap_or(self.curvatures[k]),
            })
            .collect()
    }

    fn twisting(&self, specification: &Specification) -> Vec<Twisting> {
        (0..self.voronoi.len())
            .map(|k| Twisting {
                stiffness: specification.twisting[k] / self.voronoi[k],
                natural: specification.natural_twist[k].unwrap_or(self.twists[k]),
            })
            .collect()
    }
}

/// Reference frames of a shape.
pub(crate) fn shape_frames(specification: &Specification, network: &Network, nodes: &[Vec3]) -> ReferenceFrames {
    let first = |edge: usize| specification.directors.iter().find(|(k, _)| *k == edge).map(|(_, director)| *director);
    ReferenceFrames::of_shape(network, nodes, &first)
}

/// Degrees of freedom of positions (m) and edge angles (rad).
pub(crate) fn coordinates(network: &Network, nodes: &[Vec3], theta: &[f64], dof_count: usize) -> Vec<f64> {
    let mut q = vec![0.0; dof_count];
    for (node, &dof) in nodes.iter().zip(network.node_dofs()) {
        q[dof..dof + 3].copy_from_slice(node.as_slice());
    }
    for (&angle, &dof) in theta.iter().zip(network.edge_dofs()) {
        q[dof] = angle;
    }
    q
}

fn motors(specification: &Specification, first_free: usize) -> Vec<Motor> {
    let mut next = first_free;
    specification
        .motors
        .iter()
        .map(|motor| Motor {
            hinge: motor.hinge,
            shaft_second: motor.shaft_second,
            drive: if motor.by_torque {
                next += 1;
                Drive::Torque { dof: next - 1 }
            } else {
                Drive::Speed
            },
        })
        .collect()
}

fn free_angle(motors: &[Motor], hinge: usize) -> Option<(usize, usize, f64)> {
    motors.iter().filter(|motor| motor.hinge == hinge).find_map(|motor| match motor.drive {
        Drive::Torque { dof } => {
            let (row, sign) = Motor::angle_row(motor.shaft_second);
            Some((dof, row, sign))
        }
        Drive::Speed => None,
    })
}

fn clamps(specification: &Specification, network: &Network, dof_count: usize) -> (Vec<Clamp>, Vec<bool>) {
    let mut prescribed = vec![false; dof_count];
    let clamps = specification
        .clamps
        .iter()
        .map(|clamp| {
            let nodes: Vec<usize> = clamp.nodes.iter().map(|&node| network.node_dofs()[node]).collect();
            let whole = clamp.axes == [true; 3];
            let edges: Vec<ClampedEdge> = clamp
                .edges
                .iter()
                .map(|&edge| ClampedEdge {
                    dof: network.edge_dofs()[edge],
                    edge,
                    rigid: whole && network.edges()[edge].iter().all(|node| clamp.nodes.contains(node)),
                })
                .collect();
            for &dof in &nodes {
                (0..3).filter(|&c| clamp.axes[c]).for_each(|c| prescribed[dof + c] = true);
            }
            edges.iter().for_each(|edge| prescribed[edge.dof] = true);
            Clamp { nodes, axes: clamp.axes, edges }
        })
        .collect();
    (clamps, prescribed)
}
