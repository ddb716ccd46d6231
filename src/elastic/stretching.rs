//! Stretching of edges: `1/2 EA eps^2 l` with `eps = |e|/l - 1` (equations 5 and 6).

use crate::Mat3;
use crate::linear::pattern::Pattern;
use crate::rod::assembly::{Assembly, Element};
use crate::rod::configuration::Configuration;
use crate::rod::network::Network;
use crate::rod::term::{Conservative, Term, TermError};

/// Stretching of every edge of a network.
pub struct Stretching {
    elements: Vec<Element>,
    stiffness: Vec<f64>,
    rest_lengths: Vec<f64>,
}

impl Stretching {
    /// `stiffness` is EA in N, `rest_lengths` in m, one of each per edge.
    pub fn new(network: &Network, stiffness: Vec<f64>, rest_lengths: Vec<f64>) -> Self {
        let elements = network
            .edges()
            .iter()
            .map(|nodes| {
                Element::new(nodes.iter().flat_map(|&k| (0..3).map(move |c| network.node_dofs()[k] + c)).collect())
            })
            .collect();
        Self { elements, stiffness, rest_lengths }
    }

    /// Strain of an edge.
    pub fn strain(&self, configuration: &Configuration, edge: usize) -> f64 {
        configuration.length(edge) / self.rest_lengths[edge] - 1.0
    }

    /// Energy, J.
    pub fn energy(&self, configuration: &Configuration) -> f64 {
        (0..self.elements.len())
            .map(|k| {
                let strain = configuration.length(k) / self.rest_lengths[k] - 1.0;
                0.5 * self.stiffness[k] * strain * strain * self.rest_lengths[k]
            })
            .sum()
    }

    fn tension(&self, configuration: &Configuration, edge: usize) -> f64 {
        self.stiffness[edge] * self.strain(configuration, edge)
    }

    /// Adds the residual, and the derivative as if the tensions that turn with the edges were the given ones (N, by edge).
    ///
    /// Newton's method on tensions as unknowns beside the positions has this matrix, once the tensions are eliminated. Those
    /// of a guess that stretches the edges spuriously would make a filament that is nearly inextensible buckle in the
    /// linear system.
    pub fn add_with_tensions(&self, configuration: &Configuration, tensions: &[f64], out: &mut Assembly) {
        self.add_turning(configuration, |k| tensions[k], out);
    }

    /// By how much a displacement of the degrees of freedom, to first order, changes the given tensions, N.
    pub fn tension_changes(&self, configuration: &Configuration, moved: &[f64], tensions: &[f64], out: &mut [f64]) {
        for (k, element) in self.elements.iter().enumerate() {
            let t = configuration.tangent(k);
            let relative: f64 = (0..3).map(|c| t[c] * (moved[element.dofs[3 + c]] - moved[element.dofs[c]])).sum();
            let linear = self.tension(configuration, k) + self.stiffness[k] * relative / self.rest_lengths[k];
            out[k] = linear - tensions[k];
        }
    }

    fn add_turning(&self, configuration: &Configuration, turning: impl Fn(usize) -> f64, out: &mut Assembly) {
        for (k, element) in self.elements.iter().enumerate() {
            let (length, rest, stiffness) = (configuration.length(k), self.rest_lengths[k], self.stiffness[k]);
            let t = configuration.tangent(k);
            let pull = t * self.tension(configuration, k);
            let gradient = [-pull.x, -pull.y, -pull.z, pull.x, pull.y, pull.z];
            if out.jacobian.is_none() {
                element.add(&gradient, None, out);
                continue;
            }
            let along = t * t.transpose();
            let block = along * (stiffness / rest) + (Mat3::identity() - along) * (turning(k) / length);
            let mut matrix = [0.0; 36];
            for i in 0..3 {
                for j in 0..3 {
                    let value = block[(i, j)];
                    matrix[i + 6 * j] = value;
                    matrix[i + 3 + 6 * (j + 3)] = value;
                    matrix[i + 3 + 6 * j] = -value;
                    matrix[i + 6 * (j + 3)] = -value;
                }
            }
            element.add(&gradient, Some(&matrix), out);
        }
    }
}

impl Term for Stretching {
    fn name(&self) -> &'static str {
        "stretching"
    }

    fn stencils(&self) -> Vec<Vec<usize>> {
        self.elements.iter().map(|element| element.dofs.clone()).collect()
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.elements.iter_mut().for_each(|element| element.bind(pattern));
    }
}

impl Conservative for Stretching {
    fn energies(&self, configuration: &Configuration, count: &mut dyn FnMut(&'static str, f64)) {
        count("stretching", self.energy(configuration));
    }

    fn add(&self, configuration: &Configuration, _: f64, out: &mut Assembly) -> Result<(), TermError> {
        self.add_turning(configuration, |k| self.tension(configuration, k), out);
        Ok(())
    }
}
