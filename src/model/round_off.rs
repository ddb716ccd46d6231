//! How exactly the force on every degree of freedom is known in floating-point numbers, from what is beside it.

use crate::model::Model;
use crate::model::specification::Specification;
use crate::rod::network::Network;

/// Rounding errors gathered over those of single numbers.
const GATHERED: f64 = 2.0;

/// What multiplies the round-off of positions, angles and unity in the residual of every degree of freedom.
pub(crate) struct RoundOff {
    /// Of lengths over rest lengths: N for positions.
    constant: Vec<f64>,
    /// Of coordinates: N/m for positions, N for angles.
    position: Vec<f64>,
    /// Of angles: N for positions, N m for angles.
    angle: Vec<f64>,
    /// Of angles, times the rate of the step: N s or N m s.
    spin: Vec<f64>,
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
        let mut all = Self { constant: zeros(), position: zeros(), angle: zeros(), spin: zeros() };
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
            let moment = (ei[0][0] + ei[1][1] + specification.twisting[k]) / voronoi[k];
            let shortest = lengths[hinge.edges[0]].min(lengths[hinge.edges[1]]);
            for dof in hinge.nodes.iter().flat_map(|&k| node(k)) {
                all.position[dof] += moment / shortest.powi(2);
                all.angle[dof] += moment / shortest;
            }
            for dof in hinge.edges.map(|edge| network.edge_dofs()[edge]) {
                all.position[dof] += moment / shortest;
                all.angle[dof] += moment;
            }
        }
        for (motor, first) in specification.motors.iter().filter(|motor| motor.by_torque).zip(network.dof_count()..) {
            let [e, f] = network.hinges()[motor.hinge].edges.map(|edge| network.edge_dofs()[edge]);
            for values in [&mut all.position, &mut all.angle, &mut all.spin] {
                values[first] = values[e].max(values[f]);
            }
        }
        all
    }

    /// Round-off of every force (moments over the mean edge) in a step from the degrees of freedom `q`, N; rates change by `rate` of
    /// displacements, their rates by `inertia`; `drag` is the resistance of every degree of freedom to moving by itself, N s/m.
    pub fn floors(&self, model: &Model, (rate, inertia): (f64, f64), drag: &[f64], q: &[f64], out: &mut Vec<f64>) {
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
        out.clear();
        out.extend((0..q.len()).map(|dof| {
            let (x, theta) = (farthest[of_dof[dof]], turned[of_dof[dof]]);
            let own = (model.mass[dof] * inertia + drag[dof] * rate) * if positional[dof] { x } else { theta };
            let elastic = self.constant[dof] + self.position[dof] * x + self.angle[dof] * theta;
            let spin = self.spin[dof] * rate * theta;
            GATHERED * f64::EPSILON * (elastic + spin + own) * model.force_weight[dof]
        }));
    }
}
