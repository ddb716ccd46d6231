//! The flow of one straight segment of regularized Stokeslets, exact to round-off near and far.
//!
//! A segment from `start` to `end`, of length `L`, carries a force density that is linear along it. At a target `x`
//!
//! ```text
//! 8 pi mu u(x) = M1 f_start + M2 f_end
//! M1, M2 = L * integral over a in [0, 1] of (1 - a), a times [ I/R + eps^2 I/R^3 + d d^T/R^3 ] da
//! d = x - start - a (end - start),   R^2 = |d|^2 + eps^2
//! ```
//!
//! (Cortez, J. Comput. Phys. 375 (2018) 783; Lim et al.'s eq. 12-14, with the misprint in 14e mended.) Both blocks are
//! symmetric. The textbook antiderivatives lose all digits on the segment's axis and far away. Here every block is put
//! together from six moments about a *base* on the axis, `d = base + alpha s` with `s = start - end`:
//!
//! ```text
//! i_m = L * integral alpha^m / R,  m = 0, 1      c_m = L * integral alpha^m / R^3,  m = 0..3
//! ```
//!
//! and the moments are found in one of two ways:
//!
//! * **near** (`near_moments`): closed forms about the target's foot on the axis, arranged so that nothing that counts
//!   cancels, with the offset from the axis computed to full relative accuracy;
//! * **far** (`gauss_moments`): symmetric Gauss-Legendre quadrature about the centre, of an order set by the distance.
//!
//! The switch depends only on `D = 2 sqrt(|x - centre|^2 + eps^2) / L`. The integrands have their poles at distance
//! `D` from the centre in half-lengths, so the quadrature error falls as `(D + sqrt(D^2 - 1))^(-2n)`, and the closed
//! forms lose a factor of about `D` to cancellation (errors reach 1.7e-14 at the switch). Measured in 40-digit
//! arithmetic, worst of both blocks over directions and `eps/R` from 0 to 0.99, the distance beyond which n points
//! truncate by less than 2e-14 of a block's largest entry is
//!
//! | n | 3 | 4 | 5 | 6 | 7 | 8 | 9 | 10 |
//! |---|---|---|---|---|---|---|---|---|
//! | D | 275 | 45.2 | 17.2 | 8.99 | 5.86 | 4.20 | 3.26 | 2.74 |
//!
//! Every target is computed with the formula of its own distance, whatever its neighbours in the vector need: of targets
//! that differ, all formulas are evaluated and each lane keeps its own. Lengths are counted in segment lengths from the
//! first rounding on, so that no unit of length overflows an intermediate product.

use std::ops::{Add, Sub};

use super::lanes::{Kernel, Lanes, MOST_LANES, Path, TILE, inverse_sqrt, ln_ratio, load_points};
use crate::{Mat3, Vec3};

/// Six independent entries of a symmetric 3x3 block, in the order xx, xy, xz, yy, yz, zz.
pub(crate) type Symmetric<T> = [T; 6];

/// The two blocks of each of several targets and a segment, `8 pi mu u = start f_start + end f_end`; dimensionless.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Blocks<L> {
    pub start: Symmetric<L>,
    pub end: Symmetric<L>,
}

