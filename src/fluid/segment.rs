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
//! (Cortez, J. Comput. Phys. 375 (2018) 783; the seed's eq. 12-14, with the misprint in 14e mended.) Both blocks are
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
//! forms lose a factor of about `D` to cancellation (errors reach 1.6e-14 at the switch). Measured in 40-digit
//! arithmetic, worst of both blocks over directions and `eps/R` from 0 to 0.99, the distance beyond which n points
//! truncate by less than 2e-14 of a block's largest entry is
//!
//! | n | 3 | 4 | 5 | 6 | 7 | 8 | 9 | 10 |
//! |---|---|---|---|---|---|---|---|---|
//! | D | 275 | 45.2 | 17.2 | 8.99 | 5.86 | 4.20 | 3.26 | 2.74 |
//!
//! This is the only file of the crate with `unsafe`: one call into code compiled for AVX2 and FMA.

use crate::{Mat3, Vec3};

/// Six independent entries of a symmetric 3x3 block, in the order xx, xy, xz, yy, yz, zz.
pub(crate) type Symmetric = [f64; 6];

/// The two blocks of a target and a segment, `8 pi mu u = start f_start + end f_end`; dimensionless.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Blocks {
    pub start: Symmetric,
    pub end: Symmetric,
}

/// Blocks (M1, M2) with `8 pi mu u(x) = M1 f_start + M2 f_end`.
///
/// `target`, `start`, `end` and the regularization length `epsilon` are in metres, the force densities `f` in N/m, and
/// `mu` in Pa s; the blocks are dimensionless, symmetric 3x3 matrices. Their error is below 3e-14 of their largest entry
/// for every direction, `|target - start| / |end - start|` from 0 to 1e6 and `epsilon / |end - start|` from 1e-6 to 10
/// (measured against 20,000 cases in 120-digit arithmetic, with the segment up to 15 lengths from the origin).
///
/// The segment must have a length, and `epsilon` must be positive: otherwise the result may not be finite.
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
    struct Pair(Mat3, Mat3);
    impl Collect for Pair {
        fn collect(&mut self, _: usize, blocks: &Blocks) {
            (self.0, self.1) = (full(&blocks.start), full(&blocks.end));
        }
    }
    let mut pair = Pair(Mat3::zeros(), Mat3::zeros());
    for_each_target(&Segment::new(start, end, epsilon), std::slice::from_ref(target), &mut pair);
    (pair.0, pair.1)
}

fn full(b: &Symmetric) -> Mat3 {
    Mat3::new(b[0], b[1], b[2], b[1], b[3], b[4], b[2], b[4], b[5])
}

/// What a segment brings to every target, computed once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    start: [f64; 3],
    end: [f64; 3],
    /// `start - end`, rounded, and what the rounding lost.
    s: [f64; 3],
    s_low: [f64; 3],
    /// Unit vector from start to end.
    tangent: [f64; 3],
    length: f64,
    inverse_length: f64,
    /// `|s|^2`, for the distance of points along `s`.
    s_squared: f64,
    epsilon_squared: f64,
    /// Entries of `s s^T`.
    s_outer: Symmetric,
    /// `R^2` at the centre beyond which each quadrature rule serves, from the lowest order to the highest.
    far: [f64; RULES],
}

impl Segment {
    pub(crate) fn new(start: &Vec3, end: &Vec3, epsilon: f64) -> Self {
        let (start, end) = ([start.x, start.y, start.z], [end.x, end.y, end.z]);
        let (s, s_low) = difference(&start, &end);
        let s_squared = dot::<false>(&s, &s);
        let length = s_squared.sqrt();
        Self {
            start,
            end,
            s,
            s_low,
            tangent: s.map(|c| -c / length),
            length,
            inverse_length: 1.0 / length,
            s_squared,
            epsilon_squared: epsilon * epsilon,
            s_outer: outer(&s),
            far: SWITCH.map(|d| 0.25 * d * d * s_squared),
        }
    }
}

/// Takes the blocks of one segment and many targets.
///
/// A trait and not a closure, because only a method can be `#[inline(always)]`: called out of line, every block goes
/// through memory in pieces the processor cannot forward, and a pair costs a third more.
pub(crate) trait Collect {
    /// Receives the blocks of the target of this index.
    fn collect(&mut self, target: usize, blocks: &Blocks);
}

