//! Contact geometry: closest points, candidate pairs and exclusions, each against an independent
//! way of finding them.

use std::f64::consts::{FRAC_PI_2, PI};

use flagrs::Vec3;
use flagrs::contact::broad_phase::{BroadPhase, Search};
use flagrs::contact::distance::segment_distance;
use flagrs::contact::exclusion::{DEFAULT_FACTOR, Exclusion};
use proptest::prelude::*;

type Segment = (Vec3, Vec3);

fn vector(range: f64) -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-range..range).prop_map(|[x, y, z]| Vec3::new(x, y, z))
}

fn direction() -> impl Strategy<Value = Vec3> {
    vector(1.0).prop_filter("too short to have a direction", |v| v.norm() > 0.1).prop_map(|v| v.normalize())
}

/// Two segments whose lines pass each other at a given angle and gap: angles from 1e-10 rad to a
/// right angle, lengths differing up to a factor of 1e3, crossing, overlapping or apart.
fn pair_of_segments() -> impl Strategy<Value = (Segment, Segment)> {
    (direction(), direction(), -10.0..0.2, -12.0..0.5, -3.0..3.0, -1.5..1.5, -0.2..1.2, -0.2..1.2).prop_filter_map(
        "directions too close to span a plane",
        |(along, other, log_angle, log_gap, log_length, slide, part_a, part_b): (
            Vec3,
            Vec3,
            f64,
            f64,
            f64,
            f64,
            f64,
            f64,
        )| {
            let normal = along.cross(&other).try_normalize(0.1)?;
            let angle = 10f64.powf(log_angle);
            let tilted = along * angle.cos() + normal.cross(&along) * angle.sin();
            let length = 10f64.powf(log_length);
            let centre = normal * 10f64.powf(log_gap) + along * slide;
            let a = (along * -part_a, along * (1.0 - part_a));
            let b = (centre - tilted * (part_b * length), centre + tilted * ((1.0 - part_b) * length));
            Some((a, b))
        },
    )
}

/// The length against which an error of the distance is judged.
fn size(a: &Segment, b: &Segment) -> f64 {
    (a.1 - a.0).norm().max((b.1 - b.0).norm()).max(measure(a, b))
}

fn measure(a: &Segment, b: &Segment) -> f64 {
    segment_distance(&a.0, &a.1, &b.0, &b.1).distance
}

fn point_to_segment(p: &Vec3, b: &Segment) -> f64 {
    let v = b.1 - b.0;
    let t = ((p - b.0).dot(&v) / v.norm_squared()).clamp(0.0, 1.0);
    (p - b.0 - v * t).norm()
}

