//! A binary tree over points in space, halved across the longest side until few are left.

use std::ops::Range;

use super::translation::Place;

/// A cell of the tree: items that are neighbours in space and in [`Tree::order`].
#[derive(Clone, Debug)]
pub(crate) struct Cell {
    first: u32,
    last: u32,
    /// The cell after the last of this one's descendants.
    pub next: u32,
    /// Largest distance of a point from the centre.
    pub radius: f64,
}

impl Cell {
    pub fn items(&self) -> Range<usize> {
        self.first as usize..self.last as usize
    }

    pub fn count(&self) -> usize {
        (self.last - self.first) as usize
    }
}

/// Cells in preorder: the left half of cell `c`, if it has halves, is `c + 1`, the right half is `cells[c + 1].next`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    pub cells: Vec<Cell>,
    /// Centre and radius of every cell, at least [`SMALLEST_SCALE`].
    pub places: Vec<Place>,
    /// The items in the order of the tree.
    pub order: Vec<u32>,
    middles: Vec<[f64; 3]>,
}

/// Scale of the expansion of cells of a single point, in units of the scene; any positive number would do.
const SMALLEST_SCALE: f64 = 1e-9;

impl Tree {
    /// Rebuilds the tree over items of `per_item` points each, kept in the memory it has.
    ///
    /// Cells of at most `capacity` items are not halved; halves hold a multiple of `grain` items, but for the last.
    pub fn rebuild(&mut self, points: &[[f64; 3]], per_item: usize, capacity: usize, grain: usize) {
        let items = points.len() / per_item;
        self.cells.clear();
        self.places.clear();
        self.order.clear();
        self.order.extend(0..items as u32);
        self.middles.clear();
        self.middles.extend(
            points.chunks_exact(per_item).map(|points| {
                std::array::from_fn(|k| points.iter().map(|point| point[k]).sum::<f64>() / per_item as f64)
            }),
        );
        if items > 0 {
            self.divide(points, per_item, 0..items, capacity, grain);
        }
    }

    fn divide(&mut self, points: &[[f64; 3]], per_item: usize, items: Range<usize>, capacity: usize, grain: usize) {
        let own = self.cells.len();
        let bounds = Bounds::of(self.points_of(points, per_item, &items));
        let centre = bounds.centre();
        let radius = self
            .points_of(points, per_item, &items)
            .map(|point| squared_distance(point, &centre))
            .fold(0.0, f64::max)
            .sqrt();
        self.cells.push(Cell { first: items.start as u32, last: items.end as u32, next: own as u32 + 1, radius });
        self.places.push(Place { centre, scale: radius.max(SMALLEST_SCALE) });
        if items.len() <= capacity {
            return;
        }
        let half = (items.len() / 2).next_multiple_of(grain).min(items.len() - 1);
        let (axis, middles) = (bounds.longest_axis(), &self.middles);
        // Ties go by number, so that the order does not depend on how the selection works.
        self.order[items.clone()].select_nth_unstable_by(half, |&a, &b| {
            middles[a as usize][axis].total_cmp(&middles[b as usize][axis]).then(a.cmp(&b))
        });
        let middle = items.start + half;
        self.divide(points, per_item, items.start..middle, capacity, grain);
        self.divide(points, per_item, middle..items.end, capacity, grain);
        self.cells[own].next = self.cells.len() as u32;
    }

    fn points_of<'a>(
        &'a self,
        points: &'a [[f64; 3]],
        per_item: usize,
        items: &Range<usize>,
    ) -> impl Iterator<Item = &'a [f64; 3]> {
        let order = &self.order[items.clone()];
        order.iter().flat_map(move |&item| &points[item as usize * per_item..(item as usize + 1) * per_item])
    }

    /// The two halves of a cell, if it has any.
    pub fn halves(&self, cell: usize) -> Option<[usize; 2]> {
        let next = self.cells[cell].next as usize;
        (next > cell + 1).then(|| [cell + 1, self.cells[cell + 1].next as usize])
    }
}

struct Bounds {
    low: [f64; 3],
    high: [f64; 3],
}

impl Bounds {
    fn of<'a>(points: impl Iterator<Item = &'a [f64; 3]>) -> Self {
        let mut bounds = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };
        for point in points {
            for k in 0..3 {
                bounds.low[k] = bounds.low[k].min(point[k]);
                bounds.high[k] = bounds.high[k].max(point[k]);
            }
        }
        bounds
    }

    fn centre(&self) -> [f64; 3] {
        std::array::from_fn(|k| 0.5 * (self.low[k] + self.high[k]))
    }

    fn longest_axis(&self) -> usize {
        let side = |k: usize| self.high[k] - self.low[k];
        (1..3).fold(0, |longest, k| if side(k) > side(longest) { k } else { longest })
    }
}

pub(crate) fn squared_distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spiral(count: usize) -> Vec<[f64; 3]> {
        (0..count).map(|k| (k as f64, (k as f64 * 0.7).sin_cos())).map(|(k, (s, c))| [0.01 * k, s, c]).collect()
    }

    #[test]
    fn leaves_partition_the_items_and_cells_contain_their_points() {
        let points = spiral(1000);
        let mut tree = Tree::default();
        tree.rebuild(&points, 2, 20, 8);
        let mut seen = 0;
        for (index, cell) in tree.cells.iter().enumerate() {
            if tree.halves(index).is_none() {
                assert_eq!(cell.items().start, seen);
                assert!(cell.count() <= 20 && cell.count() > 0);
                seen = cell.items().end;
            }
            for item in cell.items() {
                for point in &points[2 * tree.order[item] as usize..][..2] {
                    let distance = squared_distance(point, &tree.places[index].centre).sqrt();
                    assert!(distance <= cell.radius * (1.0 + 1e-15));
                }
            }
        }
        assert_eq!(seen, 500);
        let mut order = tree.order.clone();
        order.sort_unstable();
        assert!(order.iter().enumerate().all(|(k, &item)| k == item as usize));
    }

    #[test]
    fn coincident_points_still_divide() {
        let mut tree = Tree::default();
        tree.rebuild(&[[1.0, 2.0, 3.0]; 100], 1, 8, 8);
        assert!(tree.cells.iter().all(|cell| cell.radius == 0.0));
        assert!(tree.cells.len() > 12);
    }
}
