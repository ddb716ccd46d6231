//! Eight numbers side by side in the widest registers of this machine; all `unsafe` of the far field.
//!
//! Kernels are written once, for any [`Lanes`], and compiled for each implementation: plain arrays, a pair of AVX2
//! registers, an AVX-512 register. Every lane does the same arithmetic whatever its neighbours hold, so results depend on the
//! machine but never on how the work is cut up.

/// Four numbers in memory: one for each harmonic potential of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Four(pub [f64; 4]);

impl Four {
    pub const ZERO: Self = Self([0.0; 4]);
}

/// Eight numbers in memory: eight points, or four potentials of two cells.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Eight(pub [f64; 8]);

impl Eight {
    pub const ZERO: Self = Self([0.0; 8]);

    /// `first` in the lower four lanes, `second` in the upper.
    #[inline(always)]
    pub fn halves(first: f64, second: f64) -> Self {
        Self([first, first, first, first, second, second, second, second])
    }
}

/// Eight numbers in registers.
///
/// Implementations for vector registers are sound only in code that runs after [`Width::detect`] has found their
/// instructions, which is what [`for_width`] sees to.
pub(crate) trait Lanes: Copy {
    fn splat(value: f64) -> Self;
    fn load(from: &Eight) -> Self;
    fn join(lower: &Four, upper: &Four) -> Self;
    fn store(self, to: &mut Eight);
    fn plus(self, other: Self) -> Self;
    fn minus(self, other: Self) -> Self;
    fn times(self, other: Self) -> Self;
    /// `self * a + b`.
    fn fma(self, a: Self, b: Self) -> Self;
    /// `b - self * a`.
    fn fnma(self, a: Self, b: Self) -> Self;
    /// Lane `k` of each half, in all lanes of that half.
    fn spread<const K: i32>(self) -> Self;
    /// `1 / sqrt`, to 1e-14, for numbers from 1e-30 to 1e30.
    fn inverse_root(self) -> Self;
    /// Adds the sum of the halves to `to`.
    fn add_halves(self, to: &mut Four);
    /// Adds each half to one of them.
    fn add_each(self, lower: &mut Four, upper: &mut Four);

    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }

    /// `self * a + b` with one number for all lanes of `a`.
    #[inline(always)]
    fn fma_scalar(self, a: f64, b: Self) -> Self {
        self.fma(Self::splat(a), b)
    }
}

/// Eight numbers in an array, for machines without anything better; fused arithmetic where that is one instruction.
#[derive(Clone, Copy)]
pub(crate) struct Plain([f64; 8]);

/// `a * b + c`.
#[inline(always)]
fn fma(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(target_arch = "aarch64") { a.mul_add(b, c) } else { a * b + c }
}

