//! The contact energy of one pair of edges: a point of contact where they cross, a line where they lie along each other.
//!
//! The element of the edges e and f has the energy
//!
//! ```text
//!   E / kappa = xi sqrt(2 delta) phi(c) S + (1 - m(c)) Q
//!   S = b(e, f) - sum_v p_v b(v, f) - sum_w q_w b(e, w) + sum_vw p_v q_w b(v, w)
//!   Q = l_e / 4 sum_v [b(v, f) - sum_w q_w b(v, w)] + l_f / 4 sum_w [b(e, w) - sum_v p_v b(v, w)]
//! ```
//!
//! with `b(., .)` the barrier at the distance of two features, v and w the nodes of e and f, `l` rest lengths, and `phi` and `m`
//! the functions of the angle in [`super::angle`]. `p_v = (k - 1) / k` for a node in which `k` edges meet that may touch f: 1/2
//! within a rod, 0 at its end. Summed over the edges of two rods,
//!
//! * S counts every closest approach of the rods once, wherever nodes are: where it moves from one edge to the next, both have
//!   the distance of the node between them, which is taken off once (inclusion and exclusion; for whole rods S is the number
//!   of approaches within a distance minus the number of saddles between them). So the force of a crossing does not depend on
//!   the mesh, nor does it change while nodes slide past;
//! * Q is the integral of the barrier along both rods, half of it from each, by the trapezoidal rule on the nodes, each against
//!   the nearest place of the other rod, counted once by the same rule. Force per length does not depend on the mesh.
//!
//! Every term has a continuous gradient by itself, hence so has the sum. Spheres, edges of no length, touch at a point: `phi =
//! 1`, `Q = 0`. Forces are equal and opposite and have no torque, since `E` does not change in a rigid motion. The weights are
//! ours; the barrier, the mollifier and the exclusion of what is counted twice follow Li et al. (2020) and the convergent form
//! of the IPC toolkit.

use nalgebra::SymmetricEigen;

use super::angle::{Angle, Derivatives, shares, widest_parallel};
use super::barrier::{Barrier, BarrierValue};
use super::separation::{Gradient12, Hessian12, Separation};
use crate::Vec3;

/// What is constant about a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    barrier: Barrier,
    /// `xi sqrt(2 delta)`, m.
    reach: f64,
    /// Rest lengths, m; `None` if either is a sphere.
    rest_lengths: Option<[f64; 2]>,
    /// `p_v` of the nodes of e and `q_w` of those of f.
    shares: [[f64; 2]; 2],
}

/// Energy over stiffness of a pair and its derivatives.
#[derive(Clone, Debug)]
pub struct PairEnergy {
    /// `E / kappa`, m^3.
    pub energy: f64,
    /// Derivative with respect to the nodes `a0, a1, b0, b1`, m^2.
    pub gradient: Gradient12,
    /// Second derivative, m; zero unless asked for.
    pub hessian: Hessian12,
}

/// Which matrix takes the place of the second derivative.
///
/// Newton's method does best with the exact one as long as the matrix of the whole system is positive definite, and with the other
/// one in the iterations where it is not: rods that are about to slip off each other have negative stiffness. The definite
/// one alone leaves out what lets rods slide: it took up to four times the iterations for rods pressed across each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curvature {
    /// The second derivative itself, which may be indefinite.
    Exact,
    /// The nearest positive semidefinite matrix: negative eigenvalues set to zero.
    Definite,
}

/// The angle's part in the energy; spheres have none.
pub(super) struct Blend {
    pub angle: Option<Angle>,
    pub point: Derivatives,
    pub line: Derivatives,
}

/// A distance within range, and how often it counts in the two sums.
pub(super) struct Contribution {
    pub separation: Separation,
    pub barrier: BarrierValue,
    pub point: f64,
    pub line: f64,
}

impl Pair {
    /// Two edges of rest lengths `rest_lengths` (m) whose radii sum to `thickness` (m). `meeting[k][v]` is the number of edges,
    /// this one included, that meet in node `v` of edge `k` and may touch the other edge.
    pub fn of_edges(thickness: f64, delta: f64, rest_lengths: [f64; 2], meeting: [[usize; 2]; 2]) -> Self {
        Self::new(thickness, delta, Some(rest_lengths), meeting)
    }

    /// An edge, or a sphere, and a sphere: the segment B, or both, have no length.
    pub fn with_sphere(thickness: f64, delta: f64, meeting: [usize; 2]) -> Self {
        Self::new(thickness, delta, None, [meeting, [1, 1]])
    }

    fn new(thickness: f64, delta: f64, rest_lengths: Option<[f64; 2]>, meeting: [[usize; 2]; 2]) -> Self {
        Self {
            barrier: Barrier::new(thickness, delta),
            reach: thickness * (2.0 * delta).sqrt(),
            rest_lengths,
            shares: meeting.map(|ends| ends.map(|count| (count as f64 - 1.0) / count as f64)),
        }
    }

    /// The distances between which the pair acts.
    pub fn barrier(&self) -> &Barrier {
        &self.barrier
    }

