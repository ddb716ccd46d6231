//! Eight numbers side by side, in as many registers as they take on this machine: eight points, or four potentials of two
//! cells.

use crate::fluid::lanes::{Lanes, inverse_sqrt};

/// Four numbers in memory: one for each harmonic potential of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Four(pub [f64; 4]);

impl Four {
    pub const ZERO: Self = Self([0.0; 4]);
}

/// Eight numbers in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Eight(pub [f64; 8]);

impl Eight {
    pub const ZERO: Self = Self([0.0; 8]);

    /// `first` in the lower four places, `second` in the upper.
    #[inline(always)]
    pub fn halves(first: f64, second: f64) -> Self {
        Self([first, first, first, first, second, second, second, second])
    }

    /// Two times four numbers.
    #[inline(always)]
    pub fn join(Four(a): &Four, Four(b): &Four) -> Self {
        Self([a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]])
    }
}

/// Eight numbers in registers.
#[derive(Clone, Copy)]
pub(crate) struct Octet<L: Lanes>(L::Octet);

impl<L: Lanes> Octet<L> {
    #[inline(always)]
    fn map(self, make: impl Fn(L) -> L) -> Self {
        Self(L::octet(|k| make(self.0.as_ref()[k])))
    }

    #[inline(always)]
    fn zip(self, other: Self, make: impl Fn(L, L) -> L) -> Self {
        Self(L::octet(|k| make(self.0.as_ref()[k], other.0.as_ref()[k])))
    }

    #[inline(always)]
    fn zip_three(self, a: Self, b: Self, make: impl Fn(L, L, L) -> L) -> Self {
        Self(L::octet(|k| make(self.0.as_ref()[k], a.0.as_ref()[k], b.0.as_ref()[k])))
    }

    #[inline(always)]
    pub fn splat(value: f64) -> Self {
        Self(L::octet(|_| L::splat(value)))
    }

    #[inline(always)]
    pub fn zero() -> Self {
        Self::splat(0.0)
    }

    #[inline(always)]
    pub fn load(Eight(from): &Eight) -> Self {
        Self(L::octet(|k| L::load(&from[k * L::WIDTH..(k + 1) * L::WIDTH])))
    }

    #[inline(always)]
    pub fn store(self, Eight(to): &mut Eight) {
        for (k, vector) in self.0.as_ref().iter().enumerate() {
            vector.store(&mut to[k * L::WIDTH..(k + 1) * L::WIDTH]);
        }
    }

    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    #[inline(always)]
    pub fn minus(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    #[inline(always)]
    pub fn times(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }

    /// `self * a + b`.
    #[inline(always)]
    pub fn fma(self, a: Self, b: Self) -> Self {
        self.zip_three(a, b, |this, a, b| this.mul_add(a, b))
    }

    /// `b - self * a`.
    #[inline(always)]
    pub fn fnma(self, a: Self, b: Self) -> Self {
        self.zip_three(a, b, |this, a, b| this.neg_mul_add(a, b))
    }

    /// `self * a + b` with one number for all of `a`.
    #[inline(always)]
    pub fn fma_scalar(self, a: f64, b: Self) -> Self {
        self.fma(Self::splat(a), b)
    }

    /// `1 / sqrt(self)`.
    #[inline(always)]
    pub fn inverse_root(self) -> Self {
        self.map(inverse_sqrt)
    }

    /// Adds the sum of the halves to `to`.
    #[inline(always)]
    pub fn add_halves(self, Four(to): &mut Four) {
        let mut own = Eight::ZERO;
        self.store(&mut own);
        for k in 0..4 {
            to[k] += own.0[k] + own.0[k + 4];
        }
    }

    /// Adds each half to one of them.
    #[inline(always)]
    pub fn add_each(self, Four(lower): &mut Four, Four(upper): &mut Four) {
        let mut own = Eight::ZERO;
        self.store(&mut own);
        for k in 0..4 {
            lower[k] += own.0[k];
            upper[k] += own.0[k + 4];
        }
    }
}

/// Defines a function that runs `body::<lanes>(arguments)` on the [`crate::fluid::lanes::Path`] given first.
///
/// The body must be `#[inline(always)]`, and so must all of it that touches lanes.
macro_rules! on_path {
    ($(#[$meta:meta])* $visibility:vis fn $name:ident($($argument:ident: $kind:ty),* $(,)?) = $body:ident) => {
        $(#[$meta])*
        $visibility fn $name(path: $crate::fluid::lanes::Path, $($argument: $kind),*) {
            struct Call<T>(T);
            impl $crate::fluid::lanes::Kernel for Call<($($kind,)*)> {
                #[inline(always)]
                fn run<L: $crate::fluid::lanes::Lanes>(self) {
                    let Self(($($argument,)*)) = self;
                    $body::<L>($($argument),*);
                }
            }
            path.run(Call(($($argument,)*)));
        }
    };
}
pub(crate) use on_path;