/// Minimum over A of the distance to B, a convex function of the place on A, by narrowing an
/// interval.
fn distance_by_interval_search(a: &Segment, b: &Segment) -> f64 {
    let at = |s: f64| point_to_segment(&(a.0 + (a.1 - a.0) * s), b);
    let (mut low, mut high) = (0.0, 1.0);
    let mut least = f64::min(at(0.0), at(1.0));
    for _ in 0..400 {
        let (p, q) = (low + 0.45 * (high - low), low + 0.55 * (high - low));
        let (at_p, at_q) = (at(p), at(q));
        least = least.min(at_p).min(at_q);
        if at_p < at_q { high = q } else { low = p }
    }
    least
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn distance_is_the_minimum_an_interval_search_finds((a, b) in pair_of_segments()) {
        let found = measure(&a, &b);
        let reference = distance_by_interval_search(&a, &b);
        let error = (found - reference).abs() / size(&a, &b);
        prop_assert!(error <= 1e-14, "{found:e}, not {reference:e}");
    }

    #[test]
    fn distance_is_that_of_the_points_returned_and_normal_joins_them((a, b) in pair_of_segments()) {
        let c = segment_distance(&a.0, &a.1, &b.0, &b.1);
        prop_assert!((0.0..=1.0).contains(&c.s) && (0.0..=1.0).contains(&c.t));
        prop_assert!((c.normal.norm() - 1.0).abs() < 4e-16);
        let gap = a.0 + (a.1 - a.0) * c.s - b.0 - (b.1 - b.0) * c.t;
        // Where the lines cross, the gap is round-off, at most 16 eps sqrt(|u|^2 + |v|^2), or 5.1e-15
        // sizes, and the normal is not along it.
        prop_assert!((gap - c.normal * c.distance).norm() <= 1.1e-14 * size(&a, &b));
    }

    #[test]
    fn distance_is_at_most_that_of_any_two_points((a, b) in pair_of_segments()) {
        let bound = measure(&a, &b) - 1e-14 * size(&a, &b);
        for k in 0..=20 {
            for l in 0..=20 {
                let (s, t) = (f64::from(k) / 20.0, f64::from(l) / 20.0);
                prop_assert!((a.0 + (a.1 - a.0) * s - b.0 - (b.1 - b.0) * t).norm() >= bound);
            }
        }
    }

    #[test]
    fn distance_scales_with_the_segments((a, b) in pair_of_segments(), log_scale in -9.0..3.0) {
        let k = 10f64.powf(log_scale);
        let scaled = measure(&(a.0 * k, a.1 * k), &(b.0 * k, b.1 * k));
        prop_assert!((scaled / k - measure(&a, &b)).abs() <= 1e-14 * size(&a, &b));
    }

    #[test]
    fn powers_of_two_scale_without_changing_a_bit(
        (a, b) in pair_of_segments(), power in -300..300,
    ) {
        let k = 2f64.powi(power);
        let plain = segment_distance(&a.0, &a.1, &b.0, &b.1);
        let scaled = segment_distance(&(a.0 * k), &(a.1 * k), &(b.0 * k), &(b.1 * k));
        prop_assert_eq!(scaled.distance, plain.distance * k);
        prop_assert_eq!((scaled.s, scaled.t, scaled.normal), (plain.s, plain.t, plain.normal));
    }

    #[test]
    fn distance_does_not_depend_on_order_or_direction((a, b) in pair_of_segments()) {
        let tolerance = 1e-14 * size(&a, &b);
        let plain = measure(&a, &b);
        prop_assert!((measure(&b, &a) - plain).abs() <= tolerance);
        prop_assert!((measure(&(a.1, a.0), &b) - plain).abs() <= tolerance);
        prop_assert!((measure(&a, &(b.1, b.0)) - plain).abs() <= tolerance);
    }

    #[test]
    fn distance_changes_no_more_than_the_end_points_move(
        (a, b) in pair_of_segments(),
        moves in prop::array::uniform4(vector(1.0)),
        log_move in -12.0..0.0,
    ) {
        let moves = moves.map(|m| m * 10f64.powf(log_move));
        let moved = measure(&(a.0 + moves[0], a.1 + moves[1]), &(b.0 + moves[2], b.1 + moves[3]));
        let allowed = moves[0].norm().max(moves[1].norm()) + moves[2].norm().max(moves[3].norm());
        prop_assert!((moved - measure(&a, &b)).abs() <= allowed + 1e-14 * (size(&a, &b) + allowed));
    }
}

#[test]
fn crossings_keep_their_gap_for_every_length_and_angle() {
    for power in -9..=3 {
        let length = 10f64.powi(power);
        for degrees in [90.0, 10.0, 1.0, 0.5, 0.1, 1e-2, 1e-4, 1e-6] {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let half = 0.5 * length;
            let a = Vec3::new(half, 0.0, 0.02 * length);
            let b = Vec3::new(half * cos, half * sin, 0.0);
            let c = segment_distance(&Vec3::new(-half, 0.0, 0.02 * length), &a, &-b, &b);
            assert!((c.distance / length - 0.02).abs() < 1e-14, "{length} m, {degrees} degrees: {c:?}");
            assert!((c.normal - Vec3::z()).norm() < 1e-12, "{length} m, {degrees} degrees: {c:?}");
        }
    }
}

