//! Integrals of a function of time: Gauss-Kronrod panels, halved where they disagree, and how far the running integral strays
//! from the cubic that the ends of the span suggest.

/// Positive nodes of the seven-point Kronrod rule on [-1, 1] and its weights; the three-point Gauss rule has every other node
/// (Piessens et al., QUADPACK, 1983).
const NODES: [f64; 4] = [0.0, 0.434_243_749_346_802_56, 0.774_596_669_241_483_4, 0.960_491_268_708_020_3];
const KRONROD: [f64; 4] =
    [0.450_916_538_658_474_14, 0.401_397_414_775_962_2, 0.268_488_089_868_333_44, 0.104_656_226_026_467_27];
const GAUSS: [f64; 4] = [8.0 / 9.0, 0.0, 5.0 / 9.0, 0.0];

/// Where a span of two panels is cut: not at its middle, where a whole period would be taken for nothing.
const CUT: f64 = 0.41;
/// Most panels of a span before any is halved, and most halvings.
const MOST_PANELS: f64 = 10_000.0;
const MOST_HALVINGS: usize = 4_000;
/// Error of a panel, relative to the integral of the magnitude over the span, below which it is not halved.
const TARGET: f64 = 1e-12;
/// Halvings of a panel from which on a jump is inside: a corner does not need as many.
const DEEP: u32 = 24;
/// Width of a panel, relative to the largest instant, that is not halved any more.
const NARROWEST: f64 = 1e-14;

/// What a function of time does over a span.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Course {
    /// Its integral.
    pub integral: f64,
    /// Estimated error of the integral.
    pub uncertainty: f64,
    /// Largest distance of the running integral from the cubic with its values and slopes at both ends: of fourth order in
    /// a span over which the function is smooth, the size of a pulse that the ends do not show.
    pub departure: f64,
    /// Where it jumps first, if it does: an instant just before.
    pub jump: Option<f64>,
}

/// One panel: its ends, integral, error, and integral of the magnitude.
#[derive(Clone, Copy)]
struct Panel {
    start: f64,
    end: f64,
    integral: f64,
    error: f64,
    magnitude: f64,
    depth: u32,
}

fn panel<E>(
    function: &mut impl FnMut(f64) -> Result<f64, E>,
    (start, end): (f64, f64),
    depth: u32,
) -> Result<Panel, E> {
    let (middle, half) = (0.5 * (start + end), 0.5 * (end - start));
    let (mut kronrod, mut gauss, mut magnitude, mut count) = (0.0, 0.0, 0.0, 0);
    let mut values = [0.0; 7];
    let mut weights = [0.0; 7];
    for k in 0..4 {
        for sign in [-1.0, 1.0] {
            if k == 0 && sign > 0.0 {
                continue;
            }
            let value = function(middle + sign * NODES[k] * half)?;
            kronrod += KRONROD[k] * value;
            gauss += GAUSS[k] * value;
            magnitude += KRONROD[k] * value.abs();
            (values[count], weights[count]) = (value, KRONROD[k]);
            count += 1;
        }
    }
    // QUADPACK's estimate: the difference of the rules is the error of the worse one.
    let mean = 0.5 * kronrod;
    let spread: f64 = values.iter().zip(&weights).map(|(value, weight)| weight * (value - mean).abs()).sum();
    let difference = (kronrod - gauss).abs();
    let error = if spread > 0.0 { spread * (200.0 * difference / spread).powf(1.5).min(1.0) } else { 0.0 };
    Ok(Panel { start, end, integral: kronrod * half, error: error * half, magnitude: magnitude * half, depth })
}

