//! Regular solid harmonics: the polynomials in which far fields are expanded.
//!
//! With `Y_n^m = N_n^m r^n P_n^m(cos t) e^(i m p) / (n + m)!`, sign convention of Dehnen (Comput. Astrophys. Cosmol. 1 (2014) 1),
//! `N_n^m = sqrt((n + m)! (n - m)!)`, and another `sqrt(2)` for `m > 0`,
//!
//! ```text
//! U_n^m + i V_n^m = Y_n^m,  0 <= m <= n        sum over m of U(a) U(b) + V(a) V(b) = |a|^n |b|^n P_n(cos(a, b))
//! ```
//!
//! so that these real polynomials are orthogonal with the same norm within a degree, and rotations and reflections act on
//! them by orthogonal matrices. Coefficients of degree n are stored together from `n^2` on: `U` of even m, `U` of odd m, `V`
//! of odd m, `V` of even m, the four families that [`super::rotation`] treats alike.

use super::octet::{Eight, Octet};
use crate::fluid::lanes::Lanes;

/// Highest degree there are tables for.
pub(crate) const MAX_ORDER: usize = 24;

/// Number of coefficients up to the highest degree.
pub(crate) const MAX_COEFFICIENTS: usize = (MAX_ORDER + 1) * (MAX_ORDER + 1);

/// Number of coefficients up to a degree.
pub(crate) const fn coefficients(order: usize) -> usize {
    (order + 1) * (order + 1)
}

/// Place of `U_n^m`.
#[inline(always)]
pub(crate) const fn real(n: usize, m: usize) -> usize {
    n * n + m / 2 + if m % 2 == 1 { n / 2 + 1 } else { 0 }
}

/// Place of `V_n^m`, m > 0.
#[inline(always)]
pub(crate) const fn imaginary(n: usize, m: usize) -> usize {
    n * n + n + 1 + (m - 1) / 2 + if m.is_multiple_of(2) { n.div_ceil(2) } else { 0 }
}

/// Where the families of a degree start within it, and where the last ends.
#[inline(always)]
pub(crate) const fn families(n: usize) -> [usize; 5] {
    [0, n / 2 + 1, n + 1, n + 1 + n.div_ceil(2), 2 * n + 1]
}

/// `N_n^m` without its `sqrt(2)`.
pub(crate) fn norm(n: usize, m: usize) -> f64 {
    (factorial(n + m) * factorial(n - m)).sqrt()
}

/// `N_n^m`.
pub(crate) fn full_norm(n: usize, m: usize) -> f64 {
    if m > 0 { std::f64::consts::SQRT_2 * norm(n, m) } else { norm(n, m) }
}

pub(crate) fn factorial(n: usize) -> f64 {
    (1..=n).map(|k| k as f64).product()
}

/// Coefficients of the recursions over degrees, and of the gradients.
pub(crate) struct Harmonics {
    order: usize,
    /// `Y_m^m = diagonal[m] (x + i y) Y_(m-1)^(m-1)`.
    diagonal: Vec<f64>,
    /// `Y_n^m = climb.0 z Y_(n-1)^m - climb.1 r^2 Y_(n-2)^m`, at [`real`].
    climb: Vec<[f64; 2]>,
    ladder: Vec<Rung>,
}

/// One term of a gradient: `d Y[of] / d axis` contains `factor Y[to]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rung {
    pub of: usize,
    pub to: usize,
    pub axis: usize,
    pub factor: f64,
}

impl Harmonics {
    /// Tables up to a degree, at most [`MAX_ORDER`].
    pub fn new(order: usize) -> Self {
        let diagonal = (0..=order)
            .map(|m| if m == 0 { 1.0 } else { full_norm(m, m) / full_norm(m - 1, m - 1) / (2 * m) as f64 })
            .collect();
        let mut climb = vec![[0.0; 2]; coefficients(order)];
        for m in 0..order {
            for n in m + 1..=order {
                let denominator = (n * n - m * m) as f64;
                let first = (2 * n - 1) as f64 / denominator * norm(n, m) / norm(n - 1, m);
                let second = if n > m + 1 { norm(n, m) / norm(n - 2, m) / denominator } else { 0.0 };
                climb[real(n, m)] = [first, second];
            }
        }
        Self { order, diagonal, climb, ladder: ladder(order) }
    }

    /// The terms of all gradients; every `to` is one degree below its `of`.
    pub fn ladder(&self) -> &[Rung] {
        &self.ladder
    }

    /// Fills `out` with all harmonics at eight points.
    #[inline(always)]
    pub fn evaluate<L: Lanes>(&self, [x, y, z]: [Octet<L>; 3], out: &mut [Eight]) {
        let r_squared = x.fma(x, y.fma(y, z.times(z)));
        let (mut u, mut v) = (Octet::<L>::splat(1.0), Octet::<L>::zero());
        for m in 0..=self.order {
            if m > 0 {
                let factor = Octet::<L>::splat(self.diagonal[m]);
                let (x, y) = (x.times(factor), y.times(factor));
                (u, v) = (v.fnma(y, u.times(x)), u.fma(y, v.times(x)));
                self.climb_from(m, v, imaginary, z, r_squared, out);
            }
            self.climb_from(m, u, real, z, r_squared, out);
        }
    }