#[test]
fn parallel_segments_meet_in_the_middle_of_their_overlap() {
    let axis = Vec3::new(1.0, 2.0, -0.5).normalize();
    let aside = axis.cross(&Vec3::y()).normalize();
    for length in [1e-9, 1e-3, 1.0, 1e3] {
        for (from, to) in [(0.25, 1.25), (1.25, 0.25), (0.25, 0.5), (-3.0, 9.0), (-1.0, 0.5)] {
            let at = |x: f64| (axis * x + aside * 0.1) * length;
            let c = segment_distance(&Vec3::zeros(), &(axis * length), &at(from), &at(to));
            let middle = 0.5 * (f64::min(from, to).max(0.0) + f64::max(from, to).min(1.0));
            assert!((c.distance / length - 0.1).abs() < 1e-15);
            assert!((c.s - middle).abs() < 1e-14 && (from + (to - from) * c.t - middle).abs() < 1e-14, "{c:?}");
            assert!((c.normal + aside).norm() < 1e-13);
        }
    }
}

#[test]
fn parallel_segments_without_overlap_meet_at_their_ends() {
    let (x, b0, b1) = (Vec3::x(), Vec3::new(4.0, 4.0, 0.0), Vec3::new(9.0, 4.0, 0.0));
    let c = segment_distance(&Vec3::zeros(), &x, &b0, &b1);
    assert_eq!((c.distance, c.s, c.t), (5.0, 1.0, 0.0));
    let c = segment_distance(&Vec3::zeros(), &x, &b1, &b0);
    assert_eq!((c.distance, c.s, c.t), (5.0, 1.0, 1.0));
}

#[test]
fn segments_of_no_length_are_points() {
    let (o, x) = (Vec3::zeros(), Vec3::x());
    for k in [1e-9, 1.0, 1e3] {
        let p = Vec3::new(0.25, 0.0, 2.0) * k;
        let c = segment_distance(&p, &p, &o, &(x * k));
        assert_eq!((c.distance, c.t), (2.0 * k, 0.25));
        assert!((c.normal - Vec3::z()).norm() < 4e-16);
        let c = segment_distance(&o, &(x * k), &p, &p);
        assert_eq!((c.distance, c.s), (2.0 * k, 0.25));
        assert!((c.normal + Vec3::z()).norm() < 4e-16);
        let c = segment_distance(&p, &p, &(x * k), &(x * k));
        assert!((c.distance - (p - x * k).norm()).abs() <= 1e-15 * k);
    }
    let c = segment_distance(&x, &x, &x, &x);
    assert_eq!((c.distance, c.normal.norm()), (0.0, 1.0));
}

#[test]
fn segments_skew_by_a_nanoradian_meet_in_the_middle_too() {
    let skew = 1e-9;
    for gap in [0.01, 0.1, 1.0] {
        let b = [Vec3::new(0.25, gap, 0.0), Vec3::new(1.25, gap, skew)];
        let c = segment_distance(&Vec3::zeros(), &Vec3::x(), &b[0], &b[1]);
        assert!((c.s - 0.625).abs() < 1e-8 && (c.t - 0.375).abs() < 1e-8, "{c:?}");
    }
}

#[test]
fn a_tiny_segment_beside_a_long_one_keeps_its_own_closest_point() {
    // To parry the first of these pairs is in general position, the others parallel or a point.
    for tiny in [1e-6, 1e-8, 1e-10] {
        let a = [Vec3::new(0.3, -tiny, 2.0 * tiny), Vec3::new(0.3, 4.0 * tiny, 3.0 * tiny)];
        let c = segment_distance(&a[0], &a[1], &Vec3::zeros(), &Vec3::x());
        // The nearest point of a line of slope 1/5 that passes the origin at (-1, 2).
        assert!((c.s - 3.0 / 26.0).abs() < 1e-12, "{tiny}: {c:?}");
        assert!((c.distance / tiny - 11.0 / f64::sqrt(26.0)).abs() < 1e-12, "{tiny}: {c:?}");
        let swapped = segment_distance(&Vec3::zeros(), &Vec3::x(), &a[0], &a[1]);
        assert!((swapped.t - 3.0 / 26.0).abs() < 1e-12, "{tiny}: {swapped:?}");
    }
}

