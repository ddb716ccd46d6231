//! Several numbers at once: one arithmetic over the vector registers of every machine, chosen at run time.
//!
//! A computation is written once, generic over `Lanes`, and wrapped in a `Kernel`; `Path::run` compiles it for each
//! instruction set and calls the one asked for. What is built from the trait's operations alone gives the same bits on
//! every path with fused multiplication and addition, however many lanes it has: they are all correctly rounded, and
//! `inverse_sqrt` and `ln_ratio` are made from them. The one path without (`Path::Separate`, for x86 processors older
//! than 2013) differs in round-off.
//!
//! All `unsafe` of the crate is in this file and the folder below it. It rests on one rule: the vector types are private,
//! and the only way to name them is to be called by `Path::run`, which has asked whether the processor knows them.

#[cfg(target_arch = "aarch64")]
mod neon;
mod scalar;
#[cfg(target_arch = "x86_64")]
mod x86;

use std::ops::{Add, Div, Mul, Sub};
use std::sync::OnceLock;

use crate::Vec3;
use scalar::Scalar;

/// The widest register holds eight numbers.
pub(crate) const MOST_LANES: usize = 8;

/// Points that are worked on together. Large enough that results are written in pieces that memory likes, small enough that
/// all there is to remember of them stays in the first-level cache.
pub(crate) const TILE: usize = 64;

/// A vector of `WIDTH` doubles whose operations act on every lane alike.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Lanes of a vector, at most [`MOST_LANES`].
    const WIDTH: usize;

    /// One truth value for every lane.
    type Mask: Copy;

    /// Something for every vector of a tile of [`TILE`] points.
    type PerVector<T: Copy>: AsMut<[T]>;

    /// The same for every vector of a tile.
    fn per_vector<T: Copy>(value: T) -> Self::PerVector<T>;

    /// Eight numbers, in as many vectors as they take.
    type Octet: Copy + AsRef<[Self]> + AsMut<[Self]>;

    /// The same vector as often as eight numbers take it.
    fn octet(vector: Self) -> Self::Octet;

    /// The same value in every lane.
    fn splat(value: f64) -> Self;

    /// The first values, as many as there are, up to `WIDTH`; zero in the lanes that are left.
    fn load(from: &[f64]) -> Self;

    /// Writes the first lanes over the first values, as many as there are, up to `WIDTH`.
    fn store(self, to: &mut [f64]);

    /// `self * b + c`, rounded once (twice on [`Path::Separate`]).
    fn mul_add(self, b: Self, c: Self) -> Self;

    /// `self * b - c`, rounded once (twice on [`Path::Separate`]).
    fn mul_sub(self, b: Self, c: Self) -> Self;

    /// `c - self * b`, rounded once (twice on [`Path::Separate`]).
    fn neg_mul_add(self, b: Self, c: Self) -> Self;

    /// `self * b + c` with an exact product: rounded once, or twice where the product must be recovered.
    #[inline(always)]
    fn exact_mul_add(self, b: Self, c: Self) -> Self {
        self.mul_add(b, c)
    }

    /// Magnitude.
    fn abs(self) -> Self;

    /// Where `self > other`; false where either is not a number.
    fn exceeds(self, other: Self) -> Self::Mask;

    /// `yes` where the mask holds, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Whether the mask holds in every lane.
    fn all(mask: Self::Mask) -> bool;

    /// Whether the mask holds in some lane.
    fn any(mask: Self::Mask) -> bool;

    /// Sum of the bit patterns as 64-bit integers.
    fn add_bits(self, other: Self) -> Self;

    /// Difference of the bit patterns as 64-bit integers.
    fn sub_bits(self, other: Self) -> Self;

    /// The bit pattern moved down by `N`, zeros entering.
    fn shift_right<const N: u32>(self) -> Self;

    /// The bit pattern moved up by `N`, zeros entering.
    fn shift_left<const N: u32>(self) -> Self;

    /// From `x0 y0 z0 x1 y1 ...` in three vectors to all `x`, all `y`, all `z`.
    fn deinterleave(xyz: [Self; 3]) -> [Self; 3];

    /// The reverse of [`Lanes::deinterleave`].
    fn interleave(components: [Self; 3]) -> [Self; 3];
}

