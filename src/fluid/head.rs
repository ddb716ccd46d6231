//! The head: drag on its node, and a couple against its turning about any axis on the edges fixed to it, both relative to a
//! background flow (docs/theory/fluid.md, 9).

use crate::linear::pattern::Pattern;
use crate::rod::assembly::{Assembly, Element, Increment};
use crate::rod::configuration::{Configuration, node};
use crate::rod::frames::Holonomy;
use crate::rod::network::Network;
use crate::rod::term::{External, Purpose, Term, TermError};
use crate::{Mat3, Vec3};

/// Most edges that may be fixed to a head; its matrix is made on the stack.
pub const MOST_EDGES: usize = 6;

/// Degrees of freedom of an edge: its first node, its angle, its second node.
const EDGE_WIDTH: usize = 7;
const WIDTH: usize = MOST_EDGES * EDGE_WIDTH;

/// Drag and counter-torque of a head.
pub struct Head {
    translation: f64,
    rotation: f64,
    node: usize,
    drag: Element,
    edges: Vec<usize>,
    /// Share of every edge in the head's angular velocity.
    shares: Vec<f64>,
    couple: Element,
}

/// What one edge says of the head's turning.
#[derive(Clone, Copy)]
struct Spoke {
    share: f64,
    /// Tangent over length.
    lever: Vec3,
    tangent: Vec3,
    /// Derivative of `lever` with respect to the edge vector.
    lever_slope: Mat3,
    /// Derivative of `tangent` with respect to the edge vector.
    tangent_slope: Mat3,
    rate: Vec3,
    spin: f64,
    /// Derivatives of the reference frame's spin with respect to the edge vector.
    holonomy: Holonomy,
}

impl Spoke {
    fn new(share: f64, edge: usize, dofs: &[usize], configuration: &Configuration, increment: &Increment) -> Self {
        let (tangent, length) = (configuration.tangent(edge), configuration.length(edge));
        let across = Mat3::identity() - tangent * tangent.transpose();
        let q = configuration.q();
        let rate = |dof: usize| Vec3::from_fn(|c, _| increment.rate_of(dof + c, q[dof + c]));
        Self {
            share,
            lever: tangent / length,
            tangent,
            lever_slope: (across - tangent * tangent.transpose()) / (length * length),
            tangent_slope: across / length,
            rate: rate(dofs[4]) - rate(dofs[0]),
            spin: increment.rate_of(dofs[3], q[dofs[3]]),
            holonomy: configuration.holonomy(edge),
        }
    }

    /// Its share of the head's angular velocity, rad/s.
    fn turning(&self) -> Vec3 {
        (self.lever.cross(&self.rate) + self.tangent * self.spin) * self.share
    }

    /// Derivatives of [`Self::turning`] with respect to edge vector and angle.
    fn turning_slopes(&self, rate: f64) -> (Mat3, Vec3) {
        let turned = self.lever.cross_matrix() * rate - self.rate.cross_matrix() * self.lever_slope;
        ((turned + self.tangent_slope * self.spin) * self.share, self.tangent * (self.share * rate))
    }

    /// Residual on edge vector and angle under a couple, in which it is linear: the work of the couple in a virtual turn.
    fn residual(&self, couple: &Vec3) -> (Vec3, f64) {
        let along = couple.dot(&self.tangent);
        ((couple.cross(&self.lever) + self.holonomy.gradient * along) * self.share, along * self.share)
    }

    /// Derivative of [`Self::residual`] with respect to the edge vector at a fixed couple: of the vector, and of the angle's.
    fn own_slope(&self, couple: &Vec3) -> (Mat3, Vec3) {
        let along = couple.dot(&self.tangent);
        let along_slope = self.tangent_slope * couple;
        // The slope of the holonomy is no gradient: its derivative has the curvature of the sphere besides the Hessian.
        let bend = self.holonomy.hessian - self.lever.cross_matrix() * (0.5 * self.lever.norm());
        let vector =
            couple.cross_matrix() * self.lever_slope + self.holonomy.gradient * along_slope.transpose() + bend * along;
        (vector * self.share, along_slope * self.share)
    }
}

