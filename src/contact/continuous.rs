//! How far nodes can go along straight paths before two segments come too close.
//!
//! Additive continuous collision detection (Li, Kaufman and Jiang, Codimensional IPC, 2021, algorithm 1): while the nodes of A and
//! B move by `p_i` per unit of time, the distance falls no faster than
//!
//! ```text
//!   l = max(|p_a0 - c|, |p_a1 - c|) + max(|p_b0 - c|, |p_b1 - c|)
//! ```
//!
//! with any common motion `c`, so from a gap `D - D_min` it is safe to go on for the part of the gap that may be used up over
//! `l`, and to measure again. Other than in the source, a step aims at the gap to be kept, not at a part of the present one, so that
//! the gap is kept at every time up to the answer, not only at the places visited.

use super::distance::segment_distance;
use crate::Vec3;

/// Part of the first gap that a step must leave.
const KEPT: f64 = 0.1;

/// The search ends where the gap that may still be used up is this part of the gap to be kept.
const CLOSE: f64 = 0.1;

/// Most distances measured for one pair; fewer only shorten the step. Grazing pairs, whose gap stays small over a long way, need
/// the most.
const MOST_MEASURED: usize = 10_000;

/// The largest part in `[0, 1]` of the straight paths from `from` to `to` of the nodes `a0, a1, b0, b1` (m) over which the
/// distance of the segments stays above `least` (m) with at least a tenth of the gap at the start.
///
/// 0 if they are at `least` or closer at the start; at most `limit`, which saves work where a shorter step is known already.
pub fn safe_part(from: &[Vec3; 4], to: &[Vec3; 4], least: f64, limit: f64) -> f64 {
    let paths: [Vec3; 4] = std::array::from_fn(|i| to[i] - from[i]);
    let common = (paths[0] + paths[1] + paths[2] + paths[3]) * 0.25;
    let own = paths.map(|path| (path - common).norm());
    let speed = own[0].max(own[1]) + own[2].max(own[3]);
    let distance_at = |time: f64| {
        let x: [Vec3; 4] = std::array::from_fn(|i| from[i] + (paths[i] - common) * time);
        segment_distance(&x[0], &x[1], &x[2], &x[3]).distance
    };
    let gap = distance_at(0.0) - least;
    if gap <= 0.0 {
        return 0.0;
    }
    let kept = KEPT * gap;
    let (mut time, mut clearance) = (0.0, gap - kept);
    for _ in 0..MOST_MEASURED {
        if clearance >= speed * (limit - time) {
            return limit;
        }
        if clearance <= CLOSE * kept {
            break;
        }
        time += clearance / speed;
        clearance = distance_at(time) - least - kept;
    }
    time
}
