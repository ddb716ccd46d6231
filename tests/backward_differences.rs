//! Backward differences on scalar equations with known answers: their order, their weights, dense output, and step control.

use flagrs::bdf::control::{Control, Estimate, HIGHEST_ORDER};
use flagrs::bdf::history::{History, Sample, derivative_weights};

/// Instants whose steps grow and shrink by up to a quarter, newest last; more steps of the same kind with a larger count.
fn uneven(span: f64, count: usize) -> Vec<f64> {
    let phase = |k: usize| k as f64 / count as f64;
    (0..=count).map(|k| span * (phase(k) + 0.04 * (4.0 * std::f64::consts::TAU * phase(k)).sin())).collect()
}

/// The value at `to` that satisfies `y' = rate y` with a backward difference through the known values, newest first.
fn decayed(rate: f64, known: &[(f64, f64)], to: f64) -> f64 {
    let times: Vec<f64> = std::iter::once(to).chain(known.iter().map(|(time, _)| *time)).collect();
    let weights = derivative_weights(&times);
    let past: f64 = weights[1..].iter().zip(known).map(|(weight, (_, value))| weight * value).sum();
    past / (rate - weights[0])
}

#[test]
fn decay_converges_at_the_order_of_the_difference_on_uneven_steps() {
    for order in 1..=HIGHEST_ORDER {
        let error = |count: usize| {
            let times = uneven(2.0, count);
            let mut known: Vec<(f64, f64)> = times[..order].iter().rev().map(|&time| (time, (-time).exp())).collect();
            for &to in &times[order..] {
                let value = decayed(-1.0, &known[..order], to);
                known.insert(0, (to, value));
            }
            known[0].1 - (-2.0_f64).exp()
        };
        let observed = (error(100) / error(200)).abs().log2();
        assert!((observed - order as f64).abs() < 0.1, "order {observed} instead of {order}");
    }
}

#[test]
fn decay_too_fast_for_the_step_stays_decay() {
    // Explicit differences would grow by 1e4 a step; these fall by at least as much as the stiff limit of each order allows.
    for order in 1..=HIGHEST_ORDER {
        let times = uneven(1.0, 50);
        let mut known: Vec<(f64, f64)> = times[..order].iter().rev().map(|&time| (time, 1.0)).collect();
        for &to in &times[order..] {
            let value = decayed(-1e6, &known[..order], to);
            known.insert(0, (to, value));
            assert!(value.abs() < 1e-3);
        }
    }
}

#[test]
fn weights_on_equal_steps_are_those_of_the_textbook() {
    let expected: [&[f64]; 3] = [&[1.0, -1.0], &[1.5, -2.0, 0.5], &[11.0 / 6.0, -3.0, 1.5, -1.0 / 3.0]];
    for weights in expected {
        let times: Vec<f64> = (0..weights.len()).map(|k| 7.0 - 0.25 * k as f64).collect();
        for (found, weight) in derivative_weights(&times).iter().zip(weights) {
            assert!((found - weight / 0.25).abs() < 1e-13, "{found}, not {}", weight / 0.25);
        }
    }
}

#[test]
fn weights_differentiate_polynomials_exactly() {
    let times = [2.0, 1.7, 1.1, 0.9];
    for count in 2..=4 {
        let weights = derivative_weights(&times[..count]);
        for power in 0..count as i32 {
            let found: f64 = weights.iter().zip(&times).map(|(weight, time)| weight * time.powi(power)).sum();
            let exact = f64::from(power) * 2.0_f64.powi(power - 1);
            assert!((found - exact).abs() < 1e-12, "power {power} with {count}: {found}, not {exact}");
        }
    }
}

/// States of `value` at the times before the first, which is the present one.
fn history(times: &[f64], value: impl Fn(f64) -> f64) -> History {
    let sample = |&time: &f64| Sample { time, q: vec![value(time)], ..Sample::default() };
    History { past: times[1..].iter().map(sample).collect(), order: 0 }
}

