//! One product: multipoles from the leaves up, local expansions and flow from the root down.
//!
//! Both trees are in preorder, so the two halves of a cell own disjoint parts of every array, and threads share the work by
//! halves without sharing memory. What is added to what, and in which order, is fixed by the trees alone.

use std::cell::RefCell;

use super::accuracy::gauss_rule;
use super::close::Scratch;
use super::octet::Four;
use super::sources::{self, Source};
use super::translation::{Multipoles, Work};
use super::{FarField, field, near, translation};

/// Items of a cell below which its halves are not worth two threads.
const SMALLEST_PARALLEL: usize = 256;

thread_local! {
    /// Room for translations, for each thread; none of them hands work to others while it is taken.
    static WORK: RefCell<Box<Work>> = RefCell::new(Box::new(Work::new()));
}

impl FarField {
    /// Fills `flow` with the product.
    pub(super) fn multiply(&mut self, density: &[f64], parallel: bool) {
        // What changes is taken out, so that the rest can be shared.
        let mut points = std::mem::take(&mut self.sources);
        let mut multipoles = std::mem::take(&mut self.multipoles);
        if !points.is_empty() {
            self.gather(0, density, &mut multipoles, &mut points, parallel);
        }
        (self.sources, self.multipoles) = (points, multipoles);

        let mut locals = std::mem::take(&mut self.locals);
        let mut flow = std::mem::take(&mut self.flow);
        if !flow.is_empty() {
            self.spread(0, false, density, &mut locals, &mut flow, parallel);
        }
        (self.locals, self.flow) = (locals, flow);
    }

    /// Charges the sources of a cell and finds its multipole and those of its descendants.
    fn gather(&self, cell: usize, density: &[f64], multipoles: &mut [Four], points: &mut [Source], parallel: bool) {
        let (tree, count) = (&self.source_tree, self.translation.count());
        let place = |cell: usize| &tree.places[cell];
        let needed = self.interactions.far.len() > 0;
        let Some([left, right]) = tree.halves(cell) else {
            let edges = &self.tree_edges[tree.cells[cell].items()];
            sources::charge(edges, gauss_rule(self.accuracy.gauss), density, points);
            if needed {
                sources::multipole(self.path, &self.harmonics, place(cell), points, &mut multipoles[..count]);
            }
            return;
        };
        let (own, halves) = multipoles.split_at_mut(count);
        let (first, second) = halves.split_at_mut((right - left) * count);
        let (near, far) = points.split_at_mut(tree.cells[left].count() * self.accuracy.gauss);
        let parallel = parallel && tree.cells[cell].count() > SMALLEST_PARALLEL;
        both(
            parallel,
            || self.gather(left, density, first, near, parallel),
            || self.gather(right, density, second, far, parallel),
        );
        if needed {
            let given = [&first[..count], &second[..count]];
            let places = [place(left), place(right)];
            WORK.with_borrow_mut(|work| {
                translation::to_parent(self.path, &self.translation, work, place(cell), places, given, own);
            });
        }
    }

    /// Completes the local expansion of a cell, hands it on to its halves, and finds the flow in the leaves.
    ///
    /// `carried` says whether the expansion already holds what comes from above.
    fn spread(
        &self,
        cell: usize,
        carried: bool,
        density: &[f64],
        locals: &mut [Four],
        flow: &mut [[f64; 3]],
        parallel: bool,
    ) {
        let (tree, count) = (&self.target_tree, self.translation.count());
        let (place, path) = (&tree.places[cell], self.path);
        let (own, halves) = locals.split_at_mut(count);
        if !carried {
            own.fill(Four::ZERO);
        }
        let far = self.interactions.far.of(cell);
        if !far.is_empty() {
            let all = Multipoles { places: &self.source_tree.places, multipoles: &self.multipoles };
            WORK.with_borrow_mut(|work| {
                translation::to_local(path, &self.translation, work, place, far, &all, own);
            });
        }
        let carried = carried || !far.is_empty();
        let Some([left, right]) = tree.halves(cell) else {
            flow.fill([0.0; 3]);
            if carried {
                field::evaluate(path, &self.harmonics, place, own, &self.targets[tree.cells[cell].items()], flow);
            }
            self.add_nearby(self.leaf_of[cell] as usize, density, flow);
            return;
        };
        let (first, second) = halves.split_at_mut((right - left) * count);
        if carried {
            let (first, second) = (&mut first[..count], &mut second[..count]);
            first.fill(Four::ZERO);
            second.fill(Four::ZERO);
            let places = [&tree.places[left], &tree.places[right]];
            WORK.with_borrow_mut(|work| {
                translation::to_children(path, &self.translation, work, place, places, own, [first, second]);
            });
        }
        let (before, after) = flow.split_at_mut(tree.cells[left].count());
        let parallel = parallel && tree.cells[cell].count() > SMALLEST_PARALLEL;
        both(
            parallel,
            || self.spread(left, carried, density, first, before, parallel),
            || self.spread(right, carried, density, second, after, parallel),
        );
    }

    /// Adds the flow of all that is near a leaf.
    fn add_nearby(&self, leaf: usize, density: &[f64], flow: &mut [[f64; 3]]) {
        let leaf = &self.leaves[leaf];
        near::add_near(self.path, &self.sources, &leaf.runs, &self.targets[leaf.targets.clone()], flow);
        match &leaf.blocks {
            Some(blocks) => blocks.iter().for_each(|block| block.add(density, flow)),
            None => self.neighbourhood(leaf).add(density, &mut Scratch::default(), flow),
        }
    }
}

fn both(parallel: bool, first: impl FnOnce() + Send, second: impl FnOnce() + Send) {
    if parallel {
        rayon::join(first, second);
    } else {
        first();
        second();
    }
}
