//! Pairs of a target and an edge too close for Gauss points: what the exact integral adds to them.

use super::near;
use super::sources::{Edge, Source};
use super::tree::squared_distance;
use crate::Vec3;
use crate::fluid::lanes::Path;
use crate::fluid::segment::{Blocks, Segment, Symmetric, for_each_target};

/// The targets of a leaf and the edges that may be close to some of them.
pub(crate) struct Neighbourhood<'a> {
    /// In the units of the trees, in their order; of the leaf alone.
    pub targets: &'a [[f64; 3]],
    /// The same in metres.
    pub exact_targets: &'a [Vec3],
    /// A ball around the targets.
    pub centre: &'a [f64; 3],
    pub radius: f64,
    /// In metres.
    pub nodes: &'a [Vec3],
    /// The regularization of every edge of the network, m.
    pub epsilon: &'a [f64],
    pub edges: &'a [Edge],
    pub sources: &'a [Source],
    pub rule: &'a [[f64; 2]],
    pub runs: &'a [std::ops::Range<u32>],
    /// Distance from an edge's centre below which a target is close, in half-lengths.
    pub close: f64,
    pub path: Path,
}

/// Room for the close targets of an edge.
#[derive(Default)]
pub(crate) struct Scratch {
    rows: Vec<u32>,
    targets: Vec<Vec3>,
    tree_targets: Vec<[f64; 3]>,
    blocks: Vec<Blocks<f64>>,
    gauss: Vec<Symmetric<f64>>,
    entries: Vec<Entry>,
}

impl Scratch {
    /// Makes room for the rows found.
    fn take(&mut self, given: &Neighbourhood) {
        self.targets.clear();
        self.targets.extend(self.rows.iter().map(|&row| given.exact_targets[row as usize]));
        self.tree_targets.clear();
        self.tree_targets.extend(self.rows.iter().map(|&row| given.targets[row as usize]));
        self.blocks.clear();
        self.gauss.clear();
        self.gauss.resize(self.rows.len(), [0.0; 6]);
    }
}

/// The block of a row, by which a nodal force density contributes to a target of the leaf.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    row: u32,
    node: u32,
    block: Symmetric<f64>,
}

/// Memory that a close pair takes at most: a block for each end.
pub(crate) const BYTES_PER_PAIR: usize = 2 * size_of::<Entry>();

impl Neighbourhood<'_> {
    /// Number of close pairs.
    pub fn count(&self) -> usize {
        self.candidates().map(|(_, edge, centre)| self.rows(edge, centre).count()).sum()
    }

    /// Replaces `out` by the blocks of all close pairs, one for each target and node, sorted.
    pub fn blocks(&self, scratch: &mut Scratch, out: &mut Vec<Entry>) {
        out.clear();
        scratch.entries.clear();
        let mut entries = std::mem::take(&mut scratch.entries);
        self.for_each_pair(scratch, |row, edge, blocks| {
            for (node, block) in edge.nodes.into_iter().zip([blocks.start, blocks.end]) {
                entries.push(Entry { row, node, block });
            }
        });
        // Stable, so that blocks of a target and a node are added in the order of the edges.
        entries.sort_by_key(|entry| (entry.row, entry.node));
        for entry in &entries {
            match out.last_mut() {
                Some(last) if (last.row, last.node) == (entry.row, entry.node) => {
                    last.block.iter_mut().zip(&entry.block).for_each(|(sum, value)| *sum += value);
                }
                _ => out.push(*entry),
            }
        }
        scratch.entries = entries;
    }

    /// Adds the flow of all close pairs without keeping their blocks.
    pub fn add(&self, density: &[f64], scratch: &mut Scratch, out: &mut [[f64; 3]]) {
        self.for_each_pair(scratch, |row, edge, blocks| {
            for (node, block) in edge.nodes.into_iter().zip([blocks.start, blocks.end]) {
                Entry { row, node, block }.add(density, out);
            }
        });
    }

    /// Edges that may have close targets, with their places and centres.
    fn candidates(&self) -> impl Iterator<Item = (usize, &Edge, [f64; 3])> {
        let gauss = self.rule.len();
        let places = self.runs.iter().flat_map(move |run| run.start as usize / gauss..run.end as usize / gauss);
        places.filter_map(move |place| {
            let (edge, first, last) =
                (&self.edges[place], &self.sources[place * gauss], &self.sources[(place + 1) * gauss - 1]);
            let centre = std::array::from_fn(|k| 0.5 * (first.position[k] + last.position[k]));
            let reach = self.radius + self.limit(edge);
            (squared_distance(self.centre, &centre) < reach * reach).then_some((place, edge, centre))
        })
    }

    /// Distance from an edge's centre below which a target is close.
    fn limit(&self, edge: &Edge) -> f64 {
        0.5 * self.close * edge.length
    }

    fn rows(&self, edge: &Edge, centre: [f64; 3]) -> impl Iterator<Item = u32> {
        let limit = self.limit(edge).powi(2);
        let close = move |target: &[f64; 3]| squared_distance(target, &centre) < limit;
        self.targets.iter().zip(0..).filter(move |(target, _)| close(target)).map(|(_, row)| row)
    }

    /// Hands on the exact blocks of every close pair, less those of the Gauss points.
    fn for_each_pair(&self, scratch: &mut Scratch, mut take: impl FnMut(u32, &Edge, &Blocks<f64>)) {
        let gauss = self.rule.len();
        for (place, edge, centre) in self.candidates() {
            scratch.rows.clear();
            scratch.rows.extend(self.rows(edge, centre));
            if scratch.rows.is_empty() {
                continue;
            }
            scratch.take(self);
            let [start, end] = edge.nodes.map(|node| &self.nodes[node as usize]);
            let segment = Segment::new(start, end, self.epsilon[edge.index as usize]);
            let exact = &mut scratch.blocks;
            for_each_target(self.path, &segment, &scratch.targets, |_, blocks| exact.push(*blocks));
            for (source, [point, weight]) in self.sources[place * gauss..].iter().zip(self.rule) {
                near::blocks(self.path, source, &scratch.tree_targets, &mut scratch.gauss);
                let (at_start, at_end) = ((1.0 - point) * weight * edge.length, point * weight * edge.length);
                for (blocks, gauss) in scratch.blocks.iter_mut().zip(&scratch.gauss) {
                    for k in 0..6 {
                        blocks.start[k] -= at_start * gauss[k];
                        blocks.end[k] -= at_end * gauss[k];
                    }
                }
            }
            for (row, blocks) in scratch.rows.iter().zip(&scratch.blocks) {
                take(*row, edge, blocks);
            }
        }
    }
}

impl Entry {
    /// Adds this block's flow to its target.
    #[inline]
    pub fn add(&self, density: &[f64], out: &mut [[f64; 3]]) {
        let (f, b) = (&density[3 * self.node as usize..][..3], &self.block);
        let out = &mut out[self.row as usize];
        out[0] += b[0] * f[0] + b[1] * f[1] + b[2] * f[2];
        out[1] += b[1] * f[0] + b[3] * f[1] + b[4] * f[2];
        out[2] += b[2] * f[0] + b[4] * f[1] + b[5] * f[2];
    }
}