#[test]
fn crossing_centrelines_get_a_unit_normal_across_both() {
    for angle in [FRAC_PI_2, 0.1, 1e-4, 1e-8] {
        for k in [1e-9, 1.0, 1e3] {
            let (u, v) = (Vec3::new(k, 0.0, 0.0), Vec3::new(k * f64::cos(angle), k * f64::sin(angle), 0.0));
            let c = segment_distance(&-u, &u, &-v, &v);
            assert!(c.distance <= 1e-14 * k);
            assert!((c.normal.norm() - 1.0).abs() < 1e-15 && c.normal.x == 0.0 && c.normal.y == 0.0, "{c:?}");
            assert_eq!(segment_distance(&-v, &v, &-u, &u).normal, -c.normal);
        }
    }
    let x = Vec3::x();
    let collinear = segment_distance(&Vec3::zeros(), &x, &(x * 0.5), &(x * 2.0));
    assert_eq!((collinear.distance, collinear.s), (0.0, 0.75));
    assert!((collinear.normal.norm() - 1.0).abs() < 1e-15 && collinear.normal.x == 0.0);
}

#[test]
fn coordinates_that_are_not_finite_do_not_give_a_finite_distance() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for k in 0..4 {
            let mut p = [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()];
            p[k].y = bad;
            assert!(!segment_distance(&p[0], &p[1], &p[2], &p[3]).distance.is_finite(), "{bad} at {k}");
        }
    }
}

/// Edges scattered over a cube, each with its own nodes, radius and activity.
#[derive(Clone, Debug)]
struct Cloud {
    nodes: Vec<Vec3>,
    edges: Vec<[usize; 2]>,
    radius: Vec<f64>,
    active: Vec<bool>,
}

impl Cloud {
    fn broad_phase(&self, search: Search) -> BroadPhase {
        let exclusion = Exclusion::new(self.nodes.len(), &self.edges, &vec![1.0; self.edges.len()], &self.radius, 0.0);
        BroadPhase::new(&self.edges, Some(&self.active), exclusion).with_search(search)
    }

    fn pairs_by_brute_force(&self, nodes: &[Vec3], radius: &[f64], margin: f64) -> Vec<[u32; 2]> {
        self.broad_phase(Search::BruteForce).with_skin(0.0).candidates(nodes, radius, margin).to_vec()
    }
}

fn cloud(edges: std::ops::Range<usize>) -> impl Strategy<Value = Cloud> {
    let edge = (vector(1.0), vector(0.3), 0.0..0.05, prop::bool::weighted(0.9));
    (prop::collection::vec(edge, edges), -9.0..3.0).prop_map(|(list, log_scale)| {
        let k = 10f64.powf(log_scale);
        let mut cloud = Cloud { nodes: vec![], edges: vec![], radius: vec![], active: vec![] };
        for (e, (at, along, radius, active)) in list.into_iter().enumerate() {
            cloud.nodes.extend([at * k, (at + along) * k]);
            cloud.edges.push([2 * e, 2 * e + 1]);
            cloud.radius.push(radius * k);
            cloud.active.push(active);
        }
        // Some neighbours share a node, as in a chain.
        for e in (3..cloud.edges.len()).step_by(3) {
            cloud.edges[e][0] = cloud.edges[e - 1][1];
        }
        cloud
    })
}