/// `1 / sqrt(x)` of positive, normal numbers to one unit in the last place (measured over 4 million).
///
/// A guess from the bits (halving the exponent), good to 6 %, is improved to 1.6e-5 by the quadratic in `x y^2` of least
/// error, and to round-off by the expansion of `(1 - e)^(-1/2)` with `e = 1 - x y^2`. Of the 13 operations none waits for
/// the divider, which takes several times as long for the root and its inverse.
#[inline(always)]
pub(crate) fn inverse_sqrt<L: Lanes>(x: L) -> L {
    let guess = L::splat(f64::from_bits(0x5fe4_0000_0000_0000)).sub_bits(x.shift_right::<1>());
    let u = x * guess * guess;
    let quadratic =
        u.mul_add(L::splat(0.6631629995935012), L::splat(-1.7609447109925767)).mul_add(u, L::splat(2.102361487427154));
    let y = guess * quadratic;
    let e = (x * y).neg_mul_add(y, L::splat(1.0));
    let series = e.mul_add(L::splat(0.3125), L::splat(0.375)).mul_add(e, L::splat(0.5));
    (y * e).mul_add(series, y)
}

/// `ln(numerator / denominator)` of positive, normal numbers of which the first is the greater; to two units in the last
/// place from a quotient of 1.2 on.
///
/// The quotient is never formed: the denominator is scaled by the power of two that brings it within a factor of 1.51 of
/// the numerator, and `ln(n/d) = 2 atanh((n - d)/(n + d))`, by a polynomial with a relative error of 5e-19.
#[inline(always)]
pub(crate) fn ln_ratio<L: Lanes>(numerator: L, denominator: L) -> L {
    // Bit patterns are logarithms to within 0.09 of an octave; half an octave more, and the exponent is the nearest.
    let octaves = numerator.sub_bits(denominator).add_bits(L::splat(f64::from_bits(1 << 51))).shift_right::<52>();
    let scaled = denominator.add_bits(octaves.shift_left::<52>());
    // An integer below 2^52 in the low bits of 2^52 is 2^52 plus that integer.
    let two_to_52 = L::splat(4_503_599_627_370_496.0);
    let octaves = two_to_52.add_bits(octaves) - two_to_52;

    let f = (numerator - scaled) / (numerator + scaled);
    let s = f * f;
    let mut series = L::splat(ATANH[0]);
    for &coefficient in &ATANH[1..] {
        series = series.mul_add(s, L::splat(coefficient));
    }
    octaves.mul_add(L::splat(std::f64::consts::LN_2), (f * s).mul_add(series, f + f))
}

/// Chebyshev fit of `2 (atanh(f)/f - 1)/f^2` in `f^2` up to 0.0402, highest power first; near `2/17, ..., 2/5, 2/3`.
const ATANH: [f64; 8] = [
    0.136_116_143_541_051_4,
    0.132_093_714_941_151_17,
    0.153_888_849_415_587,
    0.181_817_371_969_786_36,
    0.222_222_230_538_264_57,
    0.285_714_285_672_430_3,
    0.400_000_000_000_080_1,
    0.666_666_666_666_666_6,
];

/// Loads up to `WIDTH` points as their `x`, `y` and `z`; lanes without a point repeat the last one.
///
/// # Panics
/// When there are no points.
#[inline(always)]
pub(crate) fn load_points<L: Lanes>(points: &[Vec3]) -> [L; 3] {
    let padded: [[f64; 3]; MOST_LANES];
    let xyz = if points.len() >= L::WIDTH {
        coordinates(points)
    } else {
        padded = pad(points);
        padded.as_flattened()
    };
    L::deinterleave([L::load(xyz), L::load(&xyz[L::WIDTH..]), L::load(&xyz[2 * L::WIDTH..])])
}

fn pad(points: &[Vec3]) -> [[f64; 3]; MOST_LANES] {
    std::array::from_fn(|lane| points[lane.min(points.len() - 1)].into())
}

/// What becomes of the old values when new ones are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Write {
    /// They are replaced.
    Over,
    /// The new values are added to them.
    Add,
}

/// Writes the lanes' `x`, `y`, `z` together over as many triples of numbers; of more lanes than triples, the last ones are
/// dropped.
#[inline(always)]
pub(crate) fn write_triples<L: Lanes>(components: [L; 3], write: Write, to: &mut [f64]) {
    let values = L::interleave(components);
    if let Some(to) = to.get_mut(..3 * L::WIDTH) {
        for k in 0..3 {
            put(values[k], write, &mut to[k * L::WIDTH..]);
        }
    } else {
        for k in 0..3 {
            let at = (k * L::WIDTH).min(to.len());
            put(values[k], write, &mut to[at..]);
        }
    }
}

#[inline(always)]
fn put<L: Lanes>(value: L, write: Write, to: &mut [f64]) {
    match write {
        Write::Over => value.store(to),
        Write::Add => (L::load(to) + value).store(to),
    }
}

