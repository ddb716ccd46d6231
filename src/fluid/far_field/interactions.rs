//! Which cells meet by expansions and which point by point: a walk down two trees at once.

use super::accuracy::Accuracy;
use super::translation::FarCell;
use super::tree::{Tree, squared_distance};

/// Something for every target cell: a list for each.
#[derive(Clone, Debug)]
pub(crate) struct Lists<T> {
    starts: Vec<u32>,
    entries: Vec<T>,
    pairs: Vec<(u32, T)>,
}

impl<T> Default for Lists<T> {
    fn default() -> Self {
        Self { starts: Vec::new(), entries: Vec::new(), pairs: Vec::new() }
    }
}

impl<T: Copy> Lists<T> {
    /// Sorts the pairs into lists, each in the order of the pairs.
    fn sort(&mut self, targets: usize) {
        self.starts.clear();
        self.starts.resize(targets + 2, 0);
        for (target, _) in &self.pairs {
            self.starts[*target as usize + 2] += 1;
        }
        for k in 2..self.starts.len() {
            self.starts[k] += self.starts[k - 1];
        }
        self.entries.clear();
        self.entries.extend(self.pairs.iter().map(|(_, entry)| *entry));
        for (target, entry) in &self.pairs {
            let place = &mut self.starts[*target as usize + 1];
            self.entries[*place as usize] = *entry;
            *place += 1;
        }
        self.starts.pop();
    }

    pub fn of(&self, target: usize) -> &[T] {
        &self.entries[self.starts[target] as usize..self.starts[target + 1] as usize]
    }

    fn of_mut(&mut self, target: usize) -> &mut [T] {
        &mut self.entries[self.starts[target] as usize..self.starts[target + 1] as usize]
    }

    pub fn len(&self) -> usize {
        self.entries.len()
    }

    pub fn bytes(&self) -> usize {
        4 * self.starts.capacity()
            + size_of::<T>() * self.entries.capacity()
            + size_of::<(u32, T)>() * self.pairs.capacity()
    }
}

/// The pairs of cells of a target tree and a source tree; together they cover every target and source once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Interactions {
    pub far: Lists<FarCell>,
    pub near: Lists<u32>,
}

impl Interactions {
    /// Walks both trees; `reach` is the least distance from each source cell at which expansions hold.
    pub fn rebuild(&mut self, targets: &Tree, sources: &Tree, reach: &[f64], accuracy: &Accuracy) {
        self.far.pairs.clear();
        self.near.pairs.clear();
        if !targets.cells.is_empty() && !sources.cells.is_empty() {
            Walk { targets, sources, reach, accuracy, lists: self }.meet(0, 0);
        }
        self.far.sort(targets.cells.len());
        self.near.sort(targets.cells.len());
        // Cells are taken two at a time, at the higher order of the two.
        for target in 0..targets.cells.len() {
            self.far.of_mut(target).sort_by_key(|far| far.order);
        }
    }
}

struct Walk<'a> {
    targets: &'a Tree,
    sources: &'a Tree,
    reach: &'a [f64],
    accuracy: &'a Accuracy,
    lists: &'a mut Interactions,
}

impl Walk<'_> {
    fn meet(&mut self, target: usize, source: usize) {
        let (t, s) = (&self.targets.cells[target], &self.sources.cells[source]);
        let distance =
            squared_distance(&self.targets.places[target].centre, &self.sources.places[source].centre).sqrt();
        let pairs = t.count() * s.count() * self.accuracy.gauss;
        let gap = distance - t.radius - s.radius;
        let order =
            if gap >= self.reach[source] { self.accuracy.order_for(t.radius, s.radius, distance) } else { None };
        if let Some(order) = order.filter(|&order| pairs > self.accuracy.worthwhile(order)) {
            self.lists.far.pairs.push((target as u32, FarCell { cell: source as u32, order: order as u8 }));
            return;
        }
        // Nothing is gained by halving what would be taken one by one whatever the order.
        if order.is_some() || pairs <= self.accuracy.worthwhile(1) {
            self.lists.near.pairs.push((target as u32, source as u32));
            return;
        }
        match (self.targets.halves(target), self.sources.halves(source)) {
            (None, None) => self.lists.near.pairs.push((target as u32, source as u32)),
            (Some(halves), None) => halves.into_iter().for_each(|half| self.meet(half, source)),
            (Some(halves), Some(_)) if t.radius >= s.radius => {
                halves.into_iter().for_each(|half| self.meet(half, source));
            }
            (_, Some(halves)) => halves.into_iter().for_each(|half| self.meet(target, half)),
        }
    }
}
