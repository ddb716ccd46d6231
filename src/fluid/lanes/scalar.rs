//! One lane: plain doubles, with fused or with separate multiplication and addition.

use std::ops::{Add, Div, Mul, Sub};

use super::{Lanes, MOST_LANES, TILE};

/// A double; `FUSED` where multiplication with addition is one instruction.
#[derive(Clone, Copy)]
pub(super) struct Scalar<const FUSED: bool>(f64);

impl<const FUSED: bool> Add for Scalar<FUSED> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl<const FUSED: bool> Sub for Scalar<FUSED> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl<const FUSED: bool> Mul for Scalar<FUSED> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }
}

impl<const FUSED: bool> Div for Scalar<FUSED> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0 / other.0)
    }
}

impl<const FUSED: bool> Lanes for Scalar<FUSED> {
    const WIDTH: usize = 1;
    type Mask = bool;
    type PerVector<T: Copy> = [T; TILE];
    type Octet = [Self; MOST_LANES];

    #[inline(always)]
    fn per_vector<T: Copy>(value: T) -> Self::PerVector<T> {
        [value; TILE]
    }

    #[inline(always)]
    fn octet(vector: Self) -> Self::Octet {
        [vector; MOST_LANES]
    }

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(value)
    }

    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        Self(from.first().copied().unwrap_or(0.0))
    }

    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        if let Some(to) = to.first_mut() {
            *to = self.0;
        }
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(if FUSED { self.0.mul_add(b.0, c.0) } else { self.0 * b.0 + c.0 })
    }

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        self.mul_add(b, Self(-c.0))
    }

    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        Self(-self.0).mul_add(b, c)
    }

    #[inline(always)]
    fn exact_mul_add(self, b: Self, c: Self) -> Self {
        if FUSED {
            return self.mul_add(b, c);
        }
        // Dekker's splitting recovers what the product's rounding lost.
        let split = |v: f64| {
            let t = 134_217_729.0 * v; // 2^27 + 1
            let high = t - (t - v);
            (high, v - high)
        };
        let ((a_high, a_low), (b_high, b_low)) = (split(self.0), split(b.0));
        let product = self.0 * b.0;
        let rounding = a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low);
        Self((product + c.0) + rounding)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }

    #[inline(always)]
    fn exceeds(self, other: Self) -> bool {
        self.0 > other.0
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn all(mask: bool) -> bool {
        mask
    }

    #[inline(always)]
    fn any(mask: bool) -> bool {
        mask
    }

    #[inline(always)]
    fn add_bits(self, other: Self) -> Self {
        Self(f64::from_bits(self.0.to_bits().wrapping_add(other.0.to_bits())))
    }

    #[inline(always)]
    fn sub_bits(self, other: Self) -> Self {
        Self(f64::from_bits(self.0.to_bits().wrapping_sub(other.0.to_bits())))
    }

    #[inline(always)]
    fn shift_right<const N: u32>(self) -> Self {
        Self(f64::from_bits(self.0.to_bits() >> N))
    }

    #[inline(always)]
    fn shift_left<const N: u32>(self) -> Self {
        Self(f64::from_bits(self.0.to_bits() << N))
    }

    #[inline(always)]
    fn deinterleave(xyz: [Self; 3]) -> [Self; 3] {
        xyz
    }

    #[inline(always)]
    fn interleave(components: [Self; 3]) -> [Self; 3] {
        components
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn product_is_exact_before_it_is_added_without_fused_arithmetic() {
        let exact = |a: f64, b: f64, c: f64| Scalar::<false>(a).exact_mul_add(Scalar(b), Scalar(c)).0;
        // (1 + e)(1 - e) - 1 = -e^2, which a rounded product loses altogether.
        assert_eq!(exact(1.0 + f64::EPSILON, 1.0 - f64::EPSILON, -1.0), -f64::EPSILON * f64::EPSILON);
        assert_eq!(exact(0.1, 0.3, -0.03), 0.1_f64.mul_add(0.3, -0.03));
    }
}