/// Hands the blocks of every target in turn to `collector`, in the fastest code this machine runs.
///
/// The two versions of the code differ in round-off only (fused or separate multiplication and addition); which one runs
/// depends on the machine, never on the data.
pub(crate) fn for_each_target(segment: &Segment, targets: &[Vec3], collector: &mut impl Collect) {
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
            // SAFETY: the function is safe but for needing AVX2 and FMA, which this processor has, as just asked.
            unsafe { for_each_target_avx2(segment, targets, collector) }
        } else {
            for_each_target_as::<false>(segment, targets, collector)
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    for_each_target_as::<{ cfg!(target_arch = "aarch64") }>(segment, targets, collector)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn for_each_target_avx2(segment: &Segment, targets: &[Vec3], collector: &mut impl Collect) {
    for_each_target_as::<true>(segment, targets, collector)
}

#[inline(always)]
fn for_each_target_as<const FUSED: bool>(segment: &Segment, targets: &[Vec3], collector: &mut impl Collect) {
    let mut tile = [Moments::ZERO; TILE];
    for (k, targets) in targets.chunks(TILE).enumerate() {
        for (moments, target) in tile.iter_mut().zip(targets) {
            *moments = moments_at::<FUSED>(segment, &[target.x, target.y, target.z]);
        }
        for (index, moments) in tile[..targets.len()].iter().enumerate() {
            collector.collect(k * TILE + index, &assemble::<FUSED>(segment, moments));
        }
    }
}

/// Targets whose moments are found before their blocks are put together. The chain from a target to its blocks is long;
/// cut in two, the processor works on several targets at once.
const TILE: usize = 16;

/// Moments of `1/R` and `1/R^3` along the segment, with the frame they refer to.
#[derive(Clone, Copy)]
struct Moments {
    /// `x - (point of the axis where alpha = 0)`.
    base: [f64; 3],
    /// `alpha` at the start and at the end; they differ by one.
    lower: f64,
    upper: f64,
    i: [f64; 2],
    c: [f64; 4],
}

impl Moments {
    const ZERO: Self = Self { base: [0.0; 3], lower: 0.0, upper: 0.0, i: [0.0; 2], c: [0.0; 4] };
}

#[inline(always)]
fn moments_at<const FUSED: bool>(segment: &Segment, target: &[f64; 3]) -> Moments {
    let (r, r_low) = difference(target, &segment.start);
    let centre: [f64; 3] = std::array::from_fn(|k| fma::<FUSED>(0.5, segment.s[k], r[k]));
    let r_squared = dot::<FUSED>(&centre, &centre) + segment.epsilon_squared;
    if r_squared > segment.far[0] {
        gauss_moments::<FUSED, _>(segment, centre, r_squared, &GAUSS_4)
    } else if r_squared > segment.far[1] {
        gauss_moments::<FUSED, _>(segment, centre, r_squared, &GAUSS_6)
    } else {
        near_moments::<FUSED>(segment, target, &r, &r_low)
    }
}

/// Puts the blocks together: the weight of the start is `upper - alpha`, that of the end `alpha - lower`.
#[inline(always)]
fn assemble<const FUSED: bool>(segment: &Segment, m: &Moments) -> Blocks {
    let base_outer = outer(&m.base);
    let (b, s) = (&m.base, &segment.s);
    let cross = [
        2.0 * b[0] * s[0],
        fma::<FUSED>(b[0], s[1], b[1] * s[0]),
        fma::<FUSED>(b[0], s[2], b[2] * s[0]),
        2.0 * b[1] * s[1],
        fma::<FUSED>(b[1], s[2], b[2] * s[1]),
        2.0 * b[2] * s[2],
    ];
    let block = |i: f64, c0: f64, c1: f64, c2: f64| -> Symmetric {
        let isotropic = fma::<FUSED>(segment.epsilon_squared, c0, i);
        let mut block: Symmetric = std::array::from_fn(|k| {
            fma::<FUSED>(c2, segment.s_outer[k], fma::<FUSED>(c1, cross[k], c0 * base_outer[k]))
        });
        for k in [0, 3, 5] {
            block[k] += isotropic;
        }
        block
    };
    let start = |k0: f64, k1: f64| fma::<FUSED>(m.upper, k0, -k1);
    let end = |k0: f64, k1: f64| fma::<FUSED>(-m.lower, k0, k1);
    let (i, c) = (&m.i, &m.c);
    Blocks {
        start: block(start(i[0], i[1]), start(c[0], c[1]), start(c[1], c[2]), start(c[2], c[3])),
        end: block(end(i[0], i[1]), end(c[0], c[1]), end(c[1], c[2]), end(c[2], c[3])),
    }
}

/// Closed-form moments about the target's foot on the axis.
///
/// `zeta = alpha L` is the distance along the axis from the foot, `zeta0` and `zeta1` those of the ends, `h^2` the squared
/// distance from the axis plus `eps^2`, and `R = sqrt(h^2 + zeta^2)`.
#[inline(always)]
fn near_moments<const FUSED: bool>(segment: &Segment, target: &[f64; 3], r: &[f64; 3], r_low: &[f64; 3]) -> Moments {
    let u = &segment.tangent;
    // Each end's distance comes from the target's own distance to that end: with eps = 1e-6 L, a target next to an end has
    // R = 1e-6 L there, and L - z0 in place of zeta1 would already cost six digits.
    let to_end: [f64; 3] = std::array::from_fn(|k| target[k] - segment.end[k]);
    let (zeta0, zeta1) = (-dot::<FUSED>(r, u), -dot::<FUSED>(&to_end, u));

    // r - (r.u) u likewise must keep its relative accuracy down to 1e-6 L. The product is exact before it is subtracted,
    // the rounding of r and s is carried along, and what the rounded foot leaves along the axis is projected out.
    let foot = -zeta0 * segment.inverse_length;
    let offset: [f64; 3] = std::array::from_fn(|k| {
        fma_exact::<FUSED>(foot, segment.s[k], r[k]) + fma::<FUSED>(foot, segment.s_low[k], r_low[k])
    });
    let slip = dot::<FUSED>(&offset, u);
    let base: [f64; 3] = std::array::from_fn(|k| fma::<FUSED>(-slip, u[k], offset[k]));

    let h_squared = dot::<FUSED>(&base, &base) + segment.epsilon_squared;
    let r0 = fma::<FUSED>(zeta0, zeta0, h_squared).sqrt();
    let r1 = fma::<FUSED>(zeta1, zeta1, h_squared).sqrt();
    let (product, sum) = (r0 * r1, r0 + r1);

    // int 1/R = ln((R0 + R1 + L) / G), G = R0 + R1 - L = (R0 + zeta0) + (R1 - zeta1), where R -+ zeta = h^2/(R +- zeta)
    // whenever the direct form would cancel. The logarithm's argument stays above 1.4 as long as D < 4.2.
    let (far0, far1) = (r0 + zeta0.abs(), r1 + zeta1.abs());
    let gap0 = if zeta0 < 0.0 { h_squared / far0 } else { far0 };
    let gap1 = if zeta1 > 0.0 { h_squared / far1 } else { far1 };
    let i0 = ((sum + segment.length) / (gap0 + gap1)).ln();

    // int zeta/R = R1 - R0 and int zeta/R^3 = 1/R0 - 1/R1, both over L.
    let zetas = zeta0 + zeta1;
    let i1 = zetas / sum;
    let c1 = i1 / product;

    // int 1/R^3 = (zeta1/R1 - zeta0/R0) / h^2. This cancels when the foot lies beyond an end, and may: c0 only ever counts
    // times h^2 or less (base base^T, eps^2, and h^2 itself below), where its error is round-off beside i0.
    let c0 = (zeta1 * r0 - zeta0 * r1) / (h_squared * product);

    // int zeta^2/R^3 = int 1/R - h^2 int 1/R^3, int zeta^3/R^3 = int zeta/R - h^2 int zeta/R^3.
    let inverse_s_squared = segment.inverse_length * segment.inverse_length;
    Moments {
        base,
        lower: zeta0 * segment.inverse_length,
        upper: zeta1 * segment.inverse_length,
        i: [i0, i1],
        c: [
            c0,
            c1,
            fma::<FUSED>(-h_squared, c0, i0) * inverse_s_squared,
            fma::<FUSED>(-h_squared, c1, i1) * inverse_s_squared,
        ],
    }
}

/// Quadrature moments about the centre; `rule` lists the positive nodes on `[-1/2, 1/2]` with their weights.
#[inline(always)]
fn gauss_moments<const FUSED: bool, const PAIRS: usize>(
    segment: &Segment,
    centre: [f64; 3],
    r_squared: f64,
    rule: &Rule<PAIRS>,
) -> Moments {
    let slope = 2.0 * dot::<FUSED>(&centre, &segment.s);
    // Negative zero, because x + (-0) is x for every x and the compiler may drop the addition.
    let (mut i, mut c) = ([-0.0; 2], [-0.0; 4]);
    for k in 0..PAIRS {
        let (node, weight) = (rule.nodes[k], rule.weights[k] * segment.length);
        let (even, odd) = (fma::<FUSED>(node * node, segment.s_squared, r_squared), node * slope);
        // R = sqrt(R^2) and 1/R^2 do not wait for one another; 1/R = R / R^2.
        let (plus, minus) = (even + odd, even - odd);
        let (inverse_plus, inverse_minus) = (1.0 / plus, 1.0 / minus);
        let (r_plus, r_minus) = (plus.sqrt() * inverse_plus, minus.sqrt() * inverse_minus);
        let (cube_plus, cube_minus) = (r_plus * inverse_plus, r_minus * inverse_minus);
        let (c_even, c_odd) = (weight * (cube_plus + cube_minus), (weight * node) * (cube_plus - cube_minus));
        i[0] = fma::<FUSED>(weight, r_plus + r_minus, i[0]);
        i[1] = fma::<FUSED>(weight * node, r_plus - r_minus, i[1]);
        c[0] += c_even;
        c[1] += c_odd;
        c[2] = fma::<FUSED>(node * node, c_even, c[2]);
        c[3] = fma::<FUSED>(node * node, c_odd, c[3]);
    }
    Moments { base: centre, lower: -0.5, upper: 0.5, i, c }
}

/// Number of quadrature rules.
const RULES: usize = 2;

/// Distances `D` (module documentation) beyond which the rules of 4 and of 6 points serve. Nearer, the closed forms are
/// as accurate; an 8-point rule from D = 4.3 would save a fifth of the time of the few pairs between.
const SWITCH: [f64; RULES] = [46.0, 9.1];

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

/// `a * b + c`, fused where that is one instruction.
#[inline(always)]
fn fma<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// `a * b + c` with the product exact: fused, or with the product's rounding recovered by Dekker's splitting.
#[inline(always)]
fn fma_exact<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED {
        return a.mul_add(b, c);
    }
    let split = |v: f64| {
        let t = 134_217_729.0 * v; // 2^27 + 1
        let high = t - (t - v);
        (high, v - high)
    };
    let ((a_high, a_low), (b_high, b_low)) = (split(a), split(b));
    let product = a * b;
    let rounding = a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low);
    (product + c) + rounding
}

