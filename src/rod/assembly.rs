//! How a term of the force balance hands its residual and its derivative to the solver.

use super::configuration::Configuration;
use super::frames::Holonomy;
use super::strain::{EDGE_F, Gradient8, Hessian8, THETA_E, THETA_F};
use crate::Vec3;
use crate::linear::pattern::{ElementSlots, Pattern};

/// How rates follow from the degrees of freedom at the end of a step; elastic terms do not need it.
///
/// A backward difference formula makes them `rate (q - previous) + drift`: backward Euler has `rate = 1/dt` and no
/// drift.
#[derive(Debug, Clone, Copy)]
pub struct Increment<'a> {
    /// Time at the end of the step, s.
    pub time: f64,
    /// Derivative of every rate with respect to its degree of freedom, 1/s.
    pub rate: f64,
    /// Degrees of freedom at the beginning of the step.
    pub previous: &'a [f64],
    /// Rates at the end of the step were the degrees of freedom those of its beginning.
    pub drift: &'a [f64],
    /// Rates at the beginning of the step.
    pub velocity: &'a [f64],
    /// What `drift` is to the degrees of freedom, to their rates.
    pub velocity_drift: &'a [f64],
    /// Values of the loads' signals at the end of the step.
    pub inputs: &'a [f64],
    /// Torques of motors at the end of the step, N m; zero for those of given speed.
    pub motor_torques: &'a [f64],
    /// The background flow, if there is any.
    pub background: Option<Background<'a>>,
}

/// What a background flow is at the nodes and edges of a scene.
#[derive(Debug, Clone, Copy)]
pub struct Background<'a> {
    /// Velocity at every node, m/s.
    pub node_velocities: &'a [Vec3],
    /// Half the vorticity at every node, rad/s.
    pub node_spins: &'a [Vec3],
    /// Half the vorticity about the tangent of every edge, rad/s.
    pub edge_spins: &'a [f64],
}

impl Increment<'_> {
    /// Rate of a degree of freedom whose value at the end of the step is `value`.
    #[inline]
    pub fn rate_of(&self, dof: usize, value: f64) -> f64 {
        self.rate * (value - self.previous[dof]) + self.drift[dof]
    }
}

/// Where a term adds its share: the residual (energy gradient minus forces) and, if wanted, its derivative on the model's pattern.
pub struct Assembly<'a> {
    /// Residual, one entry per degree of freedom, N or N m.
    pub residual: &'a mut [f64],
    /// Values of the derivative on the model's sparsity pattern.
    pub jacobian: Option<&'a mut [f64]>,
}

/// An element's degrees of freedom and the storage of its matrix.
#[derive(Debug, Clone)]
pub struct Element {
    /// Degrees of freedom, in the order of the local matrix.
    pub dofs: Vec<usize>,
    slots: Option<ElementSlots>,
}

impl Element {
    /// An element on these degrees of freedom.
    pub fn new(dofs: Vec<usize>) -> Self {
        Self { dofs, slots: None }
    }

    /// Looks up the storage.
    pub fn bind(&mut self, pattern: &Pattern) {
        self.slots = Some(pattern.element_slots(&self.dofs));
    }

    /// Adds a local gradient and, if wanted, a local column-major matrix.
    #[inline]
    pub fn add(&self, gradient: &[f64], matrix: Option<&[f64]>, out: &mut Assembly) {
        for (&dof, &value) in self.dofs.iter().zip(gradient) {
            out.residual[dof] += value;
        }
        if let (Some(matrix), Some(values), Some(slots)) = (matrix, out.jacobian.as_deref_mut(), &self.slots) {
            slots.add(matrix, values);
        }
    }
}

/// A hinge's element: local variables are mapped to nodes and angles, with the holonomy of both edges.
#[derive(Debug, Clone)]
pub struct HingeElement {
    element: Element,
    edges: [usize; 2],
    signs: [f64; 2],
    /// Derivative of the effective angles with respect to a motor angle that is itself a degree of freedom.
    motor: Option<(usize, f64)>,
}

const WIDTH: usize = 11;
/// Local order: first node, theta_e, shared node, theta_f, last node; a motor angle comes last.
const NODE_ROWS: [usize; 3] = [0, 4, 8];
const ANGLE_ROWS: [usize; 2] = [3, 7];

