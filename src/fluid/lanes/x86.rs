//! Four lanes with AVX2 and FMA, eight with AVX-512F.

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Sub};

use super::scalar::Scalar;
use super::{Kernel, Lanes, MOST_LANES, TILE};

/// Runs a kernel one number at a time with fused multiplication and addition.
#[target_feature(enable = "fma")]
pub(super) fn run_scalar(kernel: impl Kernel) {
    kernel.run::<Scalar<true>>();
}

/// Runs a kernel four numbers at a time.
#[target_feature(enable = "avx2,fma")]
pub(super) fn run_avx2(kernel: impl Kernel) {
    kernel.run::<Avx2>();
}

/// Runs a kernel eight numbers at a time.
#[target_feature(enable = "avx512f,avx2,fma")]
pub(super) fn run_avx512(kernel: impl Kernel) {
    kernel.run::<Avx512>();
}

/// Four doubles; exists only below [`run_avx2`].
#[derive(Clone, Copy)]
pub(super) struct Avx2(__m256d);

/// Eight doubles; exists only below [`run_avx512`].
#[derive(Clone, Copy)]
pub(super) struct Avx512(__m512d);

/// Calls intrinsics from a method of [`Avx2`] or [`Avx512`].
macro_rules! on {
    ($($call:tt)*) => {
        // SAFETY: a value of this type, or a call of its method, exists only below the entry point above that is compiled
        // for its instructions, and that is called only where the processor has them. Loads and stores touch no more numbers
        // than their slice holds: a whole vector of a slice that long, else the lanes marked by `first`.
        unsafe { $($call)* }
    };
}

macro_rules! operators {
    ($lanes:ident: $add:ident $sub:ident $mul:ident $div:ident) => {
        impl Add for $lanes {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Self(on!($add(self.0, other.0)))
            }
        }
        impl Sub for $lanes {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Self(on!($sub(self.0, other.0)))
            }
        }
        impl Mul for $lanes {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                Self(on!($mul(self.0, other.0)))
            }
        }
        impl Div for $lanes {
            type Output = Self;
            #[inline(always)]
            fn div(self, other: Self) -> Self {
                Self(on!($div(self.0, other.0)))
            }
        }
    };
}

operators!(Avx2: _mm256_add_pd _mm256_sub_pd _mm256_mul_pd _mm256_div_pd);
operators!(Avx512: _mm512_add_pd _mm512_sub_pd _mm512_mul_pd _mm512_div_pd);

impl Avx2 {
    /// Marks the first lanes, as many as `count` says.
    #[inline(always)]
    fn first(count: usize) -> __m256i {
        on!(_mm256_cmpgt_epi64(_mm256_set1_epi64x(count.min(4) as i64), _mm256_setr_epi64x(0, 1, 2, 3)))
    }

    #[inline(always)]
    fn bits(self) -> __m256i {
        on!(_mm256_castpd_si256(self.0))
    }

    #[inline(always)]
    fn from_bits(bits: __m256i) -> Self {
        Self(on!(_mm256_castsi256_pd(bits)))
    }
}

impl Lanes for Avx2 {
    const WIDTH: usize = 4;
    type Mask = __m256d;
    type PerVector<T: Copy> = [T; TILE / Self::WIDTH];
    type Octet = [Self; MOST_LANES / Self::WIDTH];

    #[inline(always)]
    fn per_vector<T: Copy>(value: T) -> Self::PerVector<T> {
        [value; TILE / Self::WIDTH]
    }

