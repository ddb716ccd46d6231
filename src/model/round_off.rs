//! How exactly the force on every degree of freedom is known in floating-point numbers, from what is beside it.

use crate::forces::motors::Drive;
use crate::model::Model;
use crate::model::specification::Specification;
use crate::rod::configuration::node;
use crate::rod::network::Network;

/// Rounding errors gathered over those of single numbers.
const GATHERED: f64 = 2.0;
/// Least curvature that a hinge counts with: the guess that round-off is taken from may be straighter than the solution.
const LEAST_BENT: f64 = 1e-2;

/// What multiplies the round-off of positions, angles and unity in the residual of every degree of freedom.
pub(crate) struct RoundOff {
    /// Of lengths over rest lengths: N for positions.
    constant: Vec<f64>,
    /// Of coordinates, as edges resist: N/m.
    position: Vec<f64>,
    /// Of angles, times the rate of the step: N s or N m s.
    spin: Vec<f64>,
    /// By hinge.
    joints: Vec<Joint>,
}

/// How a hinge resists. Forces on nodes feel its twist, and moments on edges its bending, through its curvature only: where it is hardly
/// bent they are known far better than each other, and a stiff twist must not hide a soft bend, nor the other way round.
struct Joint {
    /// Stiffnesses over the hinge's length, N m.
    bending: f64,
    twisting: f64,
    /// Length of its shorter edge, m.
    shortest: f64,
    /// Whether a motor sits there, which adds to the twist.
    driven: bool,
}

impl RoundOff {
    /// Stiffness beside every degree of freedom. Rest lengths of edges and of hinges in m, resistance of edges to spin in N m s.
    pub fn new(
        specification: &Specification,
        network: &Network,
        dof_count: usize,
        (lengths, voronoi): (&[f64], &[f64]),
        spin_drag: &[f64],
    ) -> Self {
        let zeros = || vec![0.0; dof_count];
        let mut all = Self { constant: zeros(), position: zeros(), spin: zeros(), joints: Vec::new() };
        let node = |node: usize| network.node_dofs()[node]..network.node_dofs()[node] + 3;
        for (k, &[i, j]) in network.edges().iter().enumerate() {
            for dof in node(i).chain(node(j)) {
                all.constant[dof] += specification.stretching[k];
                all.position[dof] += specification.stretching[k] / lengths[k];
                all.spin[dof] += spin_drag[k] / lengths[k];
            }
            all.spin[network.edge_dofs()[k]] += spin_drag[k];
        }
        for (k, hinge) in network.hinges().iter().enumerate() {
            let ei = &specification.bending[k];
            let driven = specification.motors.iter().any(|motor| motor.hinge == k);
            let shortest = lengths[hinge.edges[0]].min(lengths[hinge.edges[1]]);
            let (bending, twisting) = ((ei[0][0] + ei[1][1]) / voronoi[k], specification.twisting[k] / voronoi[k]);
            all.joints.push(Joint { bending, twisting, shortest, driven });
        }
        for (motor, first) in specification.motors.iter().filter(|motor| motor.by_torque).zip(network.dof_count()..) {
            let [e, f] = network.hinges()[motor.hinge].edges.map(|edge| network.edge_dofs()[edge]);
            all.spin[first] = all.spin[e].max(all.spin[f]);
        }
        all
    }

    /// Round-off of every force (moments over the mean edge) in a step from the degrees of freedom `q`, N; rates change by `rate` of
    /// displacements, their rates by `inertia`; `drag` is the resistance of every degree of freedom to moving by itself, N s/m, `twists` the reference twist of every hinge.
    pub fn floors(
        &self,
        model: &Model,
        (rate, inertia): (f64, f64),
        (drag, twists): (&[f64], &[f64]),
        q: &[f64],
        out: &mut Vec<f64>,
    ) {
        let of_dof = model.filaments.of_dof();
        let mut positional = vec![false; q.len()];
        model.network.node_dofs().iter().for_each(|&dof| positional[dof..dof + 3].fill(true));
        // Farthest coordinate, from the origin, and largest angle of every filament.
        let mut farthest = vec![0.0_f64; model.filaments.all().len()];
        let mut turned = vec![1.0_f64; farthest.len()];
        for (dof, value) in q.iter().enumerate() {
            let largest = if positional[dof] { &mut farthest } else { &mut turned };
            largest[of_dof[dof]] = largest[of_dof[dof]].max(value.abs());
        }
        let hinges = self.hinges(model, twists, (&farthest, &turned), q);
        out.clear();
        out.extend((0..q.len()).map(|dof| {
            let (x, theta) = (farthest[of_dof[dof]], turned[of_dof[dof]]);
            let own = (model.mass[dof] * inertia + drag[dof] * rate) * if positional[dof] { x } else { theta };
            let elastic = self.constant[dof] + self.position[dof] * x + hinges[dof];
            let spin = self.spin[dof] * rate * theta;
            GATHERED * f64::EPSILON * (elastic + spin + own) * model.force_weight[dof]
        }));
    }

    /// What the stiffness of hinges multiplies the round-off of unity by, in the residual of every degree of freedom, N or N m; `farthest`
    /// and `turned` are the largest coordinate and angle of every filament.
    fn hinges(&self, model: &Model, twists: &[f64], (farthest, turned): (&[f64], &[f64]), q: &[f64]) -> Vec<f64> {
        let (network, of_dof) = (&model.network, model.filaments.of_dof());
        let mut out = vec![0.0; q.len()];
        for (k, (joint, hinge)) in self.joints.iter().zip(network.hinges()).enumerate() {
            let &Joint { bending, twisting, shortest, driven } = joint;
            let [a, b, c] = hinge.nodes.map(|k| node(q, network.node_dofs()[k]));
            let (e, f) = (b - a, c - b);
            // Half the curvature binormal: the tangent of half the turning angle.
            let bent = e.cross(&f).norm() / (e.norm() * f.norm() + e.dot(&f));
            let bent = bent.max(0.5 * model.hinges.natural_curvature(k)).clamp(LEAST_BENT, 1.0);
            let angles = hinge.edges.map(|edge| q[network.edge_dofs()[edge]]);
            let twist = hinge.signs[1] * angles[1] - hinge.signs[0] * angles[0] + twists[k];
            let strained = if driven { 1.0 } else { (twist - model.hinges.natural_twist(k)).abs().min(1.0) };
            let filament = of_dof[network.node_dofs()[hinge.nodes[1]]];
            let (x, theta) = (farthest[filament] / shortest, turned[filament]);
            // Curvature is known to the round-off of positions and, through itself, of angles; twist the other way round.
            let bend_known = bending * (x + bent * theta);
            let twist_known = twisting * (theta + bent * x);
            for dof in hinge.nodes.iter().flat_map(|&k| (0..3).map(move |c| network.node_dofs()[k] + c)) {
                out[dof] += (bend_known + twist_known * bent + twisting * strained * x) / shortest;
            }
            for edge in hinge.edges {
                out[network.edge_dofs()[edge]] += bend_known * bent + twist_known;
            }
        }
        for motor in &model.motors {
            if let Drive::Torque { dof, .. } = motor.drive {
                let edges = network.hinges()[motor.hinge].edges.map(|edge| out[network.edge_dofs()[edge]]);
                out[dof] = edges[0].max(edges[1]);
            }
        }
        out
    }
}