/// Largest coordinate of a cloud (m): the unit of margins and moves.
fn extent(cloud: &Cloud) -> f64 {
    cloud.nodes.iter().map(|x| x.amax()).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn tree_and_brute_force_find_the_same_pairs(cloud in cloud(0..120), margin in 0.0..0.1) {
        let margin = margin * extent(&cloud);
        let mut tree = cloud.broad_phase(Search::Tree);
        let found = tree.candidates(&cloud.nodes, &cloud.radius, margin).to_vec();
        prop_assert_eq!(found, cloud.pairs_by_brute_force(&cloud.nodes, &cloud.radius, margin));
    }

    #[test]
    fn candidates_are_sorted_active_and_contain_every_pair_within_twice_the_margin(
        cloud in cloud(0..60), margin in 0.0..0.1,
    ) {
        let margin = margin * extent(&cloud);
        let mut broad_phase = cloud.broad_phase(Search::Tree);
        let pairs = broad_phase.candidates(&cloud.nodes, &cloud.radius, margin);
        prop_assert!(pairs.windows(2).all(|p| p[0] < p[1]));
        let end = |e: usize, k: usize| &cloud.nodes[cloud.edges[e][k]];
        for i in 0..cloud.edges.len() {
            for j in i + 1..cloud.edges.len() {
                let listed = pairs.contains(&[i as u32, j as u32]);
                let countable = cloud.active[i] && cloud.active[j]
                    && !cloud.edges[i].iter().any(|node| cloud.edges[j].contains(node));
                let closest = segment_distance(end(i, 0), end(i, 1), end(j, 0), end(j, 1));
                let touches = closest.distance <= cloud.radius[i] + cloud.radius[j] + 2.0 * margin;
                prop_assert!(countable || !listed);
                prop_assert!(listed || !(countable && touches), "{i} and {j} touch unlisted");
            }
        }
    }

    #[test]
    fn reused_lists_equal_fresh_searches_on_a_random_walk(
        cloud in cloud(2..60),
        steps in prop::collection::vec(
            (prop::collection::vec(vector(1.0), 120), 0.0..0.02, 0.9..1.1), 12,
        ),
        tree in any::<bool>(),
    ) {
        let search = if tree { Search::Tree } else { Search::BruteForce };
        let mut walking = cloud.broad_phase(search).with_skin(0.2 * extent(&cloud));
        let (mut nodes, step) = (cloud.nodes.clone(), 0.02 * extent(&cloud));
        let calls = steps.len() as u64;
        for (moves, margin, growth) in steps {
            for (x, m) in nodes.iter_mut().zip(moves) {
                *x += m * step;
            }
            let radius: Vec<f64> = cloud.radius.iter().map(|r| r * growth).collect();
            let margin = margin * extent(&cloud);
            let found = walking.candidates(&nodes, &radius, margin).to_vec();
            prop_assert_eq!(found, cloud.pairs_by_brute_force(&nodes, &radius, margin));
        }
        prop_assert!(walking.searches() < calls, "no list was ever reused");
    }
}

#[test]
fn a_list_is_reused_until_a_node_has_moved_half_the_skin() {
    let edges = [[0, 1], [2, 3]];
    let exclusion = Exclusion::new(4, &edges, &[1.0; 2], &[0.1; 2], DEFAULT_FACTOR);
    let mut broad_phase = BroadPhase::new(&edges, None, exclusion).with_skin(0.5);
    let at = |z: f64| [Vec3::zeros(), Vec3::x(), Vec3::new(0.0, 0.0, z), Vec3::new(1.0, 0.0, z)];
    assert_eq!(broad_phase.candidates(&at(0.4), &[0.1; 2], 0.0), [[0u32; 2]; 0]);
    assert_eq!(broad_phase.candidates(&at(0.199), &[0.1; 2], 0.0), [[0, 1]]);
    assert_eq!(broad_phase.searches(), 1);
    assert_eq!(broad_phase.candidates(&at(0.14), &[0.1; 2], 0.0), [[0, 1]]);
    assert_eq!(broad_phase.searches(), 2);
    broad_phase.reset();
    assert_eq!(broad_phase.candidates(&at(0.14), &[0.1; 2], 0.0), [[0, 1]]);
    assert_eq!(broad_phase.searches(), 3);
}

#[test]
fn a_list_made_for_a_small_margin_or_radius_does_not_serve_a_larger_one() {
    let edges = [[0, 1], [2, 3]];
    let nodes = [Vec3::zeros(), Vec3::x(), Vec3::new(0.0, 0.0, 0.8), Vec3::new(1.0, 0.0, 0.8)];
    let new = || {
        let exclusion = Exclusion::new(4, &edges, &[1.0; 2], &[0.1; 2], DEFAULT_FACTOR);
        let mut broad_phase = BroadPhase::new(&edges, None, exclusion).with_skin(0.5);
        assert!(broad_phase.candidates(&nodes, &[0.1; 2], 0.0).is_empty());
        broad_phase
    };
    assert_eq!(new().candidates(&nodes, &[0.1; 2], 0.31), [[0, 1]]);
    assert_eq!(new().candidates(&nodes, &[0.41; 2], 0.0), [[0, 1]]);
    assert_eq!(new().candidates(&nodes, &[0.3; 2], 0.11), [[0, 1]]);
}