/// The components of the points, one after the other.
fn coordinates(points: &[Vec3]) -> &[f64] {
    const {
        assert!(size_of::<Vec3>() == size_of::<[f64; 3]>() && align_of::<Vec3>() == align_of::<[f64; 3]>());
    }
    // SAFETY: a `Vec3` is its `[[f64; 3]; 1]` and markers of no size, of the size and alignment just checked.
    unsafe { std::slice::from_raw_parts(points.as_ptr().cast(), 3 * points.len()) }
}

/// As [`coordinates`], to be changed.
pub(crate) fn coordinates_mut(vectors: &mut [Vec3]) -> &mut [f64] {
    // SAFETY: as in `coordinates`; the borrow is exclusive.
    unsafe { std::slice::from_raw_parts_mut(vectors.as_mut_ptr().cast(), 3 * vectors.len()) }
}

/// A computation that can run on lanes of any width.
pub(crate) trait Kernel {
    /// Does it all; must be `#[inline(always)]`, and so must whatever it calls with lanes, or the code is not compiled for
    /// the instructions of the path.
    fn run<L: Lanes>(self);
}

/// The instructions a computation runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// One number at a time, products and sums rounded separately: for processors that cannot fuse them.
    Separate,
    /// One number at a time, products and sums fused.
    Scalar,
    /// Four numbers at a time on x86 with AVX2 and FMA.
    Avx2,
    /// Eight numbers at a time on x86 with AVX-512F.
    Avx512,
    /// Two numbers at a time on 64-bit ARM.
    Neon,
}

impl Path {
    /// Every path, from the slowest to the fastest.
    pub const ALL: [Self; 5] = [Self::Separate, Self::Scalar, Self::Neon, Self::Avx2, Self::Avx512];

    /// Whether this processor has the instructions.
    pub fn is_available(self) -> bool {
        match self {
            Self::Separate => true,
            #[cfg(target_arch = "x86_64")]
            Self::Scalar => std::arch::is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => Self::Avx2.is_available() && std::arch::is_x86_feature_detected!("avx512f"),
            #[cfg(target_arch = "aarch64")]
            Self::Scalar | Self::Neon => true,
            #[allow(unreachable_patterns)]
            _ => false,
        }
    }

    /// The path of this process: the fastest there is, unless the environment variable `FLAGRS_SIMD` names another
    /// (`scalar`, `avx2`, `avx512` or `neon`). Read once; a name that is unknown, or that this processor lacks, is
    /// ignored.
    pub fn chosen() -> Self {
        static CHOSEN: OnceLock<Path> = OnceLock::new();
        *CHOSEN.get_or_init(|| Self::named(std::env::var("FLAGRS_SIMD").ok().as_deref()))
    }

    fn named(name: Option<&str>) -> Self {
        let allowed: &[Self] = match name {
            Some("scalar") => &[Self::Separate, Self::Scalar],
            Some("avx2") => &[Self::Avx2],
            Some("avx512") => &[Self::Avx512],
            Some("neon") => &[Self::Neon],
            _ => &[],
        };
        let fastest = |paths: &[Self]| paths.iter().copied().rfind(|path| path.is_available());
        fastest(allowed).or_else(|| fastest(&Self::ALL)).unwrap_or(Self::Separate)
    }

