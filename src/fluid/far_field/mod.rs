//! The product of the mobility with a force density in time proportional to the number of nodes: a fast multipole method.
//!
//! `A` of [`super::stokeslet::mobility`] couples every target with every edge, so its product with a density costs `M N`.
//! Far from an edge its flow is that of a few Gauss points, and the flow of a whole cell of them is a short expansion, of
//! which cells take over each other's as they are. With the tolerance `t`, relative to the largest component of the product,
//!
//! ```text
//! A f = expansions between distant cells         (harmonic potentials: `sources`, `translation`, `field`)
//!     + Gauss points one by one in nearby cells  (full regularization: `near`)
//!     + exact minus Gauss for close pairs        (a sparse matrix, built once for a geometry: `close`)
//! ```
//!
//! * `tree` halves targets and edges in space, `interactions` finds which cells meet how, `accuracy` says what `t`
//!   needs, `product` goes through it all.
//! * `harmonics`, `rotation` and `square` are the mathematics of the expansions, `octet` their arithmetic.
//!
//! Every edge may have its own regularization length. Within `Accuracy::smooth` of them flows are summed point
//! by point; farther out the regularization counts to second order, where it is a harmonic dipole (module `sources`).

mod accuracy;
mod close;
mod error;
mod field;
mod harmonics;
mod interactions;
mod near;
mod octet;
mod product;
mod rotation;
mod sources;
mod square;
mod translation;
mod tree;

use std::ops::Range;

use rayon::ThreadPool;
use rayon::prelude::*;

use self::accuracy::{Accuracy, gauss_rule};
use self::close::{BYTES_PER_PAIR, Entry, Neighbourhood, Scratch};
pub use self::error::{FarFieldError, LARGEST_TOLERANCE, SMALLEST_TOLERANCE};
use self::error::{check_length, check_positions};
use self::harmonics::Harmonics;
use self::interactions::Interactions;
use self::octet::Four;
use self::sources::{Edge, Source};
use self::translation::Translation;
use self::tree::Tree;
use crate::Vec3;
use crate::fluid::lanes::Path;

/// Smallest regularization over the extent of the scene: beyond, squared lengths leave the range of single precision, in
/// which inverse distances start.
const SMALLEST_EPSILON: f64 = 1e-15;

/// What a product consists of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// Degree of the expansions.
    pub order: usize,
    /// Pairs of cells that meet by expansions.
    pub far_pairs: usize,
    /// Pairs of a target and a Gauss point taken one by one.
    pub near_pairs: usize,
    /// Pairs of a target and an edge taken exactly.
    pub close_pairs: usize,
    /// Of these, pairs whose blocks are kept from product to product.
    pub kept_pairs: usize,
    /// Memory held by all that grows with the scene but the trees, bytes.
    pub bytes: usize,
}

/// The targets of a leaf, and what is near them.
#[derive(Default)]
struct Leaf {
    cell: usize,
    targets: Range<usize>,
    /// Gauss points, in the order of their tree.
    runs: Vec<Range<u32>>,
    close_pairs: usize,
    /// Exact minus Gauss; not kept beyond the memory allowed.
    blocks: Option<Vec<Entry>>,
}

/// The product `y = A f` of the mobility of regularized Stokeslet segments with a nodal force density.
///
/// Built for nodes, edges and targets; [`Self::update`] moves it to other positions of the same nodes.
///
/// # Example
///
/// ```
/// use flagrs::{Vec3, fluid::far_field::FarField};
/// let nodes: Vec<Vec3> = (0..1000).map(|k| Vec3::new(5e-3 * k as f64, 0.0, 0.0)).collect();
/// let edges: Vec<[usize; 2]> = (1..1000).map(|k| [k - 1, k]).collect();
/// let mut product = FarField::new(&nodes, &edges, &[1e-3; 999], None, 1e-4, 1 << 30, None)?;
/// let mut flow = vec![0.0; 3000];
/// product.apply(&[1.0; 3000], &mut flow, None)?;
/// // Slower across than along.
/// assert!(flow[1500] > flow[1501]);
/// # Ok::<(), flagrs::fluid::far_field::FarFieldError>(())
/// ```
pub struct FarField {
    accuracy: Accuracy,
    memory: usize,
    path: Path,
    harmonics: Harmonics,
    translation: Translation,
    edges: Vec<[usize; 2]>,
    epsilon: Vec<f64>,
    own_targets: bool,

