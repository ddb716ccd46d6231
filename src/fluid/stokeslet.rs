//! Regularized Stokeslet segments of a whole network: mobility matrix, flow field, and the hat-function weights.
//!
//! A network carries a force *density* `f` (N/m) on its nodes, linear along each edge. Its flow is
//! `8 pi mu u(x) = A(x) f`, and the total force it exerts on the fluid near node `i` is `(W f)_i`, the integral of the
//! density times the hat function of the node. Sums over edges run in the order of the edges, whatever the number of
//! threads, so results are the same to the last bit on one thread and on many.

use rayon::ThreadPool;
use rayon::prelude::*;

use super::segment::{Blocks, Collect, Segment, Symmetric, for_each_target};
use crate::Vec3;

/// Target-edge pairs below which a thread pool is left alone. Waking it costs about 10 us however much there is to do
/// (measured at 20 to 136 nodes), as long as 400 pairs take; two threads break even at twice that and gain a quarter or
/// more from here on.
const SMALLEST_PARALLEL: usize = 2000;

/// Tasks for each thread of a pool: more than one keeps the threads even, more than a few cost more than they save.
const TASKS_PER_THREAD: usize = 2;

/// Position of the entry (row, column) in [`Symmetric`].
const ENTRY: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// Fills `out` with the dimensionless matrix `A` of `8 pi mu u = A f`.
///
/// `targets` (M) and `nodes` (N) are in metres, `edges` (E) index the nodes, `epsilon` (E) is each edge's regularization
/// length in metres. `out` holds the 3M x 3N matrix by columns: row `3 * target + component`, column
/// `3 * node + component`. Ends of edges may be targets like any others. Work is shared by the threads of `pool`.
///
/// # Panics
///
/// When the length of `out` or `epsilon` does not fit, or an edge names a node that does not exist or one node twice.
///
/// # Example
///
/// ```
/// use flagrs::{Vec3, fluid::stokeslet::mobility};
/// let nodes = [Vec3::zeros(), Vec3::new(5e-3, 0.0, 0.0)];
/// let mut matrix = [0.0; 36];
/// mobility(&nodes, &nodes, &[[0, 1]], &[1e-3], &mut matrix, None);
/// // The two ends of a lone edge are alike.
/// assert!((matrix[0] - matrix[3 + 6 * 3]).abs() < 1e-14);
/// ```
pub fn mobility(
    targets: &[Vec3],
    nodes: &[Vec3],
    edges: &[[usize; 2]],
    epsilon: &[f64],
    out: &mut [f64],
    pool: Option<&ThreadPool>,
) {
    assert_eq!(out.len(), 9 * targets.len() * nodes.len(), "out must hold 3 targets x 3 nodes");
    check_edges(nodes, edges, epsilon);
    if out.is_empty() {
        return;
    }
    let node_width = 9 * targets.len();
    let fill = |first_node: usize, columns: &mut [f64]| {
        columns.fill(0.0);
        let local_nodes = columns.len() / node_width;
        let local = |node: usize| node.checked_sub(first_node).filter(|&local| local < local_nodes);
        for (&[i, j], &epsilon) in edges.iter().zip(epsilon) {
            let (start, end) = columns_of(columns, node_width, local(i), local(j));
            if start.is_some() || end.is_some() {
                let mut columns = EdgeColumns { start: start.map(NodeColumns::new), end: end.map(NodeColumns::new) };
                for_each_target(&Segment::new(&nodes[i], &nodes[j], epsilon), targets, &mut columns);
            }
        }
    };
    match worthwhile(pool, targets.len() * edges.len()) {
        None => fill(0, out),
        Some(pool) => {
            // An edge across two tasks is computed by both; tasks of consecutive nodes keep those few.
            let nodes_per_task = nodes.len().div_ceil(TASKS_PER_THREAD * pool.current_num_threads());
            pool.install(|| {
                out.par_chunks_mut(node_width * nodes_per_task)
                    .enumerate()
                    .for_each(|(task, columns)| fill(task * nodes_per_task, columns));
            });
        }
    }
}

/// The parts of `columns` that belong to two different nodes, of those that are there.
fn columns_of(
    columns: &mut [f64],
    width: usize,
    start: Option<usize>,
    end: Option<usize>,
) -> (Option<&mut [f64]>, Option<&mut [f64]>) {
    match (start, end) {
        (Some(i), Some(j)) if i < j => {
            let (low, high) = columns.split_at_mut(j * width);
            (Some(&mut low[i * width..(i + 1) * width]), Some(&mut high[..width]))
        }
        (Some(i), Some(j)) => {
            let (low, high) = columns.split_at_mut(i * width);
            (Some(&mut high[..width]), Some(&mut low[j * width..(j + 1) * width]))
        }
        (Some(i), None) => (Some(&mut columns[i * width..(i + 1) * width]), None),
        (None, Some(j)) => (None, Some(&mut columns[j * width..(j + 1) * width])),
        (None, None) => (None, None),
    }
}

