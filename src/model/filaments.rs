//! The filaments of a scene, the parts that move on their own, and the lengths by which errors and forces of each are measured.
//!
//! A filament is a set of degrees of freedom that the terms of the force balance couple: the arms of a branched network, or
//! what head and motors join, are one. What is held parts them: a node that is clamped passes no motion on. Degrees of
//! freedom that are held make filaments of their own, whose errors do not count.

use std::collections::VecDeque;

use crate::model::specification::Specification;
use crate::rod::network::Network;
use crate::{Mat3, Vec3};

/// A filament straighter than this part of its length is measured by that.
const STRAIGHT_SHARE: f64 = 1.0 / 20.0;

/// One filament.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filament {
    /// Whether all of its degrees of freedom are prescribed.
    pub held: bool,
    /// The length that relative errors refer to, m: the root mean square distance of the rest shape from its principal axis, the
    /// helix radius of a flagellum; for filaments straighter than that, a twentieth of the length.
    pub size: f64,
    /// Length of the longest way along the filament, m.
    pub length: f64,
    /// Mean rest length of its edges, m.
    pub mean_edge: f64,
    /// Largest bending stiffness over the length squared, N.
    pub bending_force: f64,
}

/// The filaments of a scene and the one that each degree of freedom belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct Filaments {
    of_dof: Vec<usize>,
    all: Vec<Filament>,
}

impl Filaments {
    /// Parts the degrees of freedom by the stencils that couple them and by what is prescribed; rest lengths in m.
    pub(crate) fn new(
        specification: &Specification,
        network: &Network,
        stencils: &[Vec<usize>],
        prescribed: &[bool],
        lengths: &[f64],
    ) -> Self {
        let (of_dof, count) = parts(network, stencils, prescribed);
        let nodes = nodes_of(network, stencils, &of_dof, count);
        let mut shapes = Shapes::new(specification, network, lengths);
        let mut all: Vec<Filament> = nodes.iter().map(|nodes| shapes.filament(nodes)).collect();
        of_dof.iter().zip(prescribed).for_each(|(&filament, &held)| all[filament].held = held);
        for (hinge, ei) in network.hinges().iter().zip(&specification.bending) {
            let stiffest = 0.5 * (ei[0][0] + ei[1][1]) + (0.5 * (ei[0][0] - ei[1][1])).hypot(ei[0][1]);
            for &node in &hinge.nodes {
                let filament = &mut all[of_dof[network.node_dofs()[node]]];
                filament.bending_force = filament.bending_force.max(stiffest / filament.length.powi(2));
            }
        }
        Self { of_dof, all }
    }

    /// All filaments, in the order of their first degrees of freedom.
    pub fn all(&self) -> &[Filament] {
        &self.all
    }

    /// The filament of every degree of freedom.
    pub fn of_dof(&self) -> &[usize] {
        &self.of_dof
    }

    /// What turns residuals into forces: 1 for positions, one over the mean edge of the filament for angles.
    pub(crate) fn force_weights(&self, network: &Network) -> Vec<f64> {
        let mut weights: Vec<f64> = self.of_dof.iter().map(|&filament| 1.0 / self.all[filament].mean_edge).collect();
        network.node_dofs().iter().for_each(|&dof| weights[dof..dof + 3].fill(1.0));
        weights
    }

    /// What turns errors of degrees of freedom into relative ones: one over the size of the filament for positions, angles
    /// counting with its mean edge; 0 for what is held.
    pub(crate) fn error_weights(&self, force_weights: &[f64]) -> Vec<f64> {
        let relative = |(&filament, weight): (&usize, &f64)| {
            let Filament { held, size, .. } = self.all[filament];
            if held { 0.0 } else { 1.0 / (weight * size) }
        };
        self.of_dof.iter().zip(force_weights).map(relative).collect()
    }
}

/// Sets of degrees of freedom, joined as couplings are found (Tarjan 1975).
struct Sets(Vec<usize>);

impl Sets {
    fn root(&mut self, mut k: usize) -> usize {
        while self.0[k] != k {
            self.0[k] = self.0[self.0[k]];
            k = self.0[k];
        }
        k
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        let (low, high) = (a.min(b), a.max(b));
        self.0[high] = low;
    }
}

/// The filament of every degree of freedom, and how many there are.
fn parts(network: &Network, stencils: &[Vec<usize>], prescribed: &[bool]) -> (Vec<usize>, usize) {
    let mut sets = Sets((0..prescribed.len()).collect());
    let mut couple = |dofs: &mut dyn Iterator<Item = usize>| {
        let mut last = [None; 2];
        for dof in dofs {
            if let Some(other) = last[usize::from(prescribed[dof])].replace(dof) {
                sets.join(other, dof);
            }
        }
    };
    for &dof in network.node_dofs() {
        couple(&mut (dof..dof + 3));
    }
    for (&[i, j], &angle) in network.edges().iter().zip(network.edge_dofs()) {
        couple(&mut [network.node_dofs()[i], network.node_dofs()[j], angle].into_iter());
    }
    stencils.iter().for_each(|stencil| couple(&mut stencil.iter().copied()));
    let mut count = 0;
    let mut number = vec![0; prescribed.len()];
    for dof in 0..prescribed.len() {
        let root = sets.root(dof);
        if root == dof {
            number[dof] = count;
            count += 1;
        } else {
            number[dof] = number[root];
        }
    }
    (number, count)
}

