//! Regularized Stokeslet segments of a whole network: mobility matrix, flow field, and the hat-function weights.
//!
//! A network carries a force *density* `f` (N/m) on its nodes, linear along each edge. Its flow is
//! `8 pi mu u(x) = A(x) f`, and the total force it exerts on the fluid near node `i` is `(W f)_i`, the integral of the
//! density times the hat function of the node. Sums over edges run in the order of the edges, whatever the number of
//! threads, so results are the same to the last bit on one thread and on many.

use std::ops::Range;

use rayon::ThreadPool;
use rayon::prelude::*;

use super::lanes::{Lanes, Path, Write, coordinates_mut, write_triples};
use super::segment::{Blocks, Collect, Segment, Symmetric, for_each_pair};
use crate::Vec3;

/// Target-edge pairs below which a thread pool is left alone. Waking it costs about 7 us, as long as 900 pairs take with
/// eight lanes; two threads break even below 2,000 pairs and gain a quarter near 3,000 (least of some thousand repeats, at
/// 45 to 600 nodes on two cores; from 200 nodes on they take half the time of one).
const SMALLEST_PARALLEL: usize = 2600;

/// Tasks for each thread of a pool: more than one keeps the threads even, more than a few cost more than they save.
const TASKS_PER_THREAD: usize = 2;

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
    mobility_on(Path::chosen(), targets, nodes, edges, epsilon, out, pool);
}

fn mobility_on(
    path: Path,
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
        let nodes_here = first_node..first_node + columns.len() / node_width;
        let (segments, routes, touched) = route(nodes, edges, epsilon, nodes_here);
        for (columns, _) in columns.chunks_exact_mut(node_width).zip(&touched).filter(|(_, touched)| !**touched) {
            columns.fill(0.0);
        }
        for_each_pair(path, &segments, targets, &mut Columns { columns, routes: &routes, column: 3 * targets.len() });
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

/// Where the blocks of an edge go, among the nodes of one task.
struct Route {
    /// The block of the start, if the node is here.
    start: Option<Place>,
    /// Whether what the edge before carries over belongs to the start.
    takes_over: bool,
    end: End,
}

/// Where the block of an edge's end goes.
enum End {
    /// The node belongs to another task.
    Elsewhere,
    At(Place),
    /// The next edge starts there, and takes it along: a chain writes every number of the matrix once.
    Carried,
}

/// A node, counted from the first of the task, and what to do with the values there.
#[derive(Clone, Copy)]
struct Place {
    node: usize,
    write: Write,
}

/// The edges with an end among the nodes `here`, where their blocks go, and which of the nodes have any edge.
///
/// Which blocks are added to one another before they are written depends on the whole network alone, not on `here`: sums
/// are the same however the nodes are dealt out.
fn route(
    nodes: &[Vec3],
    edges: &[[usize; 2]],
    epsilon: &[f64],
    here: Range<usize>,
) -> (Vec<Segment>, Vec<Route>, Vec<bool>) {
    let mut touched = vec![false; here.len()];
    // The first edge of a node writes over what was there, which spares a pass of zeros over the whole matrix.
    let mut place = |node: usize| {
        let node = node - here.start;
        let write = if std::mem::replace(&mut touched[node], true) { Write::Add } else { Write::Over };
        Place { node, write }
    };
    let (mut segments, mut routes) = (Vec::with_capacity(edges.len()), Vec::with_capacity(edges.len()));
    let mut takes_over = false;
    for (index, &[i, j]) in edges.iter().enumerate() {
        let (has_start, has_end) = (here.contains(&i), here.contains(&j));
        if !has_start && !has_end {
            continue;
        }
        let start = has_start.then(|| place(i));
        let end = if !has_end {
            End::Elsewhere
        } else if edges.get(index + 1).is_some_and(|next| next[0] == j) {
            End::Carried
        } else {
            End::At(place(j))
        };
        let carries = matches!(end, End::Carried);
        segments.push(Segment::new(&nodes[i], &nodes[j], epsilon[index]));
        routes.push(Route { start, takes_over, end });
        takes_over = carries;
    }
    (segments, routes, touched)
}

/// The columns of consecutive nodes, three of each, which collect the blocks of every edge.
struct Columns<'a> {
    columns: &'a mut [f64],
    routes: &'a [Route],
    /// Length of a column.
    column: usize,
}

impl Columns<'_> {
    #[inline(always)]
    fn write<L: Lanes>(&mut self, first: usize, place: Place, block: &Symmetric<L>) {
        let count = (3 * L::WIDTH).min(self.column - 3 * first);
        let at = 3 * self.column * place.node + 3 * first;
        let b = block;
        write_triples([b[0], b[1], b[2]], place.write, &mut self.columns[at..][..count]);
        write_triples([b[1], b[3], b[4]], place.write, &mut self.columns[at + self.column..][..count]);
        write_triples([b[2], b[4], b[5]], place.write, &mut self.columns[at + 2 * self.column..][..count]);
    }
}

impl Collect for Columns<'_> {
    /// The block of a node that the next edge shares.
    type Carried<L: Lanes> = Symmetric<L>;

    #[inline(always)]
    fn begin<L: Lanes>() -> Symmetric<L> {
        [L::splat(0.0); 6]
    }

    #[inline(always)]
    fn collect<L: Lanes>(&mut self, first: usize, segment: usize, blocks: &Blocks<L>, carried: &mut Symmetric<L>) {
        let route = &self.routes[segment];
        if let Some(place) = route.start {
            let mut block = blocks.start;
            if route.takes_over {
                for k in 0..6 {
                    block[k] = carried[k] + block[k];
                }
            }
            self.write(first, place, &block);
        }
        match route.end {
            End::Elsewhere => {}
            End::At(place) => self.write(first, place, &blocks.end),
            End::Carried => *carried = blocks.end,
        }
    }

    #[inline(always)]
    fn finish<L: Lanes>(&mut self, _: usize, _: Symmetric<L>) {}
}

