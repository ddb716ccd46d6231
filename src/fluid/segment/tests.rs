//! The blocks of a segment against quadrature of high precision, on every path of arithmetic.

use super::*;

/// One row of tests/data/segment_blocks.csv: the pair, and its blocks to 25 digits.
struct Case {
    target: Vec3,
    segment: Segment,
    exact: [f64; 12],
}

fn table() -> Vec<Case> {
    let row = |line: &str| {
        let v: Vec<f64> = line.split(',').skip(1).map(|n| n.parse().expect("a number")).collect();
        let at = |k: usize| Vec3::new(v[k], v[k + 1], v[k + 2]);
        let exact = std::array::from_fn(|k| v[10 + k]);
        Case { target: at(0), segment: Segment::new(&at(3), &at(6), v[9]), exact }
    };
    include_str!("../../../tests/data/segment_blocks.csv").lines().skip(1).map(row).collect()
}

/// Start's and end's entries for each target.
fn blocks(path: Path, segment: &Segment, targets: &[Vec3]) -> Vec<[f64; 12]> {
    let mut all = Vec::new();
    for_each_target(path, segment, targets, |target, blocks| {
        assert_eq!(target, all.len());
        let entry = |k: usize| if k < 6 { blocks.start[k] } else { blocks.end[k - 6] };
        all.push(std::array::from_fn(entry));
    });
    all
}

/// Largest difference of each block over the largest entry of the reference.
fn difference(value: &[f64; 12], reference: &[f64; 12]) -> f64 {
    let of_block = |value: &[f64], reference: &[f64]| {
        let size = reference.iter().fold(0.0_f64, |size, entry| size.max(entry.abs()));
        value.iter().zip(reference).fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs() / size))
    };
    of_block(&value[..6], &reference[..6]).max(of_block(&value[6..], &reference[6..]))
}

fn available() -> impl Iterator<Item = Path> {
    Path::ALL.into_iter().filter(|path| path.is_available())
}

#[test]
fn every_path_agrees_with_high_precision_quadrature() {
    for path in available() {
        let error = |case: &Case| difference(&blocks(path, &case.segment, &[case.target])[0], &case.exact);
        let worst = table().iter().map(error).fold(0.0, f64::max);
        assert!(worst > 0.0 && worst < 2e-14, "{path:?}: {worst:e}");
    }
}

#[test]
fn every_path_with_fused_arithmetic_has_the_same_bits() {
    for Case { target, segment, .. } in table() {
        let mut fused = available().filter(|&path| path != Path::Separate);
        let Some(first) = fused.next() else { return };
        let reference = blocks(first, &segment, &[target]);
        for path in fused {
            assert_eq!(blocks(path, &segment, &[target]), reference, "{path:?} and {first:?} at {target:?}");
        }
    }
}

/// Measured: 5e-16 by quadrature; 1.2e-14 by the closed forms, which may be wrong by that much on either path.
#[test]
fn separate_arithmetic_differs_in_the_last_places() {
    let (mut near, mut far) = (0.0_f64, 0.0_f64);
    for Case { target, segment, .. } in table() {
        let of = |path| blocks(path, &segment, &[target])[0];
        let apart = difference(&of(Path::Separate), &of(Path::chosen()));
        let centre = Vec3::from(segment.start).lerp(&Vec3::from(segment.end), 0.5);
        let d = 2.0 * ((target - centre).norm() * segment.inverse_length).hypot(segment.epsilon_squared.sqrt());
        let worst = if d > SWITCH[1] { &mut far } else { &mut near };
        *worst = worst.max(apart);
    }
    assert!(near > 0.0 && near < 2e-14, "{near:e}");
    assert!(far > 0.0 && far < 8.0 * f64::EPSILON, "{far:e}");
}

/// Vectors of targets of which each needs another formula.
#[test]
fn a_target_has_the_same_blocks_whatever_its_neighbours() {
    let segment = Segment::new(&Vec3::new(0.3, -0.2, 0.1), &Vec3::new(0.9, 0.4, -0.5), 0.02);
    let targets: Vec<Vec3> = (0..83)
        .map(|k| {
            let (angle, distance) = (2.4 * f64::from(k), [0.1, 30.0, 3.0, 7.0, 1.0, 400.0, 0.7][k as usize % 7]);
            Vec3::new(angle.cos(), angle.sin(), 0.3) * distance
        })
        .collect();
    for path in available() {
        let together = blocks(path, &segment, &targets);
        for (target, blocks_together) in targets.iter().zip(&together) {
            assert_eq!(&blocks(path, &segment, &[*target])[0], blocks_together, "{path:?} at {target:?}");
        }
        // In every place of the vector, and with every number of targets.
        for skip in 0..20 {
            let rest = blocks(path, &segment, &targets[skip..60]);
            assert_eq!(rest, together[skip..60], "{path:?} from target {skip}");
        }
    }
}

#[test]
fn what_is_not_a_number_stays_with_its_own_target() {
    let segment = Segment::new(&Vec3::zeros(), &Vec3::x(), 0.1);
    let mut targets: Vec<Vec3> = (0..16).map(|k| Vec3::new(0.1, 0.4 * f64::from(k), 0.2)).collect();
    for path in available() {
        let clean = blocks(path, &segment, &targets);
        targets[5].y = f64::NAN;
        for (k, (with, without)) in blocks(path, &segment, &targets).iter().zip(&clean).enumerate() {
            if k == 5 {
                assert!(with.iter().all(|entry| entry.is_nan()), "{path:?}: {with:?}");
            } else {
                assert_eq!(with, without, "{path:?} target {k}");
            }
        }
        targets[5] = Vec3::new(0.1, 2.0, 0.2);
    }
}
