//! Barrier contact: derivatives, invariances, independence of the mesh, candidates, continuous detection and friction.

mod common;

use common::Random;
use flagrs::Vec3;
use flagrs::contact::barrier::Barrier;
use flagrs::contact::pair::{Curvature, Pair};
use flagrs::contact::separation::{Gradient12, Hessian12, Separation};

const DELTA: f64 = 0.05;
/// Sum of the radii of the pairs below, in units of their rest lengths of about 1.
const XI: f64 = 0.4;

/// From a right angle to nearly parallel, rad.
const ANGLES: [f64; 8] = [1.5707963, 0.7, 0.1, 0.03, 1e-2, 1e-3, 1e-4, 1e-6];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Features {
    Lines,
    EndOfA,
    EndOfB,
    Ends,
}

const FEATURES: [Features; 4] = [Features::Lines, Features::EndOfA, Features::EndOfB, Features::Ends];

fn unit(random: &mut Random) -> Vec3 {
    loop {
        let v = random.vector(1.0);
        if v.norm() > 0.2 {
            return v.normalize();
        }
    }
}

fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * 0.5 * (random.uniform() + 1.0)
}

/// A pair whose closest points are of a given kind, at a given angle, somewhere in the range of the barrier.
fn pair_at(random: &mut Random, features: Features, angle: f64) -> [Vec3; 4] {
    let along = unit(random);
    let side = along.cross(&unit(random)).normalize();
    let normal = along.cross(&side);
    let distance = XI * (1.0 + DELTA * between(random, -0.95, 0.95));
    let (a, b) = (between(random, 0.8, 1.2), between(random, 0.8, 1.2));
    let (s, t) = (between(random, 0.1, 0.9), between(random, 0.1, 0.9));
    // A leaves the plane of closest approach by `angle` where one of its ends is closest.
    let in_plane = along * angle.cos() + side * angle.sin();
    let out_of_plane = along * angle.cos() + (normal * 0.6 + side * 0.8) * angle.sin();
    match features {
        Features::Lines => {
            let (p, q) = (normal * distance, Vec3::zeros());
            [p - in_plane * (s * a), p + in_plane * ((1.0 - s) * a), q - along * (t * b), q + along * ((1.0 - t) * b)]
        }
        Features::EndOfA => {
            let p = normal * distance;
            [p, p + out_of_plane * a, -along * (t * b), along * ((1.0 - t) * b)]
        }
        Features::EndOfB => {
            let [b0, b1, a0, a1] = pair_at(random, Features::EndOfA, angle);
            [a0, a1, b0, b1]
        }
        Features::Ends => {
            // The gap leans along both segments, which lead away from each other.
            let p = (normal * 0.8 + along * 0.6) * distance;
            [p, p + in_plane * a, Vec3::zeros(), -along * b]
        }
    }
}

fn some_pair(random: &mut Random) -> Pair {
    let meeting = [1, 2, 3];
    let mut pick = || meeting[(between(random, 0.0, 3.0) as usize).min(2)];
    let meeting = [[pick(), pick()], [pick(), pick()]];
    Pair::of_edges(XI, DELTA, [1.0, 1.1], meeting)
}

/// The derivative of a function of the four nodes by the central difference of fourth order whose step agrees best.
///
/// The best step depends on angle and gap; a wrong derivative agrees with none.
fn worst_difference<const N: usize>(
    x: &[Vec3; 4],
    exact: impl Fn(usize) -> [f64; N],
    value: impl Fn(&[Vec3; 4]) -> [f64; N],
) -> f64 {
    let size = (0..12).flat_map(&exact).fold(0.0, |size: f64, entry| size.max(entry.abs()));
    let mut best = f64::INFINITY;
    for exponent in 6..22 {
        let step = 10f64.powf(-0.5 * exponent as f64);
        let at = |coordinate: usize, by: f64| {
            let mut moved = *x;
            moved[coordinate / 3][coordinate % 3] += by;
            value(&moved)
        };
        let mut worst: f64 = 0.0;
        for coordinate in 0..12 {
            let [m2, m1, p1, p2] = [-2.0, -1.0, 1.0, 2.0].map(|k| at(coordinate, k * step));
            let exact = exact(coordinate);
            for k in 0..N {
                let difference = (8.0 * (p1[k] - m1[k]) - (p2[k] - m2[k])) / (12.0 * step);
                let error = (difference - exact[k]).abs();
                worst = if error.is_nan() { f64::INFINITY } else { worst.max(error) };
            }
        }
        best = best.min(worst / size);
    }
    best
}