impl Head {
    /// `translation` is `C_t 6 pi mu r_h` in N s/m, `rotation` is `C_r 8 pi mu r_h^3` in N m s; `edges` are the edges fixed
    /// to the head, at most [`MOST_EDGES`], which count with their rest lengths.
    pub fn new(
        network: &Network,
        head: usize,
        edges: Vec<usize>,
        rest_lengths: &[f64],
        [translation, rotation]: [f64; 2],
    ) -> Self {
        let node_dofs = |k: usize| network.node_dofs()[k]..network.node_dofs()[k] + 3;
        let total: f64 = edges.iter().map(|&edge| rest_lengths[edge]).sum();
        let shares = edges.iter().map(|&edge| rest_lengths[edge] / total).collect();
        let couple = edges
            .iter()
            .flat_map(|&edge| {
                let [i, j] = network.edges()[edge];
                node_dofs(i).chain([network.edge_dofs()[edge]]).chain(node_dofs(j))
            })
            .collect();
        Self {
            translation,
            rotation,
            node: head,
            drag: Element::new(node_dofs(head).collect()),
            edges,
            shares,
            couple: Element::new(couple),
        }
    }

    fn add_drag(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) {
        let dof = self.drag.dofs[0];
        let position = node(configuration.q(), dof);
        let flow = increment.background.map_or_else(Vec3::zeros, |background| background.node_velocities[self.node]);
        let velocity = Vec3::from_fn(|c, _| increment.rate_of(dof + c, position[c])) - flow;
        let force = velocity * self.translation;
        let matrix = Mat3::identity() * (self.translation * increment.rate);
        self.drag.add(force.as_slice(), Some(matrix.as_slice()), out);
    }

    fn add_couple(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) {
        let count = self.edges.len();
        let dofs = |k: usize| &self.couple.dofs[EDGE_WIDTH * k..EDGE_WIDTH * (k + 1)];
        let spoke = |k: usize| Spoke::new(self.shares[k], self.edges[k], dofs(k), configuration, increment);
        let flow = increment.background.map_or_else(Vec3::zeros, |background| background.node_spins[self.node]);
        let couple = ((0..count).map(|k| spoke(k).turning()).sum::<Vec3>() - flow) * self.rotation;
        let mut residual = [0.0; WIDTH];
        for k in 0..count {
            let (force, torque) = spoke(k).residual(&couple);
            store(&mut residual[EDGE_WIDTH * k..], &force, torque);
        }
        let width = EDGE_WIDTH * count;
        if out.jacobian.is_none() {
            self.couple.add(&residual[..width], None, out);
            return;
        }
        let mut matrix = [0.0; WIDTH * WIDTH];
        for m in 0..count {
            let source = spoke(m);
            let (by_vector, by_angle) = source.turning_slopes(increment.rate);
            for k in 0..count {
                let target = spoke(k);
                let (own_vector, own_angle) =
                    if k == m { target.own_slope(&couple) } else { (Mat3::zeros(), Vec3::zeros()) };
                let mut column = |local: usize, sign: f64, force: Vec3, torque: f64| {
                    let start = width * (EDGE_WIDTH * m + local) + EDGE_WIDTH * k;
                    store(&mut matrix[start..], &(force * sign), torque * sign);
                };
                for c in 0..3 {
                    let (force, torque) = target.residual(&(by_vector.column(c) * self.rotation));
                    let (force, torque) = (force + own_vector.column(c), torque + own_angle[c]);
                    column(c, -1.0, force, torque);
                    column(c + 4, 1.0, force, torque);
                }
                let (force, torque) = target.residual(&(by_angle * self.rotation));
                column(3, 1.0, force, torque);
            }
        }
        self.couple.add(&residual[..width], Some(&matrix[..width * width]), out);
    }
}

/// Spreads a residual of edge vector and angle to the edge's degrees of freedom.
fn store(out: &mut [f64], force: &Vec3, torque: f64) {
    for c in 0..3 {
        out[c] = -force[c];
        out[c + 4] = force[c];
    }
    out[3] = torque;
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
}

impl External for Head {
    fn purpose(&self) -> Purpose {
        Purpose::Head
    }

    fn add(&self, configuration: &Configuration, increment: &Increment, out: &mut Assembly) -> Result<(), TermError> {
        self.add_drag(configuration, increment, out);
        self.add_couple(configuration, increment, out);
        Ok(())
    }
}
