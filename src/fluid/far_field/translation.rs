//! Moving expansions between cells: multipoles to parents, multipoles to locals, locals to children.
//!
//! Each translation turns the axes until it runs along z, where it acts on every `m` apart, and turns them back; two run
//! side by side. With `r` the distance of the centres, `s` and `t` the radii in which the coefficients of the giving and the
//! taking cell are measured, and `N` the norms of [`super::harmonics`], along z
//!
//! ```text
//! multipole to parent   M_n^m = sum over k <= n of (s/t)^k (r/t)^(n-k) N_n^m / N_k^m / (n - k)!  M_k^m
//! local to child        the transpose of it
//! multipole to local    F_j^m = (-1)^(j+m) (t/r)^j / r  sum over k of (j + k)! / (N_j^m N_k^m) (s/r)^k  M_k^m
//! ```
//!
//! (after Dehnen, Comput. Astrophys. Cosmol. 1 (2014) 1.) The fourth potential is `sum (y - centre) . f / |x - y|`, so it
//! changes with the centre, by the other three.

use super::harmonics::{MAX_COEFFICIENTS, MAX_ORDER, coefficients, factorial, imaginary, norm, real};
use super::octet::{Eight, Four, Octet, on_path};
use super::rotation::{Multiples, NO_MULTIPLES, Swap, multiples, turn};
use super::square;
use crate::fluid::lanes::Lanes;

/// Where an expansion sits: its centre and the length its coefficients are measured in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub centre: [f64; 3],
    pub scale: f64,
}

impl Place {
    fn from(&self, other: &Self) -> [f64; 3] {
        std::array::from_fn(|k| self.centre[k] - other.centre[k])
    }
}

/// A source cell that a target cell meets by expansions up to an order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FarCell {
    pub cell: u32,
    pub order: u8,
}

/// Tables of the translations up to an order.
pub(crate) struct Translation {
    order: usize,
    swap: Swap,
    /// For each order up to that one, `(-1)^(j+m) (j + k)! / (N_j^m N_k^m)` for m, j, k in turn, `j, k >= m`.
    far: Vec<Vec<f64>>,
    /// `N_n^m / N_k^m / (n - k)!` for m, n, k in turn, `n >= k >= m`.
    shift: Vec<f64>,
    /// For each order, places of `U_n^m` and of `V_n^m` for m, n in turn, `n >= m`; those of `V` for `m > 0` only.
    columns: Vec<[Vec<u16>; 2]>,
}

impl Translation {
    pub fn new(order: usize) -> Self {
        let mut shift = Vec::new();
        for m in 0..=order {
            for n in m..=order {
                shift.extend((m..=n).map(|k| norm(n, m) / norm(k, m) / factorial(n - k)));
            }
        }
        let orders = 0..=order;
        Self {
            order,
            swap: Swap::new(order),
            far: orders.clone().map(far_factors).collect(),
            shift,
            columns: orders.map(|order| [places(order, 0, real), places(order, 1, imaginary)]).collect(),
        }
    }

    /// Number of coefficients of an expansion.
    pub fn count(&self) -> usize {
        coefficients(self.order)
    }
}

fn far_factors(order: usize) -> Vec<f64> {
    let mut factors = Vec::new();
    for m in 0..=order {
        for j in m..=order {
            let sign = if (j + m) % 2 == 0 { 1.0 } else { -1.0 };
            factors.extend((m..=order).map(|k| sign * factorial(j + k) / (norm(j, m) * norm(k, m))));
        }
    }
    factors
}

fn places(order: usize, first: usize, place: fn(usize, usize) -> usize) -> Vec<u16> {
    (first..=order).flat_map(|m| (m..=order).map(move |n| place(n, m) as u16)).collect()
}

on_path! {
    /// Sets the multipole of a cell from those of its two halves.
    pub(crate) fn to_parent(
        tables: &Translation,
        work: &mut Work,
        parent: &Place,
        children: [&Place; 2],
        multipoles: [&[Four]; 2],
        out: &mut [Four],
    ) = to_parent_as
}

on_path! {
    /// Adds the local expansion of a cell to those of its two halves.
    pub(crate) fn to_children(
        tables: &Translation,
        work: &mut Work,
        parent: &Place,
        children: [&Place; 2],
        local: &[Four],
        out: [&mut [Four]; 2],
    ) = to_children_as
}

