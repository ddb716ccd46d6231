//! The viscous fluid: models of the force it exerts on moving filaments, behind one trait.
//!
//! * [`lanes`]: vectors of numbers on every machine's instructions, chosen at run time (all `unsafe` of the crate).
//! * [`segment`]: integrals of a regularized Stokeslet over a straight segment.
//! * [`stokeslet`]: mobility matrix, velocity field and hat-function weights of segment networks.
//! * [`kernel`]: what walls and surfaces add to it.
//! * [`far_field`]: the mobility's product with a force density in time proportional to the number of nodes.
//! * [`product`]: with a stored matrix or without, by the number of nodes.
//! * [`rss`]: nonlocal drag by regularized Stokeslet segments.
//! * [`rft`]: resistive force theory, local drag coefficients along and across every edge.
//! * [`ambient`]: prescribed background flows.
//! * [`twist_drag`]: resistance of an edge to spinning about its own centreline.
//! * [`head`]: drag of a head, and and its couple about all axes.

pub mod ambient;
pub mod far_field;
pub mod head;
pub mod kernel;
pub mod lanes;
pub mod product;
pub mod rft;
pub mod rss;
pub mod segment;
pub mod stokeslet;
pub mod twist_drag;

use crate::linear::LinearError;
use crate::{Mat3, Vec3};

/// A model of the drag on the immersed part of a rod network, at a fixed geometry.
///
/// Vectors over the immersed nodes hold three components per node, in the order of [`Self::immersed`].
pub trait FluidModel: Send + Sync {
    /// What the model is called.
    fn name(&self) -> &'static str;

    /// The nodes the fluid acts on, ascending.
    fn immersed(&self) -> &[usize];

    /// Moves to a new geometry, given every node of the scene.
    ///
    /// # Errors
    /// If the resistance does not exist there.
    fn update(&mut self, nodes: &[Vec3], pool: Option<&rayon::ThreadPool>) -> Result<(), LinearError>;

    /// Force that drags the immersed nodes through the fluid at the given velocities, N; in place.
    ///
    /// # Errors
    /// If the solve fails.
    fn resist(&mut self, velocity: &mut [f64], pool: Option<&rayon::ThreadPool>) -> Result<(), LinearError>;

    /// Force per length on the fluid at the given nodal velocities, N/m; in place.
    ///
    /// # Errors
    /// If the solve fails.
    fn force_density(&mut self, velocity: &mut [f64], pool: Option<&rayon::ThreadPool>) -> Result<(), LinearError>;

    /// Resistance of every immersed node on its own, N s/m: the whole model if it is local, else a preconditioner.
    fn local(&self) -> &[Mat3];

    /// The model in mobility form, if it is not local.
    fn nonlocal(&mut self) -> Option<&mut (dyn Mobility + 'static)>;

    /// Whether [`Self::local`] is the whole model.
    fn is_local(&self) -> bool;
}

/// A nonlocal model in mobility form: velocities follow from nodal force densities `f` by `8 pi mu u = A f`, nodal
/// forces by `W f`.
pub trait Mobility: Send + Sync {
    /// `8 pi mu`, Pa s.
    fn scale(&self) -> f64;

    /// `out = A f`.
    ///
    /// # Errors
    /// If the product is made without the matrix, and there is no geometry yet.
    fn apply(&mut self, density: &[f64], out: &mut [f64], pool: Option<&rayon::ThreadPool>) -> Result<(), LinearError>;

    /// `out = A f`, at least to single precision.
    ///
    /// # Errors
    /// As [`Self::apply`].
    fn apply_roughly(
        &mut self,
        density: &[f64],
        out: &mut [f64],
        pool: Option<&rayon::ThreadPool>,
    ) -> Result<(), LinearError>;

    /// Whether products are made without the matrix; nothing of its size should then be formed.
    fn is_matrix_free(&self) -> bool;

    /// `out = W f`.
    fn weigh(&self, density: &[f64], out: &mut [f64]);

    /// `f <- W^-1 f`.
    ///
    /// # Errors
    /// If `W` is singular: an edge without length.
    fn unweigh(&mut self, force: &mut [f64]) -> Result<(), LinearError>;
}

/// Ascending nodes of the immersed edges, and these edges in that numbering.
pub(crate) fn immersed_part(edges: &[[usize; 2]], immersed: &[bool]) -> (Vec<usize>, Vec<[usize; 2]>, Vec<usize>) {
    let chosen: Vec<usize> = (0..edges.len()).filter(|&edge| immersed[edge]).collect();
    let mut nodes: Vec<usize> = chosen.iter().flat_map(|&edge| edges[edge]).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let place = |node: usize| nodes.partition_point(|&other| other < node);
    let local = chosen.iter().map(|&edge| edges[edge].map(place)).collect();
    (nodes, local, chosen)
}