/// Fills `out` with the velocity (m/s) of the fluid at `points` (m).
///
/// `density` (N) is the force per length that the network exerts on the fluid at its nodes over `8 pi mu`, in m/s; the other
/// arguments are those of [`mobility`], whose product with that density this is, without the matrix.
///
/// # Panics
///
/// When the lengths of `out`, `density` or `epsilon` do not fit, or an edge names a node that does not exist or one node twice.
pub fn velocity(
    points: &[Vec3],
    nodes: &[Vec3],
    edges: &[[usize; 2]],
    density: &[Vec3],
    epsilon: &[f64],
    out: &mut [Vec3],
    pool: Option<&ThreadPool>,
) {
    let path = Path::chosen();
    assert_eq!(out.len(), points.len(), "out must hold one velocity for every point");
    assert_eq!(density.len(), nodes.len(), "density must hold one vector for every node");
    check_edges(nodes, edges, epsilon);
    let segments: Vec<Segment> =
        edges.iter().zip(epsilon).map(|(&[i, j], &epsilon)| Segment::new(&nodes[i], &nodes[j], epsilon)).collect();
    let densities: Vec<[[f64; 3]; 2]> = edges.iter().map(|edge| edge.map(|node| density[node].into())).collect();
    let fill = |(points, out): (&[Vec3], &mut [Vec3])| {
        let mut flow = Flow { velocity: coordinates_mut(out), densities: &densities };
        for_each_pair(path, &segments, points, &mut flow);
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

/// Velocities of consecutive points, which sum up what every edge's density brings.
struct Flow<'a> {
    velocity: &'a mut [f64],
    /// Force densities over 8 pi mu at the start and at the end of each edge, m/s.
    densities: &'a [[[f64; 3]; 2]],
}

impl Collect for Flow<'_> {
    type Carried<L: Lanes> = [L; 3];

    #[inline(always)]
    fn begin<L: Lanes>() -> [L; 3] {
        [L::splat(0.0); 3]
    }

    #[inline(always)]
    fn collect<L: Lanes>(&mut self, _: usize, segment: usize, blocks: &Blocks<L>, velocity: &mut [L; 3]) {
        let [start, end] = &self.densities[segment];
        add_product(&blocks.start, start, velocity);
        add_product(&blocks.end, end, velocity);
    }

    #[inline(always)]
    fn finish<L: Lanes>(&mut self, first: usize, velocity: [L; 3]) {
        let count = (3 * L::WIDTH).min(self.velocity.len() - 3 * first);
        write_triples(velocity, Write::Over, &mut self.velocity[3 * first..][..count]);
    }
}

#[inline(always)]
fn add_product<L: Lanes>(b: &Symmetric<L>, f: &[f64; 3], sum: &mut [L; 3]) {
    let f = [L::splat(f[0]), L::splat(f[1]), L::splat(f[2])];
    sum[0] = b[0].mul_add(f[0], b[1].mul_add(f[1], b[2].mul_add(f[2], sum[0])));
    sum[1] = b[1].mul_add(f[0], b[3].mul_add(f[1], b[4].mul_add(f[2], sum[1])));
    sum[2] = b[2].mul_add(f[0], b[4].mul_add(f[1], b[5].mul_add(f[2], sum[2])));
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

#[cfg(test)]
mod tests {
    use super::*;

    fn helix(count: usize) -> Vec<Vec3> {
        let at = |k: f64| Vec3::new(3.2e-3 * k, 1e-2 * (0.39 * k).cos(), 1e-2 * (0.39 * k).sin());
        (0..count).map(|k| at(k as f64)).collect()
    }

    #[test]
    fn every_path_with_fused_arithmetic_fills_the_same_matrix_and_nothing_else() {
        let nodes = helix(9);
        // A chain, numbered both ways, a branch and a node without an edge.
        let edges = [[0, 1], [1, 2], [2, 3], [5, 4], [4, 3], [2, 6], [6, 7]];
        let epsilon: Vec<f64> = (0..edges.len()).map(|k| 1e-3 * (1.0 + 0.1 * k as f64)).collect();
        for count in 1..=19 {
            let targets = helix(count);
            let size = 9 * count * nodes.len();
            let matrix = |path| {
                let mut out = vec![-7.0; size + 9];
                mobility_on(path, &targets, &nodes, &edges, &epsilon, &mut out[..size], None);
                assert_eq!(out[size..], [-7.0; 9], "{path:?}: written past the end");
                out.truncate(size);
                out
            };
            let reference = matrix(Path::chosen());
            assert!(reference[size - 9 * count..].iter().all(|&entry| entry == 0.0), "no edge, no flow");
            let scale = reference.iter().fold(0.0_f64, |scale, entry| scale.max(entry.abs()));
            for path in Path::ALL.into_iter().filter(|path| path.is_available()) {
                let matrix = matrix(path);
                if path == Path::Separate {
                    let apart = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-14 * scale;
                    assert!(matrix.iter().zip(&reference).all(apart), "{count} targets");
                } else {
                    assert!(matrix == reference, "{path:?}, {count} targets");
                }
            }
        }
    }
}