    #[inline(always)]
    fn octet(vector: Self) -> Self::Octet {
        [vector; MOST_LANES / Self::WIDTH]
    }

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(on!(_mm256_set1_pd(value)))
    }

    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        if from.len() >= Self::WIDTH {
            Self(on!(_mm256_loadu_pd(from.as_ptr())))
        } else {
            Self(on!(_mm256_maskload_pd(from.as_ptr(), Self::first(from.len()))))
        }
    }

    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        if to.len() >= Self::WIDTH {
            on!(_mm256_storeu_pd(to.as_mut_ptr(), self.0))
        } else {
            on!(_mm256_maskstore_pd(to.as_mut_ptr(), Self::first(to.len()), self.0))
        }
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(on!(_mm256_fmadd_pd(self.0, b.0, c.0)))
    }

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        Self(on!(_mm256_fmsub_pd(self.0, b.0, c.0)))
    }

    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        Self(on!(_mm256_fnmadd_pd(self.0, b.0, c.0)))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(on!(_mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0)))
    }

    #[inline(always)]
    fn exceeds(self, other: Self) -> __m256d {
        on!(_mm256_cmp_pd::<_CMP_GT_OQ>(self.0, other.0))
    }

    #[inline(always)]
    fn select(mask: __m256d, yes: Self, no: Self) -> Self {
        Self(on!(_mm256_blendv_pd(no.0, yes.0, mask)))
    }

    #[inline(always)]
    fn all(mask: __m256d) -> bool {
        on!(_mm256_movemask_pd(mask)) == 0b1111
    }

    #[inline(always)]
    fn any(mask: __m256d) -> bool {
        on!(_mm256_movemask_pd(mask)) != 0
    }

    #[inline(always)]
    fn add_bits(self, other: Self) -> Self {
        Self::from_bits(on!(_mm256_add_epi64(self.bits(), other.bits())))
    }

    #[inline(always)]
    fn sub_bits(self, other: Self) -> Self {
        Self::from_bits(on!(_mm256_sub_epi64(self.bits(), other.bits())))
    }

    #[inline(always)]
    fn shift_right<const N: u32>(self) -> Self {
        Self::from_bits(on!(_mm256_srl_epi64(self.bits(), _mm_cvtsi32_si128(N as i32))))
    }

    #[inline(always)]
    fn shift_left<const N: u32>(self) -> Self {
        Self::from_bits(on!(_mm256_sll_epi64(self.bits(), _mm_cvtsi32_si128(N as i32))))
    }

    #[inline(always)]
    fn deinterleave([a, b, c]: [Self; 3]) -> [Self; 3] {
        on! {
            let xy = _mm256_blend_pd::<0b1100>(a.0, b.0); // x0 y0 x2 y2
            let zx = _mm256_permute2f128_pd::<0x21>(a.0, c.0); // z0 x1 z2 x3
            let yz = _mm256_blend_pd::<0b1100>(b.0, c.0); // y1 z1 y3 z3
            [
                Self(_mm256_shuffle_pd::<0b1010>(xy, zx)),
                Self(_mm256_shuffle_pd::<0b0101>(xy, yz)),
                Self(_mm256_shuffle_pd::<0b1010>(zx, yz)),
            ]
        }
    }

    #[inline(always)]
    fn interleave([x, y, z]: [Self; 3]) -> [Self; 3] {
        on! {
            let xy = _mm256_unpacklo_pd(x.0, y.0); // x0 y0 x2 y2
            let zx = _mm256_shuffle_pd::<0b1010>(z.0, x.0); // z0 x1 z2 x3
            let yz = _mm256_unpackhi_pd(y.0, z.0); // y1 z1 y3 z3
            [
                Self(_mm256_permute2f128_pd::<0x20>(xy, zx)),
                Self(_mm256_blend_pd::<0b1100>(yz, xy)),
                Self(_mm256_permute2f128_pd::<0x31>(zx, yz)),
            ]
        }
    }
}

impl Avx512 {
    /// Marks the first lanes, as many as `count` says.
    #[inline(always)]
    fn first(count: usize) -> __mmask8 {
        // Widened, because a shift by all eight bits is none at all.
        ((1_u32 << count.min(8)) - 1) as __mmask8
    }

    #[inline(always)]
    fn bits(self) -> __m512i {
        on!(_mm512_castpd_si512(self.0))
    }

    #[inline(always)]
    fn from_bits(bits: __m512i) -> Self {
        Self(on!(_mm512_castsi512_pd(bits)))
    }

    /// Lanes of three vectors: `first` picks from `a` (0 to 7) and `b` (8 to 15), `then` from that and `c`.
    #[inline(always)]
    fn pick(a: Self, first: [i64; 8], b: Self, then: [i64; 8], c: Self) -> Self {
        let two = on!(_mm512_permutex2var_pd(a.0, Self::index(first), b.0));
        Self(on!(_mm512_permutex2var_pd(two, Self::index(then), c.0)))
    }