    nodes: Vec<Vec3>,
    /// In metres, in the order of the tree.
    exact_targets: Vec<Vec3>,
    /// In the units of the trees, in their order.
    targets: Vec<[f64; 3]>,
    sources: Vec<Source>,
    tree_edges: Vec<Edge>,
    /// Least distance from each source cell at which expansions hold.
    reach: Vec<f64>,
    target_tree: Tree,
    source_tree: Tree,
    interactions: Interactions,
    leaves: Vec<Leaf>,
    /// The leaf of each target cell that is one.
    leaf_of: Vec<u32>,

    points: Vec<[f64; 3]>,
    multipoles: Vec<Four>,
    locals: Vec<Four>,
    flow: Vec<[f64; 3]>,
}

impl FarField {
    /// Prepares the product for these positions.
    ///
    /// `nodes` (N) and `targets` (M; the nodes if `None`) are in metres, `edges` (E) index the nodes, `epsilon` (E) is each
    /// edge's regularization length in metres. `tolerance` is the largest error of a component of the product, relative to
    /// the largest component; `memory` is how many bytes the exact blocks of close pairs may take: those that do not fit
    /// are computed anew in every product, at the price of about a hundred multiplications each.
    ///
    /// # Errors
    ///
    /// If the tolerance is out of range, a position is not finite, an edge has no length or no such nodes, or a regularization
    /// length is missing, not positive or below 1e-15 of the scene's extent.
    pub fn new(
        nodes: &[Vec3],
        edges: &[[usize; 2]],
        epsilon: &[f64],
        targets: Option<&[Vec3]>,
        tolerance: f64,
        memory: usize,
        pool: Option<&ThreadPool>,
    ) -> Result<Self, FarFieldError> {
        if !(SMALLEST_TOLERANCE..=LARGEST_TOLERANCE).contains(&tolerance) {
            return Err(FarFieldError::Tolerance(tolerance));
        }
        check_length("epsilon", epsilon.len(), edges.len())?;
        let accuracy = Accuracy::for_tolerance(tolerance);
        let mut product = Self {
            memory,
            path: Path::chosen(),
            harmonics: Harmonics::new(accuracy.order),
            translation: Translation::new(accuracy.order),
            accuracy,
            edges: edges.to_vec(),
            epsilon: epsilon.to_vec(),
            own_targets: targets.is_some(),
            nodes: Vec::new(),
            exact_targets: Vec::new(),
            targets: Vec::new(),
            sources: Vec::new(),
            tree_edges: Vec::new(),
            reach: Vec::new(),
            target_tree: Tree::default(),
            source_tree: Tree::default(),
            interactions: Interactions::default(),
            leaves: Vec::new(),
            leaf_of: Vec::new(),
            points: Vec::new(),
            multipoles: Vec::new(),
            locals: Vec::new(),
            flow: Vec::new(),
        };
        product.prepare(nodes, targets.unwrap_or(nodes), pool)?;
        Ok(product)
    }

    /// Moves to other positions of the same nodes, and of targets if it was built with some, in the memory it has.
    ///
    /// # Errors
    ///
    /// If the number of nodes or of targets has changed, or as for [`Self::new`]; the product then stays where it was.
    pub fn update(
        &mut self,
        nodes: &[Vec3],
        targets: Option<&[Vec3]>,
        pool: Option<&ThreadPool>,
    ) -> Result<(), FarFieldError> {
        check_length("nodes", nodes.len(), self.nodes.len())?;
        let expected = if self.own_targets { self.targets.len() } else { 0 };
        check_length("targets", targets.map_or(0, <[Vec3]>::len), expected)?;
        self.prepare(nodes, if self.own_targets { targets.unwrap_or_default() } else { nodes }, pool)
    }

