//! The terms of the force balance that a scene asks for: masses, drag besides the fluid's own, weight, loads and fields.

use std::f64::consts::PI;

use crate::Vec3;
use crate::fluid::head::Head;
use crate::fluid::twist_drag::TwistDrag;
use crate::forces::channels::Channels;
use crate::forces::follower::{FollowerForce, FollowerTorque};
use crate::forces::laboratory::{EdgeTorque, NodeForce};
use crate::forces::magnetic::Magnetism;
use crate::forces::weight::Weight;
use crate::model::specification::{FluidModelSpecification, Frame, LoadKind, Specification};
use crate::rod::network::Network;
use crate::rod::term::External;

/// Mass of a solid round edge, half on each node, and its moment of inertia `m a^2 / 2` about the centreline.
pub(crate) fn masses(specification: &Specification, network: &Network, dof_count: usize, lengths: &[f64]) -> Vec<f64> {
    let mut mass = vec![0.0; dof_count];
    for (k, &[i, j]) in network.edges().iter().enumerate() {
        let radius = specification.radius[k];
        let own = specification.density[k] * PI * radius * radius * lengths[k];
        for node in [i, j] {
            let dof = network.node_dofs()[node];
            mass[dof..dof + 3].iter_mut().for_each(|m| *m += 0.5 * own);
        }
        mass[network.edge_dofs()[k]] = 0.5 * own * radius * radius;
    }
    if let Some(head) = &specification.head {
        let dof = network.node_dofs()[head.node];
        mass[dof..dof + 3].iter_mut().for_each(|m| *m += head.mass);
    }
    mass
}

/// Resistance of every edge to spinning about its centreline, N m s.
pub(crate) fn spin_resistances(specification: &Specification, lengths: &[f64]) -> Vec<f64> {
    let Some(fluid) = specification.fluid.as_ref().filter(|fluid| fluid.twist_drag) else {
        return vec![0.0; lengths.len()];
    };
    let resistance = |edge: usize| 4.0 * PI * fluid.viscosity * specification.radius[edge].powi(2) * lengths[edge];
    (0..lengths.len()).map(|edge| if fluid.immersed[edge] { resistance(edge) } else { 0.0 }).collect()
}

pub(crate) fn dissipative_terms(
    specification: &Specification,
    network: &Network,
    dof_count: usize,
    lengths: &[f64],
) -> Vec<Box<dyn External>> {
    let mut terms: Vec<Box<dyn External>> = Vec::new();
    if let Some(fluid) = specification.fluid.as_ref().filter(|fluid| fluid.twist_drag) {
        let edges: Vec<usize> = (0..network.edges().len()).filter(|&edge| fluid.immersed[edge]).collect();
        let spin = spin_resistances(specification, lengths);
        let coefficients = edges.iter().map(|&edge| spin[edge]).collect();
        if !edges.is_empty() {
            terms.push(Box::new(TwistDrag::new(network, edges, coefficients)));
        }
    }
    if let Some(head) = &specification.head {
        let drag = [head.translation, head.rotation];
        terms.push(Box::new(Head::new(network, head.node, head.edges.clone(), lengths, drag)));
    }
    let forces = weights(specification, network, dof_count, lengths);
    if forces.iter().any(|&force| force != 0.0) {
        terms.push(Box::new(Weight::new(forces)));
    }
    terms
}

/// Regularization of every immersed edge, m, and zero for dry ones and other models.
pub(crate) fn regularization(specification: &Specification) -> Vec<f64> {
    let mut out = vec![0.0; specification.edges.len()];
    if let Some(fluid) = &specification.fluid
        && let FluidModelSpecification::StokesletSegments { epsilon, .. } = &fluid.model
    {
        let wet = fluid.immersed.iter().zip(epsilon);
        out.iter_mut().zip(wet).for_each(|(out, (&wet, &epsilon))| *out = if wet { epsilon } else { 0.0 });
    }
    out
}

/// Weight less buoyancy on every degree of freedom, N.
pub(crate) fn weights(specification: &Specification, network: &Network, dof_count: usize, lengths: &[f64]) -> Vec<f64> {
    let mut forces = vec![0.0; dof_count];
    let mut add = |node: usize, force: Vec3| {
        let dof = network.node_dofs()[node];
        (0..3).for_each(|c| forces[dof + c] += force[c]);
    };
    for (k, &[i, j]) in network.edges().iter().enumerate() {
        let buoyancy = specification.fluid.as_ref().map_or(0.0, |fluid| fluid.density);
        let volume = PI * specification.radius[k].powi(2) * lengths[k];
        let weight = specification.gravity * ((specification.density[k] - buoyancy) * volume);
        add(i, weight * 0.5);
        add(j, weight * 0.5);
    }
    if let Some(head) = &specification.head {
        add(head.node, specification.gravity * head.mass);
    }
    forces
}

/// Terms of loads that follow signals: three channels for every load, then three for the magnetic field, as [`crate::inputs::Inputs`] has them.
pub(crate) fn load_terms(
    specification: &Specification,
    network: &Network,
    lengths: &[f64],
    channels: &mut Channels,
) -> Vec<Box<dyn External>> {
    let mut terms: Vec<Box<dyn External>> = Vec::new();
    for load in &specification.loads {
        let channels = channels.take_vector();
        // Per length: half of an edge's share goes to each of its nodes.
        let halves = |edge: usize| (edge, [0.5 * lengths[edge]; 2]);
        let whole = |edge: usize| (edge, lengths[edge]);
        let term: Box<dyn External> = match (&load.kind, load.frame) {
            (LoadKind::NodeForce { node, .. }, Frame::Laboratory) => {
                Box::new(NodeForce::new(network, &[(*node, 1.0)], channels))
            }
            (LoadKind::NodeForce { node, edge }, Frame::Material) => {
                let weights = network.edges()[*edge].map(|end| if end == *node { 1.0 } else { 0.0 });
                Box::new(FollowerForce::new(network, vec![(*edge, weights)], channels))
            }
            (LoadKind::ForcePerLength { edges }, Frame::Laboratory) => {
                let shares = |&edge: &usize| network.edges()[edge].map(|node| (node, 0.5 * lengths[edge]));
                let nodes: Vec<(usize, f64)> = edges.iter().flat_map(shares).collect();
                Box::new(NodeForce::new(network, &nodes, channels))
            }
            (LoadKind::ForcePerLength { edges }, Frame::Material) => {
                let edges = edges.iter().map(|&edge| halves(edge)).collect();
                Box::new(FollowerForce::new(network, edges, channels))
            }
            (LoadKind::EdgeTorque { edge }, Frame::Laboratory) => {
                Box::new(EdgeTorque::new(network, vec![(*edge, 1.0)], channels))
            }
            (LoadKind::EdgeTorque { edge }, Frame::Material) => {
                Box::new(FollowerTorque::new(network, vec![(*edge, 1.0)], channels))
            }
            (LoadKind::TorquePerLength { edges }, Frame::Laboratory) => {
                Box::new(EdgeTorque::new(network, edges.iter().map(|&edge| whole(edge)).collect(), channels))
            }
            (LoadKind::TorquePerLength { edges }, Frame::Material) => {
                Box::new(FollowerTorque::new(network, edges.iter().map(|&edge| whole(edge)).collect(), channels))
            }
        };
        terms.push(term);
    }
    if let Some(magnetism) = &specification.magnetism {
        let channels = channels.take_vector();
        terms.push(Box::new(Magnetism::new(network, magnetism.moments.clone(), channels, magnetism.gradient)));
    }
    terms
}