/// The three columns of a node, with the components of a target together.
struct NodeColumns<'a>([&'a mut [[f64; 3]]; 3]);

impl<'a> NodeColumns<'a> {
    fn new(columns: &'a mut [f64]) -> Self {
        let (x, yz) = columns.split_at_mut(columns.len() / 3);
        let (y, z) = yz.split_at_mut(yz.len() / 2);
        Self([x, y, z].map(|column| column.as_chunks_mut().0))
    }

    #[inline(always)]
    fn add(&mut self, target: usize, block: &Symmetric) {
        for (column, entries) in self.0.iter_mut().zip(&ENTRY) {
            let column = &mut column[target];
            for (value, &entry) in column.iter_mut().zip(entries) {
                *value += block[entry];
            }
        }
    }
}

/// The columns that collect the blocks of an edge: both ends' or, where tasks meet, one end's.
struct EdgeColumns<'a> {
    start: Option<NodeColumns<'a>>,
    end: Option<NodeColumns<'a>>,
}

impl Collect for EdgeColumns<'_> {
    #[inline(always)]
    fn collect(&mut self, target: usize, blocks: &Blocks) {
        if let Some(columns) = &mut self.start {
            columns.add(target, &blocks.start);
        }
        if let Some(columns) = &mut self.end {
            columns.add(target, &blocks.end);
        }
    }
}

/// Fills `out` with the velocity (m/s) of the fluid at `points` (m).
///
/// `density` (N) is the force per length (N/m) that the network exerts on the fluid at its nodes, `viscosity` is in Pa s;
/// the other arguments are those of [`mobility`], whose product with the density this is, without the matrix.
///
/// # Panics
///
/// When the lengths of `out`, `density` or `epsilon` do not fit, or an edge names a node that does not exist or one node twice.
pub fn velocity(
    points: &[Vec3],
    nodes: &[Vec3],
    edges: &[[usize; 2]],
    density: &[Vec3],
    viscosity: f64,
    epsilon: &[f64],
    out: &mut [Vec3],
    pool: Option<&ThreadPool>,
) {
    assert_eq!(out.len(), points.len(), "out must hold one velocity for every point");
    assert_eq!(density.len(), nodes.len(), "density must hold one vector for every node");
    check_edges(nodes, edges, epsilon);
    let scale = 1.0 / (8.0 * std::f64::consts::PI * viscosity);
    let fill = |(points, out): (&[Vec3], &mut [Vec3])| {
        out.fill(Vec3::zeros());
        for (&[i, j], &epsilon) in edges.iter().zip(epsilon) {
            let segment = Segment::new(&nodes[i], &nodes[j], epsilon);
            for_each_target(&segment, points, &mut Flow { velocity: out, f_start: density[i], f_end: density[j] });
        }
        for u in out.iter_mut() {
            *u *= scale;
        }
    };
    match worthwhile(pool, points.len() * edges.len()) {
        None => fill((points, out)),
        Some(pool) => {
            let points_per_task = points.len().div_ceil(TASKS_PER_THREAD * pool.current_num_threads());
            let tasks = points.par_chunks(points_per_task).zip(out.par_chunks_mut(points_per_task));
            pool.install(|| tasks.for_each(fill));
        }
    }
}

/// Flow that collects what an edge's density brings, times 8 pi mu.
struct Flow<'a> {
    velocity: &'a mut [Vec3],
    f_start: Vec3,
    f_end: Vec3,
}

impl Collect for Flow<'_> {
    #[inline(always)]
    fn collect(&mut self, target: usize, blocks: &Blocks) {
        self.velocity[target] += apply(&blocks.start, &self.f_start) + apply(&blocks.end, &self.f_end);
    }
}

#[inline(always)]
fn apply(b: &Symmetric, f: &Vec3) -> Vec3 {
    Vec3::new(
        b[0] * f.x + b[1] * f.y + b[2] * f.z,
        b[1] * f.x + b[3] * f.y + b[4] * f.z,
        b[2] * f.x + b[4] * f.y + b[5] * f.z,
    )
}