/// `a - b` as a rounded difference and its exact rounding error (Knuth's two-sum).
#[inline(always)]
fn difference(a: &[f64; 3], b: &[f64; 3]) -> ([f64; 3], [f64; 3]) {
    let high: [f64; 3] = std::array::from_fn(|k| a[k] - b[k]);
    let low = std::array::from_fn(|k| {
        let minus_b = high[k] - a[k];
        (a[k] - (high[k] - minus_b)) - (b[k] + minus_b)
    });
    (high, low)
}

#[inline(always)]
fn dot<const FUSED: bool>(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    fma::<FUSED>(a[2], b[2], fma::<FUSED>(a[1], b[1], a[0] * b[0]))
}

#[inline(always)]
fn outer(v: &[f64; 3]) -> Symmetric {
    [v[0] * v[0], v[0] * v[1], v[0] * v[2], v[1] * v[1], v[1] * v[2], v[2] * v[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest error of both blocks over their largest entries, in the arithmetic asked for.
    fn worst_error<const FUSED: bool>() -> f64 {
        let mut worst = 0.0_f64;
        for line in include_str!("../../tests/data/segment_blocks.csv").lines().skip(1) {
            let v: Vec<f64> = line.split(',').skip(1).map(|n| n.parse().expect("a number")).collect();
            let at = |k: usize| Vec3::new(v[k], v[k + 1], v[k + 2]);
            let segment = Segment::new(&at(3), &at(6), v[9]);
            let blocks = assemble::<FUSED>(&segment, &moments_at::<FUSED>(&segment, &[v[0], v[1], v[2]]));
            for (block, reference) in [(blocks.start, &v[10..16]), (blocks.end, &v[16..22])] {
                let size = reference.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
                for (value, exact) in block.iter().zip(reference) {
                    worst = worst.max((value - exact).abs() / size);
                }
            }
        }
        worst
    }

    /// The tests of the crate run what this machine dispatches to; other machines run the other.
    #[test]
    fn both_arithmetics_agree_with_high_precision_quadrature() {
        let (fused, separate) = (worst_error::<true>(), worst_error::<false>());
        assert!(fused > 0.0 && fused < 2e-14, "fused: {fused:e}");
        assert!(separate > 0.0 && separate < 2e-14, "separate: {separate:e}");
    }

    #[test]
    fn product_is_exact_before_it_is_added_without_fused_arithmetic() {
        let (a, b) = (1.0 + f64::EPSILON, 1.0 - f64::EPSILON);
        // (1 + e)(1 - e) - 1 = -e^2, which a rounded product loses altogether.
        assert_eq!(fma_exact::<false>(a, b, -1.0), -f64::EPSILON * f64::EPSILON);
        assert_eq!(fma_exact::<false>(0.1, 0.3, -0.03), 0.1_f64.mul_add(0.3, -0.03));
    }
}
