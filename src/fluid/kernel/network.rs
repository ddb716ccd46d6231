//! Images of a whole network of segments: what they add to its mobility matrix and to its flow.
//!
//! Sums over edges run in the order of the edges, whatever the number of threads.

use rayon::ThreadPool;
use rayon::prelude::*;

use super::free_surface::FreeSurface;
use super::image_segment::{ImageBlocks, ImageSegment};
use super::no_slip::NoSlip;
use super::{Block, Boundary, PointImage};
use crate::Vec3;
use crate::fluid::lanes::{Kernel, Lanes, Path, TILE, Write, coordinates_mut, load_points, write_triples};

/// Target-edge pairs below which a thread pool is left alone; an image takes several times as long as a segment.
const SMALLEST_PARALLEL: usize = 600;

/// Tasks for each thread of a pool.
const TASKS_PER_THREAD: usize = 2;

/// The edges of a network.
#[derive(Clone, Copy, Debug)]
pub struct Segments<'a> {
    /// Positions, m.
    pub nodes: &'a [Vec3],
    /// Pairs of nodes.
    pub edges: &'a [[usize; 2]],
    /// Regularization of every edge, m.
    pub epsilon: &'a [f64],
}

impl Boundary {
    /// Adds to `matrix`, as [`crate::fluid::stokeslet::mobility`] fills it, what the images of the segments bring.
    ///
    /// Targets (m) and nodes must be on the fluid's side.
    ///
    /// # Panics
    /// If lengths do not fit.
    pub fn add_to_mobility(
        &self,
        segments: Segments<'_>,
        targets: &[Vec3],
        matrix: &mut [f64],
        pool: Option<&ThreadPool>,
    ) {
        assert_eq!(matrix.len(), 9 * targets.len() * segments.nodes.len(), "the matrix must hold 3 targets x 3 nodes");
        if matrix.is_empty() {
            return;
        }
        let node_width = 9 * targets.len();
        let fill = |first: usize, columns: &mut [f64]| {
            let here = first..first + columns.len() / node_width;
            let (mut images, mut places) = (Vec::new(), Vec::new());
            for (image, ends) in self.images(segments).zip(segments.edges) {
                let place = ends.map(|node| here.contains(&node).then(|| node - first));
                if place != [None; 2] {
                    images.push(image);
                    places.push(place);
                }
            }
            let mut sink = Sink::Columns { columns, places: &places, column: 3 * targets.len() };
            self.visit(&images, targets, &mut sink);
        };
        match worthwhile(pool, targets.len() * segments.edges.len()) {
            None => fill(0, matrix),
            Some(pool) => {
                let nodes = segments.nodes.len().div_ceil(TASKS_PER_THREAD * pool.current_num_threads());
                pool.install(|| {
                    let tasks = matrix.par_chunks_mut(node_width * nodes).enumerate();
                    tasks.for_each(|(task, columns)| fill(task * nodes, columns));
                });
            }
        }
    }

    /// Adds to `velocity` (m/s) what the images bring at `points` (m), for nodal force densities over `8 pi mu` (m/s).
    ///
    /// # Panics
    /// If lengths do not fit.
    pub fn add_to_velocity(
        &self,
        segments: Segments<'_>,
        density: &[Vec3],
        points: &[Vec3],
        velocity: &mut [Vec3],
        pool: Option<&ThreadPool>,
    ) {
        assert_eq!(density.len(), segments.nodes.len(), "one density for every node");
        assert_eq!(points.len(), velocity.len(), "one velocity for every point");
        if points.is_empty() {
            return;
        }
        let images: Vec<ImageSegment> = self.images(segments).collect();
        let densities: Vec<[[f64; 3]; 2]> =
            segments.edges.iter().map(|ends| ends.map(|node| density[node].into())).collect();
        let fill = |(points, velocity): (&[Vec3], &mut [Vec3])| {
            let mut sink = Sink::Flow { velocity: coordinates_mut(velocity), densities: &densities };
            self.visit(&images, points, &mut sink);
        };
        match worthwhile(pool, points.len() * images.len()) {
            None => fill((points, velocity)),
            Some(pool) => {
                let count = points.len().div_ceil(TASKS_PER_THREAD * pool.current_num_threads());
                pool.install(|| points.par_chunks(count).zip(velocity.par_chunks_mut(count)).for_each(fill));
            }
        }
    }