/// All cells with sources: where they are, and their multipoles, one expansion after the other.
pub(crate) struct Multipoles<'a> {
    pub(crate) places: &'a [Place],
    pub(crate) multipoles: &'a [Four],
}

on_path! {
    /// Adds what the multipoles of the cells listed bring to a local expansion, each up to its order.
    pub(crate) fn to_local(
        tables: &Translation,
        work: &mut Work,
        target: &Place,
        sources: &[FarCell],
        all: &Multipoles<'_>,
        out: &mut [Four],
    ) = to_local_as
}

#[inline(always)]
fn to_parent_as<L: Lanes>(
    tables: &Translation,
    work: &mut Work,
    parent: &Place,
    children: [&Place; 2],
    multipoles: [&[Four]; 2],
    out: &mut [Four],
) {
    let order = tables.order;
    let offsets = children.map(|child| child.from(parent));
    work.face::<L>(order, &offsets);
    work.load::<L>(order, multipoles, children.map(|child| child.scale / parent.scale), &offsets);
    work.onto_axis::<L>(tables, order);
    let steps = work.distances.map(|r| r / parent.scale);
    powers::<L>(&mut work.powers[..=order], steps);
    let mut rows = tables.shift.as_slice();
    for m in 0..=order {
        work.gather(order, m);
        for n in m..=order {
            let (row, rest) = rows.split_at(n - m + 1);
            rows = rest;
            let (mut u, mut v) = (Octet::<L>::zero(), Octet::<L>::zero());
            for (([a, b], factor), step) in work.column[m..].iter().zip(row).zip(work.powers[..=n - m].iter().rev()) {
                let factor = Octet::<L>::load(step).times(Octet::<L>::splat(*factor));
                (u, v) = (Octet::<L>::load(a).fma(factor, u), Octet::<L>::load(b).fma(factor, v));
            }
            work.put(n, m, u, v);
        }
    }
    work.off_axis::<L>(tables, order);
    for (out, sum) in out.iter_mut().zip(&work.values[..tables.count()]) {
        *out = Four::ZERO;
        Octet::<L>::load(sum).add_halves(out);
    }
}

#[inline(always)]
fn to_children_as<L: Lanes>(
    tables: &Translation,
    work: &mut Work,
    parent: &Place,
    children: [&Place; 2],
    local: &[Four],
    [left, right]: [&mut [Four]; 2],
) {
    let order = tables.order;
    let offsets = children.map(|child| child.from(parent));
    let back = offsets.map(|offset| offset.map(|c| -c));
    work.face::<L>(order, &offsets);
    work.load::<L>(order, [local, local], [1.0; 2], &back);
    work.onto_axis::<L>(tables, order);
    let steps = work.distances.map(|r| r / parent.scale);
    powers::<L>(&mut work.powers[..=order], steps);
    let mut rows = tables.shift.as_slice();
    for m in 0..=order {
        work.gather(order, m);
        for k in m..=order {
            work.put(k, m, Octet::<L>::zero(), Octet::<L>::zero());
        }
        for n in m..=order {
            let (row, rest) = rows.split_at(n - m + 1);
            rows = rest;
            let [u, v] = [Octet::<L>::load(&work.column[n][0]), Octet::<L>::load(&work.column[n][1])];
            for (k, factor) in (m..=n).zip(row) {
                let factor = Octet::<L>::load(&work.powers[n - k]).times(Octet::<L>::splat(*factor));
                work.add(k, m, u.times(factor), v.times(factor));
            }
        }
    }
    work.off_axis::<L>(tables, order);
    let shrink = children.map(|child| child.scale / parent.scale);
    powers::<L>(&mut work.powers[..=order], shrink);
    for n in 0..=order {
        let shrink = Octet::<L>::load(&work.powers[n]);
        for c in n * n..(n + 1) * (n + 1) {
            Octet::<L>::load(&work.values[c]).times(shrink).add_each(&mut left[c], &mut right[c]);
        }
    }
}