/// Blocks (M1, M2) with `8 pi mu u(x) = M1 f_start + M2 f_end`.
///
/// `target`, `start`, `end` and the regularization length `epsilon` are in metres, the force densities `f` in N/m, and
/// `mu` in Pa s; the blocks are dimensionless, symmetric 3x3 matrices. Their error is below 2e-14 of their largest entry
/// in every case of `tests/data/segment_blocks.csv`: 726 of them, in every direction, `|target - start| / |end - start|`
/// from 0 to 1e6 and `epsilon / |end - start|` from 1e-6 to 10.
///
/// The segment must have a length, and `epsilon` must be positive: otherwise the result means nothing, and may not be
/// finite.
///
/// # Example
///
/// ```
/// use flagrs::{Vec3, fluid::segment::segment_blocks};
/// // Half a metre from a segment that is a micrometre long, the flow is that of a point force.
/// let (m1, m2) = segment_blocks(&Vec3::new(0.5, 0.0, 0.0), &Vec3::zeros(), &Vec3::new(0.0, 1e-6, 0.0), 1e-7);
/// assert!(((m1 + m2)[(0, 0)] - 2.0 * 1e-6 / 0.5).abs() < 1e-16);
/// ```
pub fn segment_blocks(target: &Vec3, start: &Vec3, end: &Vec3, epsilon: f64) -> (Mat3, Mat3) {
    segment_blocks_on(Path::chosen(), target, start, end, epsilon)
}

/// [`segment_blocks`] on the given path, or on `Separate` if the processor lacks its instructions: what each path makes of
/// the same numbers.
pub fn segment_blocks_on(path: Path, target: &Vec3, start: &Vec3, end: &Vec3, epsilon: f64) -> (Mat3, Mat3) {
    let mut pair = (Mat3::zeros(), Mat3::zeros());
    let segment = Segment::new(start, end, epsilon);
    for_each_target(path, &segment, std::slice::from_ref(target), |_, blocks| {
        pair = (full(&blocks.start), full(&blocks.end));
    });
    pair
}

fn full(b: &Symmetric<f64>) -> Mat3 {
    Mat3::new(b[0], b[1], b[2], b[1], b[3], b[4], b[2], b[4], b[5])
}

/// What a segment brings to every target, computed once. Lengths are in metres unless they are said to be scaled, which
/// means divided by the segment's own length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    start: [f64; 3],
    end: [f64; 3],
    /// `start - end`, rounded, and what the rounding lost.
    s: [f64; 3],
    s_low: [f64; 3],
    /// `s` scaled: the unit vector from end to start.
    unit: [f64; 3],
    /// `s` scaled twice, 1/m: the foot of a vector along `s`.
    foot: [f64; 3],
    /// 1/m.
    inverse_length: f64,
    /// `eps^2`, scaled.
    epsilon_squared: f64,
}

impl Segment {
    pub(crate) fn new(start: &Vec3, end: &Vec3, epsilon: f64) -> Self {
        let (start, end) = ([start.x, start.y, start.z], [end.x, end.y, end.z]);
        let s: [f64; 3] = std::array::from_fn(|k| start[k] - end[k]);
        let s_low = std::array::from_fn(|k| lost(start[k], end[k], s[k]));
        let length = (s[0] * s[0] + s[1] * s[1] + s[2] * s[2]).sqrt();
        let inverse_length = 1.0 / length;
        let unit = s.map(|c| c / length);
        Self {
            start,
            end,
            s,
            s_low,
            unit,
            foot: unit.map(|c| c * inverse_length),
            inverse_length,
            epsilon_squared: (epsilon * inverse_length) * (epsilon * inverse_length),
        }
    }
}

/// Takes the blocks of many segments and many targets.
///
/// A trait and not a closure, because only a method can be generic over the lanes and `#[inline(always)]`, which it must
/// be ([`Kernel::run`]).
pub(crate) trait Collect {
    /// What a vector of targets takes along from one segment to the next.
    type Carried<L: Lanes>: Copy;

    /// What a vector of targets sets out with.
    fn begin<L: Lanes>() -> Self::Carried<L>;

    /// Receives the blocks of a segment and the targets from this index on, one in each lane; lanes beyond the last target
    /// hold copies of its blocks. A target meets the segments in their order.
    fn collect<L: Lanes>(&mut self, first: usize, segment: usize, blocks: &Blocks<L>, carried: &mut Self::Carried<L>);

    /// Receives what the targets from this index on carry past the last segment.
    fn finish<L: Lanes>(&mut self, first: usize, carried: Self::Carried<L>);
}