impl HingeElement {
    /// An element of a hinge; `motor` gives the degree of freedom of a free motor angle, the row of the angle it turns
    /// ([`THETA_E`] or [`THETA_F`]) and the sign.
    pub fn new(network: &super::network::Network, hinge: usize, motor: Option<(usize, usize, f64)>) -> Self {
        let hinge = network.hinges()[hinge];
        let node = |k: usize| network.node_dofs()[hinge.nodes[k]];
        let angle = |k: usize| network.edge_dofs()[hinge.edges[k]];
        let mut dofs = Vec::with_capacity(WIDTH + 1);
        dofs.extend(node(0)..node(0) + 3);
        dofs.push(angle(0));
        dofs.extend(node(1)..node(1) + 3);
        dofs.push(angle(1));
        dofs.extend(node(2)..node(2) + 3);
        if let Some((dof, _, _)) = motor {
            dofs.push(dof);
        }
        Self {
            element: Element::new(dofs),
            edges: hinge.edges,
            signs: hinge.signs,
            motor: motor.map(|(_, row, sign)| (row, sign)),
        }
    }

    /// The element's degrees of freedom.
    pub fn dofs(&self) -> &[usize] {
        &self.element.dofs
    }

    /// Looks up the storage.
    pub fn bind(&mut self, pattern: &Pattern) {
        self.element.bind(pattern);
    }

    /// Adds gradient and Hessian given in the hinge's eight variables.
    pub fn add(
        &self,
        configuration: &Configuration,
        mut gradient: Gradient8,
        hessian: Option<Hessian8>,
        out: &mut Assembly,
    ) {
        let spins = [configuration.holonomy(self.edges[0]), configuration.holonomy(self.edges[1])];
        let moments = [gradient[THETA_E], gradient[THETA_F]];
        let hessian = hessian.map(|hessian| self.with_holonomy(hessian, moments, &spins));
        for (start, moment, spin) in [(0, moments[0], &spins[0]), (EDGE_F, moments[1], &spins[1])] {
            let mut rows = gradient.fixed_rows_mut::<3>(start);
            rows += spin.gradient * moment;
        }
        let width = self.element.dofs.len();
        let mut local = [0.0; WIDTH + 1];
        self.spread_gradient(&gradient, &mut local);
        match hessian {
            None => self.element.add(&local[..width], None, out),
            Some(hessian) => {
                let mut matrix = [0.0; (WIDTH + 1) * (WIDTH + 1)];
                // Columns first, then rows: each is the map of a gradient.
                let mut half = [[0.0; WIDTH + 1]; 8];
                for (row, spread) in half.iter_mut().enumerate() {
                    self.spread_gradient(&hessian.column(row).into_owned(), spread);
                }
                for column in 0..width {
                    let line = Gradient8::from_fn(|row, _| half[row][column]);
                    let target: &mut [f64; WIDTH + 1] = (&mut matrix[column * width..column * width + WIDTH + 1])
                        .try_into()
                        .expect("the buffer holds one row more than is used");
                    *target = [0.0; WIDTH + 1];
                    self.spread_gradient(&line, target);
                }
                self.element.add(&local[..width], Some(&matrix[..width * width]), out);
            }
        }
    }

    fn with_holonomy(&self, mut hessian: Hessian8, moments: [f64; 2], spins: &[Holonomy; 2]) -> Hessian8 {
        let rows = [(0, THETA_E), (EDGE_F, THETA_F)];
        if spins.iter().all(|spin| spin.gradient == Vec3::zeros()) {
            return hessian;
        }
        // theta -> theta + beta(edge vector): J^T H J with J the identity plus the gradients of beta, then M Hess(beta).
        for (k, &(start, angle)) in rows.iter().enumerate() {
            let line = hessian.row(angle).into_owned();
            for i in 0..3 {
                for column in 0..8 {
                    hessian[(start + i, column)] += spins[k].gradient[i] * line[column];
                }
            }
        }
        for (k, &(start, angle)) in rows.iter().enumerate() {
            let line = hessian.column(angle).into_owned();
            for i in 0..3 {
                for row in 0..8 {
                    hessian[(row, start + i)] += spins[k].gradient[i] * line[row];
                }
            }
        }
        for (k, &(start, _)) in rows.iter().enumerate() {
            let mut block = hessian.fixed_view_mut::<3, 3>(start, start);
            block += spins[k].hessian * (self.signs[k] * moments[k]);
        }
        hessian
    }

    /// Maps a gradient from `(e, theta_e, f, theta_f)` to nodes and angles.
    #[inline]
    fn spread_gradient(&self, gradient: &Gradient8, out: &mut [f64; WIDTH + 1]) {
        for i in 0..3 {
            let (e, f) = (gradient[i], gradient[EDGE_F + i]);
            out[NODE_ROWS[0] + i] = -e;
            out[NODE_ROWS[1] + i] = e - f;
            out[NODE_ROWS[2] + i] = f;
        }
        out[ANGLE_ROWS[0]] = self.signs[0] * gradient[THETA_E];
        out[ANGLE_ROWS[1]] = self.signs[1] * gradient[THETA_F];
        if let Some((row, sign)) = self.motor {
            out[WIDTH] = sign * gradient[row];
        }
    }
}