#[inline(always)]
fn to_local_as<L: Lanes>(
    tables: &Translation,
    work: &mut Work,
    target: &Place,
    sources: &[FarCell],
    &Multipoles { places, multipoles }: &Multipoles<'_>,
    out: &mut [Four],
) {
    let count = tables.count();
    let out = &mut out[..count];
    for pair in sources.chunks(2) {
        // A lone last cell goes in twice and counts once.
        let both = [pair[0], pair[pair.len() - 1]];
        let order = usize::from(both[0].order.max(both[1].order));
        let both = both.map(|source| source.cell as usize);
        let weights = [1.0, if pair.len() == 2 { 1.0 } else { 0.0 }];
        let given = both.map(|source| &places[source]);
        let offsets = given.map(|place| target.from(place));
        let back = offsets.map(|offset| offset.map(|c| -c));
        work.face::<L>(order, &offsets);
        let inverse = work.distances.map(|r| 1.0 / r);
        let ratios = std::array::from_fn(|k| given[k].scale * inverse[k]);
        work.load::<L>(order, both.map(|source| &multipoles[source * count..(source + 1) * count]), ratios, &back);
        work.onto_axis::<L>(tables, order);
        let mut columns = tables.columns[order].each_ref().map(Vec::as_slice);
        let mut blocks = tables.far[order].as_slice();
        for m in 0..=order {
            let size = order + 1 - m;
            let (block, rest) = blocks.split_at(size * size);
            blocks = rest;
            work.multiply::<L>(block, &mut columns[0], size);
            if m > 0 {
                work.multiply::<L>(block, &mut columns[1], size);
            }
        }
        work.off_axis::<L>(tables, order);
        powers::<L>(&mut work.powers[..=order], inverse.map(|inverse| target.scale * inverse));
        let weight = Octet::<L>::load(&Eight::halves(weights[0] * inverse[0], weights[1] * inverse[1]));
        for n in 0..=order {
            let scale = Octet::<L>::load(&work.powers[n]).times(weight);
            for c in n * n..(n + 1) * (n + 1) {
                Octet::<L>::load(&work.values[c]).times(scale).add_halves(&mut out[c]);
            }
        }
    }
}

/// Two expansions on their way: room for their forms, and the axes in which each of their translations runs along z.
pub(crate) struct Work {
    values: [Eight; MAX_COEFFICIENTS],
    other: [Eight; MAX_COEFFICIENTS],
    /// Coefficients `U_n^m`, `V_n^m` of one m, at n; `V` counts for `m > 0` only.
    column: [[Eight; 2]; MAX_ORDER + 1],
    taken: [Eight; MAX_ORDER + 1],
    made: [Eight; MAX_ORDER + 1],
    powers: [Eight; MAX_ORDER + 1],
    distances: [f64; 2],
    first: Multiples,
    second: Multiples,
}

impl Work {
    pub fn new() -> Self {
        Self {
            values: [Eight::ZERO; MAX_COEFFICIENTS],
            other: [Eight::ZERO; MAX_COEFFICIENTS],
            column: [[Eight::ZERO; 2]; MAX_ORDER + 1],
            taken: [Eight::ZERO; MAX_ORDER + 1],
            made: [Eight::ZERO; MAX_ORDER + 1],
            powers: [Eight::ZERO; MAX_ORDER + 1],
            distances: [0.0; 2],
            first: NO_MULTIPLES,
            second: NO_MULTIPLES,
        }
    }

    /// Finds the turns that bring each offset onto z.
    #[inline(always)]
    fn face<L: Lanes>(&mut self, order: usize, offsets: &[[f64; 3]; 2]) {
        let angles = offsets.map(|[x, y, z]| {
            let across = (x * x + y * y).sqrt();
            let distance = (x * x + y * y + z * z).sqrt();
            // The first turn brings the offset into the plane x = 0, y > 0; swapped, the second brings it onto x.
            let (c1, s1) = if across > 0.0 { (y / across, x / across) } else { (1.0, 0.0) };
            let (c2, s2) = if distance > 0.0 { (z / distance, -across / distance) } else { (1.0, 0.0) };
            [distance, c1, s1, c2, s2]
        });
        let halves = |k: usize| Eight::halves(angles[0][k], angles[1][k]);
        let [c1, s1, c2, s2] = Octet::<L>::load_each(&[halves(1), halves(2), halves(3), halves(4)]);
        self.distances = angles.map(|angle| angle[0]);
        multiples(order, c1, s1, &mut self.first);
        multiples(order, c2, s2, &mut self.second);
    }

