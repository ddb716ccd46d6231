//! Stretching of edges: `1/2 EA eps^2 l` with `eps = |e|/l - 1` (equations 5 and 6).

use crate::Mat3;
use crate::linear::pattern::Pattern;
use crate::rod::assembly::{Assembly, Element, Increment, Term};
use crate::rod::configuration::Configuration;
use crate::rod::network::Network;

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

    fn energy(&self, configuration: &Configuration) -> f64 {
        (0..self.elements.len())
            .map(|k| {
                let strain = configuration.length(k) / self.rest_lengths[k] - 1.0;
                0.5 * self.stiffness[k] * strain * strain * self.rest_lengths[k]
            })
            .sum()
    }

    fn add(&self, configuration: &Configuration, _: &Increment, out: &mut Assembly) {
        for (k, element) in self.elements.iter().enumerate() {
            let (length, rest, stiffness) = (configuration.length(k), self.rest_lengths[k], self.stiffness[k]);
            let t = configuration.tangent(k);
            let tension = stiffness * (length / rest - 1.0);
            let pull = t * tension;
            let gradient = [-pull.x, -pull.y, -pull.z, pull.x, pull.y, pull.z];
            if out.jacobian.is_none() {
                element.add(&gradient, None, out);
                continue;
            }
            let along = t * t.transpose();
            let block = along * (stiffness / rest) + (Mat3::identity() - along) * (tension / length);
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