    #[inline(always)]
    fn climb_from<L: Lanes>(
        &self,
        m: usize,
        start: Octet<L>,
        place: impl Fn(usize, usize) -> usize,
        z: Octet<L>,
        r_squared: Octet<L>,
        out: &mut [Eight],
    ) {
        let (mut below, mut current) = (Octet::<L>::zero(), start);
        current.store(&mut out[place(m, m)]);
        for n in m + 1..=self.order {
            let [first, second] = self.climb[real(n, m)];
            let lower = below.times(r_squared).times(Octet::<L>::splat(-second));
            (below, current) = (current, current.times(z).fma_scalar(first, lower));
            current.store(&mut out[place(n, m)]);
        }
    }
}

/// In the complex basis without norms, `d/dx Y_n^m = (Y_(n-1)^(m-1) - Y_(n-1)^(m+1)) / 2`,
/// `d/dy Y_n^m = i (Y_(n-1)^(m-1) + Y_(n-1)^(m+1)) / 2` and `d/dz Y_n^m = Y_(n-1)^m`, with `Y_n^(-1) = -conj(Y_n^1)`.
fn ladder(order: usize) -> Vec<Rung> {
    let mut rungs = Vec::new();
    for n in 1..=order {
        for m in 0..=n {
            let mut push = |of: usize, to: usize, to_m: usize, axis: usize, factor: f64| {
                rungs.push(Rung { of, to, axis, factor: factor * full_norm(n, m) / full_norm(n - 1, to_m) });
            };
            if m < n {
                push(real(n, m), real(n - 1, m), m, 2, 1.0);
            }
            if m == 0 {
                if n > 1 {
                    push(real(n, 0), real(n - 1, 1), 1, 0, -1.0);
                    push(real(n, 0), imaginary(n - 1, 1), 1, 1, -1.0);
                }
                continue;
            }
            push(real(n, m), real(n - 1, m - 1), m - 1, 0, 0.5);
            push(imaginary(n, m), real(n - 1, m - 1), m - 1, 1, 0.5);
            if m > 1 {
                push(imaginary(n, m), imaginary(n - 1, m - 1), m - 1, 0, 0.5);
                push(real(n, m), imaginary(n - 1, m - 1), m - 1, 1, -0.5);
            }
            if m < n {
                push(imaginary(n, m), imaginary(n - 1, m), m, 2, 1.0);
            }
            if m + 1 < n {
                push(real(n, m), real(n - 1, m + 1), m + 1, 0, -0.5);
                push(imaginary(n, m), imaginary(n - 1, m + 1), m + 1, 0, -0.5);
                push(real(n, m), imaginary(n - 1, m + 1), m + 1, 1, -0.5);
                push(imaginary(n, m), real(n - 1, m + 1), m + 1, 1, 0.5);
            }
        }
    }
    rungs
}

#[cfg(test)]
mod tests {
    use super::super::octet::on_path;
    use super::*;
    use crate::fluid::lanes::Path;

    on_path! { fn evaluate(harmonics: &Harmonics, point: [f64; 3], out: &mut [Eight]) = evaluate_as }

    #[inline(always)]
    fn evaluate_as<L: Lanes>(harmonics: &Harmonics, point: [f64; 3], out: &mut [Eight]) {
        harmonics.evaluate(point.map(Octet::<L>::splat), out);
    }

    const ORDER: usize = 8;

    fn at(harmonics: &Harmonics, point: [f64; 3]) -> Vec<f64> {
        let mut out = vec![Eight::ZERO; coefficients(ORDER)];
        evaluate(Path::chosen(), harmonics, point, &mut out);
        out.iter().map(|value| value.0[3]).collect()
    }

    #[test]
    fn harmonics_of_a_degree_sum_to_the_legendre_polynomial() {
        let harmonics = Harmonics::new(ORDER);
        let (a, b) = ([0.3, -0.7, 0.4], [-0.2, 0.5, 0.9]);
        let (ya, yb) = (at(&harmonics, a), at(&harmonics, b));
        let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
        let (product, size) = (dot(a, b), (dot(a, a) * dot(b, b)).sqrt());
        let (mut last, mut legendre) = (0.0, 1.0);
        for n in 0..=ORDER {
            let sum: f64 = (n * n..(n + 1) * (n + 1)).map(|k| ya[k] * yb[k]).sum();
            assert!((sum - legendre).abs() < 1e-14, "degree {n}: {sum} for {legendre}");
            let k = n as f64;
            (last, legendre) = (legendre, ((2.0 * k + 1.0) * product * legendre - k * size * size * last) / (k + 1.0));
        }
    }

    #[test]
    fn ladder_is_the_gradient() {
        let harmonics = Harmonics::new(ORDER);
        let point = [0.3, -0.7, 0.4];
        let values = at(&harmonics, point);
        for axis in 0..3 {
            let shifted = |by: f64| {
                let mut point = point;
                point[axis] += by;
                at(&harmonics, point)
            };
            let (up, down) = (shifted(1e-5), shifted(-1e-5));
            for k in 0..coefficients(ORDER) {
                let rungs = harmonics.ladder().iter().filter(|rung| rung.of == k && rung.axis == axis);
                let gradient: f64 = rungs.map(|rung| rung.factor * values[rung.to]).sum();
                let difference = (up[k] - down[k]) / 2e-5;
                assert!((gradient - difference).abs() < 1e-8, "axis {axis}, {k}: {gradient} for {difference}");
            }
        }
    }
}