    /// Runs the kernel on this path, or on `Separate` if the processor lacks its instructions.
    pub(crate) fn run(self, kernel: impl Kernel) {
        if !self.is_available() {
            return kernel.run::<Scalar<false>>();
        }
        match self {
            // SAFETY, here and below: each function needs what its path needs, which this processor has, as just asked.
            #[cfg(target_arch = "x86_64")]
            Self::Scalar => unsafe { x86::run_scalar(kernel) },
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { x86::run_avx2(kernel) },
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { x86::run_avx512(kernel) },
            #[cfg(target_arch = "aarch64")]
            Self::Scalar => kernel.run::<Scalar<true>>(),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => kernel.run::<neon::Neon>(),
            _ => kernel.run::<Scalar<false>>(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a test on every path this processor has.
    fn on_every_path<K: Kernel>(kernel: impl Fn(Path) -> K) {
        for path in Path::ALL.into_iter().filter(|path| path.is_available()) {
            path.run(kernel(path));
        }
    }

    /// The function of every lane's own number, and its reference, agree to so many units in the last place.
    #[inline(always)]
    fn check<L: Lanes>(name: &str, x: &[f64], value: L, reference: impl Fn(f64) -> f64, units: f64) {
        let mut lanes = [f64::NAN; MOST_LANES];
        value.store(&mut lanes);
        for (&x, value) in x.iter().zip(lanes).take(L::WIDTH) {
            let exact = reference(x);
            let error = ((value - exact) / (exact * f64::EPSILON)).abs();
            assert!(error <= units, "{name} of {x:e}: {value:e} and not {exact:e}, {error} units");
        }
    }

    /// `count` numbers, evenly spread in their logarithm.
    fn logarithmic(from: f64, to: f64, count: usize) -> Vec<f64> {
        let at = |part: f64| ((1.0 - part) * from.ln() + part * to.ln()).exp();
        (0..count).map(|k| at((k as f64 + 0.5) / count as f64)).collect()
    }

    #[test]
    fn inverse_square_root_is_right_to_two_units() {
        struct Test(Vec<f64>);
        impl Kernel for Test {
            #[inline(always)]
            fn run<L: Lanes>(self) {
                for x in self.0.chunks_exact(MOST_LANES) {
                    check("inverse root", x, inverse_sqrt(L::load(x)), |x| 1.0 / x.sqrt(), 2.0);
                }
            }
        }
        on_every_path(|_| Test(logarithmic(1e-290, 1e290, 80_000)));
        on_every_path(|_| Test(logarithmic(1.0, 4.0, 80_000)));
    }

    #[test]
    fn logarithm_of_a_quotient_is_right_to_two_units() {
        struct Test(Vec<f64>);
        impl Kernel for Test {
            #[inline(always)]
            fn run<L: Lanes>(self) {
                for x in self.0.chunks_exact(MOST_LANES) {
                    for denominator in [1.0, 0.0078125, 1024.0] {
                        let quotient = ln_ratio(L::load(x) * L::splat(denominator), L::splat(denominator));
                        check("logarithm", x, quotient, f64::ln, 2.0);
                    }
                    // A denominator of many digits: the quotient is rounded before the reference sees it.
                    let quotient = ln_ratio(L::load(x) * L::splat(0.7), L::splat(0.7));
                    check("logarithm", x, quotient, f64::ln, 4.0);
                }
            }
        }
        on_every_path(|_| Test(logarithmic(1.2, 1e60, 80_000)));
        on_every_path(|_| Test(logarithmic(1.2, 4.0, 80_000)));
    }

    #[test]
    fn points_are_loaded_by_component_and_the_last_fills_up() {
        struct Test(Vec<Vec3>);
        impl Kernel for Test {
            #[inline(always)]
            fn run<L: Lanes>(self) {
                let components = load_points::<L>(&self.0);
                for k in 0..3 {
                    let mut lanes = [f64::NAN; MOST_LANES];
                    components[k].store(&mut lanes);
                    for lane in 0..L::WIDTH {
                        assert_eq!(lanes[lane], self.0[lane.min(self.0.len() - 1)][k]);
                    }
                }
            }
        }
        for count in 1..=2 * MOST_LANES {
            let point = |k: usize| Vec3::new(k as f64, k as f64 + 0.25, k as f64 + 0.5);
            on_every_path(|_| Test((0..count).map(point).collect()));
        }
    }

    #[test]
    fn triples_are_written_up_to_the_last_and_no_further() {
        struct Test(usize, Path);
        impl Kernel for Test {
            #[inline(always)]
            fn run<L: Lanes>(self) {
                let Self(count, path) = self;
                let counting: [f64; MOST_LANES] = std::array::from_fn(|lane| lane as f64);
                let lanes = L::load(&counting);
                let components = [lanes, lanes + L::splat(0.25), lanes + L::splat(0.5)];
                for (write, old) in [(Write::Over, 100.0), (Write::Add, 100.0)] {
                    let mut values = [old; 4 * MOST_LANES];
                    write_triples(components, write, &mut values[..3 * count]);
                    for (k, value) in values.into_iter().enumerate() {
                        let new = (k / 3) as f64 + 0.25 * (k % 3) as f64;
                        let expected = match write {
                            _ if k >= 3 * count.min(L::WIDTH) => old,
                            Write::Over => new,
                            Write::Add => old + new,
                        };
                        assert_eq!(value, expected, "{write:?} {count} triples, number {k}, {path:?}");
                    }
                }
            }
        }
        for count in 0..=MOST_LANES {
            on_every_path(|path| Test(count, path));
        }
    }

    #[test]
    fn every_path_has_a_name_and_other_names_are_ignored() {
        let fastest = Path::named(None);
        assert!(fastest.is_available());
        for name in ["", "AVX2", "sse9", "separate"] {
            assert_eq!(Path::named(Some(name)), fastest, "{name}");
        }
        assert!(matches!(Path::named(Some("scalar")), Path::Scalar | Path::Separate));
        for (name, path) in [("avx2", Path::Avx2), ("avx512", Path::Avx512), ("neon", Path::Neon)] {
            assert_eq!(Path::named(Some(name)), if path.is_available() { path } else { fastest });
        }
    }
}