fn extended(times: &[f64], value: impl Fn(f64) -> f64 + Copy, order: usize, to: f64) -> f64 {
    let mut out = [f64::NAN];
    history(times, value).extrapolate(order, (times[0], &[value(times[0])]), |sample| &sample.q, to, &mut out);
    out[0]
}

#[test]
fn guesses_and_dense_output_are_exact_for_polynomials_of_their_order() {
    let times = [3.0, 2.8, 2.1, 1.9, 1.0];
    let coefficients = [0.5, -1.0, 2.0, -0.3, 0.7];
    for order in 0..times.len() {
        let value = |t: f64| coefficients[..=order].iter().rev().fold(0.0, |sum, c| sum * t + c);
        for to in [3.4, 3.0, 2.9, 2.8, 2.05] {
            let found = extended(&times, value, order, to);
            assert!((found - value(to)).abs() < 1e-12 * value(to).abs().max(1.0), "order {order} at {to}: {found}");
        }
    }
}

#[test]
fn dense_output_of_a_smooth_motion_converges_one_order_above_its_polynomial() {
    for order in 0..=3 {
        let error = |step: f64| {
            let times: Vec<f64> = [0.0, 1.0, 2.1, 3.5].iter().map(|k| 1.0 - k * step).collect();
            let to = 1.0 - 0.4 * step;
            extended(&times, f64::sin, order, to) - to.sin()
        };
        let observed = (error(0.02) / error(0.01)).abs().log2();
        assert!((observed - order as f64 - 1.0).abs() < 0.1, "order {observed} of a polynomial of order {order}");
    }
}

#[test]
fn the_order_of_guesses_follows_the_one_that_predicts_best() {
    let sample = |time: f64| Sample { time, q: vec![0.0], ..Sample::default() };
    let mut kept = History::default();
    kept.accept(sample(0.0), &[0.5]);
    assert_eq!((kept.past.len(), kept.guess_order()), (1, 1));
    kept.accept(sample(1.0), &[0.5, 0.1]);
    kept.accept(sample(2.0), &[0.5, 0.1, 0.01]);
    assert_eq!((kept.past.len(), kept.guess_order()), (3, 3));
    // A corner in the motion: what stands still predicts best.
    kept.accept(sample(3.0), &[0.1, 0.5, 2.0, 8.0]);
    assert_eq!(kept.guess_order(), 0);
    kept.accept(sample(4.0), &[0.5, 0.1, 0.2, 0.3, 0.4]);
    assert_eq!((kept.past.len(), kept.guess_order()), (4, 1));
    assert_eq!(kept.times(5.0, 3), vec![5.0, 4.0, 3.0]);
}

#[test]
fn prediction_errors_are_weighted_and_the_largest_counts() {
    let past = vec![Sample { time: 0.0, q: vec![1.0, -2.0], ..Sample::default() }];
    let kept = History { past, order: 1 };
    let errors = kept.prediction_errors((1.0, &[2.0, -2.5]), (3.0, &[4.5, -3.0]), &[10.0, 100.0], &mut [0.0; 2]);
    // Standing still misses by 2.5 and 0.5, the line through both states, at (4, -3.5), by 0.5 and 0.5.
    assert_eq!(errors, vec![50.0, 50.0]);
    let errors = kept.prediction_errors((1.0, &[2.0, -2.5]), (3.0, &[4.5, -3.0]), &[10.0, 1.0], &mut [0.0; 2]);
    assert_eq!(errors, vec![25.0, 5.0]);
}

/// A run of adaptive steps of `y' = exact'(t) - (y - exact(t))`.
struct Run {
    steps: usize,
    rejected: usize,
    orders: [usize; HIGHEST_ORDER],
    /// Largest error at the end of a step.
    error: f64,
    shortest: f64,
}

/// A point of the plane that moves, or its velocity.
type Curve = fn(f64) -> [f64; 2];

