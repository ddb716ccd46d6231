//! Rotations of solid harmonics, put together from turns about z and from swapping x with z.
//!
//! A turn about z multiplies `Y_n^m` by `e^(i m angle)`. Swapping the axes x and z acts within each degree by a constant,
//! symmetric, orthogonal matrix; it maps each of the four families of [`super::harmonics`] onto one of them. Turn, swap,
//! turn, swap brings any direction onto z (Dehnen, Comput. Astrophys. Cosmol. 1 (2014) 1), at a cost of
//! `order^3`.

use super::harmonics::{MAX_ORDER, families, full_norm};
use super::octet::{Eight, Octet};
use super::square;
use crate::fluid::lanes::Lanes;

/// The matrix of the swap of x and z, degree by degree.
pub(crate) struct Swap {
    /// For each degree, for each family that comes out, rows over the family that goes in.
    entries: Vec<f64>,
}

/// The four families of a degree: whether they are real, and the parity of m.
const FAMILIES: [(bool, usize); 4] = [(true, 0), (true, 1), (false, 1), (false, 0)];

/// The orders m of a family.
fn family(n: usize, (is_real, parity): (bool, usize)) -> impl Iterator<Item = usize> {
    (0..=n).filter(move |m| m % 2 == parity && (is_real || *m > 0))
}

impl Swap {
    pub fn new(order: usize) -> Self {
        let mut entries = Vec::new();
        // Row m + n, column l + n of the swap in the complex basis without norms.
        let mut matrix: Vec<Vec<f64>> = vec![vec![1.0]];
        for n in 0..=order {
            if n > 0 {
                matrix = next_degree(n, &matrix);
            }
            let at = |m: usize, l: usize| {
                let (plus, minus) = (matrix[n + m][n + l], matrix[n + m][n - l]);
                (plus, if l.is_multiple_of(2) { minus } else { -minus })
            };
            for (is_real, parity) in FAMILIES {
                for m in family(n, (is_real, parity)) {
                    // Y^l and Y^(-l) = (-1)^l conj(Y^l) share U^l and V^l.
                    entries.extend(family(n, (is_real, partner(n, is_real, parity))).map(|l| {
                        let entry = match (at(m, l), is_real) {
                            ((plus, _), true) if l == 0 => plus,
                            ((plus, minus), true) => plus + minus,
                            ((plus, minus), false) => plus - minus,
                        };
                        entry * full_norm(n, m) / full_norm(n, l)
                    }));
                }
            }
        }
        Self { entries }
    }

    /// Fills `out` with the harmonics, or the coefficients, up to a degree in swapped axes.
    #[inline(always)]
    pub fn apply<L: Lanes>(&self, order: usize, values: &[Eight], out: &mut [Eight]) {
        let mut entries = self.entries.as_slice();
        for n in 0..=order {
            let (values, out) = (&values[n * n..(n + 1) * (n + 1)], &mut out[n * n..(n + 1) * (n + 1)]);
            let starts = families(n);
            for (k, (is_real, parity)) in FAMILIES.into_iter().enumerate() {
                let from = if partner(n, is_real, parity) == parity { k } else { k ^ 1 };
                let (values, out) = (&values[starts[from]..starts[from + 1]], &mut out[starts[k]..starts[k + 1]]);
                let (block, rest) = entries.split_at(values.len() * values.len());
                entries = rest;
                square::multiply::<L>(block, values, out);
            }
        }
    }
}

/// The parity of the orders that swap with a family: `l = n + m` for `U`, `l = n + m + 1` for `V`, modulo two.
#[inline(always)]
fn partner(n: usize, is_real: bool, parity: usize) -> usize {
    (n + parity + usize::from(!is_real)) % 2
}

/// The swap of degree n from that of degree n - 1: derivatives of a swapped harmonic are swapped derivatives.
///
/// `d/dz (Y_n^m o s) = (d/dx Y_n^m) o s` gives the inner columns; `d/dx` and `d/dy` together give the outermost two.
fn next_degree(n: usize, below: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let size = n as i32;
    let lower = |m: i32, l: i32| {
        let inside = m.abs() < size && l.abs() < size;
        if inside { below[(m + size - 1) as usize][(l + size - 1) as usize] } else { 0.0 }
    };
    let entry = |m: i32, l: i32| {
        if l.abs() < size {
            return 0.5 * (lower(m - 1, l) - lower(m + 1, l));
        }
        let inner = l - l.signum();
        0.5 * (lower(m - 1, inner) + lower(m + 1, inner)) + f64::from(l.signum()) * lower(m, inner)
    };
    (-size..=size).map(|m| (-size..=size).map(|l| entry(m, l)).collect()).collect()
}

/// Cosines and sines of the multiples of an angle: of even multiples from 0 on, and of odd ones.
pub(crate) type Multiples = [[[Eight; 2]; MAX_ORDER / 2 + 1]; 2];

/// No angle.
pub(crate) const NO_MULTIPLES: Multiples = [[[Eight::ZERO; 2]; MAX_ORDER / 2 + 1]; 2];