/// Hands the blocks of all pairs of a segment and a target to `collector`.
pub(crate) fn for_each_pair(path: Path, segments: &[Segment], targets: &[Vec3], collector: &mut impl Collect) {
    path.run(ForEachPair { segments, targets, collector });
}

struct ForEachPair<'a, C> {
    segments: &'a [Segment],
    targets: &'a [Vec3],
    collector: &'a mut C,
}

impl<C: Collect> Kernel for ForEachPair<'_, C> {
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut points = L::per_vector([L::splat(0.0); 3]);
        let mut carried = L::per_vector(C::begin::<L>());
        let mut moments = L::per_vector(Moments::<L>::zero());
        let (points, carried, moments) = (points.as_mut(), carried.as_mut(), moments.as_mut());
        for (k, targets) in self.targets.chunks(TILE).enumerate() {
            let first = k * TILE;
            let vectors = targets.len().div_ceil(L::WIDTH);
            let (points, carried, moments) = (&mut points[..vectors], &mut carried[..vectors], &mut moments[..vectors]);
            for vector in 0..vectors {
                points[vector] = load_points(&targets[vector * L::WIDTH..]);
                carried[vector] = C::begin();
            }
            for (index, segment) in self.segments.iter().enumerate() {
                // The chain from a target to its blocks is long; cut in two, the processor works on several at once.
                for vector in 0..vectors {
                    moments_at(segment, points[vector], &mut moments[vector]);
                }
                for vector in 0..vectors {
                    let blocks = assemble(segment, &moments[vector]);
                    self.collector.collect(first + vector * L::WIDTH, index, &blocks, &mut carried[vector]);
                }
            }
            for vector in 0..vectors {
                self.collector.finish(first + vector * L::WIDTH, carried[vector]);
            }
        }
    }
}

/// Hands the blocks of one segment and every target in turn to `take`, one by one, with the index of the target.
pub(crate) fn for_each_target(path: Path, segment: &Segment, targets: &[Vec3], take: impl FnMut(usize, &Blocks<f64>)) {
    for_each_pair(path, std::slice::from_ref(segment), targets, &mut OneByOne { count: targets.len(), take });
}

/// Hands on blocks as plain numbers.
struct OneByOne<F> {
    count: usize,
    take: F,
}

impl<F: FnMut(usize, &Blocks<f64>)> Collect for OneByOne<F> {
    type Carried<L: Lanes> = ();

    #[inline(always)]
    fn begin<L: Lanes>() {}

    #[inline(always)]
    fn collect<L: Lanes>(&mut self, first: usize, _: usize, blocks: &Blocks<L>, _: &mut ()) {
        let mut lanes = [[[0.0; MOST_LANES]; 6]; 2];
        for k in 0..6 {
            blocks.start[k].store(&mut lanes[0][k]);
            blocks.end[k].store(&mut lanes[1][k]);
        }
        for lane in 0..L::WIDTH.min(self.count - first) {
            let [start, end] = lanes.map(|block| block.map(|entry| entry[lane]));
            (self.take)(first + lane, &Blocks { start, end });
        }
    }

    #[inline(always)]
    fn finish<L: Lanes>(&mut self, _: usize, (): ()) {}
}

/// Moments of `1/R` and `1/R^3` along the segment, with the frame they refer to; all scaled.
#[derive(Clone, Copy)]
struct Moments<L> {
    /// `x - (point of the axis where alpha = 0)`.
    base: [L; 3],
    /// `alpha` at the start and at the end; they differ by one.
    lower: L,
    upper: L,
    i: [L; 2],
    c: [L; 4],
}

impl<L: Lanes> Moments<L> {
    #[inline(always)]
    fn zero() -> Self {
        let zero = L::splat(0.0);
        Self { base: [zero; 3], lower: zero, upper: zero, i: [zero; 2], c: [zero; 4] }
    }