#[test]
fn capsules_that_touch_to_the_last_bit_are_candidates() {
    let edges = [[0, 1], [2, 3]];
    let mut touching = 0;
    for k in 1..2000 {
        let (x, r) = (f64::from(k) / 7.0, [f64::from(k % 13 + 1) / 9.0, f64::from(k % 17 + 1) / 11.0]);
        let other = x + (r[0] + r[1]);
        let at = |x: f64, y: f64| Vec3::new(x, y, 0.0);
        let nodes = [at(x, 0.0), at(x, 1.0), at(other, 0.0), at(other, 1.0)];
        if segment_distance(&nodes[0], &nodes[1], &nodes[2], &nodes[3]).distance <= r[0] + r[1] {
            touching += 1;
            let exclusion = Exclusion::new(4, &edges, &[1.0; 2], &r, DEFAULT_FACTOR);
            let mut broad_phase = BroadPhase::new(&edges, None, exclusion).with_skin(0.0);
            assert_eq!(broad_phase.candidates(&nodes, &r, 0.0), [[0, 1]], "{x}, {r:?}");
        }
    }
    assert!(touching > 500, "only {touching} of the pairs touch");
}

#[test]
fn a_tree_of_any_few_active_edges_finds_their_pairs() {
    let edges: Vec<[usize; 2]> = (0..5).map(|e| [2 * e, 2 * e + 1]).collect();
    let nodes: Vec<Vec3> = (0..10).map(|n| Vec3::new((n % 2) as f64, 0.01 * n as f64, 0.0)).collect();
    for mask in 0..32u32 {
        let active: Vec<bool> = (0..5).map(|e| mask >> e & 1 == 1).collect();
        let exclusion = Exclusion::new(10, &edges, &[1.0; 5], &[0.1; 5], DEFAULT_FACTOR);
        let mut broad_phase = BroadPhase::new(&edges, Some(&active), exclusion).with_search(Search::Tree);
        let found = broad_phase.candidates(&nodes, &[0.1; 5], 0.0).len() as u32;
        let count = mask.count_ones();
        assert_eq!(found, count * count.saturating_sub(1) / 2, "{active:?}");
    }
}

#[test]
fn positions_that_are_not_finite_neither_panic_nor_linger() {
    for search in [Search::BruteForce, Search::Tree] {
        let edges: Vec<[usize; 2]> = (0..40).map(|e| [2 * e, 2 * e + 1]).collect();
        let nodes: Vec<Vec3> = (0..80).map(|n| Vec3::new(n as f64, (n * n % 7) as f64, (n % 5) as f64)).collect();
        let radius = [3.0; 40];
        let exclusion = Exclusion::new(80, &edges, &[1.0; 40], &radius, DEFAULT_FACTOR);
        let mut broad_phase = BroadPhase::new(&edges, None, exclusion).with_search(search);
        let expected = broad_phase.candidates(&nodes, &radius, 0.0).to_vec();
        assert!(!expected.is_empty());
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            for all in [false, true] {
                let mut spoiled = nodes.clone();
                for x in spoiled.iter_mut().skip(7).take(if all { 80 } else { 1 }) {
                    x.y = bad;
                }
                broad_phase.candidates(&spoiled, &radius, 0.0);
                assert_eq!(broad_phase.candidates(&nodes, &radius, 0.0), expected);
            }
        }
    }
}

fn chain(edges: usize) -> Vec<[usize; 2]> {
    (0..edges).map(|e| [e, e + 1]).collect()
}

#[test]
fn a_chain_excludes_pairs_by_the_rest_length_between_them() {
    let lengths: Vec<f64> = (0..40).map(|e| 1e-3 * (1.0 + f64::from(e % 4))).collect();
    let radius: Vec<f64> = (0..40).map(|e| 1e-3 * (1.0 + 0.1 * f64::from(e % 3))).collect();
    let exclusion = Exclusion::new(41, &chain(40), &lengths, &radius, DEFAULT_FACTOR);
    for i in 0..40 {
        for j in i + 1..40 {
            let arc: f64 = lengths[i + 1..j].iter().sum();
            let expected = j == i + 1 || arc < FRAC_PI_2 * (radius[i] + radius[j]);
            assert_eq!(exclusion.excludes(i, j), expected, "{i}, {j}, arc {arc}");
            assert_eq!(exclusion.excludes(j, i), expected);
        }
    }
}