/// The course of a function from `start` to `end`, in panels no longer than `resolution` unless there were more than ten
/// thousand, and `ends`, the function's values there.
///
/// # Errors
/// What the function fails with.
pub fn course<E>(
    function: &mut impl FnMut(f64) -> Result<f64, E>,
    (start, end): (f64, f64),
    ends: [f64; 2],
    resolution: f64,
) -> Result<Course, E> {
    let span = end - start;
    let wanted = (span / resolution).ceil().min(MOST_PANELS);
    let cuts: Vec<f64> = if wanted <= 2.0 {
        vec![start, start + CUT * span, end]
    } else {
        (0..=wanted as usize).map(|k| if k as f64 == wanted { end } else { start + span * k as f64 / wanted }).collect()
    };
    let mut panels = cuts.windows(2).map(|cut| panel(function, (cut[0], cut[1]), 0)).collect::<Result<Vec<_>, E>>()?;
    let target = TARGET * panels.iter().map(|panel| panel.magnitude).sum::<f64>();
    let narrowest = NARROWEST * start.abs().max(end.abs());
    // A stack of the panels still to come: the halves of one are looked at before its successor, so that time runs on.
    panels.reverse();
    let mut out = Course::default();
    let mut reached: Vec<(f64, f64)> = Vec::with_capacity(panels.len());
    let mut halvings = 0;
    let (mut deepest, mut passed) = (DEEP - 1, false);
    while let Some(Panel { start: a, end: b, integral, error, depth, .. }) = panels.pop() {
        if error > target && b - a > narrowest && halvings < MOST_HALVINGS {
            halvings += 1;
            let middle = 0.5 * (a + b);
            let halves = [panel(function, (a, middle), depth + 1)?, panel(function, (middle, b), depth + 1)?];
            panels.extend(halves.into_iter().rev());
            continue;
        }
        out.integral += integral;
        out.uncertainty += error;
        reached.push((b, out.integral));
        // The first run of narrow panels closes in on the first jump.
        if depth > deepest && !passed {
            (deepest, out.jump) = (depth, Some(a));
        }
        passed |= out.jump.is_some() && depth < DEEP;
    }
    out.departure = departure(&reached, (start, span), ends, out.integral);
    Ok(out)
}

/// Largest distance of a running integral, given at instants, from the cubic with its values and slopes at both ends.
pub fn departure(reached: &[(f64, f64)], (start, span): (f64, f64), ends: [f64; 2], integral: f64) -> f64 {
    let cubic = |s: f64| {
        let through = integral * s * s * (3.0 - 2.0 * s);
        through + span * s * (1.0 - s) * (ends[0] * (1.0 - s) - ends[1] * s)
    };
    reached.iter().map(|&(time, value)| (value - cubic((time - start) / span)).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    fn of(mut function: impl FnMut(f64) -> f64, span: (f64, f64), resolution: f64) -> Course {
        let ends = [function(span.0), function(span.1)];
        let Ok(course) = course(&mut |t| Ok::<f64, Infallible>(function(t)), span, ends, resolution);
        course
    }

    #[test]
    fn polynomials_of_fifth_degree_and_their_running_integrals_of_third_are_exact() {
        // The Gauss rule is exact to degree 5, so that no panel is halved.
        let course = of(|t| 6.0 * t.powi(5), (0.5, 2.0), 10.0);
        assert!((course.integral - (64.0 - 0.5_f64.powi(6))).abs() < 1e-12);
        let parabola = of(|t| 1.0 + 2.0 * t - 3.0 * t * t, (0.5, 2.0), 0.1);
        assert!(parabola.departure < 1e-13, "{}", parabola.departure);
    }

    #[test]
    fn a_short_pulse_is_found_wherever_it_falls_and_integrated_to_its_jumps() {
        for k in 0..50 {
            // Off the ends of panels, where a jump would not be noticed, as it does no harm there.
            let begins = 0.013 * f64::from(k) + 1.3e-3;
            let pulse = |t: f64| if t >= begins && t < begins + 0.01 { 100.0 } else { 0.0 };
            let course = of(pulse, (-0.5, 1.5), 0.01);
            assert!((course.integral - 1.0).abs() < 1e-9, "begins at {begins}: {}", course.integral);
            assert!(course.departure > 0.3, "{}", course.departure);
            let jump = course.jump.unwrap_or(f64::NAN);
            assert!(jump <= begins && jump > begins - 1e-9, "begins at {begins}: {jump}");
        }
    }

    #[test]
    fn a_corner_is_no_jump() {
        assert_eq!(of(|t| (t - 0.37).abs(), (0.0, 1.0), 0.01).jump, None);
    }

    #[test]
    fn a_whole_period_is_not_taken_for_nothing() {
        let course = of(|t| (std::f64::consts::TAU * t).sin(), (0.0, 1.0), 10.0);
        assert!(course.integral.abs() < 1e-10);
        // The running integral rises to 1/pi; the ends alone suggest at most 2 pi / 4 / 27.
        assert!(course.departure > 0.1, "{}", course.departure);
    }

    #[test]
    fn the_departure_of_a_smooth_function_falls_with_the_fourth_power_of_the_span() {
        let at = |span: f64| of(f64::exp, (1.0, 1.0 + span), 10.0).departure;
        let order = (at(0.2) / at(0.1)).log2();
        assert!((order - 4.0).abs() < 0.15, "{order}");
    }

    #[test]
    fn the_cost_of_a_function_without_any_limit_is_bounded() {
        let (mut calls, mut seed) = (0_u64, 1_u64);
        let noise = |_: f64| {
            calls += 1;
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 40) as f64
        };
        let course = of(noise, (0.0, 1e9), 0.01);
        assert!(calls < 150_000, "{calls}");
        assert!(course.uncertainty > 0.0);
    }
}