    #[inline(always)]
    fn index(l: [i64; 8]) -> __m512i {
        on!(_mm512_setr_epi64(l[0], l[1], l[2], l[3], l[4], l[5], l[6], l[7]))
    }
}

impl Lanes for Avx512 {
    const WIDTH: usize = 8;
    type Mask = __mmask8;
    type PerVector<T: Copy> = [T; TILE / Self::WIDTH];
    type Octet = [Self; MOST_LANES / Self::WIDTH];

    #[inline(always)]
    fn per_vector<T: Copy>(value: T) -> Self::PerVector<T> {
        [value; TILE / Self::WIDTH]
    }

    #[inline(always)]
    fn octet(vector: Self) -> Self::Octet {
        [vector; MOST_LANES / Self::WIDTH]
    }

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(on!(_mm512_set1_pd(value)))
    }

    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        if from.len() >= Self::WIDTH {
            Self(on!(_mm512_loadu_pd(from.as_ptr())))
        } else {
            Self(on!(_mm512_maskz_loadu_pd(Self::first(from.len()), from.as_ptr())))
        }
    }

    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        if to.len() >= Self::WIDTH {
            on!(_mm512_storeu_pd(to.as_mut_ptr(), self.0))
        } else {
            on!(_mm512_mask_storeu_pd(to.as_mut_ptr(), Self::first(to.len()), self.0))
        }
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(on!(_mm512_fmadd_pd(self.0, b.0, c.0)))
    }

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        Self(on!(_mm512_fmsub_pd(self.0, b.0, c.0)))
    }

    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        Self(on!(_mm512_fnmadd_pd(self.0, b.0, c.0)))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(on!(_mm512_abs_pd(self.0)))
    }

    #[inline(always)]
    fn exceeds(self, other: Self) -> __mmask8 {
        on!(_mm512_cmp_pd_mask::<_CMP_GT_OQ>(self.0, other.0))
    }

    #[inline(always)]
    fn select(mask: __mmask8, yes: Self, no: Self) -> Self {
        Self(on!(_mm512_mask_blend_pd(mask, no.0, yes.0)))
    }

    #[inline(always)]
    fn all(mask: __mmask8) -> bool {
        mask == 0xff
    }

    #[inline(always)]
    fn any(mask: __mmask8) -> bool {
        mask != 0
    }

    #[inline(always)]
    fn add_bits(self, other: Self) -> Self {
        Self::from_bits(on!(_mm512_add_epi64(self.bits(), other.bits())))
    }

    #[inline(always)]
    fn sub_bits(self, other: Self) -> Self {
        Self::from_bits(on!(_mm512_sub_epi64(self.bits(), other.bits())))
    }

    #[inline(always)]
    fn shift_right<const N: u32>(self) -> Self {
        Self::from_bits(on!(_mm512_srli_epi64::<N>(self.bits())))
    }

    #[inline(always)]
    fn shift_left<const N: u32>(self) -> Self {
        Self::from_bits(on!(_mm512_slli_epi64::<N>(self.bits())))
    }

    #[inline(always)]
    fn deinterleave([a, b, c]: [Self; 3]) -> [Self; 3] {
        [
            Self::pick(a, [0, 3, 6, 9, 12, 15, 0, 0], b, [0, 1, 2, 3, 4, 5, 10, 13], c),
            Self::pick(a, [1, 4, 7, 10, 13, 0, 0, 0], b, [0, 1, 2, 3, 4, 8, 11, 14], c),
            Self::pick(a, [2, 5, 8, 11, 14, 0, 0, 0], b, [0, 1, 2, 3, 4, 9, 12, 15], c),
        ]
    }

    #[inline(always)]
    fn interleave([x, y, z]: [Self; 3]) -> [Self; 3] {
        [
            Self::pick(x, [0, 8, 0, 1, 9, 0, 2, 10], y, [0, 1, 8, 3, 4, 9, 6, 7], z),
            Self::pick(x, [0, 3, 11, 0, 4, 12, 0, 5], y, [10, 1, 2, 11, 4, 5, 12, 7], z),
            Self::pick(x, [13, 0, 6, 14, 0, 7, 15, 0], y, [0, 13, 2, 3, 14, 5, 6, 15], z),
        ]
    }
}