#[test]
fn refining_a_chain_does_not_change_the_excluded_length() {
    for per_radius in [1, 4, 16] {
        let edges = 40 * per_radius;
        let length = 1e-3 / per_radius as f64;
        let exclusion =
            Exclusion::new(edges + 1, &chain(edges), &vec![length; edges], &vec![1e-3; edges], DEFAULT_FACTOR);
        let middle = edges / 2;
        let first_counted = (middle + 1..edges).find(|&j| !exclusion.excludes(middle, j)).unwrap();
        let arc = (first_counted - middle - 1) as f64 * length;
        assert!(arc >= PI * 1e-3 && arc - length < PI * 1e-3, "{per_radius} edges per radius: {arc}");
    }
}

#[test]
fn a_ring_measures_the_shorter_way_round() {
    let edges: Vec<[usize; 2]> = (0..50).map(|e| [e, (e + 1) % 50]).collect();
    let exclusion = Exclusion::new(50, &edges, &[1.0; 50], &[1.5; 50], DEFAULT_FACTOR);
    for i in 0..50usize {
        for j in 0..50usize {
            let apart = i.abs_diff(j).min(50 - i.abs_diff(j));
            // pi r = 4.7 edges between the nearest ends.
            assert_eq!(exclusion.excludes(i, j), apart <= 5, "{i}, {j}");
        }
    }
}

#[test]
fn a_fork_measures_through_the_branching_node() {
    // Three arms of ten edges from node 0; edge 10 a + k starts k edges away from it.
    let node = |arm: usize, k: usize| if k == 0 { 0 } else { 10 * arm + k };
    let edges: Vec<[usize; 2]> = (0..30).map(|e| [node(e / 10, e % 10), node(e / 10, e % 10 + 1)]).collect();
    let exclusion = Exclusion::new(31, &edges, &[1.0; 30], &[1.0; 30], DEFAULT_FACTOR);
    for i in 0..30usize {
        for j in i + 1..30 {
            let arc = if i / 10 == j / 10 { j - i - 1 } else { i % 10 + j % 10 };
            assert_eq!(exclusion.excludes(i, j), (arc as f64) < PI, "{i}, {j}");
        }
    }
}

#[test]
fn unconnected_rods_are_never_excluded_from_each_other() {
    let mut edges = chain(5);
    edges.extend((6..11).map(|n| [n, n + 1]));
    let exclusion = Exclusion::new(12, &edges, &[1.0; 10], &[1.0; 10], f64::INFINITY);
    for i in 0..10 {
        for j in 0..10 {
            assert_eq!(exclusion.excludes(i, j), i / 5 == j / 5, "{i}, {j}");
        }
    }
}

#[test]
fn factor_zero_leaves_only_edges_that_share_a_node() {
    let exclusion = Exclusion::new(6, &chain(5), &[1.0, 0.0, 1.0, 1.0, 1.0], &[1.0; 5], 0.0);
    for i in 0..5usize {
        for j in 0..5usize {
            assert_eq!(exclusion.excludes(i, j), i.abs_diff(j) <= 1, "{i}, {j}");
        }
    }
}

proptest! {
    #[test]
    fn exclusions_follow_the_shortest_paths_of_any_network(
        links in prop::collection::vec((0..12usize, 1..12usize, 0.1..2.0, 0.1..1.0), 1..20),
        factor in 0.0..3.0,
    ) {
        let edges: Vec<[usize; 2]> = links.iter().map(|l| [l.0, (l.0 + l.1) % 12]).collect();
        let lengths: Vec<f64> = links.iter().map(|l| l.2).collect();
        let radius: Vec<f64> = links.iter().map(|l| l.3).collect();
        let exclusion = Exclusion::new(12, &edges, &lengths, &radius, factor);

        // Floyd and Warshall's shortest paths between all nodes.
        let mut arc = [[f64::INFINITY; 12]; 12];
        for n in 0..12 {
            arc[n][n] = 0.0;
        }
        for (&[i, j], &length) in edges.iter().zip(&lengths) {
            arc[i][j] = length.min(arc[i][j]);
            arc[j][i] = arc[i][j];
        }
        for k in 0..12 {
            for i in 0..12 {
                for j in 0..12 {
                    arc[i][j] = arc[i][j].min(arc[i][k] + arc[k][j]);
                }
            }
        }
        for i in 0..edges.len() {
            for j in 0..edges.len() {
                let ends = edges[i].iter().flat_map(|&p| edges[j].iter().map(move |&q| (p, q)));
                let nearest = ends.map(|(p, q)| arc[p][q]).fold(f64::INFINITY, f64::min);
                let limit = factor * (radius[i] + radius[j]);
                // Sums of lengths in another order differ by rounding.
                prop_assume!((nearest - limit).abs() > 1e-12 || nearest == 0.0);
                let shares = edges[i].iter().any(|node| edges[j].contains(node));
                let expected = shares || nearest < limit;
                prop_assert_eq!(exclusion.excludes(i, j), expected, "{}, {}", i, j);
            }
        }
    }
}