    /// These moments where the mask holds, else the others.
    #[inline(always)]
    fn or(mut self, mask: L::Mask, others: &Self) -> Self {
        for k in 0..3 {
            self.base[k] = L::select(mask, self.base[k], others.base[k]);
        }
        self.lower = L::select(mask, self.lower, others.lower);
        self.upper = L::select(mask, self.upper, others.upper);
        for k in 0..2 {
            self.i[k] = L::select(mask, self.i[k], others.i[k]);
        }
        for k in 0..4 {
            self.c[k] = L::select(mask, self.c[k], others.c[k]);
        }
        self
    }
}

#[inline(always)]
fn moments_at<L: Lanes>(segment: &Segment, target: [L; 3], moments: &mut Moments<L>) {
    let r = minus(target, splat(&segment.start));
    let centre = scaled(add_scaled(r, L::splat(0.5), splat(&segment.s)), L::splat(segment.inverse_length));
    let r_squared = dot(centre, centre) + L::splat(segment.epsilon_squared);
    let beyond_4 = r_squared.exceeds(L::splat(0.25 * SWITCH[0] * SWITCH[0]));
    let beyond_6 = r_squared.exceeds(L::splat(0.25 * SWITCH[1] * SWITCH[1]));

    if L::all(beyond_4) {
        *moments = gauss_moments(segment, centre, r_squared, &GAUSS_4);
        return;
    }
    if L::any(beyond_6) {
        *moments = gauss_moments(segment, centre, r_squared, &GAUSS_6);
        if L::any(beyond_4) {
            *moments = gauss_moments(segment, centre, r_squared, &GAUSS_4).or(beyond_4, moments);
        }
        if !L::all(beyond_6) {
            *moments = moments.or(beyond_6, &near_moments(segment, target));
        }
    } else {
        *moments = near_moments(segment, target);
    }
}

/// Puts the blocks together: the weight of the start is `upper - alpha`, that of the end `alpha - lower`.
#[inline(always)]
fn assemble<L: Lanes>(segment: &Segment, m: &Moments<L>) -> Blocks<L> {
    let ([i0, i1], [c0, c1, c2, c3], lower, upper) = (m.i, m.c, m.lower, m.upper);
    Blocks {
        start: block(
            segment,
            m.base,
            upper.mul_sub(i0, i1),
            [upper.mul_sub(c0, c1), upper.mul_sub(c1, c2), upper.mul_sub(c2, c3)],
        ),
        end: block(
            segment,
            m.base,
            lower.neg_mul_add(i0, i1),
            [lower.neg_mul_add(c0, c1), lower.neg_mul_add(c1, c2), lower.neg_mul_add(c2, c3)],
        ),
    }
}

/// `(i + eps^2 c0) I + c0 b b^T + c1 (b s^T + s b^T) + c2 s s^T`, where `b` is the base: as `b v^T + s w^T` with
/// `v = c0 b + c1 s` and `w = c1 b + c2 s`.
#[inline(always)]
fn block<L: Lanes>(segment: &Segment, b: [L; 3], i: L, [c0, c1, c2]: [L; 3]) -> Symmetric<L> {
    let s = splat::<L>(&segment.unit);
    let v = add_scaled(scaled(b, c0), c1, s);
    let w = add_scaled(scaled(b, c1), c2, s);
    let isotropic = L::splat(segment.epsilon_squared).mul_add(c0, i);
    [
        b[0].mul_add(v[0], s[0].mul_add(w[0], isotropic)),
        b[0].mul_add(v[1], s[0] * w[1]),
        b[0].mul_add(v[2], s[0] * w[2]),
        b[1].mul_add(v[1], s[1].mul_add(w[1], isotropic)),
        b[1].mul_add(v[2], s[1] * w[2]),
        b[2].mul_add(v[2], s[2].mul_add(w[2], isotropic)),
    ]
}

