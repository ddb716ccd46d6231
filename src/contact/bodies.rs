//! What can touch: edges, spheres and walls, in one numbering.
//!
//! A sphere, such as a head, is an edge of no length whose two nodes are the same; broad phase, exclusion and distances then treat
//! both alike. The edges come first. Walls, which come last, touch nodes of the others and never each other.

use std::fmt;

use super::barrier::Barrier;
use super::exclusion::Exclusion;
use super::pair::Pair;
use super::wall::WallContact;
use crate::Vec3;
use crate::plane::Plane;

/// A body that can touch others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Body {
    /// An edge by its index.
    Edge(usize),
    /// A sphere by its place in the list of spheres.
    Sphere(usize),
    /// A wall by its place in the list of walls.
    Wall(usize),
}

impl fmt::Display for Body {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Edge(edge) => write!(f, "edge {edge}"),
            Self::Sphere(sphere) => write!(f, "sphere {sphere}"),
            Self::Wall(wall) => write!(f, "wall {wall}"),
        }
    }
}

/// All edges, spheres and walls of a scene; constant.
#[derive(Clone, Debug)]
pub struct Bodies {
    ends: Vec<[usize; 2]>,
    radius: Vec<f64>,
    rest_lengths: Vec<f64>,
    colliding: Vec<bool>,
    exclusion: Exclusion,
    edge_count: usize,
    walls: Vec<Plane>,
    /// Colliding edges that meet in node `n` are `incident[first[n]..first[n + 1]]`.
    first: Vec<usize>,
    incident: Vec<u32>,
}

impl Bodies {
    /// Edges with radii and rest lengths (m), whether they collide, and spheres as node and radius (m); `exclusion` is the
    /// excluded rest arc length over the sum of two radii, see [`super::exclusion`].
    ///
    /// # Panics
    /// If lengths of slices differ or a node does not exist.
    pub fn new(
        node_count: usize,
        edges: &[[usize; 2]],
        radius: &[f64],
        rest_lengths: &[f64],
        colliding: &[bool],
        spheres: &[(usize, f64)],
        exclusion: f64,
    ) -> Self {
        assert!(radius.len() == edges.len() && colliding.len() == edges.len(), "one radius and flag per edge");
        let ends: Vec<_> = edges.iter().copied().chain(spheres.iter().map(|&(node, _)| [node, node])).collect();
        let radius: Vec<_> = radius.iter().copied().chain(spheres.iter().map(|&(_, radius)| radius)).collect();
        let rest_lengths: Vec<_> = rest_lengths.iter().copied().chain(spheres.iter().map(|_| 0.0)).collect();
        let colliding: Vec<_> = colliding.iter().copied().chain(spheres.iter().map(|_| true)).collect();
        let exclusion = Exclusion::new(node_count, &ends, &rest_lengths, &radius, exclusion);
        let (first, incident) = incident_edges(node_count, edges, &colliding);
        Self {
            ends,
            radius,
            rest_lengths,
            colliding,
            exclusion,
            edge_count: edges.len(),
            walls: Vec::new(),
            first,
            incident,
        }
    }

    /// The same bodies, and walls that keep them on their side.
    pub fn with_walls(self, walls: Vec<Plane>) -> Self {
        Self { walls, ..self }
    }

    /// Number of bodies, walls included.
    pub fn count(&self) -> usize {
        self.ends.len() + self.walls.len()
    }

