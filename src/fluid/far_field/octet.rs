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

// Loops and no closures: code in a closure is not compiled for the instructions of its path.
impl<L: Lanes> Octet<L> {
    #[inline(always)]
    pub fn splat(value: f64) -> Self {
        Self(L::octet(L::splat(value)))
    }

    #[inline(always)]
    pub fn zero() -> Self {
        Self::splat(0.0)
    }

    #[inline(always)]
    pub fn load(Eight(from): &Eight) -> Self {
        let mut loaded = Self::zero();
        for (vector, from) in loaded.0.as_mut().iter_mut().zip(from.chunks_exact(L::WIDTH)) {
            *vector = L::load(from);
        }
        loaded
    }

    #[inline(always)]
    pub fn load_each<const N: usize>(from: &[Eight; N]) -> [Self; N] {
        let mut loaded = [Self::zero(); N];
        for (octet, from) in loaded.iter_mut().zip(from) {
            *octet = Self::load(from);
        }
        loaded
    }

    #[inline(always)]
    pub fn store(self, Eight(to): &mut Eight) {
        for (vector, to) in self.0.as_ref().iter().zip(to.chunks_exact_mut(L::WIDTH)) {
            vector.store(to);
        }
    }

    #[inline(always)]
    pub fn plus(mut self, other: Self) -> Self {
        for (own, &other) in self.0.as_mut().iter_mut().zip(other.0.as_ref()) {
            *own = *own + other;
        }
        self
    }

    #[inline(always)]
    pub fn minus(mut self, other: Self) -> Self {
        for (own, &other) in self.0.as_mut().iter_mut().zip(other.0.as_ref()) {
            *own = *own - other;
        }
        self
    }

    #[inline(always)]
    pub fn times(mut self, other: Self) -> Self {
        for (own, &other) in self.0.as_mut().iter_mut().zip(other.0.as_ref()) {
            *own = *own * other;
        }
        self
    }

    /// `self * a + b`.
    #[inline(always)]
    pub fn fma(mut self, a: Self, b: Self) -> Self {
        for ((own, &a), &b) in self.0.as_mut().iter_mut().zip(a.0.as_ref()).zip(b.0.as_ref()) {
            *own = own.mul_add(a, b);
        }
        self
    }

    /// `b - self * a`.
    #[inline(always)]
    pub fn fnma(mut self, a: Self, b: Self) -> Self {
        for ((own, &a), &b) in self.0.as_mut().iter_mut().zip(a.0.as_ref()).zip(b.0.as_ref()) {
            *own = own.neg_mul_add(a, b);
        }
        self
    }

    /// `1 / sqrt(self)`.
    #[inline(always)]
    pub fn inverse_root(mut self) -> Self {
        for own in self.0.as_mut() {
            *own = inverse_sqrt(*own);
        }
        self
    }

    /// `self * a + b` with one number for all of `a`.
    #[inline(always)]
    pub fn fma_scalar(self, a: f64, b: Self) -> Self {
        self.fma(Self::splat(a), b)
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