fn check_edges(nodes: &[Vec3], edges: &[[usize; 2]], epsilon: &[f64]) {
    assert_eq!(epsilon.len(), edges.len(), "epsilon must hold one length for every edge");
    assert!(edges.iter().flatten().all(|&node| node < nodes.len()), "an edge names a node that does not exist");
    assert!(edges.iter().all(|[i, j]| i != j), "an edge joins a node to itself");
}

fn worthwhile(pool: Option<&ThreadPool>, pairs: usize) -> Option<&ThreadPool> {
    pool.filter(|pool| pool.current_num_threads() > 1 && pairs >= SMALLEST_PARALLEL)
}

/// The consistent hat-function matrix `W` of a network: `F = W f` are the nodal forces (N) of a linear force density.
///
/// `W` is a symmetric N x N matrix of lengths (m) that acts on each component alike; an edge (i, j) of length `L` adds
/// `L/6 [[2, 1], [1, 2]]`. Forces and torques so obtained have exactly the totals of the linear density.
///
/// # Example
///
/// ```
/// use flagrs::{Vec3, fluid::stokeslet::HatWeights};
/// let weights = HatWeights::new(&[Vec3::zeros(), Vec3::new(0.0, 3.0, 0.0)], &[[0, 1]]);
/// let mut force = [0.0; 6];
/// weights.apply(&[1.0, 0.0, 0.0, 1.0, 0.0, 0.0], &mut force);
/// assert_eq!(force, [1.5, 0.0, 0.0, 1.5, 0.0, 0.0]);
/// ```
#[derive(Clone, Debug)]
pub struct HatWeights {
    edges: Vec<[usize; 2]>,
    /// `W_ij` of each edge (i, j), m.
    coupling: Vec<f64>,
    /// `W_ii` of each node, m.
    diagonal: Vec<f64>,
}

impl HatWeights {
    /// Weights of the network with these nodes (m) and edges.
    ///
    /// # Panics
    ///
    /// When an edge names a node that does not exist.
    pub fn new(nodes: &[Vec3], edges: &[[usize; 2]]) -> Self {
        let mut weights =
            Self { edges: edges.to_vec(), coupling: vec![0.0; edges.len()], diagonal: vec![0.0; nodes.len()] };
        weights.update(nodes);
        weights
    }

    /// Recomputes the weights for new positions (m) of the same nodes; allocates nothing.
    ///
    /// # Panics
    ///
    /// When the number of nodes has changed.
    pub fn update(&mut self, nodes: &[Vec3]) {
        assert_eq!(nodes.len(), self.diagonal.len(), "the number of nodes has changed");
        self.diagonal.fill(0.0);
        for (&[i, j], coupling) in self.edges.iter().zip(&mut self.coupling) {
            let length = (nodes[j] - nodes[i]).norm();
            *coupling = length / 6.0;
            self.diagonal[i] += length / 3.0;
            self.diagonal[j] += length / 3.0;
        }
    }

    /// Number of nodes, N.
    pub fn node_count(&self) -> usize {
        self.diagonal.len()
    }

    /// Fills `out` (3N, N) with `W` times `density` (3N, N/m), both node by node.
    ///
    /// # Panics
    ///
    /// When a length is not 3N.
    pub fn apply(&self, density: &[f64], out: &mut [f64]) {
        let n = 3 * self.node_count();
        assert!(density.len() == n && out.len() == n, "density and out must hold three numbers for every node");
        for ((out, f), w) in out.chunks_exact_mut(3).zip(density.chunks_exact(3)).zip(&self.diagonal) {
            for c in 0..3 {
                out[c] = w * f[c];
            }
        }
        for (&[i, j], w) in self.edges.iter().zip(&self.coupling) {
            for c in 0..3 {
                out[3 * i + c] += w * density[3 * j + c];
                out[3 * j + c] += w * density[3 * i + c];
            }
        }
    }

    /// Replaces a matrix of 3N rows, stored by columns, by `W` times itself; `column` (3N) is scratch space.
    ///
    /// # Panics
    ///
    /// When `column` is not 3N long or the matrix is not whole columns.
    pub fn left_multiply(&self, matrix: &mut [f64], column: &mut [f64]) {
        let n = 3 * self.node_count();
        assert_eq!(column.len(), n, "the scratch column must hold three numbers for every node");
        assert!(matrix.len().is_multiple_of(n.max(1)), "the matrix must have three rows for every node");
        for values in matrix.chunks_exact_mut(n.max(1)) {
            column.copy_from_slice(values);
            self.apply(column, values);
        }
    }
}
