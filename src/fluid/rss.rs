//! Nonlocal drag by regularized Stokeslet segments: `8 pi mu u = A f`, forces `W f` (equations 12 to 14).
//!
//! `A` maps nodal force densities to nodal velocities by collocation and is not symmetric, so where its inverse is needed
//! (the explicit scheme, resistance matrices) it is factored by LU, or, in scenes too large for a matrix, applied by GMRES;
//! `W` holds the integrals of products of hat functions, so that total force and torque are exact (docs/theory, "Fluid").

use super::kernel::Boundary;
use super::kernel::network::Segments;
use super::product::{FarFieldChoice, Product};
use super::rft::ResistiveForce;
use super::stokeslet::HatWeights;
use super::{FluidModel, Mobility, immersed_part};
use crate::linear::LinearError;
use crate::linear::ldlt::SparseLdlt;
use crate::linear::pattern::Pattern;
use crate::{Mat3, Vec3};

/// Regularized Stokeslet segments on the immersed edges.
pub struct StokesletSegments {
    nodes: Vec<usize>,
    edges: Vec<[usize; 2]>,
    epsilon: Vec<f64>,
    viscosity: f64,
    positions: Vec<Vec3>,
    product: Product,
    weights: HatWeights,
    gram: Gram,
    scratch: Vec<f64>,
    local: ResistiveForce,
    boundary: Option<Boundary>,
}

impl StokesletSegments {
    /// `epsilon` is the regularization of every edge of the network, m; `local` are drag coefficients along and across,
    /// used for preconditioning only; `far_field` says from how many immersed nodes on there is no matrix.
    ///
    /// # Errors
    /// If the pattern of `W` cannot be analysed.
    pub fn new(
        nodes: &[Vec3],
        edges: &[[usize; 2]],
        immersed: &[bool],
        epsilon: &[f64],
        viscosity: f64,
        local: &[[f64; 2]],
        far_field: &FarFieldChoice,
    ) -> Result<Self, LinearError> {
        let (own, own_edges, chosen) = immersed_part(edges, immersed);
        let positions: Vec<Vec3> = own.iter().map(|&node| nodes[node]).collect();
        Ok(Self {
            product: Product::new(own.len(), far_field),
            weights: HatWeights::new(&positions, &own_edges),
            gram: Gram::new(own.len(), &own_edges)?,
            scratch: vec![0.0; 3 * own.len()],
            epsilon: chosen.iter().map(|&edge| epsilon[edge]).collect(),
            local: ResistiveForce::new(edges, immersed, local),
            nodes: own,
            edges: own_edges,
            viscosity,
            positions,
            boundary: None,
        })
    }

    /// The same model in a fluid that ends at a boundary. Its products take a matrix, whatever the size of the scene; the local drag,
    /// which preconditions, stays that of unbounded fluid.
    pub fn with_boundary(self, boundary: Boundary) -> Self {
        let product = Product::new(self.nodes.len(), &FarFieldChoice::NEVER);
        Self { product, boundary: Some(boundary), ..self }
    }

    /// Checks that all of the filament is where the fluid is.
    fn check_side(&self) -> Result<(), LinearError> {
        let Some(boundary) = &self.boundary else { return Ok(()) };
        let heights = self.positions.iter().map(|position| boundary.plane().height(position));
        match self.nodes.iter().zip(heights).find(|(_, height)| height.is_nan() || *height <= 0.0) {
            Some((node, height)) => Err(LinearError::Product(format!(
                "node {node} is {:.3e} m behind the wall, where there is no fluid; with a Contact, rods stay on their side",
                -height
            ))),
            None => Ok(()),
        }
    }
}