/// Closed-form moments about the target's foot on the axis.
///
/// `lower` and `upper` are the distances along the axis from the foot to the start and to the end, `h^2` the squared
/// distance from the axis plus `eps^2`, and `R = sqrt(h^2 + lower^2)` or with `upper`; all scaled.
#[inline(always)]
fn near_moments<L: Lanes>(segment: &Segment, target: [L; 3]) -> Moments<L> {
    let (start, end) = (splat(&segment.start), splat(&segment.end));
    let r = minus(target, start);
    // Each end's distance comes from the target's own distance to that end: with eps = 1e-6 L, a target next to an end has
    // R = 1e-6 L there, and 1 + lower in place of upper would already cost six digits.
    let along = splat(&segment.foot);
    let (lower, upper) = (dot(r, along), dot(minus(target, end), along));

    // r - lower s likewise must keep its relative accuracy down to 1e-6 L. The product is exact before it is subtracted,
    // the rounding of r and s is carried along, and what the rounded foot leaves along the axis is projected out.
    let foot = L::splat(0.0) - lower;
    let mut offset = r;
    for k in 0..3 {
        let low = foot.mul_add(L::splat(segment.s_low[k]), lost(target[k], start[k], r[k]));
        offset[k] = foot.exact_mul_add(L::splat(segment.s[k]), r[k]) + low;
    }
    let offset = scaled(offset, L::splat(segment.inverse_length));
    let unit = splat(&segment.unit);
    let base = add_scaled(offset, L::splat(0.0) - dot(offset, unit), unit);

    let h_squared = dot(base, base) + L::splat(segment.epsilon_squared);
    let (squared0, squared1) = (lower.mul_add(lower, h_squared), upper.mul_add(upper, h_squared));
    let (inverse0, inverse1) = (inverse_sqrt(squared0), inverse_sqrt(squared1));
    let (r0, r1) = (squared0 * inverse0, squared1 * inverse1);
    let sum = r0 + r1;

    // int 1/R = ln((R0 + R1 + 1) / G), G = R0 + R1 - 1 = (R0 + lower) + (R1 - upper), where R -+ zeta = h^2/(R +- zeta)
    // whenever the direct form would cancel: each of the two is a quotient. The logarithm's argument stays above 1.2 as
    // long as D < 9.1.
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let (far0, far1) = (r0 + lower.abs(), r1 + upper.abs());
    let (cancels0, cancels1) = (zero.exceeds(lower), upper.exceeds(zero));
    let (above0, below0) = (L::select(cancels0, h_squared, far0), L::select(cancels0, far0, one));
    let (above1, below1) = (L::select(cancels1, h_squared, far1), L::select(cancels1, far1, one));
    let i0 = ln_ratio((sum + one) * (below0 * below1), above0.mul_add(below1, above1 * below0));

    // int zeta/R = R1 - R0 and int zeta/R^3 = 1/R0 - 1/R1.
    let inverse = one / (sum * h_squared);
    let i1 = (lower + upper) * (inverse * h_squared);
    let c1 = i1 * (inverse0 * inverse1);

    // int 1/R^3 = (upper/R1 - lower/R0) / h^2. This cancels when the foot lies beyond an end, and may: c0 only ever counts
    // times h^2 or less (base base^T, eps^2, and h^2 itself below), where its error is round-off beside i0.
    let c0 = lower.neg_mul_add(inverse0, upper * inverse1) * (inverse * sum);

    // int zeta^2/R^3 = int 1/R - h^2 int 1/R^3, int zeta^3/R^3 = int zeta/R - h^2 int zeta/R^3.
    Moments {
        base,
        lower,
        upper,
        i: [i0, i1],
        c: [c0, c1, h_squared.neg_mul_add(c0, i0), h_squared.neg_mul_add(c1, i1)],
    }
}