/// The nodes of every filament and the held ones beside it, ascending.
fn nodes_of(network: &Network, stencils: &[Vec<usize>], of_dof: &[usize], count: usize) -> Vec<Vec<usize>> {
    let dofs = network.node_dofs();
    let mut node_of_dof = vec![None; of_dof.len()];
    dofs.iter().enumerate().for_each(|(node, &dof)| node_of_dof[dof] = Some(node));
    let mut nodes = vec![Vec::new(); count];
    dofs.iter().enumerate().for_each(|(node, &dof)| nodes[of_dof[dof]].push(node));
    for (&[i, j], &angle) in network.edges().iter().zip(network.edge_dofs()) {
        for filament in [of_dof[dofs[i]], of_dof[dofs[j]], of_dof[angle]] {
            nodes[filament].extend([i, j]);
        }
    }
    for stencil in stencils {
        for &dof in stencil {
            nodes[of_dof[dof]].extend(stencil.iter().filter_map(|&other| node_of_dof[other]));
        }
    }
    nodes.iter_mut().for_each(|nodes| {
        nodes.sort_unstable();
        nodes.dedup();
    });
    nodes
}

/// The rest shape, as a graph of nodes.
struct Shapes<'a> {
    nodes: &'a [Vec3],
    neighbours: Vec<Vec<(usize, f64)>>,
    /// Distance along the filament that is looked at; infinite where not reached, NaN elsewhere.
    distance: Vec<f64>,
}

impl<'a> Shapes<'a> {
    fn new(specification: &'a Specification, network: &Network, lengths: &[f64]) -> Self {
        let nodes = &specification.rest_nodes;
        let mut neighbours = vec![Vec::new(); nodes.len()];
        for (&[i, j], &length) in network.edges().iter().zip(lengths) {
            neighbours[i].push((j, length));
            neighbours[j].push((i, length));
        }
        Self { nodes, neighbours, distance: vec![f64::NAN; nodes.len()] }
    }

    fn filament(&mut self, nodes: &[usize]) -> Filament {
        let across = self.across(nodes);
        // From anywhere to the farthest node and from there to the farthest: the longest way, on a tree.
        let end = self.farthest(nodes, nodes[0]).0;
        let length = self.farthest(nodes, end).1;
        let (mut total, mut count) = (0.0, 0);
        for &node in nodes {
            for &(_, edge) in self.neighbours[node].iter().filter(|(other, _)| nodes.binary_search(other).is_ok()) {
                total += edge;
                count += 1;
            }
        }
        // A node without edges has no length; any will do, since nothing elastic acts on it.
        let mean_edge = if count > 0 { total / f64::from(count) } else { 1.0 };
        let length = if length > 0.0 { length } else { mean_edge };
        Filament { held: false, size: across.max(STRAIGHT_SHARE * length), length, mean_edge, bending_force: 0.0 }
    }

    /// Root mean square distance from the principal axis, m.
    fn across(&self, nodes: &[usize]) -> f64 {
        let count = nodes.len() as f64;
        let mean = nodes.iter().map(|&node| self.nodes[node]).sum::<Vec3>() / count;
        let offsets = nodes.iter().map(|&node| self.nodes[node] - mean);
        let spread: Mat3 = offsets.map(|offset| offset * offset.transpose()).sum::<Mat3>() / count;
        let along = spread.symmetric_eigenvalues().max();
        (spread.trace() - along).max(0.0).sqrt()
    }

    /// The node farthest from `start` along the edges between the nodes, and its distance, m.
    fn farthest(&mut self, nodes: &[usize], start: usize) -> (usize, f64) {
        nodes.iter().for_each(|&node| self.distance[node] = f64::INFINITY);
        self.distance[start] = 0.0;
        let mut queue = VecDeque::from([start]);
        while let Some(node) = queue.pop_front() {
            for &(other, length) in &self.neighbours[node] {
                let reached = self.distance[node] + length;
                // Nodes elsewhere have no distance, and compare as false.
                if reached < self.distance[other] {
                    self.distance[other] = reached;
                    queue.push_back(other);
                }
            }
        }
        let mut farthest = (start, 0.0);
        for &node in nodes {
            let distance = std::mem::replace(&mut self.distance[node], f64::NAN);
            if distance.is_finite() && distance > farthest.1 {
                farthest = (node, distance);
            }
        }
        farthest
    }
}