    /// Fills `out` (3M) with the product of `A` and `density` (3N, N/m), both component by component within nodes.
    ///
    /// The result is `8 pi mu u` and the same to the last bit on any number of threads.
    ///
    /// # Errors
    ///
    /// If a length does not fit.
    pub fn apply(&mut self, density: &[f64], out: &mut [f64], pool: Option<&ThreadPool>) -> Result<(), FarFieldError> {
        check_length("density", density.len(), 3 * self.nodes.len())?;
        check_length("out", out.len(), 3 * self.targets.len())?;
        match pool {
            Some(pool) => pool.install(|| self.multiply(density, pool.current_num_threads() > 1)),
            None => self.multiply(density, false),
        }
        for (&target, flow) in self.target_tree.order.iter().zip(&self.flow) {
            out[3 * target as usize..][..3].copy_from_slice(flow);
        }
        Ok(())
    }

    /// Number of targets, M.
    pub fn target_count(&self) -> usize {
        self.targets.len()
    }

    /// What the product consists of at the present positions.
    pub fn summary(&self) -> Summary {
        let near = |leaf: &Leaf| leaf.targets.len() * leaf.runs.iter().map(ExactSizeIterator::len).sum::<usize>();
        let kept = |leaf: &&Leaf| leaf.blocks.is_some();
        let blocks: usize = self.leaves.iter().filter_map(|leaf| leaf.blocks.as_ref().map(Vec::capacity)).sum();
        Summary {
            order: self.accuracy.order,
            far_pairs: self.interactions.far.len(),
            near_pairs: self.leaves.iter().map(near).sum(),
            close_pairs: self.leaves.iter().map(|leaf| leaf.close_pairs).sum(),
            kept_pairs: self.leaves.iter().filter(kept).map(|leaf| leaf.close_pairs).sum(),
            bytes: blocks * size_of::<Entry>()
                + self.interactions.far.bytes()
                + self.interactions.near.bytes()
                + self.sources.capacity() * size_of::<Source>()
                + (self.multipoles.capacity() + self.locals.capacity()) * size_of::<Four>()
                + (self.nodes.capacity() + self.exact_targets.capacity()) * size_of::<Vec3>()
                + (self.targets.capacity() + self.points.capacity() + self.flow.capacity()) * size_of::<[f64; 3]>(),
        }
    }

    fn prepare(&mut self, nodes: &[Vec3], targets: &[Vec3], pool: Option<&ThreadPool>) -> Result<(), FarFieldError> {
        check_positions("node", nodes)?;
        check_positions("target", targets)?;
        let units = Units::of(nodes, targets);
        self.check_edges(nodes, &units)?;
        self.nodes.clear();
        self.nodes.extend_from_slice(nodes);
        self.plant_sources(&units);
        self.plant_targets(targets, &units);
        self.interactions.rebuild(&self.target_tree, &self.source_tree, &self.reach, &self.accuracy);
        self.find_leaves();
        let count = self.translation.count();
        self.multipoles.resize(self.source_tree.cells.len() * count, Four::ZERO);
        self.locals.resize(self.target_tree.cells.len() * count, Four::ZERO);
        self.flow.resize(targets.len(), [0.0; 3]);
        self.keep_blocks(pool);
        Ok(())
    }

    fn check_edges(&self, nodes: &[Vec3], units: &Units) -> Result<(), FarFieldError> {
        let smallest = SMALLEST_EPSILON / units.inverse_length;
        for (edge, (&[i, j], &value)) in self.edges.iter().zip(&self.epsilon).enumerate() {
            if i >= nodes.len() || j >= nodes.len() || nodes[i] == nodes[j] {
                return Err(FarFieldError::Edge { edge, ends: [i, j], nodes: nodes.len() });
            }
            if !(value > smallest && value.is_finite()) {
                return Err(FarFieldError::Epsilon { edge, value, smallest });
            }
        }
        Ok(())
    }