/// Quadrature moments about the centre; `rule` lists the positive nodes on `[-1/2, 1/2]` with their weights.
#[inline(always)]
fn gauss_moments<L: Lanes, const PAIRS: usize>(
    segment: &Segment,
    centre: [L; 3],
    r_squared: L,
    rule: &Rule<PAIRS>,
) -> Moments<L> {
    let half_slope = dot(centre, splat(&segment.unit));
    let slope = half_slope + half_slope;
    let mut moments = Moments {
        base: centre,
        lower: L::splat(-0.5),
        upper: L::splat(0.5),
        // Negative zero, because x + (-0) is x for every x and the compiler may drop the addition.
        i: [L::splat(-0.0); 2],
        c: [L::splat(-0.0); 4],
    };
    let Moments { i, c, .. } = &mut moments;
    for k in 0..PAIRS {
        let (node, weight) = (rule.nodes[k], rule.weights[k]);
        let even = r_squared + L::splat(node * node);
        let (plus, minus) = (slope.mul_add(L::splat(node), even), slope.neg_mul_add(L::splat(node), even));
        let (plus, minus) = (inverse_sqrt(plus), inverse_sqrt(minus));
        let (plus_cubed, minus_cubed) = (plus * plus * plus, minus * minus * minus);
        let (sum, difference) = (plus_cubed + minus_cubed, plus_cubed - minus_cubed);
        let weight = [weight, weight * node, weight * node * node, weight * node * node * node];
        i[0] = L::splat(weight[0]).mul_add(plus + minus, i[0]);
        i[1] = L::splat(weight[1]).mul_add(plus - minus, i[1]);
        c[0] = L::splat(weight[0]).mul_add(sum, c[0]);
        c[1] = L::splat(weight[1]).mul_add(difference, c[1]);
        c[2] = L::splat(weight[2]).mul_add(sum, c[2]);
        c[3] = L::splat(weight[3]).mul_add(difference, c[3]);
    }
    moments
}

/// Distances `D` (module documentation) beyond which the rules of 4 and of 6 points serve. Nearer, the closed forms are
/// as accurate, and hardly dearer than 8 points would be.
const SWITCH: [f64; 2] = [46.0, 9.1];

/// Positive nodes and weights of a Gauss-Legendre rule with `2 * PAIRS` points on `[-1/2, 1/2]`.
struct Rule<const PAIRS: usize> {
    nodes: [f64; PAIRS],
    weights: [f64; PAIRS],
}

const GAUSS_4: Rule<2> =
    Rule { nodes: [0.16999052179242813, 0.4305681557970263], weights: [0.32607257743127305, 0.17392742256872692] };

const GAUSS_6: Rule<3> = Rule {
    nodes: [0.11930959304159845, 0.33060469323313224, 0.466234757101576],
    weights: [0.23395696728634552, 0.1803807865240693, 0.08566224618958518],
};

/// What the rounding of `difference = a - b` lost, exactly (Knuth's two-sum).
#[inline(always)]
fn lost<T: Copy + Add<Output = T> + Sub<Output = T>>(a: T, b: T, difference: T) -> T {
    let minus_b = difference - a;
    (a - (difference - minus_b)) - (b + minus_b)
}

#[inline(always)]
pub(crate) fn splat<L: Lanes>(v: &[f64; 3]) -> [L; 3] {
    [L::splat(v[0]), L::splat(v[1]), L::splat(v[2])]
}

#[inline(always)]
pub(crate) fn minus<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn scaled<L: Lanes>(a: [L; 3], factor: L) -> [L; 3] {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

/// `a + factor b`.
#[inline(always)]
pub(crate) fn add_scaled<L: Lanes>(a: [L; 3], factor: L, b: [L; 3]) -> [L; 3] {
    [factor.mul_add(b[0], a[0]), factor.mul_add(b[1], a[1]), factor.mul_add(b[2], a[2])]
}

#[inline(always)]
pub(crate) fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

#[cfg(test)]
mod tests;
