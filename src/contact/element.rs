//! An element of the contact energy: two edges that are near each other, or a node that a wall may push.

use super::friction::SlidingContact;
use super::pair::{Curvature, Pair, PairEnergy};
use super::push::{Push, PushVariation};
use super::separation::{Gradient12, Hessian12};
use super::wall::WallContact;
use crate::Vec3;

/// What gives an element its energy.
#[derive(Clone)]
pub(super) enum Shape {
    /// Two edges, an edge and a sphere, or two spheres.
    Pair(Pair),
    /// A node and a wall.
    Wall(WallContact),
}

/// Two bodies, where they are, and how hard they push.
#[derive(Clone)]
pub(super) struct Element {
    pub bodies: [usize; 2],
    pub shape: Shape,
    /// The nodes `a0, a1, b0, b1` of a pair; four times the node that a wall pushes.
    pub corners: [usize; 4],
    /// Which of the corners are distinct nodes, the first `count` entries, and these nodes.
    pub rows: [usize; 4],
    pub nodes: [usize; 4],
    pub count: usize,
    /// Pa.
    pub stiffness: f64,
    /// Smoothing velocity of friction, m/s.
    pub slip_velocity: f64,
}

impl Element {
    fn at(&self, nodes: &[Vec3]) -> [Vec3; 4] {
        self.corners.map(|node| nodes[node])
    }

    /// Energy over stiffness, m^3.
    pub fn energy(&self, nodes: &[Vec3]) -> f64 {
        let x = self.at(nodes);
        match &self.shape {
            Shape::Pair(pair) => pair.energy(&x),
            Shape::Wall(wall) => wall.energy(&x[0]),
        }
    }

    /// Energy over stiffness and its derivatives; `None` out of range.
    pub fn evaluate(&self, nodes: &[Vec3], curvature: Option<Curvature>) -> Option<PairEnergy> {
        let x = self.at(nodes);
        match &self.shape {
            Shape::Pair(pair) => pair.evaluate(&x, curvature),
            Shape::Wall(wall) => wall.evaluate(&x[0]),
        }
    }

    /// The resultant over stiffness; `None` where it does not push.
    pub fn push(&self, nodes: &[Vec3]) -> Option<Push> {
        let x = self.at(nodes);
        match &self.shape {
            Shape::Pair(pair) => pair.push(&x),
            Shape::Wall(wall) => wall.push(&x[0]),
        }
    }

    /// The resultant and its derivatives.
    pub fn push_with_variation(&self, nodes: &[Vec3]) -> Option<(Push, PushVariation)> {
        let x = self.at(nodes);
        match &self.shape {
            Shape::Pair(pair) => pair.push_with_variation(&x),
            Shape::Wall(wall) => wall.push_with_variation(&x[0]),
        }
    }

    /// The contact as friction sees it.
    pub fn contact(&self, push: &Push) -> Option<SlidingContact> {
        let (size, [s, t]) = (push.force.norm(), push.places);
        let weights = match self.shape {
            Shape::Pair(_) => [1.0 - s, s, t - 1.0, -t],
            Shape::Wall(_) => [1.0, 0.0, 0.0, 0.0],
        };
        let (nodes, force) = (self.corners, self.stiffness * size);
        (size > 0.0).then(|| SlidingContact { nodes, weights, normal: push.force / size, force })
    }

    /// Hands over what belongs to distinct nodes, column by column.
    #[inline]
    pub fn hand_over(
        &self,
        gradient: &Gradient12,
        hessian: Option<&Hessian12>,
        mut add: impl FnMut(&[f64], Option<&[f64]>),
    ) {
        let width = 3 * self.count;
        let row_of = |i: usize| 3 * self.rows[i / 3] + i % 3;
        let (mut vector, mut matrix) = ([0.0; 12], [0.0; 144]);
        for i in 0..width {
            vector[i] = gradient[row_of(i)];
        }
        let matrix = hessian.map(|hessian| {
            for j in 0..width {
                for i in 0..width {
                    matrix[j * width + i] = hessian[(row_of(i), row_of(j))];
                }
            }
            &matrix[..width * width]
        });
        add(&vector[..width], matrix);
    }
}