/// Follows `exact`, whose derivative is `slope`, from 0 to `end` with steps chosen for the tolerance.
fn follow(exact: Curve, slope: Curve, end: f64, tolerance: f64) -> Run {
    let mut run = Run { steps: 0, rejected: 0, orders: [0; HIGHEST_ORDER], error: 0.0, shortest: f64::INFINITY };
    let mut control = Control { dt: 1e-4, ..Control::default() };
    let (mut now, mut place, mut kept) = (0.0, exact(0.0), History::default());
    while now < end {
        assert!(run.steps + run.rejected < 100_000, "no progress at {now}");
        let to = now + control.dt;
        let order = control.order.min(kept.past.len() + 1);
        let times: Vec<f64> = std::iter::once(to).chain(kept.times(now, order)).collect();
        let weights = derivative_weights(&times);
        let next: [f64; 2] = std::array::from_fn(|c| {
            let known = std::iter::once(place[c]).chain(kept.past.iter().map(|sample| sample.q[c]));
            let past: f64 = weights[1..].iter().zip(known).map(|(weight, value)| weight * value).sum();
            (slope(to)[c] + exact(to)[c] - past) / (weights[0] + 1.0)
        });
        let missed = kept.prediction_errors((now, &place), (to, &next), &[1.0; 2], &mut [0.0; 2]);
        let estimate =
            Estimate { prediction_errors: &missed, input_error: 0.0, tolerance, highest_order: HIGHEST_ORDER };
        let (wanted, accepted) = control.judge(&kept.times(now, kept.past.len() + 1), to, &estimate);
        control = wanted;
        if !accepted {
            run.rejected += 1;
            continue;
        }
        run.steps += 1;
        run.orders[order - 1] += 1;
        run.shortest = run.shortest.min(to - now);
        kept.accept(Sample { time: now, q: place.to_vec(), ..Sample::default() }, &missed);
        (now, place) = (to, next);
        let apart = exact(now).into_iter().zip(place).map(|(exact, found)| (exact - found).abs());
        run.error = apart.fold(run.error, f64::max);
    }
    run
}

#[test]
fn adaptive_steps_keep_the_error_near_the_tolerance_with_as_many_steps_as_their_order_needs() {
    let circle = |tolerance| follow(|t| [t.sin(), t.cos()], |t| [t.cos(), -t.sin()], 20.0, tolerance);
    let runs = [1e-3, 1e-5, 1e-7].map(|tolerance| (tolerance, circle(tolerance)));
    for (tolerance, run) in &runs {
        // Local errors add up over the unit of time in which the equation forgets, some steps each.
        let steps_remembered = run.steps as f64 / 20.0;
        let bound = tolerance * (1.0 + steps_remembered);
        assert!((0.02 * tolerance..bound).contains(&run.error), "{} at {tolerance}", run.error);
        assert!(run.rejected < run.steps / 10 + 3, "{} of {} rejected", run.rejected, run.steps);
        assert!(run.orders[HIGHEST_ORDER - 1] > run.steps / 2, "orders {:?}", run.orders);
    }
    // Third order: a hundredth of the error for the fourth root of 100 as many steps.
    let ratio = runs[2].1.steps as f64 / runs[1].1.steps as f64;
    assert!((2.6..4.0).contains(&ratio), "{ratio}");
}

#[test]
fn steps_are_short_where_something_happens_and_long_elsewhere() {
    // A switch within 0.02 around t = 5.
    let switch = |t: f64| [((t - 5.0) / 0.01).tanh(), 0.0];
    let run = follow(switch, |t| [100.0 / ((t - 5.0) / 0.01).cosh().powi(2), 0.0], 10.0, 1e-4);
    assert!(run.shortest < 0.01 && run.error < 1e-2, "{} {}", run.shortest, run.error);
    assert!(run.steps < 400, "{}", run.steps);
}