/// Least distance over the sum of the radii among the pairs of a chain that count, for unit radius.
fn closest_counted_pair(nodes: &[Vec3], factor: f64) -> f64 {
    let edges = chain(nodes.len() - 1);
    let lengths: Vec<f64> = edges.iter().map(|e| (nodes[e[1]] - nodes[e[0]]).norm()).collect();
    let exclusion = Exclusion::new(nodes.len(), &edges, &lengths, &vec![1.0; edges.len()], factor);
    let mut least = f64::INFINITY;
    for i in 0..edges.len() {
        for j in (i + 1..edges.len()).filter(|&j| !exclusion.excludes(i, j)) {
            least = least.min(segment_distance(&nodes[i], &nodes[i + 1], &nodes[j], &nodes[j + 1]).distance / 2.0);
        }
    }
    least
}

/// A U: two straight arms joined by a half circle.
fn bent_to_a_u(bend_radius: f64) -> Vec<Vec3> {
    let arm = |k: usize| 0.1 * k as f64;
    let down = (0..60).rev().map(|k| Vec3::new(bend_radius, arm(k + 1), 0.0));
    let bend = (0..=40).map(|k| {
        let (sin, cos) = (PI * f64::from(k) / 40.0).sin_cos();
        Vec3::new(bend_radius * cos, -bend_radius * sin, 0.0)
    });
    let up = (0..60).map(|k| Vec3::new(-bend_radius, arm(k + 1), 0.0));
    down.chain(bend).chain(up).collect()
}

#[test]
fn a_u_touches_itself_exactly_when_bent_tighter_than_its_own_radius() {
    for bend in [1.02, 1.1, 2.0] {
        assert!(closest_counted_pair(&bent_to_a_u(bend), DEFAULT_FACTOR) > 1.0, "bend radius {bend} r");
    }
    for bend in [0.98, 0.7] {
        let least = closest_counted_pair(&bent_to_a_u(bend), DEFAULT_FACTOR);
        assert!((least - bend).abs() < 1e-12, "bend radius {bend} r: {least}");
    }
}

#[test]
fn a_straight_rod_may_be_given_a_contact_range_of_half_pi_diameters() {
    let nodes: Vec<Vec3> = (0..200).map(|k| Vec3::new(0.05 * f64::from(k), 0.0, 0.0)).collect();
    assert!(closest_counted_pair(&nodes, DEFAULT_FACTOR) >= FRAC_PI_2 * (1.0 - 1e-12));
}

#[test]
fn a_kink_sharper_than_79_degrees_needs_a_larger_factor() {
    let kinked = |degrees: f64| -> Vec<Vec3> {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let first = (1..=100).rev().map(|k| Vec3::new(0.05 * f64::from(k), 0.0, 0.0));
        let second = (0..=100).map(|k| Vec3::new(cos, sin, 0.0) * (0.05 * f64::from(k)));
        first.chain(second).collect()
    };
    assert!(closest_counted_pair(&kinked(80.0), DEFAULT_FACTOR) > 1.0);
    assert!(closest_counted_pair(&kinked(60.0), DEFAULT_FACTOR) < 1.0);
    assert!(closest_counted_pair(&kinked(60.0), 1.0 / f64::to_radians(30.0).sin()) >= 1.0 - 1e-12);
}