impl FluidModel for StokesletSegments {
    fn name(&self) -> &'static str {
        "regularized Stokeslet segments"
    }

    fn immersed(&self) -> &[usize] {
        &self.nodes
    }

    fn update(&mut self, nodes: &[Vec3], pool: Option<&rayon::ThreadPool>) -> Result<(), LinearError> {
        for (position, &node) in self.positions.iter_mut().zip(&self.nodes) {
            *position = nodes[node];
        }
        self.check_side()?;
        let segments = Segments { nodes: &self.positions, edges: &self.edges, epsilon: &self.epsilon };
        self.product.update(segments, self.boundary.as_ref(), pool)?;
        self.weights.update(&self.positions);
        self.gram.update(&self.positions, &self.edges)?;
        self.local.update(nodes, pool)
    }

    fn resist(&mut self, velocity: &mut [f64], pool: Option<&rayon::ThreadPool>) -> Result<(), LinearError> {
        self.force_density(velocity, pool)?;
        self.scratch.copy_from_slice(velocity);
        self.weights.apply(&self.scratch, velocity);
        Ok(())
    }

    fn force_density(&mut self, velocity: &mut [f64], pool: Option<&rayon::ThreadPool>) -> Result<(), LinearError> {
        let scale = self.scale();
        velocity.iter_mut().for_each(|component| *component *= scale);
        let Self { product, gram, local, .. } = self;
        // A node's own drag, as if all others moved along.
        let mut by_local_drag = |flow: &mut [f64]| {
            for (block, u) in local.local().iter().zip(flow.chunks_exact_mut(3)) {
                let force = block * Vec3::new(u[0], u[1], u[2]) / scale;
                u.copy_from_slice(force.as_slice());
            }
            gram.solve(flow)
        };
        product.invert(velocity, &mut by_local_drag, pool)
    }

    fn local(&self) -> &[Mat3] {
        self.local.local()
    }

    fn nonlocal(&mut self) -> Option<&mut (dyn Mobility + 'static)> {
        Some(self)
    }

    fn is_local(&self) -> bool {
        false
    }
}

impl Mobility for StokesletSegments {
    fn scale(&self) -> f64 {
        8.0 * std::f64::consts::PI * self.viscosity
    }

    fn apply(&mut self, density: &[f64], out: &mut [f64], pool: Option<&rayon::ThreadPool>) -> Result<(), LinearError> {
        self.product.apply(density, out, pool)
    }

    fn apply_roughly(
        &mut self,
        density: &[f64],
        out: &mut [f64],
        pool: Option<&rayon::ThreadPool>,
    ) -> Result<(), LinearError> {
        self.product.apply_roughly(density, out, pool)
    }

    fn is_matrix_free(&self) -> bool {
        !self.product.is_stored()
    }

    fn weigh(&self, density: &[f64], out: &mut [f64]) {
        self.weights.apply(density, out);
    }

    fn unweigh(&mut self, force: &mut [f64]) -> Result<(), LinearError> {
        self.gram.solve(force)
    }
}

/// The Gram matrix `W` of the hat functions, factored.
struct Gram {
    pattern: Pattern,
    slots: Vec<[usize; 4]>,
    values: Vec<f64>,
    ldlt: SparseLdlt,
    column: Vec<f64>,
}

impl Gram {
    fn new(nodes: usize, edges: &[[usize; 2]]) -> Result<Self, LinearError> {
        let pattern = Pattern::from_stencils(nodes, edges.iter().map(|edge| edge.as_slice()));
        let slot = |row, column| pattern.slot(row, column).ok_or(LinearError::Singular { what: "hat-function" });
        let slots = edges
            .iter()
            .map(|&[i, j]| Ok([slot(i, i)?, slot(j, j)?, slot(i, j)?, slot(j, i)?]))
            .collect::<Result<_, LinearError>>()?;
        Ok(Self {
            slots,
            values: vec![0.0; pattern.entries()],
            ldlt: SparseLdlt::new(&pattern)?,
            column: vec![0.0; nodes],
            pattern,
        })
    }

    fn update(&mut self, positions: &[Vec3], edges: &[[usize; 2]]) -> Result<(), LinearError> {
        self.values.fill(0.0);
        for (&[i, j], &[ii, jj, ij, ji]) in edges.iter().zip(&self.slots) {
            let sixth = (positions[j] - positions[i]).norm() / 6.0;
            self.values[ii] += 2.0 * sixth;
            self.values[jj] += 2.0 * sixth;
            self.values[ij] += sixth;
            self.values[ji] += sixth;
        }
        self.ldlt.factor(&self.pattern, &self.values)
    }

    fn solve(&mut self, vectors: &mut [f64]) -> Result<(), LinearError> {
        for c in 0..3 {
            self.column.iter_mut().enumerate().for_each(|(node, value)| *value = vectors[3 * node + c]);
            self.ldlt.solve(&mut self.column)?;
            self.column.iter().enumerate().for_each(|(node, value)| vectors[3 * node + c] = *value);
        }
        Ok(())
    }
}
