//! Products of small square matrices with lanes, unrolled: most of the work of a translation.

use super::octet::{Eight, Octet};
use crate::fluid::lanes::Lanes;

/// `out = matrix values`, the matrix by rows.
#[inline(always)]
pub(crate) fn multiply<L: Lanes>(matrix: &[f64], values: &[Eight], out: &mut [Eight]) {
    match out.len() {
        0 => {}
        1 => unrolled::<L, 1>(matrix, values, out),
        2 => unrolled::<L, 2>(matrix, values, out),
        3 => unrolled::<L, 3>(matrix, values, out),
        4 => unrolled::<L, 4>(matrix, values, out),
        5 => unrolled::<L, 5>(matrix, values, out),
        6 => unrolled::<L, 6>(matrix, values, out),
        7 => unrolled::<L, 7>(matrix, values, out),
        8 => unrolled::<L, 8>(matrix, values, out),
        9 => unrolled::<L, 9>(matrix, values, out),
        10 => unrolled::<L, 10>(matrix, values, out),
        11 => unrolled::<L, 11>(matrix, values, out),
        12 => unrolled::<L, 12>(matrix, values, out),
        13 => unrolled::<L, 13>(matrix, values, out),
        _ => by_rows::<L>(matrix, values, out),
    }
}

/// All values stay in registers.
#[inline(always)]
fn unrolled<L: Lanes, const SIZE: usize>(matrix: &[f64], values: &[Eight], out: &mut [Eight]) {
    let (rows, _) = matrix.as_chunks::<SIZE>();
    let Some(values) = values.first_chunk::<SIZE>() else { return };
    let values = Octet::<L>::load_each(values);
    for (row, out) in rows.iter().zip(out) {
        let mut sum = values[0].times(Octet::<L>::splat(row[0]));
        for k in 1..SIZE {
            sum = values[k].fma_scalar(row[k], sum);
        }
        sum.store(out);
    }
}

#[inline(always)]
fn by_rows<L: Lanes>(matrix: &[f64], values: &[Eight], out: &mut [Eight]) {
    for (row, out) in matrix.chunks_exact(values.len()).zip(out) {
        let (mut even, mut odd) = (Octet::<L>::zero(), Octet::<L>::zero());
        let (values, last_value) = values.as_chunks::<2>();
        let (row, last_entry) = row.as_chunks::<2>();
        for ([a, b], [x, y]) in values.iter().zip(row) {
            (even, odd) = (Octet::<L>::load(a).fma_scalar(*x, even), Octet::<L>::load(b).fma_scalar(*y, odd));
        }
        if let ([value], [entry]) = (last_value, last_entry) {
            even = Octet::<L>::load(value).fma_scalar(*entry, even);
        }
        even.plus(odd).store(out);
    }
}

#[cfg(test)]
mod tests {
    use super::super::octet::on_path;
    use super::*;
    use crate::fluid::lanes::Path;

    on_path! { fn product(matrix: &[f64], values: &[Eight], out: &mut [Eight]) = multiply }

    #[test]
    fn products_of_every_size_are_those_of_the_definition() {
        for path in Path::ALL {
            for size in 0..=25 {
                let matrix: Vec<f64> = (0..size * size).map(|k| (k as f64).sin()).collect();
                let values: Vec<Eight> = (0..size).map(|k| Eight([(k as f64).cos(); 8])).collect();
                let mut out = vec![Eight::ZERO; size];
                product(path, &matrix, &values, &mut out);
                for (row, out) in out.iter().enumerate() {
                    let exact: f64 = (0..size).map(|k| matrix[row * size + k] * values[k].0[0]).sum();
                    assert!((out.0[6] - exact).abs() < 1e-14, "{path:?} {size} {row}");
                }
            }
        }
    }
}