impl Lanes for Plain {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; 8])
    }

    #[inline(always)]
    fn load(from: &Eight) -> Self {
        Self(from.0)
    }

    #[inline(always)]
    fn join(lower: &Four, upper: &Four) -> Self {
        Self(std::array::from_fn(|k| if k < 4 { lower.0[k] } else { upper.0[k - 4] }))
    }

    #[inline(always)]
    fn store(self, to: &mut Eight) {
        to.0 = self.0;
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] - other.0[k]))
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] * other.0[k]))
    }

    #[inline(always)]
    fn fma(self, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|k| fma(self.0[k], a.0[k], b.0[k])))
    }

    #[inline(always)]
    fn fnma(self, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|k| fma(-self.0[k], a.0[k], b.0[k])))
    }

    #[inline(always)]
    fn spread<const K: i32>(self) -> Self {
        Self(std::array::from_fn(|k| self.0[(k & 4) + K as usize]))
    }

    #[inline(always)]
    fn inverse_root(self) -> Self {
        Self(self.0.map(|value| 1.0 / value.sqrt()))
    }

    #[inline(always)]
    fn add_halves(self, to: &mut Four) {
        for k in 0..4 {
            to.0[k] += self.0[k] + self.0[k + 4];
        }
    }

    #[inline(always)]
    fn add_each(self, lower: &mut Four, upper: &mut Four) {
        for k in 0..4 {
            lower.0[k] += self.0[k];
            upper.0[k] += self.0[k + 4];
        }
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    // SAFETY of every block below: the instructions exist wherever code for these lanes runs (see `Lanes`), and memory is
    // read and written through references to types of the size and alignment that the instruction asks for.
    use std::arch::x86_64::*;

    use super::{Eight, Four, Lanes};

    /// Eight numbers in a pair of AVX2 registers.
    #[derive(Clone, Copy)]
    pub(crate) struct Avx2(__m256d, __m256d);

    impl Avx2 {
        #[inline(always)]
        fn half_inverse_root(value: __m256d) -> __m256d {
            // Single precision is quick but reaches from 1e-38 to 1e38 only; one Newton step doubles its digits.
            unsafe {
                let start = _mm256_cvtps_pd(_mm_div_ps(_mm_set1_ps(1.0), _mm_sqrt_ps(_mm256_cvtpd_ps(value))));
                let half = _mm256_mul_pd(value, _mm256_mul_pd(_mm256_set1_pd(0.5), start));
                _mm256_fmadd_pd(start, _mm256_fnmadd_pd(half, start, _mm256_set1_pd(0.5)), start)
            }
        }
    }

    impl Lanes for Avx2 {
        #[inline(always)]
        fn splat(value: f64) -> Self {
            unsafe { Self(_mm256_set1_pd(value), _mm256_set1_pd(value)) }
        }

        #[inline(always)]
        fn load(from: &Eight) -> Self {
            let from = from.0.as_ptr();
            unsafe { Self(_mm256_load_pd(from), _mm256_load_pd(from.add(4))) }
        }

        #[inline(always)]
        fn join(lower: &Four, upper: &Four) -> Self {
            unsafe { Self(_mm256_load_pd(lower.0.as_ptr()), _mm256_load_pd(upper.0.as_ptr())) }
        }

        #[inline(always)]
        fn store(self, to: &mut Eight) {
            let to = to.0.as_mut_ptr();
            unsafe {
                _mm256_store_pd(to, self.0);
                _mm256_store_pd(to.add(4), self.1);
            }
        }

        #[inline(always)]
        fn plus(self, other: Self) -> Self {
            unsafe { Self(_mm256_add_pd(self.0, other.0), _mm256_add_pd(self.1, other.1)) }
        }

        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            unsafe { Self(_mm256_sub_pd(self.0, other.0), _mm256_sub_pd(self.1, other.1)) }
        }

        #[inline(always)]
        fn times(self, other: Self) -> Self {
            unsafe { Self(_mm256_mul_pd(self.0, other.0), _mm256_mul_pd(self.1, other.1)) }
        }

        #[inline(always)]
        fn fma(self, a: Self, b: Self) -> Self {
            unsafe { Self(_mm256_fmadd_pd(self.0, a.0, b.0), _mm256_fmadd_pd(self.1, a.1, b.1)) }
        }

        #[inline(always)]
        fn fnma(self, a: Self, b: Self) -> Self {
            unsafe { Self(_mm256_fnmadd_pd(self.0, a.0, b.0), _mm256_fnmadd_pd(self.1, a.1, b.1)) }
        }

        #[inline(always)]
        fn spread<const K: i32>(self) -> Self {
            let one = |half| unsafe {
                match K {
                    0 => _mm256_permute4x64_pd::<0x00>(half),
                    1 => _mm256_permute4x64_pd::<0x55>(half),
                    2 => _mm256_permute4x64_pd::<0xAA>(half),
                    _ => _mm256_permute4x64_pd::<0xFF>(half),
                }
            };
            Self(one(self.0), one(self.1))
        }

        #[inline(always)]
        fn inverse_root(self) -> Self {
            Self(Self::half_inverse_root(self.0), Self::half_inverse_root(self.1))
        }

        #[inline(always)]
        fn add_halves(self, to: &mut Four) {
            let to = to.0.as_mut_ptr();
            unsafe { _mm256_store_pd(to, _mm256_add_pd(_mm256_load_pd(to), _mm256_add_pd(self.0, self.1))) }
        }

        #[inline(always)]
        fn add_each(self, lower: &mut Four, upper: &mut Four) {
            for (to, half) in [(lower, self.0), (upper, self.1)] {
                let to = to.0.as_mut_ptr();
                unsafe { _mm256_store_pd(to, _mm256_add_pd(_mm256_load_pd(to), half)) }
            }
        }
    }

    /// Eight numbers in an AVX-512 register.
    #[derive(Clone, Copy)]
    pub(crate) struct Avx512(__m512d);

    impl Avx512 {
        #[inline(always)]
        fn halves(self) -> Avx2 {
            unsafe { Avx2(_mm512_castpd512_pd256(self.0), _mm512_extractf64x4_pd::<1>(self.0)) }
        }
    }

    impl Lanes for Avx512 {
        #[inline(always)]
        fn splat(value: f64) -> Self {
            unsafe { Self(_mm512_set1_pd(value)) }
        }

        #[inline(always)]
        fn load(from: &Eight) -> Self {
            unsafe { Self(_mm512_load_pd(from.0.as_ptr())) }
        }

        #[inline(always)]
        fn join(lower: &Four, upper: &Four) -> Self {
            unsafe {
                let lower = _mm512_castpd256_pd512(_mm256_load_pd(lower.0.as_ptr()));
                Self(_mm512_insertf64x4::<1>(lower, _mm256_load_pd(upper.0.as_ptr())))
            }
        }

        #[inline(always)]
        fn store(self, to: &mut Eight) {
            unsafe { _mm512_store_pd(to.0.as_mut_ptr(), self.0) }
        }

        #[inline(always)]
        fn plus(self, other: Self) -> Self {
            unsafe { Self(_mm512_add_pd(self.0, other.0)) }
        }

        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            unsafe { Self(_mm512_sub_pd(self.0, other.0)) }
        }

        #[inline(always)]
        fn times(self, other: Self) -> Self {
            unsafe { Self(_mm512_mul_pd(self.0, other.0)) }
        }

        #[inline(always)]
        fn fma(self, a: Self, b: Self) -> Self {
            unsafe { Self(_mm512_fmadd_pd(self.0, a.0, b.0)) }
        }

        #[inline(always)]
        fn fnma(self, a: Self, b: Self) -> Self {
            unsafe { Self(_mm512_fnmadd_pd(self.0, a.0, b.0)) }
        }

        #[inline(always)]
        fn spread<const K: i32>(self) -> Self {
            unsafe {
                Self(match K {
                    0 => _mm512_permutex_pd::<0x00>(self.0),
                    1 => _mm512_permutex_pd::<0x55>(self.0),
                    2 => _mm512_permutex_pd::<0xAA>(self.0),
                    _ => _mm512_permutex_pd::<0xFF>(self.0),
                })
            }
        }

        #[inline(always)]
        fn inverse_root(self) -> Self {
            // Fourteen bits to start with; each Newton step doubles them.
            unsafe {
                let half = _mm512_mul_pd(self.0, _mm512_set1_pd(0.5));
                let step = |root| {
                    let rest = _mm512_fnmadd_pd(_mm512_mul_pd(half, root), root, _mm512_set1_pd(0.5));
                    _mm512_fmadd_pd(root, rest, root)
                };
                Self(step(step(_mm512_rsqrt14_pd(self.0))))
            }
        }

        #[inline(always)]
        fn add_halves(self, to: &mut Four) {
            self.halves().add_halves(to);
        }

        #[inline(always)]
        fn add_each(self, lower: &mut Four, upper: &mut Four) {
            self.halves().add_each(lower, upper);
        }
    }
}