    /// `E / kappa` (m^3) at the nodes `x = (a0, a1, b0, b1)`; infinite if the pair is at its least distance or below.
    pub fn energy(&self, x: &[Vec3; 4]) -> f64 {
        let closest = Separation::of_segments(x);
        if closest.distance >= self.barrier.most() {
            return 0.0;
        }
        if closest.distance <= self.barrier.least() {
            return f64::INFINITY;
        }
        let blend = self.blend(x);
        let (mut point, mut line) = (0.0, 0.0);
        self.visit(x, closest, |c| {
            point += c.point * c.barrier.value;
            line += c.line * c.barrier.value;
        });
        blend.point[0] * point + blend.line[0] * line
    }

    /// Energy, gradient and, if asked for, second derivative; `None` where the pair is out of range.
    ///
    /// The pair must be above its least distance, as [`super::continuous`] keeps it: below, nothing is finite.
    pub fn evaluate(&self, x: &[Vec3; 4], curvature: Option<Curvature>) -> Option<PairEnergy> {
        let closest = Separation::of_segments(x);
        if closest.distance >= self.barrier.most() {
            return None;
        }
        let blend = self.blend(x);
        let (mut point, mut line) = (0.0, 0.0);
        let (mut point_gradient, mut line_gradient) = (Gradient12::zeros(), Gradient12::zeros());
        let mut hessian = Hessian12::zeros();
        self.visit(x, closest, |c| {
            point += c.point * c.barrier.value;
            line += c.line * c.barrier.value;
            c.separation.add_gradient(c.point * c.barrier.slope, &mut point_gradient);
            c.separation.add_gradient(c.line * c.barrier.slope, &mut line_gradient);
            let factor = blend.point[0] * c.point + blend.line[0] * c.line;
            if curvature.is_some() && factor != 0.0 {
                let (slope, bend) = (factor * c.barrier.slope, factor * c.barrier.curvature);
                c.separation.add_hessian(x, slope, bend, &mut hessian);
            }
        });
        let mut gradient = point_gradient * blend.point[0] + line_gradient * blend.line[0];
        if let Some(angle) = &blend.angle {
            let turn = angle.gradient();
            let slope = blend.point[1] * point + blend.line[1] * line;
            gradient += turn * slope;
            if curvature.is_some() {
                let mixed = point_gradient * blend.point[1] + line_gradient * blend.line[1];
                hessian.ger(1.0, &mixed, &turn, 1.0);
                hessian.ger(1.0, &turn, &mixed, 1.0);
                hessian.ger(blend.point[2] * point + blend.line[2] * line, &turn, &turn, 1.0);
                angle.add_hessian(slope, &mut hessian);
            }
        }
        if curvature == Some(Curvature::Definite) {
            hessian = without_negative_eigenvalues(hessian);
        }
        Some(PairEnergy { energy: blend.point[0] * point + blend.line[0] * line, gradient, hessian })
    }

    pub(super) fn blend(&self, x: &[Vec3; 4]) -> Blend {
        let Some(rest_lengths) = self.rest_lengths else {
            return Blend { angle: None, point: [self.reach, 0.0, 0.0], line: [0.0; 3] };
        };
        let angle = Angle::new(x, rest_lengths);
        let (point, line) = shares(angle.sin2(), widest_parallel(self.reach, rest_lengths));
        Blend { angle: Some(angle), point: point.map(|part| part * self.reach), line }
    }

    /// Goes through the distances in range; `closest`, that of the segments, is one of them.
    #[inline]
    pub(super) fn visit(&self, x: &[Vec3; 4], closest: Separation, mut each: impl FnMut(&Contribution)) {
        let mut offer = |separation: Separation, point: f64, line: f64| {
            if separation.distance < self.barrier.most() {
                let barrier = self.barrier.at(separation.distance);
                each(&Contribution { separation, barrier, point, line });
            }
        };
        offer(closest, 1.0, 0.0);
        let [p, q] = self.shares;
        let quarters = self.rest_lengths.map_or([0.0; 2], |lengths| lengths.map(|length| 0.25 * length));
        // Shares vanish at the ends of rods, and both shares and quarters at spheres.
        for v in 0..2 {
            if p[v] != 0.0 || quarters[0] != 0.0 {
                offer(Separation::of_end_of_a(x, v), -p[v], quarters[0]);
            }
        }
        for w in 0..2 {
            if q[w] != 0.0 || quarters[1] != 0.0 {
                offer(Separation::of_end_of_b(x, w), -q[w], quarters[1]);
            }
        }
        for v in 0..2 {
            for w in 0..2 {
                let (point, line) = (p[v] * q[w], -quarters[0] * q[w] - quarters[1] * p[v]);
                if point != 0.0 || line != 0.0 {
                    offer(Separation::of_ends(x, v, w), point, line);
                }
            }
        }
    }
}

/// The nearest positive semidefinite matrix in the Frobenius norm.
fn without_negative_eigenvalues(hessian: Hessian12) -> Hessian12 {
    let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(hessian);
    let mut definite = Hessian12::zeros();
    for (value, vector) in eigenvalues.iter().zip(eigenvectors.column_iter()) {
        if *value > 0.0 {
            definite.ger(*value, &vector, &vector, 1.0);
        }
    }
    definite
}
