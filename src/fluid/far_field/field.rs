//! The flow of a local expansion at the targets of its cell.

use super::harmonics::{Harmonics, MAX_COEFFICIENTS};
use super::octet::{Eight, Four, Octet, on_path};
use super::translation::Place;
use crate::fluid::lanes::Lanes;

on_path! {
    /// Adds the flow of the local expansion (module [`super::sources`]) at every target.
    pub(crate) fn evaluate(
        harmonics: &Harmonics,
        place: &Place,
        local: &[Four],
        targets: &[[f64; 3]],
        out: &mut [[f64; 3]],
    ) = evaluate_as
}

#[inline(always)]
fn evaluate_as<L: Lanes>(
    harmonics: &Harmonics,
    place: &Place,
    local: &[Four],
    targets: &[[f64; 3]],
    out: &mut [[f64; 3]],
) {
    let inverse = 1.0 / place.scale;
    // The potentials and their derivatives in x; those in y and z.
    let mut fields = [[Eight::ZERO; 2]; MAX_COEFFICIENTS];
    for ([values, _], Four(local)) in fields.iter_mut().zip(local) {
        values.0[..4].copy_from_slice(local);
    }
    for rung in harmonics.ladder() {
        let (half, first) = [(0, 4), (1, 0), (1, 4)][rung.axis];
        for k in 0..4 {
            fields[rung.to][half].0[first + k] += rung.factor * inverse * local[rung.of].0[k];
        }
    }
    let mut values = [Eight::ZERO; MAX_COEFFICIENTS];
    for (targets, out) in targets.chunks(8).zip(out.chunks_mut(8)) {
        let mut from = [Eight::ZERO; 3];
        for (lane, target) in targets.iter().enumerate() {
            for k in 0..3 {
                from[k].0[lane] = target[k] - place.centre[k];
            }
        }
        let mut scaled = Octet::<L>::load_each(&from);
        for coordinate in &mut scaled {
            *coordinate = coordinate.times(Octet::splat(inverse));
        }
        harmonics.evaluate(scaled, &mut values);
        let mut sums = [[Octet::<L>::zero(); 2]; 8];
        for (value, [first, second]) in values[..local.len()].iter().zip(&fields) {
            let (first, second) = (Octet::<L>::load(first), Octet::<L>::load(second));
            for (lane, [a, b]) in sums.iter_mut().enumerate() {
                *a = first.fma_scalar(value.0[lane], *a);
                *b = second.fma_scalar(value.0[lane], *b);
            }
        }
        for (lane, (out, [a, b])) in out.iter_mut().zip(&sums).enumerate() {
            let (mut low, mut high) = (Eight::ZERO, Eight::ZERO);
            a.store(&mut low);
            b.store(&mut high);
            let (Eight(a), Eight(b)) = (low, high);
            // Derivatives of phi_x, phi_y, phi_z and chi along each axis.
            let slopes = [[a[4], a[5], a[6], a[7]], [b[0], b[1], b[2], b[3]], [b[4], b[5], b[6], b[7]]];
            for k in 0..3 {
                let [x, y, z] = from.map(|from| from.0[lane]);
                let turned = x * slopes[k][0] + y * slopes[k][1] + z * slopes[k][2];
                out[k] += a[k] - turned + slopes[k][3];
            }
        }
    }
}