    /// Every end of a colliding edge, every sphere, and every wall that may push it: the two bodies, and which end.
    pub fn at_walls(&self) -> impl Iterator<Item = ([usize; 2], usize)> + '_ {
        let walls = self.ends.len()..self.count();
        walls.flat_map(move |wall| {
            let touching = (0..self.ends.len()).filter(|&body| self.colliding[body]);
            touching.flat_map(move |body| {
                let ends = if self.is_sphere(body) { 0..1 } else { 0..2 };
                ends.map(move |end| ([body, wall], end))
            })
        })
    }

    /// The wall of an index.
    pub fn wall(&self, index: usize) -> &Plane {
        &self.walls[index - self.ends.len()]
    }

    /// The contact of a body's end with a wall under the tolerance `delta`.
    pub fn wall_contact(&self, [body, wall]: [usize; 2], end: usize, delta: f64) -> WallContact {
        let (plane, radius) = (*self.wall(wall), self.radius[body]);
        if self.is_sphere(body) {
            WallContact::of_sphere(plane, radius, delta)
        } else {
            WallContact::of_end(plane, radius, delta, self.rest_lengths[body], end)
        }
    }

    /// Sum of the radii of two bodies, m; a wall has none.
    pub fn thickness(&self, bodies: [usize; 2]) -> f64 {
        bodies.iter().filter_map(|&body| self.radius.get(body)).sum()
    }

    /// Nodes of every body; a sphere's is given twice.
    pub fn ends(&self) -> &[[usize; 2]] {
        &self.ends
    }

    /// Radius of every body but walls, m.
    pub fn radius(&self) -> &[f64] {
        &self.radius
    }

    /// Radius of the thinnest edge that can touch, m; of the thinnest body if no edge can.
    pub fn thinnest(&self) -> f64 {
        let least = |radius: &mut dyn Iterator<Item = f64>| radius.fold(f64::INFINITY, f64::min);
        let edges = self.radius[..self.edge_count].iter().zip(&self.colliding);
        let touching = least(&mut edges.filter(|(_, colliding)| **colliding).map(|(radius, _)| *radius));
        if touching.is_finite() { touching } else { least(&mut self.radius.iter().copied()) }
    }

    /// Whether a body can touch any other.
    pub fn colliding(&self) -> &[bool] {
        &self.colliding
    }

    /// The pairs that never count.
    pub fn exclusion(&self) -> &Exclusion {
        &self.exclusion
    }

    /// Whether two bodies can touch.
    pub fn may_touch(&self, a: usize, b: usize) -> bool {
        self.colliding[a] && self.colliding[b] && !self.exclusion.excludes(a, b)
    }

    /// What the body of an index is.
    pub fn body(&self, index: usize) -> Body {
        if index < self.edge_count {
            Body::Edge(index)
        } else if index < self.ends.len() {
            Body::Sphere(index - self.edge_count)
        } else {
            Body::Wall(index - self.ends.len())
        }
    }

    /// The index of a body.
    pub fn index(&self, body: Body) -> usize {
        match body {
            Body::Edge(edge) => edge,
            Body::Sphere(sphere) => self.edge_count + sphere,
            Body::Wall(wall) => self.ends.len() + wall,
        }
    }

    fn is_sphere(&self, index: usize) -> bool {
        index >= self.edge_count
    }

    /// The distances between which a pair acts under the tolerance `delta`.
    pub fn barrier(&self, [a, b]: [usize; 2], delta: f64) -> Barrier {
        Barrier::new(self.thickness([a, b]), delta)
    }

    /// Positions of the nodes `a0, a1, b0, b1` of a pair.
    #[inline]
    pub fn corners(&self, [a, b]: [usize; 2], nodes: &[Vec3]) -> [Vec3; 4] {
        let ([a0, a1], [b0, b1]) = (self.ends[a], self.ends[b]);
        [nodes[a0], nodes[a1], nodes[b0], nodes[b1]]
    }

    /// The energy of a pair `a < b` that may touch.
    pub fn pair(&self, [a, b]: [usize; 2], delta: f64) -> Pair {
        let thickness = self.radius[a] + self.radius[b];
        match (self.is_sphere(a), self.is_sphere(b)) {
            (false, false) => {
                let lengths = [self.rest_lengths[a], self.rest_lengths[b]];
                Pair::of_edges(thickness, delta, lengths, [self.meeting(a, b), self.meeting(b, a)])
            }
            (false, true) => Pair::with_sphere(thickness, delta, self.meeting(a, b)),
            _ => Pair::with_sphere(thickness, delta, [1, 1]),
        }
    }

    /// The number of edges in each node of edge `a` that may touch body `b`.
    fn meeting(&self, a: usize, b: usize) -> [usize; 2] {
        self.ends[a].map(|node| {
            let incident = &self.incident[self.first[node]..self.first[node + 1]];
            incident.iter().filter(|&&edge| self.may_touch(edge as usize, b)).count()
        })
    }

    /// The distinct nodes of a pair, and how many there are, in the order of [`Self::rows`].
    pub fn stencil(&self, [a, b]: [usize; 2]) -> ([usize; 4], usize) {
        let corners = [self.ends[a][0], self.ends[a][1], self.ends[b][0], self.ends[b][1]];
        let (rows, count) = self.rows([a, b]);
        (rows.map(|row| corners[row]), count)
    }

    /// Which of the corners `a0, a1, b0, b1` are distinct nodes: the first `count` entries.
    pub fn rows(&self, [a, b]: [usize; 2]) -> ([usize; 4], usize) {
        match (self.is_sphere(a), self.is_sphere(b)) {
            (false, false) => ([0, 1, 2, 3], 4),
            (false, true) => ([0, 1, 2, 2], 3),
            _ => ([0, 2, 2, 2], 2),
        }
    }
}

fn incident_edges(node_count: usize, edges: &[[usize; 2]], colliding: &[bool]) -> (Vec<usize>, Vec<u32>) {
    let mut first = vec![0; node_count + 1];
    let ends = || edges.iter().enumerate().filter(|(edge, _)| colliding[*edge]);
    for &node in ends().flat_map(|(_, ends)| ends) {
        first[node + 1] += 1;
    }
    for node in 0..node_count {
        first[node + 1] += first[node];
    }
    let mut next = first.clone();
    let mut incident = vec![0; first[node_count]];
    for (edge, ends) in ends() {
        for &node in ends {
            incident[next[node]] = edge as u32;
            next[node] += 1;
        }
    }
    (first, incident)
}