    fn images<'a>(&'a self, segments: Segments<'a>) -> impl Iterator<Item = ImageSegment> + 'a {
        assert_eq!(segments.edges.len(), segments.epsilon.len(), "one regularization for every edge");
        let Segments { nodes, edges, epsilon } = segments;
        let image = move |(&[i, j], &epsilon): (&[usize; 2], &f64)| {
            ImageSegment::new(self.plane(), &nodes[i], &nodes[j], epsilon)
        };
        edges.iter().zip(epsilon).map(image)
    }

    /// Hands the blocks of all images and targets on.
    fn visit(&self, images: &[ImageSegment], targets: &[Vec3], sink: &mut Sink<'_>) {
        let path = Path::chosen();
        match self {
            Self::NoSlip(plane) => path.run(Visit { kernel: NoSlip::new(plane), images, targets, sink }),
            Self::FreeSurface(plane) => path.run(Visit { kernel: FreeSurface::new(plane), images, targets, sink }),
        }
    }
}

fn worthwhile(pool: Option<&ThreadPool>, pairs: usize) -> Option<&ThreadPool> {
    pool.filter(|pool| pool.current_num_threads() > 1 && pairs >= SMALLEST_PARALLEL)
}

/// What becomes of the blocks of every image and every vector of targets: one type, so that the code above it is made once.
enum Sink<'a> {
    /// They are added to the columns of consecutive nodes, three of each.
    Columns {
        columns: &'a mut [f64],
        /// Of the start and the end of each image, the node among those here.
        places: &'a [[Option<usize>; 2]],
        /// Length of a column.
        column: usize,
    },
    /// Their velocities are added to those of consecutive points.
    Flow {
        velocity: &'a mut [f64],
        /// Force densities over 8 pi mu at the start and at the end of each edge, m/s.
        densities: &'a [[[f64; 3]; 2]],
    },
}

struct Visit<'a, 'b, K> {
    kernel: K,
    images: &'a [ImageSegment],
    targets: &'a [Vec3],
    sink: &'a mut Sink<'b>,
}

impl<K: PointImage> Kernel for Visit<'_, '_, K> {
    #[inline(always)]
    fn run<L: Lanes>(self) {
        // Tiles, so that a column is written in pieces that memory likes.
        for (tile, targets) in self.targets.chunks(TILE).enumerate() {
            for (index, image) in self.images.iter().enumerate() {
                for (vector, targets) in targets.chunks(L::WIDTH).enumerate() {
                    let blocks = image.blocks(&self.kernel, load_points::<L>(targets));
                    self.sink.collect(tile * TILE + vector * L::WIDTH, index, &blocks);
                }
            }
        }
    }
}

impl Sink<'_> {
    /// Receives the blocks of an image and the targets from `first` on, one in each lane.
    #[inline(always)]
    fn collect<L: Lanes>(&mut self, first: usize, image: usize, blocks: &ImageBlocks<L>) {
        match self {
            Self::Columns { columns, places, column } => {
                let [start, end] = places[image];
                for (place, block) in [(start, &blocks.start), (end, &blocks.end)] {
                    let Some(node) = place else { continue };
                    let count = (3 * L::WIDTH).min(*column - 3 * first);
                    let at = 3 * *column * node + 3 * first;
                    for c in 0..3 {
                        let values = [block[c], block[3 + c], block[6 + c]];
                        write_triples(values, Write::Add, &mut columns[at + c * *column..][..count]);
                    }
                }
            }
            Self::Flow { velocity, densities } => {
                let [start, end] = &densities[image];
                let mut sum = [L::splat(0.0); 3];
                add_product(&blocks.start, start, &mut sum);
                add_product(&blocks.end, end, &mut sum);
                let count = (3 * L::WIDTH).min(velocity.len() - 3 * first);
                write_triples(sum, Write::Add, &mut velocity[3 * first..][..count]);
            }
        }
    }
}

#[inline(always)]
fn add_product<L: Lanes>(block: &Block<L>, f: &[f64; 3], sum: &mut [L; 3]) {
    for i in 0..3 {
        for j in 0..3 {
            sum[i] = block[3 * i + j].mul_add(L::splat(f[j]), sum[i]);
        }
    }
}
