//! The flow of Gauss points at targets nearby, one by one, with their full regularization.

use std::ops::Range;

use super::octet::{Eight, Octet, on_path};
use super::sources::Source;
use crate::fluid::lanes::Lanes;
use crate::fluid::segment::Symmetric;

on_path! {
    /// Adds the flow of several runs of sources at every target.
    pub(crate) fn add_near(
        sources: &[Source],
        runs: &[Range<u32>],
        targets: &[[f64; 3]],
        out: &mut [[f64; 3]],
    ) = add_near_as
}

on_path! {
    /// Fills `out` with the block of a Gauss point of weight one at every target.
    ///
    /// Its inverse distances are those of [`add_near`] to the last bit, so that taking blocks off again leaves nothing but
    /// the round-off of a few sums, however close the target.
    pub(crate) fn blocks(source: &Source, targets: &[[f64; 3]], out: &mut [Symmetric<f64>]) = blocks_as
}

#[inline(always)]
fn add_near_as<L: Lanes>(sources: &[Source], runs: &[Range<u32>], targets: &[[f64; 3]], out: &mut [[f64; 3]]) {
    for (targets, out) in targets.chunks(8).zip(out.chunks_mut(8)) {
        let at = columns::<L>(targets);
        let (mut u, mut v, mut w) = (Octet::<L>::zero(), Octet::<L>::zero(), Octet::<L>::zero());
        for run in runs {
            for source in &sources[run.start as usize..run.end as usize] {
                let Pair { x, y, z, inverse, cube } = Pair::new(at, source);
                let [p, q, r] = source.force;
                let (p, q, r) = (Octet::splat(p), Octet::splat(q), Octet::splat(r));
                let along = x.fma(p, y.fma(q, z.times(r))).times(cube);
                let even = cube.fma_scalar(source.epsilon_squared, inverse);
                u = even.fma(p, x.fma(along, u));
                v = even.fma(q, y.fma(along, v));
                w = even.fma(r, z.fma(along, w));
            }
        }
        let mut sums = [Eight::ZERO; 3];
        for (sum, value) in sums.iter_mut().zip([u, v, w]) {
            value.store(sum);
        }
        for (lane, out) in out.iter_mut().enumerate() {
            for k in 0..3 {
                out[k] += sums[k].0[lane];
            }
        }
    }
}

#[inline(always)]
fn blocks_as<L: Lanes>(source: &Source, targets: &[[f64; 3]], out: &mut [Symmetric<f64>]) {
    for (targets, out) in targets.chunks(8).zip(out.chunks_mut(8)) {
        let Pair { x, y, z, inverse, cube } = Pair::new(columns::<L>(targets), source);
        let even = cube.fma_scalar(source.epsilon_squared, inverse);
        let (a, b, c) = (x.times(cube), y.times(cube), z.times(cube));
        let entries = [x.fma(a, even), x.times(b), x.times(c), y.fma(b, even), y.times(c), z.fma(c, even)];
        let mut columns = [Eight::ZERO; 6];
        for (column, entry) in columns.iter_mut().zip(entries) {
            entry.store(column);
        }
        for (lane, out) in out.iter_mut().enumerate() {
            *out = columns.map(|column| column.0[lane]);
        }
    }
}

/// Eight targets beside a source: offsets, `1 / R` and `1 / R^3`.
struct Pair<L: Lanes> {
    x: Octet<L>,
    y: Octet<L>,
    z: Octet<L>,
    inverse: Octet<L>,
    cube: Octet<L>,
}

impl<L: Lanes> Pair<L> {
    #[inline(always)]
    fn new(at: [Octet<L>; 3], source: &Source) -> Self {
        let [a, b, c] = source.position;
        let x = at[0].minus(Octet::splat(a));
        let y = at[1].minus(Octet::splat(b));
        let z = at[2].minus(Octet::splat(c));
        let r_squared = x.fma(x, y.fma(y, z.fma(z, Octet::<L>::splat(source.epsilon_squared))));
        let inverse = r_squared.inverse_root();
        Self { x, y, z, inverse, cube: inverse.times(inverse).times(inverse) }
    }
}

/// Up to eight points by coordinates; lanes without one repeat the first.
#[inline(always)]
fn columns<L: Lanes>(points: &[[f64; 3]]) -> [Octet<L>; 3] {
    let mut columns = [Octet::zero(); 3];
    for k in 0..3 {
        let mut column = Eight([points[0][k]; 8]);
        for (value, point) in column.0.iter_mut().zip(points) {
            *value = point[k];
        }
        columns[k] = Octet::load(&column);
    }
    columns
}