    fn plant_sources(&mut self, units: &Units) {
        let rule = gauss_rule(self.accuracy.gauss);
        self.points.clear();
        for &[i, j] in &self.edges {
            let (start, end) = (units.of_point(&self.nodes[i]), units.of_point(&self.nodes[j]));
            let point = |a: f64| std::array::from_fn(|k| (1.0 - a) * start[k] + a * end[k]);
            self.points.extend(rule.iter().map(|&[a, _]| point(a)));
        }
        self.source_tree.rebuild(&self.points, rule.len(), self.accuracy.edges, 1);
        self.tree_edges.clear();
        self.sources.clear();
        for &edge in &self.source_tree.order {
            let [i, j] = self.edges[edge as usize];
            let length = (self.nodes[j] - self.nodes[i]).norm() * units.inverse_length;
            self.tree_edges.push(Edge { nodes: [i as u32, j as u32], index: edge, length });
            let epsilon_squared = (self.epsilon[edge as usize] * units.inverse_length).powi(2);
            let points = &self.points[edge as usize * rule.len()..][..rule.len()];
            self.sources.extend(points.iter().map(|&position| Source { position, epsilon_squared, force: [0.0; 3] }));
        }
        self.reach.clear();
        for cell in &self.source_tree.cells {
            let reach_of = |edge: usize| {
                let epsilon = self.sources[edge * rule.len()].epsilon_squared.sqrt();
                (0.5 * self.accuracy.close * self.tree_edges[edge].length).max(self.accuracy.smooth * epsilon)
            };
            self.reach.push(cell.items().map(reach_of).fold(0.0, f64::max));
        }
    }

    fn plant_targets(&mut self, targets: &[Vec3], units: &Units) {
        self.points.clear();
        self.points.extend(targets.iter().map(|target| units.of_point(target)));
        self.target_tree.rebuild(&self.points, 1, self.accuracy.targets, 8);
        let order = &self.target_tree.order;
        self.targets.clear();
        self.targets.extend(order.iter().map(|&target| self.points[target as usize]));
        self.exact_targets.clear();
        self.exact_targets.extend(order.iter().map(|&target| targets[target as usize]));
    }

    /// Gathers for each leaf the sources near it: those near the cells it is part of.
    fn find_leaves(&mut self) {
        let tree = &self.target_tree;
        self.leaf_of.clear();
        let mut path: Vec<usize> = Vec::new();
        let mut ranges: Vec<Range<usize>> = Vec::new();
        let mut count = 0;
        for (index, cell) in tree.cells.iter().enumerate() {
            path.retain(|&above| index < tree.cells[above].next as usize);
            path.push(index);
            self.leaf_of.push(count as u32);
            if tree.halves(index).is_some() {
                continue;
            }
            ranges.clear();
            let near = path.iter().flat_map(|&above| self.interactions.near.of(above));
            ranges.extend(near.map(|&source| self.source_tree.cells[source as usize].items()));
            ranges.sort_unstable_by_key(|range| range.start);
            if count == self.leaves.len() {
                self.leaves.push(Leaf::default());
            }
            let leaf = &mut self.leaves[count];
            count += 1;
            leaf.cell = index;
            leaf.targets = cell.items();
            leaf.runs.clear();
            for range in &ranges {
                let [start, end] = [range.start, range.end].map(|edge| (edge * self.accuracy.gauss) as u32);
                match leaf.runs.last_mut() {
                    Some(last) if last.end == start => last.end = end,
                    _ => leaf.runs.push(start..end),
                }
            }
        }
        self.leaves.truncate(count);
    }

    /// Builds the blocks of close pairs, leaf by leaf as long as memory lasts.
    fn keep_blocks(&mut self, pool: Option<&ThreadPool>) {
        let mut leaves = std::mem::take(&mut self.leaves);
        let given = &*self;
        for_each(pool, &mut leaves, |_, leaf| leaf.close_pairs = given.neighbourhood(leaf).count());
        // Which leaves keep theirs depends on numbers of pairs only, not on who comes first.
        let mut left = self.memory / BYTES_PER_PAIR;
        for leaf in &mut leaves {
            let fits = leaf.close_pairs <= left;
            left = if fits { left - leaf.close_pairs } else { 0 };
            leaf.blocks = fits.then(|| leaf.blocks.take().unwrap_or_default());
        }
        for_each(pool, &mut leaves, |scratch, leaf| {
            if let Some(mut blocks) = leaf.blocks.take() {
                given.neighbourhood(leaf).blocks(scratch, &mut blocks);
                leaf.blocks = Some(blocks);
            }
        });
        self.leaves = leaves;
    }