/// Fills `out` with the multiples up to an order, from cosine and sine of the angle.
#[inline(always)]
pub(crate) fn multiples<L: Lanes>(order: usize, cosine: Octet<L>, sine: Octet<L>, [even, odd]: &mut Multiples) {
    let (mut c, mut s) = (Octet::<L>::splat(1.0), Octet::<L>::zero());
    for (even, odd) in even.iter_mut().zip(odd).take(order / 2 + 1) {
        for out in [even, odd] {
            c.store(&mut out[0]);
            s.store(&mut out[1]);
            (c, s) = (s.fnma(sine, c.times(cosine)), c.fma(sine, s.times(cosine)));
        }
    }
}

/// Turns harmonics by the angle whose [`multiples`] are given: `Y^m` becomes `e^(i m angle) Y^m`; by the opposite angle
/// if `BACK`.
#[inline(always)]
pub(crate) fn turn<L: Lanes, const BACK: bool>(order: usize, [even, odd]: &Multiples, values: &mut [Eight]) {
    for n in 1..=order {
        let [_, u_odd, v_odd, v_even, _] = families(n);
        let (u, v) = values[n * n..(n + 1) * (n + 1)].split_at_mut(v_odd);
        let (u_even, u_odd) = u.split_at_mut(u_odd);
        let (v_odd, v_even) = v.split_at_mut(v_even - v_odd);
        turn_family::<L, BACK>(&even[1..], &mut u_even[1..], v_even);
        turn_family::<L, BACK>(odd, u_odd, v_odd);
    }
}

#[inline(always)]
fn turn_family<L: Lanes, const BACK: bool>(multiples: &[[Eight; 2]], u: &mut [Eight], v: &mut [Eight]) {
    for (([c, s], at), beside) in multiples.iter().zip(u).zip(v) {
        let (c, s) = (Octet::<L>::load(c), Octet::<L>::load(s));
        let (u, v) = (Octet::<L>::load(at), Octet::<L>::load(beside));
        let (turned_u, turned_v) = if BACK {
            (v.fma(s, u.times(c)), u.fnma(s, v.times(c)))
        } else {
            (v.fnma(s, u.times(c)), u.fma(s, v.times(c)))
        };
        turned_u.store(at);
        turned_v.store(beside);
    }
}

#[cfg(test)]
mod tests {
    use super::super::harmonics::{Harmonics, coefficients};
    use super::super::octet::on_path;
    use super::*;
    use crate::fluid::lanes::Path;

    on_path! { fn evaluate(point: [f64; 3], out: &mut [Eight]) = evaluate_as }
    on_path! { fn swap(values: &[Eight], out: &mut [Eight]) = swap_as }
    on_path! { fn turn_by(angle: f64, back: bool, values: &mut [Eight]) = turn_by_as }

    #[inline(always)]
    fn evaluate_as<L: Lanes>(point: [f64; 3], out: &mut [Eight]) {
        Harmonics::new(MAX_ORDER).evaluate(point.map(Octet::<L>::splat), out);
    }

    #[inline(always)]
    fn swap_as<L: Lanes>(values: &[Eight], out: &mut [Eight]) {
        Swap::new(MAX_ORDER).apply::<L>(MAX_ORDER, values, out);
    }

    #[inline(always)]
    fn turn_by_as<L: Lanes>(angle: f64, back: bool, values: &mut [Eight]) {
        let mut table = NO_MULTIPLES;
        multiples(MAX_ORDER, Octet::<L>::splat(angle.cos()), Octet::<L>::splat(angle.sin()), &mut table);
        if back {
            turn::<L, true>(MAX_ORDER, &table, values);
        } else {
            turn::<L, false>(MAX_ORDER, &table, values);
        }
    }

    fn worst(a: &[Eight], b: &[Eight]) -> f64 {
        a.iter().zip(b).fold(0.0, |worst: f64, (a, b)| worst.max((a.0[5] - b.0[5]).abs()))
    }

    fn at(point: [f64; 3]) -> Vec<Eight> {
        let mut out = vec![Eight::ZERO; coefficients(MAX_ORDER)];
        evaluate(Path::chosen(), point, &mut out);
        out
    }

    #[test]
    fn swapped_harmonics_are_those_of_the_swapped_point() {
        let (values, direct) = (at([0.6, -0.5, 0.3]), at([0.3, -0.5, 0.6]));
        let (mut swapped, mut back) = (values.clone(), values.clone());
        swap(Path::chosen(), &values, &mut swapped);
        assert!(worst(&direct, &swapped) < 1e-13, "{:e}", worst(&direct, &swapped));
        swap(Path::chosen(), &swapped, &mut back);
        assert!(worst(&values, &back) < 1e-13, "{:e}", worst(&values, &back));
    }

    #[test]
    fn turned_harmonics_are_those_of_the_turned_point() {
        let (sine, cosine) = 0.7_f64.sin_cos();
        let mut values = at([0.6, -0.5, 0.3]);
        let direct = at([0.6 * cosine + 0.5 * sine, 0.6 * sine - 0.5 * cosine, 0.3]);
        turn_by(Path::chosen(), 0.7, false, &mut values);
        assert!(worst(&direct, &values) < 1e-14, "{:e}", worst(&direct, &values));
        turn_by(Path::chosen(), 0.7, true, &mut values);
        assert!(worst(&at([0.6, -0.5, 0.3]), &values) < 1e-14);
    }
}