    /// Takes two expansions, multiplies degree n by `ratio^n`, and refers the fourth potential to another centre `c'`:
    /// `(y - c') . f = (y - c) . f + back . f` with `back = c - c'`.
    #[inline(always)]
    fn load<L: Lanes>(&mut self, order: usize, [a, b]: [&[Four]; 2], ratios: [f64; 2], [p, q]: &[[f64; 3]; 2]) {
        powers::<L>(&mut self.powers[..=order], ratios);
        let first = Octet::<L>::load_each(&p.map(|c| Eight([0.0, 0.0, 0.0, c, 0.0, 0.0, 0.0, 0.0])));
        let second = Octet::<L>::load_each(&q.map(|c| Eight([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, c])));
        for n in 0..=order {
            let (ratio, degree) = (Octet::<L>::load(&self.powers[n]), n * n..(n + 1) * (n + 1));
            let given = a[degree.clone()].iter().zip(&b[degree.clone()]);
            for ((a, b), value) in given.zip(&mut self.values[degree]) {
                let mut moved = Octet::<L>::load(&Eight::join(a, b));
                for k in 0..3 {
                    moved = second[k].fma_scalar(b.0[k], first[k].fma_scalar(a.0[k], moved));
                }
                moved.times(ratio).store(value);
            }
        }
    }

    /// From the axes of space to those of the translation.
    #[inline(always)]
    fn onto_axis<L: Lanes>(&mut self, tables: &Translation, order: usize) {
        turn::<L, false>(order, &self.first, &mut self.values);
        tables.swap.apply::<L>(order, &self.values, &mut self.other);
        turn::<L, false>(order, &self.second, &mut self.other);
        tables.swap.apply::<L>(order, &self.other, &mut self.values);
    }

    /// Back from the axes of the translation.
    #[inline(always)]
    fn off_axis<L: Lanes>(&mut self, tables: &Translation, order: usize) {
        tables.swap.apply::<L>(order, &self.values, &mut self.other);
        turn::<L, true>(order, &self.second, &mut self.other);
        tables.swap.apply::<L>(order, &self.other, &mut self.values);
        turn::<L, true>(order, &self.first, &mut self.values);
    }

    /// Multiplies the coefficients at the first `size` places by a matrix, and drops these places.
    #[inline(always)]
    fn multiply<L: Lanes>(&mut self, matrix: &[f64], places: &mut &[u16], size: usize) {
        let (own, rest) = places.split_at(size);
        *places = rest;
        let (taken, made) = (&mut self.taken[..size], &mut self.made[..size]);
        for (taken, &place) in taken.iter_mut().zip(own) {
            Octet::<L>::load(&self.values[place as usize]).store(taken);
        }
        square::multiply::<L>(matrix, taken, made);
        for (made, &place) in made.iter().zip(own) {
            Octet::<L>::load(made).store(&mut self.values[place as usize]);
        }
    }

    /// Copies all coefficients of one m into the column.
    #[inline(always)]
    fn gather(&mut self, order: usize, m: usize) {
        for (n, column) in self.column[..=order].iter_mut().enumerate().skip(m) {
            column[0] = self.values[real(n, m)];
            if m > 0 {
                column[1] = self.values[imaginary(n, m)];
            }
        }
    }

    #[inline(always)]
    fn put<L: Lanes>(&mut self, n: usize, m: usize, u: Octet<L>, v: Octet<L>) {
        u.store(&mut self.values[real(n, m)]);
        if m > 0 {
            v.store(&mut self.values[imaginary(n, m)]);
        }
    }

    #[inline(always)]
    fn add<L: Lanes>(&mut self, n: usize, m: usize, u: Octet<L>, v: Octet<L>) {
        let place = &mut self.values[real(n, m)];
        Octet::<L>::load(place).plus(u).store(place);
        if m > 0 {
            let place = &mut self.values[imaginary(n, m)];
            Octet::<L>::load(place).plus(v).store(place);
        }
    }
}

/// Powers of two ratios, from the zeroth on.
#[inline(always)]
fn powers<L: Lanes>(out: &mut [Eight], ratios: [f64; 2]) {
    let ratio = Octet::<L>::load(&Eight::halves(ratios[0], ratios[1]));
    let mut power = Octet::<L>::splat(1.0);
    for out in out {
        power.store(out);
        power = power.times(ratio);
    }
}