/// The widest registers of this machine that the kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Width {
    /// Nothing beyond what every machine of this architecture has.
    Plain,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Width {
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
            let wide = std::arch::is_x86_feature_detected!("avx512f");
            return if wide { Self::Avx512 } else { Self::Avx2 };
        }
        Self::Plain
    }

    /// All that this machine can run, for tests.
    #[cfg(test)]
    pub fn all() -> Vec<Self> {
        let mut all = vec![Self::Plain];
        #[cfg(target_arch = "x86_64")]
        match Self::detect() {
            Self::Plain => {}
            Self::Avx2 => all.push(Self::Avx2),
            Self::Avx512 => all.extend([Self::Avx2, Self::Avx512]),
        }
        all
    }
}

/// Defines a function that runs `body::<lanes>(arguments)` for the lanes of the [`Width`] given first.
///
/// The body must be `#[inline(always)]`, and so must all of it that touches lanes.
macro_rules! for_width {
    ($(#[$meta:meta])* $visibility:vis fn $name:ident($($argument:ident: $kind:ty),* $(,)?) = $body:ident) => {
        $(#[$meta])*
        $visibility fn $name(width: $crate::fluid::far_field::lanes::Width, $($argument: $kind),*) {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            fn avx2($($argument: $kind),*) {
                $body::<$crate::fluid::far_field::lanes::Avx2>($($argument),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,avx512f")]
            fn avx512($($argument: $kind),*) {
                $body::<$crate::fluid::far_field::lanes::Avx512>($($argument),*)
            }
            match width {
                $crate::fluid::far_field::lanes::Width::Plain => {
                    $body::<$crate::fluid::far_field::lanes::Plain>($($argument),*)
                }
                // SAFETY: these functions are safe but for the instructions they need; `Width::detect` has found them.
                #[cfg(target_arch = "x86_64")]
                $crate::fluid::far_field::lanes::Width::Avx2 => unsafe { avx2($($argument),*) },
                #[cfg(target_arch = "x86_64")]
                $crate::fluid::far_field::lanes::Width::Avx512 => unsafe { avx512($($argument),*) },
            }
        }
    };
}
pub(crate) use for_width;

#[cfg(test)]
mod tests {
    use super::*;

    #[inline(always)]
    fn inverse_root_as<V: Lanes>(values: &Eight, out: &mut Eight) {
        V::load(values).inverse_root().store(out);
    }
    for_width! { fn inverse_root(values: &Eight, out: &mut Eight) = inverse_root_as }

    #[test]
    fn inverse_root_is_accurate_over_the_range_of_scenes() {
        for width in Width::all() {
            for exponent in -30..=2 {
                let (values, mut roots) = (Eight([1.7 * 10_f64.powi(exponent); 8]), Eight::ZERO);
                inverse_root(width, &values, &mut roots);
                let error = roots.0[2] * values.0[2].sqrt() - 1.0;
                assert!(error.abs() < 2e-14, "{width:?} {exponent}: {error:e}");
            }
        }
    }
}