    fn neighbourhood<'a>(&'a self, leaf: &'a Leaf) -> Neighbourhood<'a> {
        Neighbourhood {
            targets: &self.targets[leaf.targets.clone()],
            exact_targets: &self.exact_targets[leaf.targets.clone()],
            centre: &self.target_tree.places[leaf.cell].centre,
            radius: self.target_tree.cells[leaf.cell].radius,
            nodes: &self.nodes,
            epsilon: &self.epsilon,
            edges: &self.tree_edges,
            sources: &self.sources,
            rule: gauss_rule(self.accuracy.gauss),
            runs: &leaf.runs,
            close: self.accuracy.close,
            path: self.path,
        }
    }
}

/// The units of the trees: the extent of the scene is about one, about its middle.
///
/// A power of two, so that scenes that differ in scale by one give the same product to the last bit.
struct Units {
    origin: Vec3,
    inverse_length: f64,
}

impl Units {
    fn of(nodes: &[Vec3], targets: &[Vec3]) -> Self {
        let mut points = nodes.iter().chain(targets);
        let Some(&first) = points.next() else { return Self { origin: Vec3::zeros(), inverse_length: 1.0 } };
        let (low, high) = points.fold((first, first), |(low, high), point| (low.inf(point), high.sup(point)));
        let extent = (high - low).amax();
        let inverse_length = if extent > 0.0 { (-extent.log2().round()).exp2() } else { 1.0 };
        Self { origin: 0.5 * (low + high), inverse_length }
    }

    fn of_point(&self, point: &Vec3) -> [f64; 3] {
        ((point - self.origin) * self.inverse_length).into()
    }
}

fn for_each<T: Send>(pool: Option<&ThreadPool>, items: &mut [T], work: impl Fn(&mut Scratch, &mut T) + Sync) {
    match pool {
        Some(pool) => pool.install(|| items.par_iter_mut().for_each_init(Scratch::default, &work)),
        None => {
            let mut scratch = Scratch::default();
            items.iter_mut().for_each(|item| work(&mut scratch, item));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tests of the crate run on the path that is chosen; other machines run the others.
    #[test]
    fn every_path_gives_the_same_product() {
        let at = |k: f64| Vec3::new(0.05 * (0.1 * k).sin(), 0.05 * (0.13 * k).cos(), 3e-3 * k);
        let nodes: Vec<Vec3> = (0..2000).map(|k| at(f64::from(k))).collect();
        let edges: Vec<[usize; 2]> = (1..nodes.len()).map(|k| [k - 1, k]).collect();
        let epsilon = vec![1e-3; edges.len()];
        let density: Vec<f64> = (0..3 * nodes.len()).map(|k| (k as f64).sin()).collect();
        let on = |path: Path| {
            let mut product = FarField::new(&nodes, &edges, &epsilon, None, 1e-4, 1 << 30, None).expect("a product");
            assert!(product.summary().far_pairs > 100);
            product.path = path;
            product.update(&nodes, None, None).expect("a product");
            let mut out = vec![0.0; density.len()];
            product.apply(&density, &mut out, None).expect("lengths fit");
            out
        };
        let reference = on(Path::chosen());
        let size = reference.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
        for path in Path::ALL.into_iter().filter(|path| path.is_available()) {
            let other = on(path);
            if path == Path::Separate {
                let apart = reference.iter().zip(&other).fold(0.0, |worst: f64, (a, b)| worst.max((a - b).abs()));
                assert!(apart < 1e-12 * size, "{:e}", apart / size);
            } else {
                assert!(other == reference, "{path:?}");
            }
        }
    }
}
