//! The seed's head: drag on its node and a couple on the two neighbouring nodes (equations 15 to 18), both implicit.

use crate::linear::pattern::Pattern;
use crate::rod::assembly::{Assembly, Element, Increment, Term};
use crate::rod::configuration::{Configuration, node};
use crate::rod::network::Network;
use crate::{Mat3, Vec3};

/// Drag and counter-torque of a head.
pub struct Head {
    translation: f64,
    rotation: f64,
    drag: Element,
    couple: Element,
}

impl Head {
    /// `translation` is `C_t 6 pi mu r_h` in N s/m, `rotation` is `C_r 8 pi mu r_h^3` in N m s; `neighbours` are the nodes
    /// before and after the head's.
    pub fn new(network: &Network, head: usize, neighbours: [usize; 2], translation: f64, rotation: f64) -> Self {
        let dofs = |k: usize| network.node_dofs()[k]..network.node_dofs()[k] + 3;
        let couple = neighbours.iter().flat_map(|&k| dofs(k)).collect();
        Self { translation, rotation, drag: Element::new(dofs(head).collect()), couple: Element::new(couple) }
    }

    fn add_drag(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) {
        let force = rate_of_node(configuration, increment, self.drag.dofs[0]) * self.translation;
        let matrix = Mat3::identity() * (self.translation * increment.rate);
        self.drag.add(force.as_slice(), Some(matrix.as_slice()), out);
    }

    fn add_couple(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) {
        let (before, after) = (self.couple.dofs[0], self.couple.dofs[3]);
        let span = node(configuration.q(), after) - node(configuration.q(), before);
        let velocity = rate_of_node(configuration, increment, after) - rate_of_node(configuration, increment, before);
        let strength = self.rotation / span.norm_squared();
        let force = velocity * strength;
        let block = Mat3::identity() * (strength * increment.rate)
            - velocity * span.transpose() * (2.0 * strength / span.norm_squared());
        let residual = [-force.x, -force.y, -force.z, force.x, force.y, force.z];
        let mut matrix = [0.0; 36];
        for row in 0..3 {
            for column in 0..3 {
                let value = block[(row, column)];
                matrix[row + 6 * column] = value;
                matrix[row + 3 + 6 * (column + 3)] = value;
                matrix[row + 6 * (column + 3)] = -value;
                matrix[row + 3 + 6 * column] = -value;
            }
        }
        self.couple.add(&residual, Some(&matrix), out);
    }
}

fn rate_of_node(configuration: &Configuration, increment: &Increment, dof: usize) -> Vec3 {
    Vec3::from_fn(|c, _| increment.rate_of(dof + c, configuration.q()[dof + c]))
}

impl Term for Head {
    fn name(&self) -> &'static str {
        "head"
    }

    fn stencils(&self) -> Vec<Vec<usize>> {
        vec![self.drag.dofs.clone(), self.couple.dofs.clone()]
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.drag.bind(pattern);
        self.couple.bind(pattern);
    }

    fn add(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) {
        self.add_drag(configuration, increment, out);
        self.add_couple(configuration, increment, out);
    }
}