#[test]
fn explore() {
    let mut random = Random::new(3);
    for features in FEATURES {
        for angle in ANGLES {
            let (mut g, mut h, mut n, mut low) = (0f64, 0f64, 0, 0f64);
            for _ in 0..60 {
                let x = pair_at(&mut random, features, angle);
                let pair = some_pair(&mut random);
                let Some(at) = pair.evaluate(&x, Some(Curvature::Exact)) else { continue };
                n += 1;
                g = g.max(worst_difference(&x, |i| [at.gradient[i]], |x| [pair.energy(x)]));
                h = h.max(worst_difference(
                    &x,
                    |i| -> [f64; 12] { std::array::from_fn(|j| at.hessian[(i, j)]) },
                    |x| pair.evaluate(x, None).map_or([0.0; 12], |at| at.gradient.into()),
                ));
                let d = pair.evaluate(&x, Some(Curvature::Definite)).unwrap().hessian;
                let e = d.symmetric_eigenvalues();
                low = low.min(e.min() / e.max());
            }
            println!("{features:?} {angle:.0e} n={n} gradient {g:.1e} hessian {h:.1e} low {low:.1e}");
        }
    }
}

use flagrs::contact::bodies::Bodies;
use flagrs::contact::potential::{BarrierLaw, BarrierState};

/// A straight rod of `count` edges.
fn rod(centre: Vec3, direction: Vec3, length: f64, count: usize) -> Vec<Vec3> {
    (0..=count).map(|k| centre + direction * (length * (k as f64 / count as f64 - 0.5))).collect()
}

/// Rods as one scene: edges of each in turn, with the rest lengths they have.
fn scene_of(rods: &[Vec<Vec3>], radius: f64) -> (Vec<Vec3>, BarrierLaw, BarrierState) {
    let nodes: Vec<Vec3> = rods.concat();
    let mut edges = Vec::new();
    let mut start = 0;
    for rod in rods {
        edges.extend((1..rod.len()).map(|k| [start + k - 1, start + k]));
        start += rod.len();
    }
    let lengths: Vec<f64> = edges.iter().map(|&[i, j]: &[usize; 2]| (nodes[j] - nodes[i]).norm()).collect();
    let radii = vec![radius; edges.len()];
    let bodies = Bodies::new(nodes.len(), &edges, &radii, &lengths, &vec![true; edges.len()], &[], 1.5707963);
    let law = BarrierLaw::new(bodies, DELTA, 1.0);
    let mut state = law.state();
    law.ensure(&mut state, &nodes);
    (nodes, law, state)
}

fn gradient_of(law: &BarrierLaw, state: &BarrierState, nodes: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); nodes.len()];
    let stencils: Vec<_> = state.stencils().collect();
    law.add(state, nodes, None, |element, gradient, _| {
        for (k, &node) in stencils[element].iter().enumerate() {
            out[node] += Vec3::new(gradient[3 * k], gradient[3 * k + 1], gradient[3 * k + 2]);
        }
    });
    out
}

/// Force between two long straight rods crossing at an angle, by integration.
fn line_force(distance: f64, angle: f64, xi: f64) -> f64 {
    let b = Barrier::new(xi, DELTA);
    let n = 20000;
    let half = (b.most() * b.most() - distance * distance).sqrt();
    let mut sum = 0.0;
    for k in 0..n {
        let y = half * (2.0 * (k as f64 + 0.5) / n as f64 - 1.0);
        let d = (distance * distance + y * y).sqrt();
        sum -= b.at(d).slope * distance / d;
    }
    sum * 2.0 * half / n as f64 / angle.sin()
}

