//! Two lanes with NEON, which every 64-bit ARM processor has.

use std::arch::aarch64::*;
use std::ops::{Add, Div, Mul, Sub};

use super::{Lanes, MOST_LANES, TILE};

/// Two doubles.
#[derive(Clone, Copy)]
pub(super) struct Neon(float64x2_t);

/// Calls intrinsics.
macro_rules! on {
    ($($call:tt)*) => {
        // SAFETY: every processor this file is compiled for has NEON; loads and stores check the number of values first.
        unsafe { $($call)* }
    };
}

macro_rules! operator {
    ($trait:ident $method:ident $intrinsic:ident) => {
        impl $trait for Neon {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(on!($intrinsic(self.0, other.0)))
            }
        }
    };
}

operator!(Add add vaddq_f64);
operator!(Sub sub vsubq_f64);
operator!(Mul mul vmulq_f64);
operator!(Div div vdivq_f64);

impl Neon {
    #[inline(always)]
    fn bits(self) -> uint64x2_t {
        on!(vreinterpretq_u64_f64(self.0))
    }

    #[inline(always)]
    fn from_bits(bits: uint64x2_t) -> Self {
        Self(on!(vreinterpretq_f64_u64(bits)))
    }
}

impl Lanes for Neon {
    const WIDTH: usize = 2;
    type Mask = uint64x2_t;
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
        Self(on!(vdupq_n_f64(value)))
    }

    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        match from {
            [] => Self::splat(0.0),
            [one] => Self(on!(vsetq_lane_f64::<0>(*one, vdupq_n_f64(0.0)))),
            [_, _, ..] => Self(on!(vld1q_f64(from.as_ptr()))),
        }
    }

    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        match to {
            [] => {}
            [one] => *one = on!(vgetq_lane_f64::<0>(self.0)),
            [_, _, ..] => on!(vst1q_f64(to.as_mut_ptr(), self.0)),
        }
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(on!(vfmaq_f64(c.0, self.0, b.0)))
    }

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        Self(on!(vfmaq_f64(vnegq_f64(c.0), self.0, b.0)))
    }

    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        Self(on!(vfmsq_f64(c.0, self.0, b.0)))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(on!(vabsq_f64(self.0)))
    }

    #[inline(always)]
    fn exceeds(self, other: Self) -> uint64x2_t {
        on!(vcgtq_f64(self.0, other.0))
    }

    #[inline(always)]
    fn select(mask: uint64x2_t, yes: Self, no: Self) -> Self {
        Self(on!(vbslq_f64(mask, yes.0, no.0)))
    }

    #[inline(always)]
    fn all(mask: uint64x2_t) -> bool {
        on!(vgetq_lane_u64::<0>(mask)) & on!(vgetq_lane_u64::<1>(mask)) != 0
    }

    #[inline(always)]
    fn any(mask: uint64x2_t) -> bool {
        on!(vgetq_lane_u64::<0>(mask)) | on!(vgetq_lane_u64::<1>(mask)) != 0
    }

    #[inline(always)]
    fn add_bits(self, other: Self) -> Self {
        Self::from_bits(on!(vaddq_u64(self.bits(), other.bits())))
    }

    #[inline(always)]
    fn sub_bits(self, other: Self) -> Self {
        Self::from_bits(on!(vsubq_u64(self.bits(), other.bits())))
    }

    #[inline(always)]
    fn shift_right<const N: u32>(self) -> Self {
        Self::from_bits(on!(vshlq_u64(self.bits(), vdupq_n_s64(-i64::from(N)))))
    }

    #[inline(always)]
    fn shift_left<const N: u32>(self) -> Self {
        Self::from_bits(on!(vshlq_u64(self.bits(), vdupq_n_s64(i64::from(N)))))
    }

    #[inline(always)]
    fn deinterleave([a, b, c]: [Self; 3]) -> [Self; 3] {
        [
            Self(on!(vcopyq_laneq_f64::<1, 1>(a.0, b.0))), // x0 y0, z0 x1
            Self(on!(vextq_f64::<1>(a.0, c.0))),           // y0, y1
            Self(on!(vcopyq_laneq_f64::<1, 1>(b.0, c.0))), // z0 x1, y1 z1
        ]
    }

    #[inline(always)]
    fn interleave([x, y, z]: [Self; 3]) -> [Self; 3] {
        [
            Self(on!(vzip1q_f64(x.0, y.0))),               // x0 y0
            Self(on!(vcopyq_laneq_f64::<1, 1>(z.0, x.0))), // z0 x1
            Self(on!(vzip2q_f64(y.0, z.0))),               // y1 z1
        ]
    }
}