/// Gauss points both ways against the polyline (distance to the nearest point of the other rod).
fn gauss_force(a: &[Vec3], b: &[Vec3], points: usize, xi: f64) -> f64 {
    let rule: &[(f64, f64)] = match points {
        2 => &[(-0.5773502691896257, 1.0), (0.5773502691896257, 1.0)],
        _ => &[(-0.7745966692414834, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.7745966692414834, 5.0 / 9.0)],
    };
    let barrier = Barrier::new(xi, DELTA);
    let mut total = Vec3::zeros();
    for (p, q, sign) in [(a, b, 1.0), (b, a, -1.0)] {
        for e in p.windows(2) {
            for &(place, weight) in rule {
                let x = e[0] + (e[1] - e[0]) * (0.5 + 0.5 * place);
                let mut best = (f64::INFINITY, Vec3::zeros());
                for f in q.windows(2) {
                    let s = Separation::of_end_of_a(&[x, x, f[0], f[1]], 0);
                    if s.distance < best.0 {
                        best = (s.distance, s.normal);
                    }
                }
                total -= best.1 * (sign * 0.5 * 0.5 * weight * (e[1] - e[0]).norm() * barrier.at(best.0).slope);
            }
        }
    }
    total.z
}

#[test]
fn explore_forces() {
    let xi = 0.4;
    for gap in [0.97, 1.0, 1.03] {
        for angle in [1.5707963, 0.5, 0.2, 0.1, 0.05, 0.0316, 0.02, 0.01, 1e-3, 1e-6, 0.0f64] {
            print!("gap {gap} angle {angle:.0e}: ");
            for h in [0.1f64, 0.2, 0.4, 0.8, 1.6, 3.2] {
                let length = if angle < 0.1 { 51.2 } else { 12.8 };
                let n = (length / h) as usize;
                let exact = if angle > 2e-2 {
                    line_force(gap * xi, angle, xi)
                } else {
                    // integrate along finite length
                    let b = Barrier::new(xi, DELTA);
                    let m = 20000;
                    let mut s = 0.0;
                    for k in 0..m {
                        let y = length * ((k as f64 + 0.5) / m as f64 - 0.5) * angle.sin();
                        let d = ((gap * xi).powi(2) + y * y).sqrt();
                        s -= b.at(d).slope * gap * xi / d;
                    }
                    s * length / m as f64
                };
                let (mut low, mut high, mut glow, mut ghigh) = (f64::INFINITY, 0f64, f64::INFINITY, 0f64);
                let mut positive: f64 = 0.0;
                for k in 0..7 {
                    let shift = h * k as f64 / 7.0;
                    let a = rod(Vec3::new(0.0, 0.0, gap * xi), Vec3::x(), length, n);
                    let b = rod(
                        Vec3::new(angle.cos(), angle.sin(), 0.0) * shift,
                        Vec3::new(angle.cos(), angle.sin(), 0.0),
                        length,
                        n,
                    );
                    let (nodes, law, state) = scene_of(&[a.clone(), b.clone()], 0.5 * xi);
                    let g = gradient_of(&law, &state, &nodes);
                    let f: f64 = -g[..=n].iter().map(|v| v.z).sum::<f64>();
                    low = low.min(f);
                    high = high.max(f);
                    let q = gauss_force(&a, &b, 3, xi);
                    glow = glow.min(q);
                    ghigh = ghigh.max(q);
                    let sum: f64 = law.forces(&state, &nodes).iter().map(|f| f.lagged.force).sum();
                    positive = positive.max(sum / f);
                }
                print!(
                    "| {:.3} {:.3} ({:.2}) g {:.2} {:.2} ",
                    low / exact,
                    high / exact,
                    positive,
                    glow / exact,
                    ghigh / exact
                );
            }
            println!();
        }
    }
}
